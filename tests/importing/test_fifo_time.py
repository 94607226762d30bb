"""FIFOs, batches and integrals: logs built from the public definitions of messages."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.cli import main
from fieldcal.core.samples import Array, Block
from fieldcal.importing import recording as recordings
from fieldcal.importing.times.fifo_time import FifoTimes
from fieldcal.session.folder import Session

FIFO = (
    "uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float dt;"
    "float scale;int16_t[32] x;int16_t[32] y;int16_t[32] z;uint8_t samples;"
    "uint8_t[3] _padding0;"
)
INTEGRALS = (
    "uint64_t timestamp;uint64_t timestamp_sample;uint32_t accel_device_id;"
    "uint32_t gyro_device_id;float[3] delta_angle;float[3] delta_velocity;"
    "uint32_t delta_angle_dt;uint32_t delta_velocity_dt;uint8_t delta_angle_clipping;"
)


def message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def log(formats: dict[str, str], topics: list[str], rows: list[bytes]) -> bytes:
    """A PX4 log of topics ``name.instance``, numbered from 0 on."""
    out = b"ULog\x01\x12\x35\x01" + bytes(8) + message("B", bytes(40))
    for name, fields in formats.items():
        out += message("F", f"{name}:{fields}".encode())
    key = b"int32_t CAL_ACC1_ID"
    out += message("P", bytes([len(key)]) + key + struct.pack("<i", 77))
    for number, topic in enumerate(topics):
        name, _, instance = topic.partition(".")
        out += message("A", struct.pack("<BH", int(instance), number) + name.encode())
    return out + b"".join(message("D", row) for row in rows)


def fifo(
    number: int, device: int, read: Array, counts: Array, scale: float, n: int
) -> list[tuple[float, bytes]]:
    """Readings of n samples each at times in s; 250 us is told, whatever is true."""
    rows = []
    for i, t in enumerate(read):
        part = np.zeros((32, 3), dtype="<i2")
        part[:n] = counts[i * n : (i + 1) * n]
        stamp = round(t * 1e6)
        head = struct.pack("<HQQIff", number, stamp + 40, stamp, device, 250.0, scale)
        rows.append((t, head + part.T.tobytes() + bytes([n])))
    return rows


def import_log(path: Path, content: bytes, tmp_path: Path, *call: str) -> Path:
    path.write_bytes(content)
    out = tmp_path / "out"
    assert main(["import", str(path), "-o", str(out), *call]) == 0
    return out


def mark(folder: Path, event: str) -> dict[str, Any]:
    return next(m for m in Session.open(folder).marks() if m["event"] == event)


def counts(seed: int, n: int) -> Array:
    return np.random.default_rng(seed).integers(-30000, 30000, (n, 3)).astype(float)


def test_every_sample_of_a_fifo_is_taken_with_its_partner(tmp_path: Path) -> None:
    # the clock of the sensor is 1 % fast, and reading is late by up to 0.2 ms
    n, readings = 8, 200
    rng = np.random.default_rng(3)
    period = 250e-6 / 1.01
    read = 5 + period * n * np.arange(1, readings + 1)
    read = np.round(read + rng.uniform(0, 2e-4, readings), 6)
    acc = {0: counts(1, n * readings), 1: counts(2, n * readings)}
    gyr = {0: counts(3, n * readings), 1: counts(4, n * readings)}
    rows = []
    for i, device in ((0, 77), (1, 88)):
        rows += fifo(i, device, read, acc[i], 0.005, n)
        # the gyroscopes were found in the other order
        rows += fifo(2 + (1 - i), device, read, gyr[i], 0.001, n)
    topics = [f"sensor_{k}_fifo.{i}" for k in ("accel", "gyro") for i in (0, 1)]
    formats = dict.fromkeys(("sensor_accel_fifo", "sensor_gyro_fifo"), FIFO)
    content = log(formats, topics, [row for _, row in sorted(rows)])
    out = import_log(tmp_path / "f.ulg", content, tmp_path)
    for i in (0, 1):
        folder = out / f"sensor_accel_fifo.{i}"
        block = Session.open(folder).block
        scale = np.float32(0.005), np.float32(0.001)
        np.testing.assert_allclose(block.acc, acc[i] * float(scale[0]), rtol=1e-12)
        np.testing.assert_allclose(block.gyr, gyr[i] * float(scale[1]), rtol=1e-12)
        true = 5 + period * np.arange(1, n * readings + 1)
        assert np.abs(block.t - true).max() < 2.5e-4
        assert (np.diff(block.t) > 0).all()
        grain = mark(folder, "grain")
        assert grain["acc"] == pytest.approx(0.005) and not grain["cut"]
        said = " ".join(mark(folder, "imported")["says"])
        assert f"sensor_accel_fifo.{i} goes with sensor_gyro_fifo.{1 - i}" in said
    installed = mark(out / "sensor_accel_fifo.0", "device")["installed"]
    assert installed["instance"] == 1 and installed["taken_out"]


def test_a_gap_in_a_fifo_is_not_filled(tmp_path: Path) -> None:
    n = 4
    read = 1 + 1e-3 * np.array([1.0, 2, 3, 50, 51, 52])
    values = counts(1, n * len(read))
    rows = fifo(0, 5, read, values, 0.01, n)
    content = log(
        {"sensor_accel_fifo": FIFO}, ["sensor_accel_fifo.0"], [row for _, row in rows]
    )
    out = import_log(tmp_path / "f.ulg", content, tmp_path)
    block = Session.open(out).block
    assert np.isnan(block.gyr).all() and len(block) == len(values)
    # 47 ms between two readings: the samples of the second lie just before it
    gap = np.diff(block.t).max()
    assert gap == pytest.approx(47e-3 - 3 * 250e-6, abs=2e-6)
    assert mark(out, "imported")["gaps"] == 1


@pytest.mark.parametrize("wrong", [900.0, 0.001])
@pytest.mark.parametrize("size", [1 << 20, 997])
def test_a_wrong_stamp_of_a_fifo_costs_its_own_samples_alone(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    wrong: float,
    size: int,
) -> None:
    n, at = 4, 7
    read = 1 + 1e-3 * np.arange(60)
    read[at] = wrong
    values = counts(1, n * len(read))
    rows = fifo(0, 5, read, values, 0.01, n)
    path = tmp_path / "f.ulg"
    topic = "sensor_accel_fifo.0"
    path.write_bytes(log({"sensor_accel_fifo": FIFO}, [topic], [r for _, r in rows]))
    monkeypatch.setattr(recordings.Recording.pieces, "__defaults__", (size,))
    assert main(["import", str(path), "-o", str(tmp_path / "no")]) == 2
    assert f"row {at * n + 1}" in capsys.readouterr().err
    assert main(["import", str(path), "-o", str(tmp_path / "s"), "--repair"]) == 0
    block = Session.open(tmp_path / "s").block
    mine = np.repeat(np.arange(len(read)) == at, n)
    np.testing.assert_allclose(block.acc, values[~mine] * float(np.float32(0.01)))
    assert block.t[-1] - block.t[0] < 0.07


@given(
    st.lists(
        st.tuples(st.integers(1, 32), st.floats(1e-4, 1e3)), min_size=1, max_size=30
    ),
    st.floats(1e-5, 1e-2),
    st.integers(1, 29),
)
def test_times_of_a_fifo_go_forward_however_it_is_read(
    readings: list[tuple[int, float]], period: float, cut: int
) -> None:
    number = np.array([n for n, _ in readings])
    read = 10 + np.cumsum([away for _, away in readings])
    # none is read before its samples can have been taken
    read = np.maximum.accumulate(read) + period * np.cumsum(number)
    periods = np.full(len(read), period)
    whole = FifoTimes().times(read, number, periods)
    assert len(whole) == number.sum()
    np.testing.assert_allclose(whole[np.cumsum(number) - 1], read, rtol=1e-12)
    assert (np.diff(whole) > 0).all()
    parts = FifoTimes()
    some = [slice(0, cut), slice(cut, None)]
    again = [parts.times(read[s], number[s], periods[s]) for s in some if len(read[s])]
    np.testing.assert_array_equal(np.concatenate(again), whole)


def test_integrals_are_read_where_there_is_nothing_else(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    f, w = rng.normal(0, 5, (50, 3)), rng.normal(0, 0.1, (50, 3))
    rows = []
    for i in range(50):
        stamp, acc_us, gyr_us = 1_000_000 + 5000 * i, 5000, 4000
        body = struct.pack("<HQQII", 0, stamp + 9, stamp, 77, 78)
        body += struct.pack("<3f", *(w[i] * 1e-6 * gyr_us))
        body += struct.pack("<3f", *(f[i] * 1e-6 * acc_us))
        rows.append(body + struct.pack("<IIB", gyr_us, acc_us if i else 0, 0))
    content = log({"vehicle_imu": INTEGRALS}, ["vehicle_imu.0"], rows)
    out = import_log(tmp_path / "v.ulg", content, tmp_path)
    block = Session.open(out).block
    assert np.isnan(block.acc[0]).all()
    np.testing.assert_allclose(block.acc[1:], f[1:], rtol=1e-6)
    np.testing.assert_allclose(block.gyr, w, rtol=1e-6)
    np.testing.assert_allclose(block.t[1:], 0.9975 + 0.005 * np.arange(1, 50))
    device = mark(out, "device")
    assert device["device_id"] == 77 and not device["installed"]["taken_out"]


FORMS = (
    (128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"),
    (131, 35, "PARM", "QNff", "TimeUS,Name,Value,Default"),
    (140, 31, "ISBH", "QHBBHHQf",
     "TimeUS,N,type,instance,mul,smp_cnt,SampleUS,smp_rate"),
    (141, 207, "ISBD", "QHHaaa", "TimeUS,N,seqno,x,y,z"),
)  # fmt: skip


def dataflash(rows: list[tuple[int, bytes]], option: float | None = 1.0) -> bytes:
    out = b""
    for kind, size, *texts in FORMS:
        fields = (text.encode() for text in texts)
        out += b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, size, *fields)
    if option is not None:
        rows = [
            (131, struct.pack("<Q16sff", 1, b"INS_LOG_BAT_OPT", option, 0)), *rows
        ]  # fmt: skip
    for kind, body in rows:
        size = next(form[1] for form in FORMS if form[0] == kind)
        assert len(body) == size - 3
        out += b"\xa3\x95" + bytes([kind]) + body
    return out


def batch(
    number: int, gyro: bool, start: float, values: Array, mul: int, rate: float
) -> list[tuple[int, bytes]]:
    """One batch of one sensor of device 1, cut toward zero as C does."""
    us = round(start * 1e6)
    head = struct.pack(
        "<QHBBHHQf", us, number, gyro, 1, mul, len(values), us, np.float32(rate)
    )
    rows = [(140, head)]
    for i in range(0, len(values), 32):
        part = np.trunc(values[i : i + 32] * mul).astype("<i2")
        body = struct.pack("<QHH", us, number, i // 32) + part.T.tobytes()
        rows.append((141, body))
    return rows


def true(seed: int, n: int, size: float) -> Array:
    return np.random.default_rng(seed).normal(0, size, (n, 3))


def test_batches_of_either_sensor_are_read_in_turn(tmp_path: Path) -> None:
    f, w = true(1, 1024, 9.0), true(2, 1024, 0.3)
    rows = []
    for k in range(20):
        part = slice(64 * (k // 2), 64 * (k // 2 + 1))
        values, mul = ((f, 200), (w, 4000))[k % 2]
        rows += batch(k, bool(k % 2), 3 + 0.2 * k, values[part], mul, 1000.0)
    content = dataflash(rows)
    out = import_log(tmp_path / "b.bin", content, tmp_path)
    block = Session.open(out).block
    acc = np.isfinite(block.acc[:, 0])
    assert (np.isfinite(block.gyr[:, 0]) == ~acc).all() and acc.sum() == 640
    # a number that was cut is put in the middle of what it may have been
    assert np.abs(block.acc[acc] - f[:640]).max() <= 1.0001 / 200
    assert abs((np.abs(block.acc[acc]) - np.abs(f[:640])).mean()) < 2e-4
    assert np.abs(block.gyr[~acc] - w[:640]).max() <= 1.0001 / 4000
    first = 3 + 0.4 * np.arange(10)[:, None] + 1e-3 * np.arange(64)
    np.testing.assert_allclose(block.t[acc], first.ravel(), atol=1e-6)
    device, grain = mark(out, "device"), mark(out, "grain")
    assert device["samples"] == "raw, sensor's frame"
    assert grain["cut"] and grain["acc"] == 1 / 200 and grain["gyr"] == 1 / 4000


def test_batches_taken_at_once_are_put_side_by_side(tmp_path: Path) -> None:
    f, w = true(1, 64, 9.0), true(2, 128, 0.3)
    rows = batch(0, False, 3.0, f, 200, 1000.0) + batch(1, True, 3.0, w, 4000, 2000.0)
    content = dataflash(rows, option=0.0)
    block: Block = Session.open(import_log(tmp_path / "b", content, tmp_path)).block
    both = np.isfinite(block.acc[:, 0])
    assert len(block) == 128 and both.sum() == 64
    np.testing.assert_allclose(block.acc[both], f, atol=1.0001 / 200)
    np.testing.assert_allclose(block.gyr, w, atol=1.0001 / 4000)
    np.testing.assert_allclose(block.t, 3 + 5e-4 * np.arange(128), atol=1e-6)


def test_a_batch_that_lacks_a_part_is_left_out_and_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    f = true(1, 128, 9.0)
    whole = batch(0, False, 3.0, f[:64], 200, 1000.0)
    broken = batch(1, False, 4.0, f[64:], 200, 1000.0)
    # a damaged head, of a batch of nothing, and a part that seems to be its own
    empty = batch(2, True, 5.0, f[:0], 200, 1000.0)
    alien = batch(2, True, 5.0, f[:32], 200, 1000.0)[1:]
    rows = [*empty, *alien, *whole, *empty, *alien, *broken[:2]]
    out = import_log(tmp_path / "b", dataflash(rows, option=None), tmp_path)
    assert len(Session.open(out).block) == 64
    assert "a batch of which a part is missing: left out" in capsys.readouterr().err
    assert main(["import", str(tmp_path / "b"), "--list"]) == 0
    assert "lacks INS_LOG_BAT_OPT" in capsys.readouterr().out
