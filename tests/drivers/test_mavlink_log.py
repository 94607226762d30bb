"""The log of an autopilot nobody here wrote: its hidden truth, and bytes gone wrong."""

import gzip
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("fastcrc")
pytest.importorskip("pymavlink")

from fieldcal.core.errors import DeviceError, InputError
from fieldcal.core.samples import Array, Block, Grain, concat
from fieldcal.drivers.driver import open_driver
from fieldcal.drivers.mavlink_log import split_log
from fieldcal.drivers.mavlink_samples import MavlinkDecoder
from fieldcal.drivers.options import Options
from fieldcal.run.link_marks import LinkMarks

G = 9.80665
NAME = "autopilot_12_positions"


@pytest.fixture(scope="module")
def log(shared: Path) -> bytes:
    path = shared / "real" / "autopilot_streams" / f"{NAME}.tlog.gz"
    if not path.is_file():
        pytest.skip(f"the recording is not here: {path}")
    return gzip.decompress(path.read_bytes())


@pytest.fixture(scope="module")
def about(shared: Path) -> dict[str, Any]:
    path = shared / "real" / "autopilot_streams" / f"{NAME}.json"
    if not path.is_file():
        pytest.skip(f"the recording is not here: {path}")
    told: dict[str, Any] = json.loads(path.read_text())
    return told


def decoded(data: bytes, query: str) -> Block:
    decoder = MavlinkDecoder(Options("test", query))
    block = decoder.feed(data, 0.0)
    assert block is not None
    return block


def fit(block: Block, windows: list[dict[str, float]]) -> tuple[Array, Array, Array]:
    """Bias and scale of each axis by least squares, and the mean rate."""
    means = [block.between(w["start_s"], w["end_s"]).six.mean(axis=0) for w in windows]
    six = np.array(means)
    roll, pitch = np.deg2rad([[w["roll_deg"], w["pitch_deg"]] for w in windows]).T
    down = [-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)]
    design = [np.column_stack([np.ones(len(six)), -G * axis]) for axis in down]
    found = [
        np.linalg.lstsq(a, u, rcond=None)[0]
        for a, u in zip(design, six.T[:3], strict=True)
    ]
    return *np.array(found).T, six[:, 3:].mean(axis=0)


@pytest.mark.parametrize(
    ("query", "scale_within", "bias_within_mg"),
    [("message=RAW_IMU", 1e-4, 1.0), ("message=HIGHRES_IMU", 2e-5, 0.1)],
)
def test_hidden_truth_comes_back(
    log: bytes,
    about: dict[str, Any],
    query: str,
    scale_within: float,
    bias_within_mg: float,
) -> None:
    bias, scale, rate = fit(decoded(log, query), about["windows"])
    truth = about["truth"]
    # the simulator divides by its scale: what comes out is true / S + B
    np.testing.assert_allclose(scale * truth["S"], 1, atol=scale_within)
    np.testing.assert_allclose(bias, truth["B"], atol=bias_within_mg * 1e-3 * G)
    np.testing.assert_allclose(rate, truth["GB"], atol=5e-5)


def test_truncation_left_in_shows(log: bytes, about: dict[str, Any]) -> None:
    block = decoded(log, "message=RAW_IMU&rounding=nearest")
    _, scale, _ = fit(block, about["windows"])
    off = scale * about["truth"]["S"] - 1
    assert np.all((off < -3e-4) & (off > -9e-4))


def test_units_are_told_and_counts_agree(log: bytes) -> None:
    decoder = MavlinkDecoder(Options("test", "message=RAW_IMU"))
    block = decoder.feed(log, 0.0)
    assert block is not None
    assert len(block) == decoder.health.samples == 16917
    assert decoder.acc_unit == "mg"
    assert decoder.sources == {(1, 1)}
    assert decoder.health.gaps == decoder.health.repeated == 0
    assert block.temperature[0] == 25.6
    assert decoder.grain == Grain(1e-3 * G, 1e-3, cut=True)


def test_the_log_plays_as_a_device(log: bytes, tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    path.write_bytes(log[:200_000])
    blocks = []
    with open_driver(f"mavlink:{path}?speed=max&message=RAW_IMU") as imu:
        with pytest.raises(DeviceError, match="has ended after"):
            for block in imu.blocks():
                blocks.append(block)
        assert imu.notes["vehicle"] == (1, 1)
        assert imu.notes["rate_hz"] == pytest.approx(50, rel=0.01)
    direct = decoded(log[:200_000], "message=RAW_IMU")
    np.testing.assert_array_equal(concat(blocks).six, direct.six)
    with (
        open_driver(f"mavlink:{path}?speed=max&message=SCALED_IMU2") as imu,
        pytest.raises(DeviceError, match="ended"),
    ):
        list(imu.blocks())


def test_a_unit_that_shows_later_is_marked_then(log: bytes, tmp_path: Path) -> None:
    class Marks(list[dict[str, Any]]):
        def mark(self, event: str, **what: Any) -> None:
            self.append({"event": event, **what})

    path, kept = tmp_path / "flight.tlog", Marks()
    path.write_bytes(log[:200_000])
    with open_driver(f"mavlink:{path}?speed=max&message=RAW_IMU") as imu:
        assert imu.notes["acc_unit"] == ""
        marks = LinkMarks(imu, kept)
        with pytest.raises(DeviceError, match="has ended after"):
            for block in imu.blocks():
                marks.take(block)
    (told,) = [mark for mark in kept if mark["event"] == "device"]
    assert told["acc_unit"] == "mg" and told["vehicle"] == (1, 1)


def test_what_is_no_log_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        open_driver(f"mavlink:{tmp_path / 'none.tlog'}")
    (tmp_path / "odd.tlog").write_bytes(b"nothing")
    with pytest.raises(InputError, match="holds no packet"):
        open_driver(f"mavlink:{tmp_path / 'odd.tlog'}")


@pytest.mark.parametrize(
    "message", ["RAW_IMU", pytest.param("HIGHRES_IMU", marks=pytest.mark.thorough)]
)
def test_cuts_and_garbage_change_nothing(log: bytes, message: str) -> None:
    data = log[:6_000]
    whole = decoded(data, f"message={message}")
    for size in (1, 7, 64, 5000):
        decoder = MavlinkDecoder(Options("test", f"message={message}"))
        parts = [
            decoder.feed(data[i : i + size], 0.0) for i in range(0, len(data), size)
        ]
        block = concat(part for part in parts if part is not None)
        # a packet that is still open at the end waits for more
        assert 0 <= len(whole) - len(block) <= 1
        np.testing.assert_array_equal(block.six, whole.six[: len(block)])
        np.testing.assert_array_equal(block.t, whole.t[: len(block)])


def test_mutated_bytes_give_no_wrong_sample(log: bytes) -> None:
    rng = np.random.default_rng(5)
    data = np.frombuffer(log[:500_000], np.uint8)
    known = {row.tobytes() for row in decoded(data.tobytes(), "message=RAW_IMU").six}
    wrong = 0
    for _ in range(2):
        spoilt = data.copy()
        at = rng.integers(0, len(data), 10_000)
        spoilt[at] = rng.integers(0, 256, len(at))
        decoder = MavlinkDecoder(Options("test", "message=RAW_IMU"))
        for i in range(0, len(spoilt), 4096):
            block = decoder.feed(spoilt[i : i + 4096].tobytes(), 0.0)
            assert decoder.waiting_bytes <= decoder.longest
            if block is not None:
                wrong += sum(row.tobytes() not in known for row in block.six)
    # thousands of packets were spoilt, and a check of 16 bits lets one of 65536 pass
    assert wrong <= 1


@settings(max_examples=60)
@given(st.binary(max_size=600))
def test_any_bytes_are_survived(data: bytes) -> None:
    decoder = MavlinkDecoder(Options("test", "message=RAW_IMU"))
    assert decoder.feed(data, 0.0) is None
    assert decoder.waiting_bytes <= decoder.longest
    assert sum(len(chunk.data) for chunk in split_log(data)) <= len(data)


def spoiled_log(kind: str, rng: np.random.Generator) -> tuple[list[bytes], bytes]:
    """Packets of a log with their stamps, and the log with a place that is spoiled."""
    packets = [
        int(1.7e15 + 10_000 * i).to_bytes(8, "big") + b"\xfe\x1a" + rng.bytes(32)
        for i in range(300)
    ]
    at, garbage = int(rng.integers(50, 250)), rng.bytes(int(rng.integers(1, 200)))
    before, behind = b"".join(packets[:at]), b"".join(packets[at:])
    lost = int(rng.integers(1, 60))
    return packets, {
        "inserted": before + garbage + behind,
        "lost": before[:-lost] + behind,
        "changed": before + garbage[:60] + behind[60:],
    }[kind]


@pytest.mark.parametrize("kind", ["inserted", "lost", "changed"])
def test_a_spoiled_log_goes_on_in_its_own_time(kind: str) -> None:
    """A packet with a time of garbage would be due in a million years."""
    for seed in range(30):
        packets, data = spoiled_log(kind, np.random.default_rng(seed))
        chunks = split_log(data)
        times = np.array([chunk.t_host for chunk in chunks])
        assert (abs(times - 1.7e9) < 86400).all()
        whole = {packet[8:] for packet in packets}
        assert sum(chunk.data in whole for chunk in chunks) > len(packets) - 12


def test_a_clock_that_is_set_in_a_log_ends_no_log() -> None:
    """A companion computer knows the time when it has found a network."""
    begins = [10_000 * i for i in range(9)] + [10**15 + 10_000 * i for i in range(9)]
    packets = [t.to_bytes(8, "big") + b"\xfe\x04" + bytes(10) for t in begins]
    chunks = split_log(b"".join(packets))
    assert [round(chunk.t_host * 1e6) for chunk in chunks] == begins
