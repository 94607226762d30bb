"""Values off by whole bytes, put right count by count."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ladder import TACTICAL, record, ride
from ladder_sessions import tables
from numpy.typing import NDArray

from fieldcal.core.samples import CHANNELS, Block
from fieldcal.diagnosis.signal.chain import check_chain
from fieldcal.effects.decode_fault import undo_decode_fault
from fieldcal.session import description_file

LSB = np.repeat([16 * 9.80665 / 2**15, np.deg2rad(1000) / 2**15], 3)
"""Steps of a device of 16 g and 1000 deg/s."""

Counts = NDArray[np.int64]


def slip(kind: str, counts: Counts) -> Counts:
    """What a driver makes of 16-bit counts, byte by byte."""
    out = []
    for count in counts.tolist():
        high, low = count.to_bytes(2, "big", signed=True)
        if kind == "bytes_swapped":
            out.append(int.from_bytes(bytes([low, high]), "big", signed=True))
        else:
            signed = int.from_bytes(bytes([high]), "big", signed=True)
            out.append(256 * signed + (low - 256 if low > 127 else low))
    return np.array(out)


def with_six(block: Block, six: NDArray[np.floating]) -> Block:
    return replace(block, acc=six[:, :3], gyr=six[:, 3:])


@pytest.mark.parametrize("kind", ["bytes_swapped", "low_byte_signed"])
@pytest.mark.parametrize(
    "bias",
    [0.02, *(pytest.param(b, marks=pytest.mark.thorough) for b in (-0.3, 0.12, 0.57))],
)
def test_each_count_is_what_it_was(kind: str, bias: float) -> None:
    device = replace(TACTICAL, acc_noise=0.01, acc_bias=(bias, -0.1, bias))
    about = description_file.parse_description(tables(device))
    block = record(device, ride(device, seed=3))
    counts = np.round(block.six / LSB).astype(np.int64)
    whole, tried = counts * LSB, 0
    for c, name in enumerate(CHANNELS):
        broken = slip(kind, counts[:, c])
        if np.array_equal(broken, counts[:, c]):
            continue
        six = whole.copy()
        six[:, c] = broken * LSB[c]
        told = check_chain(with_six(block, six), about)
        found = [f.values for i, f in told.faults if i == "decode_fault"]
        assert found == [{"channel": name, "kind": kind}]
        np.testing.assert_allclose(told.block.six, whole, rtol=1e-6, atol=1e-9)
        tried += 1
        if tried == 3:
            break
    assert tried == 3


def test_single_wild_values_are_replaced_at_rest_and_on_the_way() -> None:
    about = description_file.parse_description(tables(TACTICAL))
    ridden = ride(TACTICAL, seed=3)
    block = record(TACTICAL, ridden)
    rng, six = np.random.default_rng(4), block.six
    full = np.repeat([16 * 9.80665, np.deg2rad(2000)], 3)
    lost = rng.choice(np.arange(5, len(six) - 5, 4), 60, replace=False)
    size = rng.uniform(0.4, 1, (60, 6)) * rng.choice([-1, 1], (60, 6))
    six[lost] = size * full
    told = check_chain(with_six(block, six), about)
    found = [f.values for i, f in told.faults if i == "decode_fault"]
    assert found == [{"channel": c, "kind": "wild"} for c in CHANNELS]
    kept = np.delete(np.arange(len(six)), lost)
    np.testing.assert_array_equal(told.block.six[kept], block.six[kept])
    beside = (block.six[lost - 1] + block.six[lost + 1]) / 2
    np.testing.assert_allclose(told.block.gyr[lost], beside[:, 3:])
    inside = [p for p in about.windows if p is not None]
    rest = np.any(
        [(block.t[lost] > a) & (block.t[lost] < b) for a, b in inside], axis=0
    )
    assert 30 < rest.sum() < 60
    np.testing.assert_allclose(told.block.acc[lost[rest]], beside[rest, :3])
    # a device that is put down is stopped by as large a force
    np.testing.assert_array_equal(told.block.acc[lost[~rest]], six[lost[~rest], :3])


def test_what_shakes_a_device_is_no_wild_value() -> None:
    """Random shaking of 4 m/s^2 in one window: each sample jumps."""
    about = description_file.parse_description(tables(TACTICAL))
    ridden = ride(TACTICAL, seed=3)
    block, rng = record(TACTICAL, ridden), np.random.default_rng(2)
    six, shaken = block.six, ridden.held == 4
    six[shaken, :3] += rng.normal(0, 4.0, (shaken.sum(), 3))
    six[shaken, 3:] += rng.normal(0, 0.4, (shaken.sum(), 3))
    told = check_chain(with_six(block, six), about)
    assert "decode_fault" not in told.ids


@pytest.mark.parametrize(
    "seed",
    [0, *(pytest.param(s, marks=pytest.mark.thorough) for s in range(1, 8))],
)
def test_shaking_that_is_rectified_has_a_long_tail_and_is_no_wild_value(
    seed: int,
) -> None:
    """Its square is chi-squared: some samples of thousands go eleven times as far."""
    about = description_file.parse_description(tables(TACTICAL))
    ridden = ride(TACTICAL, seed=3)
    block, rng = record(TACTICAL, ridden), np.random.default_rng(seed)
    six = block.six
    six[:, 1] -= 0.9 * rng.normal(size=len(six)) ** 2
    assert "decode_fault" not in check_chain(with_six(block, six), about).ids
    lost = rng.choice(np.flatnonzero(ridden.held >= 0), 3, replace=False)
    six[lost, 1] += 60.0
    told = check_chain(with_six(block, six), about)
    assert "decode_fault" in told.ids
    assert np.abs(told.block.acc[lost, 1] - six[lost, 1]).min() > 40.0


def test_wild_values_that_come_often_are_found_among_each_other() -> None:
    """Every thirtieth sample is one, so a tenth departs from those beside it."""
    about = description_file.parse_description(tables(TACTICAL))
    ridden = ride(TACTICAL, seed=3)
    block = record(TACTICAL, ridden)
    lost = np.flatnonzero(ridden.held >= 0)[10:-10:30]
    six = block.six
    six[lost, 2] += 70.0
    told = check_chain(with_six(block, six), about)
    assert [f.values for i, f in told.faults if i == "decode_fault"] == [
        {"channel": "az", "kind": "wild"}
    ]
    assert np.abs(told.block.acc[lost, 2] - block.acc[lost, 2]).max() < 1.0


@pytest.mark.parametrize("push", [2.0, 90.0])
def test_a_knock_on_the_way_is_no_wild_value(push: float) -> None:
    """It moves the device; at rest 2 m/s^2 of one sample may as well be noise."""
    about = description_file.parse_description(tables(TACTICAL))
    ridden = ride(TACTICAL, seed=3)
    block = record(TACTICAL, ridden)
    held = ridden.held >= 0
    at = np.flatnonzero(held if push < 5 else ~held)[40::400]
    six = block.six
    six[at, :3] += push
    told = check_chain(with_six(block, six), about)
    assert "decode_fault" not in told.ids


def test_registers_that_were_read_as_they_changed_are_put_back() -> None:
    """High byte of one value, low byte of the next: off by 256 counts, up or down."""
    rng = np.random.default_rng(4)
    device = replace(TACTICAL, acc_noise=0.01)
    about = description_file.parse_description(tables(device))
    ridden = ride(device, seed=3)
    block = record(device, ridden)
    six, size = block.six, 256 * 6e-4
    torn = (rng.random((len(six), 3)) < 4e-3) & (ridden.held >= 0)[:, None]
    six[:, :3] += size * torn * rng.choice([-1, 1], torn.shape)
    told = check_chain(with_six(block, six), about)
    assert [f.values for i, f in told.faults if i == "decode_fault"] == [
        {"channel": f"a{c}", "kind": "one_size"} for c in "xyz"
    ]
    off = np.abs(told.block.acc - block.acc)[torn]
    assert np.mean(off < size / 20) > 0.95
    assert not {"bump", "noise_level"} & set(told.ids)


@pytest.mark.parametrize("steps", [0.05, 0.3, 1.2])
def test_steps_however_coarse_are_no_slip(steps: float) -> None:
    device = replace(TACTICAL, acc_noise=0.1, gyr_noise=2e-3, gyr_bias=(0.3, 0.05, 0.0))
    block = record(device, ride(device, seed=3))
    size = np.repeat([steps, steps / 100], 3)
    six = np.round(block.six / size) * size
    told = check_chain(
        with_six(block, six), description_file.parse_description(tables(TACTICAL))
    )
    assert "decode_fault" not in told.ids


@given(st.lists(st.integers(-32768, 32767), min_size=2, max_size=60))
def test_nothing_is_made_of_nothing(counts: list[int]) -> None:
    some = np.array(counts)
    kind, mended = undo_decode_fault(some)
    assert len(mended) == len(some)
    assert bool(kind) or np.array_equal(mended, some)


@pytest.mark.parametrize("seed", range(3))
def test_noise_of_many_digits_did_not_wrap(seed: int) -> None:
    """Counts of the last digit reach beyond 16 bits, and jump by half of those."""
    rng = np.random.default_rng(seed)
    counts = np.round(23_000 + rng.normal(0, 12_600, 100_000)).astype(np.int64)
    for some in (counts, counts.clip(0, 65_535)):
        kind, mended = undo_decode_fault(some)
        assert not kind and mended is some


@pytest.mark.parametrize("low", [0, -(2**15)])
def test_what_wrapped_is_put_right_from_words_with_a_sign_and_without(low: int) -> None:
    rng = np.random.default_rng(5)
    course = 30_000 * np.sin(np.arange(4000) / 300) + rng.normal(0, 300, 4000)
    true = np.round(course + low + 2**16).astype(np.int64)
    kind, mended = undo_decode_fault((true - low) % 2**16 + low)
    assert kind == "wrapped" and np.ptp(mended - true) == 0


def test_an_axis_that_wraps_once_is_put_right_beside_another() -> None:
    """One driver reads them: the second axis is turned beyond its range but once."""
    about = description_file.parse_description(tables(TACTICAL))
    block = record(TACTICAL, ride(TACTICAL, seed=3))
    true = np.round(block.six / LSB).astype(np.int64)
    rows = np.arange(200) + int(np.searchsorted(block.t, 35.0))
    bell = 45_000 * np.sin(np.pi * np.arange(200) / 200) ** 2
    for axis, sign in ((3, 1), (4, -1)):
        true[rows, axis] += np.round(sign * bell).astype(np.int64)
    true[rows + 400, 3] += np.round(bell).astype(np.int64)
    wrapped = (true + 2**15) % 2**16 - 2**15
    told = check_chain(with_six(block, wrapped * LSB), about)
    found = [f.values for i, f in told.faults if i == "decode_fault"]
    assert found == [{"channel": c, "kind": "wrapped"} for c in ("gx", "gy")]
    np.testing.assert_allclose(told.block.six[:, 3:5], (true * LSB)[:, 3:5], atol=1e-9)
