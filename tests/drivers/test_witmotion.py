"""WitMotion frames written out by hand from the data sheet; what can befall them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from wires import wit
from wires import wit_acc as acc
from wires import wit_gyr as gyr
from wires import wit_time as at

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block, concat
from fieldcal.drivers.options import Options
from fieldcal.drivers.protocols.witmotion import WitmotionCodec

G = 9.80665

# 2020-07-31 12:34:56.270; sum 0x354
TIME = bytes.fromhex("55 50 14 07 1f 0c 22 38 0e 01 54")
# 1 g, -1 g, 0.5 g, 25.00 deg C; sum 0x377
ACC = bytes.fromhex("55 51 00 08 00 f8 00 04 c4 09 77")
# 1000, -1000, 0.9765625 deg/s; sum 0x1b7
GYR = bytes.fromhex("55 52 00 40 00 c0 10 00 00 00 b7")
# roll, pitch, yaw: of no use here
ANGLE = bytes.fromhex("55 53 00 00 00 00 00 00 00 00 a8")


def codec(query: str = "") -> WitmotionCodec:
    return WitmotionCodec(Options("serial", query))


def fed(codec: WitmotionCodec, *pieces: bytes) -> Block:
    blocks = [codec.feed(piece, float(i)) for i, piece in enumerate(pieces)]
    return concat(block for block in blocks if block is not None)


def test_a_sample_written_out_by_hand() -> None:
    block = codec().feed(TIME + ACC + GYR, 7.0)
    assert block is not None
    rate = np.deg2rad([1000, -1000, 0.9765625])
    np.testing.assert_allclose(block.acc, [[G, -G, G / 2]])
    np.testing.assert_allclose(block.gyr, [rate])
    np.testing.assert_allclose(block.temperature, [25])
    np.testing.assert_allclose(block.t, [12 * 3600 + 34 * 60 + 56.270], rtol=1e-12)
    assert block.t_host.tolist() == [7.0]


def test_other_ranges() -> None:
    block = codec("acc_range=2&gyr_range=250&rate=100").feed((ACC + GYR) * 3)
    assert block is not None
    np.testing.assert_allclose(block.acc[0], [G / 8, -G / 8, G / 16])
    np.testing.assert_allclose(block.gyr[0, 0], np.deg2rad(125))


def test_stamps_of_a_millisecond_become_even_times_within_their_resolution() -> None:
    truth = 3.0 + np.arange(2000) / 400
    ms = [int(t * 1000 + 1e-6) for t in truth]
    stream = b"".join(at(m) + acc(i) + gyr(i) for i, m in enumerate(ms))
    block = fed(codec(), stream)
    assert len(block) == 2000
    assert np.all(np.diff(block.t) > 0)
    assert np.all(np.abs(block.t - truth) <= 1.001e-3)
    assert np.std(np.diff(block.t)[200:]) < 0.1e-3  # the stamps': 0.5e-3


def test_midnight_and_a_leap_day_are_no_gap() -> None:
    day = 24 * 3600 * 1000
    last = at(day - 10)
    first = wit(0x50, bytes([24, 3, 1, 0, 0, 0, 0, 0]))
    block = fed(codec(), last + ACC + GYR + first + ACC + GYR)
    np.testing.assert_allclose(np.diff(block.t), 0.010)


def test_half_a_sample_is_none_and_shows_as_a_gap() -> None:
    cycles = [(at(10 * i), acc(i), gyr(i)) for i in range(60)]
    stream = b""
    for i, (time, a, w) in enumerate(cycles):
        stream += time + (a if i != 30 else b"") + (w if i != 40 else b"")
    decoder = codec()
    block = fed(decoder, stream)
    lost = [i for i in range(60) if i not in {30, 40}]
    np.testing.assert_allclose(block.acc[:, 0], np.array(lost) * 16 * G / 32768)
    np.testing.assert_allclose(block.gyr[:, 0], np.deg2rad(lost) * 2000 / 32768)
    np.testing.assert_allclose(block.t, np.array(lost) / 100, atol=1.001e-3)
    assert (decoder.health.gaps, decoder.health.missing) == (2, 2)


def test_a_declared_rate_counts_the_cycles_that_were_cut() -> None:
    stream = b"".join(acc(i) + (gyr(i) if i != 5 else b"") for i in range(10))
    decoder = codec("rate=200")
    block = fed(decoder, stream)
    np.testing.assert_allclose(block.t, np.delete(np.arange(10), 5) / 200)
    assert (decoder.health.gaps, decoder.health.missing) == (1, 1)


def test_halves_of_two_samples_are_not_put_together() -> None:
    spoilt = b"\x55\x52" + bytes(9) + b"\x55\x51" + bytes(9)
    stream = acc(1) + gyr(1) + acc(2) + spoilt + gyr(3) + acc(4) + gyr(4) + ACC + GYR
    block = fed(codec("rate=100"), stream)
    assert np.round(block.acc[:2, 0] / (16 * G / 32768)).tolist() == [1, 4]


def test_a_doubled_frame_and_a_doubled_sample_count_once() -> None:
    cycles = [at(10 * i) + acc(i) + gyr(i) for i in range(40)]
    cycles[20] += cycles[20]
    cycles[30] = at(300) + acc(30) * 2 + gyr(30) * 2
    decoder = codec()
    block = fed(decoder, b"".join(cycles))
    assert len(block) == 40
    assert decoder.health.repeated == 1
    assert decoder.health.gaps == 0


def test_kinds_of_no_use_are_passed_over() -> None:
    decoder = codec()
    block = fed(decoder, (TIME + ACC + GYR + ANGLE))
    assert len(block) == 1
    assert (decoder.health.bad, decoder.health.skipped) == (0, 0)


def test_a_lost_time_frame_costs_no_sample() -> None:
    stream = b"".join(
        (at(10 * i) if i != 30 else b"") + acc(i) + gyr(i) for i in range(60)
    )
    block = fed(codec(), stream)
    np.testing.assert_allclose(block.t, np.arange(60) / 100, atol=1.001e-3)


def test_arrivals_serve_where_nothing_else_tells_the_time() -> None:
    rng = np.random.default_rng(1)
    decoder = codec()
    pieces = []
    for i in range(2000):
        late = 0.001 + rng.exponential(0.003)
        block = decoder.feed(acc(i % 1000) + gyr(i % 1000), 100 + i / 199 + late)
        pieces += [block] if block is not None else []
    block = concat(pieces)
    assert 1780 < len(block) < 1820  # the first second only teaches
    period = np.diff(block.t)
    assert np.all(period > 0)
    np.testing.assert_allclose(period[-500:].mean(), 1 / 199, rtol=1e-3)
    assert period[-500:].std() < 1e-4  # the arrivals': 4e-3
    np.testing.assert_allclose(block.t - block.t_host, 0, atol=0.03)


@given(st.integers(0, 32), st.integers(1, 255))
def test_a_damaged_byte_makes_no_sample(at: int, flip: int) -> None:
    damaged = bytearray(TIME + ACC + GYR)
    damaged[at] ^= flip
    block = codec("rate=100").feed(bytes(damaged))
    if at < 11:
        assert block is None or not len(block)
    else:
        assert block is None


@pytest.mark.parametrize(
    "query", ["rate=fast", "rate=-1", "acc_range=0", "gyr_range=nan", "rate"]
)
def test_options_that_are_none(query: str) -> None:
    with pytest.raises(InputError):
        codec(query)
