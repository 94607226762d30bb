"""Samples put together out of frames: whatever is lost, doubled or late."""

import struct
from pathlib import Path

import numpy as np
import pytest
from can_wires import (
    DBC,
    KEYED,
    TURNS,
    climate,
    decode,
    frames,
    numbers,
    sample,
    stream,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldcal.core.samples import Block
from fieldcal.drivers.can_frame_groups import CanLinkHealth
from fieldcal.drivers.can_frames import ERROR_FLAG, frame_row
from fieldcal.drivers.can_map import read_map
from fieldcal.drivers.can_samples import CanAssembler
from fieldcal.drivers.options import Options
from fieldcal.drivers.sample_counter import SampleCounter


@pytest.fixture(scope="module")
def dbc(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("can") / "imu.dbc"
    path.write_text(DBC)
    return path


def assert_same(a: Block, b: Block) -> None:
    for name in ("t", "acc", "gyr", "temperature", "seq", "t_host"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


@pytest.mark.parametrize("query", [f"map={KEYED}", f"map={TURNS}"])
def test_every_sample_is_there_in_si_units(dbc: Path, query: str) -> None:
    block, health = decode(dbc, query, stream(1000))
    assert numbers(block) == list(range(1000))
    np.testing.assert_allclose(block.t, np.arange(1000) / 100)
    assert (health.samples, health.incomplete, health.gaps) == (1000, 0, 0)


@given(data=st.data())
@pytest.mark.parametrize("query", [f"map={KEYED}", f"map={TURNS}"])
def test_spoilt_streams_give_right_samples_however_they_are_cut(
    dbc: Path, query: str, data: st.DataObject
) -> None:
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    rows = [climate(20.0), *stream(40)]
    spoil = data.draw(st.sampled_from(["nothing", "lost", "doubled", "strange"]))
    if spoil == "lost":
        rows = [row for row in rows if rng.uniform() > 0.2]
    elif spoil == "doubled":
        rows = [row for row in rows for _ in range(1 + (rng.uniform() < 0.2))]
    elif spoil == "strange":
        rows = [
            r
            for row in rows
            for r in [
                row,
                frame_row(0, 32, True, b"12345678"),
                frame_row(0, 7, False, b""),
            ]
        ]
    late = "seq" in query and data.draw(st.booleans())
    if late:
        order = np.argsort(np.arange(len(rows)) + rng.uniform(0, 3, len(rows)))
        rows = [rows[i] for i in order]
    cuts = sorted(data.draw(st.lists(st.integers(0, len(rows)), max_size=30)))
    whole, _ = decode(dbc, query, rows)
    pieces, health = decode(dbc, query, rows, cuts)
    assert_same(whole, pieces)
    if "seq" in query:  # without a counter a lost pair may be taken for one sample
        got = numbers(pieces)
        assert got == sorted(set(got)) and len(got) == health.samples
    if spoil in ("nothing", "strange") or (spoil == "doubled" and "seq" in query):
        assert len(pieces) >= (25 if late else 40)


def test_frame_by_frame_and_late_frames(dbc: Path) -> None:
    rows = stream(60)
    rows[10], rows[13] = rows[13], rows[10]
    block, health = decode(dbc, f"map={KEYED}", rows, list(range(len(rows))))
    assert numbers(block) == [i for i in range(60) if i != 5]
    assert health.incomplete == 1
    assert (health.gaps, health.missing) == (1, 1)


def test_a_counter_tells_how_many_are_missing(dbc: Path) -> None:
    rows = [row for i in range(300) if not 100 <= i < 130 for row in sample(i)]
    block, health = decode(dbc, f"map={KEYED}", rows)
    assert (health.gaps, health.missing) == (1, 30)
    np.testing.assert_allclose(block.t, np.r_[:100, 130:300] / 100)


def test_a_lost_frame_costs_its_sample_and_no_other(dbc: Path) -> None:
    for query in (f"map={KEYED}", f"map={TURNS}"):
        for lost in (20, 21):
            rows = stream(30)
            del rows[lost]
            block, health = decode(dbc, query, rows)
            assert numbers(block) == [i for i in range(30) if i != 10]
            assert health.incomplete == 1


def test_a_stuck_counter_is_no_memory_leak(dbc: Path) -> None:
    options = Options("can", f"dbc={dbc}&rate=100&map={KEYED}")
    decoder = CanAssembler(read_map(options), CanLinkHealth(), options)
    some = frames([sample(7)[0]] * 1000)
    for _ in range(20):
        assert decoder.feed(some, some["t"]) is None
    rest = decoder._groups._rest
    assert rest is not None and len(rest.key) <= 2


def test_first_and_within(dbc: Path) -> None:
    rows = stream(20)
    swapped = [row for i in range(20) for row in (rows[2 * i + 1], rows[2 * i])]
    block, _ = decode(dbc, f"map={TURNS}&first=Rate", swapped)
    assert numbers(block) == list(range(20))
    late = [*sample(0), sample(1)[0], sample(5)[1], *sample(6)]
    block, health = decode(dbc, f"map={TURNS}&within=0.005", late)
    assert numbers(block) == [0, 6] and health.incomplete == 1


def test_a_slow_temperature_is_held(dbc: Path) -> None:
    rows = [*sample(0), climate(20.0), *sample(1), *sample(2), climate(21.5)]
    rows += sample(3)
    block, _ = decode(dbc, f"map={TURNS}", rows, [3, 5])
    np.testing.assert_allclose(block.temperature, [np.nan, 20, 20, 21.5])


def test_damaged_frames_are_counted_and_left_out(dbc: Path) -> None:
    rows = stream(10)
    rows[4] = frame_row(0.02, 32, False, b"\x01\x00")
    rows[8] = frame_row(0.04, 32, False, b"\x00\x80" + bytes(4) + b"\x04\x00")
    rows.append(frame_row(0, ERROR_FLAG, False, b""))
    block, health = decode(dbc, f"map={KEYED}", rows)
    assert numbers(block) == [0, 1, 3, 5, 6, 7, 8, 9]
    assert (health.bad, health.incomplete, health.errors) == (2, 2, 1)
    assert health.strange == 0


MUX = """\
VERSION ""
NS_ :
BS_:
BU_: A

BO_ 5 Imu: 8 A
 SG_ kind M : 0|4@1+ (1,0) [0|0] "" A
 SG_ count : 4|4@1+ (1,0) [0|0] "" A
 SG_ ax m0 : 8|16@1- (0.01,0) [0|0] "m/s²" A
 SG_ gx m1 : 8|16@1- (0.01,0) [0|0] "dps" A
"""


def test_a_multiplexed_frame_is_several(tmp_path: Path) -> None:
    path = tmp_path / "mux.dbc"
    path.write_text(MUX, encoding="cp1252")
    rows = [
        frame_row(
            i / 100, 5, False, bytes([kind | i % 16 << 4, i, kind, 0, 0, 0, 0, 0])
        )
        for i in range(50)
        for kind in (0, 1)
    ]
    block, health = decode(path, "map=ax=ax,gx=gx,seq=count", rows, [1, 50])
    np.testing.assert_allclose(block.acc[:, 0], np.arange(50) / 100)
    np.testing.assert_allclose(np.rad2deg(block.gyr[:, 0]), (np.arange(50) + 256) / 100)
    assert np.isnan(block.acc[:, 1:]).all() and health.incomplete == 0


STAMPED = """\
VERSION ""
NS_ :
BS_:
BU_: A

BO_ 5 Force: 8 A
 SG_ ax : 0|16@1- (0.01,0) [0|0] "m/s^2" A
 SG_ t : 16|16@1+ (0.1,0) [0|0] "ms" A
BO_ 6 Rate: 8 A
 SG_ gx : 0|16@1- (0.01,0) [0|0] "rad/s" A
 SG_ t : 16|16@1+ (0.1,0) [0|0] "ms" A
"""


def test_stamps_put_frames_together_and_unwrap(tmp_path: Path) -> None:
    path = tmp_path / "stamped.dbc"
    path.write_text(STAMPED)
    rows = []
    for i in range(3000):
        stamp = (100 * i % 65536).to_bytes(2, "little")
        for identifier in (6, 5):
            if (i, identifier) != (1500, 6):
                data = (i % 100).to_bytes(2, "little") + stamp
                rows.append(frame_row(i / 100, identifier, False, data))
    block, health = decode(path, "", rows, [100, 101, 3000])
    kept = np.delete(np.arange(3000), 1500)
    np.testing.assert_allclose(block.t, kept / 100, atol=1e-4)
    np.testing.assert_array_equal(block.acc[:, 0], block.gyr[:, 0])
    assert (health.incomplete, health.gaps, health.missing) == (1, 1, 1)


@settings(max_examples=40)
@given(st.integers(0, 2**32), st.lists(st.integers(0, 100), max_size=20))
@pytest.mark.parametrize("query", [f"map={KEYED}", f"map={TURNS}"])
def test_frames_of_noise_break_nothing_however_they_are_cut(
    dbc: Path, query: str, seed: int, cuts: list[int]
) -> None:
    rng = np.random.default_rng(seed)
    rows = [
        frame_row(
            float(rng.uniform(0, 1)),
            int(rng.choice([32, 33, 33, 34, 35])),
            bool(rng.uniform() < 0.1),
            rng.bytes(int(rng.choice([0, 7, 8, 8, 8, 64]))),
        )
        for _ in range(100)
    ]
    whole, _ = decode(dbc, query, rows)
    pieces, _ = decode(dbc, query, rows, sorted(cuts))
    assert_same(whole, pieces)
    assert (np.diff(whole.t) > 0).all()


@pytest.mark.parametrize(
    ("states", "lost", "missing"),
    [
        (15, (), 0),
        (16, (), 0),
        (15, (14, 90), 0),  # nobody knows yet whether there is a 14
        (15, (179, 240), 2),
        (15, (165, 166), 2),
        (16, (143, 144), 2),
        (15, (7, 8), 2),
    ],
)
@pytest.mark.parametrize("cut", [1, 7, 1000])
def test_a_counter_of_unknown_range_tells_of_a_loss_where_it_is_certain(
    states: int, lost: tuple[int, ...], missing: int, cut: int
) -> None:
    counter = SampleCounter(16, wraps_anywhere=True)
    seq = np.array([float(i % states) for i in range(300) if i not in lost])
    steps = [counter.steps(seq[at : at + cut]) for at in range(0, len(seq), cut)]
    assert np.sum(np.concatenate(steps) - 1) == missing


def test_a_counter_that_counts_by_twos_never_shows_its_last_number() -> None:
    counter = SampleCounter(16, wraps_anywhere=True)
    steps = counter.steps(np.arange(0.0, 100.0, 2.0) % 16)
    assert (steps[1:] == 2).all()


@pytest.mark.parametrize(
    ("stated", "least", "states", "missing"),
    [("0|14", 0, 15, 0), ("1|15", 1, 15, 0), ("0|15", 0, 16, 0), ("0|0", 0, 16, 0),
     ("0|3", 0, 16, 0), ("0|0", 0, 15, 0), ("0|1e999", 0, 16, 0), ("0|14.5", 0, 16, 0)],
    ids=["E2E", "from 1", "all", "unstated", "wrongly stated", "unstated, and fewer",
         "endless", "no whole number"],
)  # fmt: skip
def test_a_counter_has_as_many_numbers_as_its_range_states(
    tmp_path: Path, stated: str, least: int, states: int, missing: int
) -> None:
    """The last number of E2E profile 1 means an error, and is never sent."""
    dbc = tmp_path / "imu.dbc"
    dbc.write_text(
        DBC.replace("seq : 48|8@1+ (1,0) [0|0]", f"seq : 48|4@1+ (1,0) [{stated}]")
    )
    rows = [
        frame_row(i / 100, identifier, False, data)
        for i in range(100)
        for data in [struct.pack("<3hBx", i, 2 * i, 3 * i, least + i % states)]
        for identifier in (32, 33)
    ]
    block, health = decode(dbc, f"map={KEYED}", rows)
    assert len(block) == 100 and health.missing == missing
