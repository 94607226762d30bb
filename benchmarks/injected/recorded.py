"""Real recordings beside the project, as sessions: samples, and what is known of them.

Each has rests. Where nobody wrote down when, the importer finds them; where nobody
measured the angles, none are said. What each recording is and where it comes from
stands in the PROVENANCE.md beside it.
"""

from __future__ import annotations

import csv
import gzip
import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from fieldcal.core.frames import angles_of_force_direction
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array, Block
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.session.ingest import import_stream
from fieldcal.session import description_file
from fieldcal.session.description import Description
from fieldcal.session.folder import Session

REAL = Path(__file__).resolve().parents[3] / "shared" / "real"

SIX = ("ax", "ay", "az", "gx", "gy", "gz")
SITE = {"latitude_deg": 50.45, "height_m": 170.0}
FACES = {
    f"{axis}_{sense}": tuple(sign * (axis == a) for a in "xyz")
    for axis in "xyz"
    for sense, sign in (("p", 1.0), ("a", -1.0))
}
"""Direction of the specific force in six faces, by the names of the recordings."""

FERRARIS_HZ = 204.8
MPU6050 = {"acc_unit": "g", "acc_lsb": 16384.0, "gyr_unit": "deg/s", "gyr_lsb": 131.0}
LONG_GAP_S = 1.0
"""Time without a sample that parts two bursts."""

TEN_MINUTES = "set-2__unmoved-with-x-pointing-forward-10min"

MOVED_S = 9.0
"""Time for which the device of the PX4 log was still being moved about."""


class Real(NamedTuple):
    """A recording made into a session.

    Attributes
    ----------
    name : of the recording
    block : every sample, SI
    about : what is known of it, with the windows

    """

    name: str
    block: Block
    about: Description


Made = tuple[Block, Description]
Held = tuple[Block, list[dict[str, Any]]]
"""Samples, and the tables of the positions in which they were taken."""


def recordings() -> dict[str, Callable[[], Made]]:
    """What makes each session, by its name; empty where the recordings are absent."""
    out: dict[str, Callable[[], Made]] = {}
    if not REAL.is_dir():
        return out
    for i in range(5):
        path = REAL / "mikoff_mpu9150_x5" / f"imu{i}.log.gz"
        wanted = ReadOptions(SIX, 100.0)
        out[f"mikoff {i}"] = partial(_imported, path, wanted, 2.0)
    out["ferraris counts"] = lambda: _told(labelled_faces())
    out["ferraris"] = lambda: _told(faces_by_rows())
    for repeat in (2, 6):
        for unit in range(1, 9):
            path = REAL / "mpu9150_array" / f"exp{repeat}_imu{unit}.csv.gz"
            wanted = ReadOptions(("t", *SIX), acc_unit="g", gyr_unit="deg/s")
            out[f"array {repeat}.{unit}"] = partial(_imported, path, wanted, 5.0)
    out["pyulog"] = _autopilot_on_the_bench
    out["sunsided"] = lambda: _told(at_rest_for(TEN_MINUTES))
    for name, file in (("static", "tinit_calc"), ("positions", "calibration")):
        path = REAL / "tomisuarez_mpu6050" / f"example_data_{file}.csv.gz"
        counts = ReadOptions(SIX, 100.0, **MPU6050)  # type: ignore[arg-type]
        out[f"tomisuarez {name}"] = partial(_imported, path, counts, 1.0)
    for message in ("RAW_IMU", "HIGHRES_IMU"):
        path = REAL / "autopilot_streams" / "autopilot_12_positions.tlog.gz"
        stream = f"{message}.0"
        out[f"autopilot {message}"] = partial(
            _imported, path, ReadOptions(), 1.0, stream
        )
    out["psim"] = _bursts
    return out


def _imported(path: Path, wanted: ReadOptions, still: float, stream: str = "") -> Made:
    """Bring a file in as `fieldcal import` does; `still` is the shortest rest, s."""
    recording = open_recording(path, wanted)
    stream = stream or recording.streams()[0].name
    with TemporaryDirectory() as folder:
        there = Path(folder) / "session"
        import_stream(recording, stream, there, {"format": 1}, still)
        session = Session.open(there)
        return session.block, session.about


def _told(held: Held) -> Made:
    return held[0], _said(held[1])


def _said(positions: Sequence[Mapping[str, Any]]) -> Description:
    tables = [dict(p) for p in positions]
    return description_file.parse_description(
        {"format": 1, "site": SITE, "position": tables}
    )


def _face(name: str, start: float, end: float) -> dict[str, Any]:
    alpha, beta = np.rad2deg(angles_of_force_direction(FACES[name]))
    return {
        "name": name,
        "alpha_deg": float(alpha),
        "beta_deg": float(beta),
        "start_s": start,
        "end_s": end,
    }


def _rows(path: Path) -> list[list[str]]:
    with gzip.open(path, "rt") as file:
        return list(csv.reader(file))[1:]


def labelled_faces() -> Held:
    """Six faces in counts, labelled row by row; samples between them are left out."""
    rows = _rows(REAL / "imucal_ferraris" / "annotated_session.csv.gz")
    rows.sort(key=lambda row: float(row[1]))
    part = np.array([row[0] for row in rows])
    number = np.array([row[1:] for row in rows], dtype=float)
    t = number[:, 0] / FERRARIS_HZ
    places = []
    for name in dict.fromkeys(part.tolist()):
        if name in FACES:
            inside = t[part == name]
            places.append(_face(name, float(inside[0]), float(inside[-1]) + 0.002))
    acc, gyr = number[:, 1:4] / 2048 * G0, np.deg2rad(number[:, 4:] / 16.4)
    return Block.of(t, acc, gyr), places


def faces_by_rows() -> Held:
    """Six faces in m/s^2, with the rows of each in a file beside them."""
    folder = REAL / "imucal_ferraris"
    number = np.array(_rows(folder / "example_ferraris_session.csv.gz"), dtype=float)
    t = number[:, 0] / FERRARIS_HZ
    spans = json.loads((folder / "example_ferraris_session_list.json").read_text())
    places = [
        _face(name, float(t[s["start"]]), float(t[s["end"]]))
        for name, s in sorted(spans.items(), key=lambda item: int(item[1]["start"]))
        if name in FACES
    ]
    return Block.of(t, number[:, 4:], np.deg2rad(number[:, 1:4])), places


def _autopilot_on_the_bench() -> Made:
    """An autopilot that lies still after it has been moved about, one window."""
    path = REAL / "pyulog_samples" / "sample.ulg.gz"
    block, _ = _imported(path, ReadOptions(), 1.0, "sensor_combined.0")
    start = float(block.t[0]) + MOVED_S
    return block, _said([{"start_s": start, "end_s": float(block.t[-1])}])


def at_rest_for(name: str) -> Held:
    """Some time on a table with the temperature of the die, one window."""
    import h5py

    folder = REAL / "sunsided_mpu6050_temp"
    columns: list[Array] = []
    for part in ("accelerometer", "gyroscope", "temperature"):
        with h5py.File(folder / f"{name}__{part}.mat") as file:
            table = np.array(next(v for k, v in file.items() if k[0] != "#"))
        columns.append(table if table.shape[0] > table.shape[1] else table.T)
    acc, gyr, degrees = columns
    latest = np.maximum.accumulate(acc[:, 0])
    kept = np.concatenate([[True], np.diff(latest) > 0]) & (acc[:, 0] > 0)
    t, rate = acc[kept, 0], np.deg2rad(gyr[kept, 1:])
    block = Block.of(t, acc[kept, 1:] * G0, rate, degrees[kept, 1])
    return block, [{"start_s": float(t[0]), "end_s": float(t[-1])}]


def _bursts() -> Made:
    """A gyroscope that is heard in short bursts while it cools; a burst is a window."""
    path = REAL / "psim_cold" / "TVCtest3_7_20.csv.gz"
    table = np.array(_rows(path), dtype=float)
    t = table[:, 0] / 1e3
    warmth = 25 + table[:, 7].astype(np.uint16).astype(np.int16) / 256
    gaps = np.flatnonzero(np.diff(t) > LONG_GAP_S)
    first, last = [0, *(gaps + 1).tolist()], [*gaps.tolist(), len(t) - 1]
    places = [
        {"start_s": float(t[a]), "end_s": float(t[b]) + 0.002}
        for a, b in zip(first, last, strict=True)
    ]
    no_acc = np.full((len(t), 3), np.nan)
    return Block.of(t, no_acc, table[:, 4:7], warmth), _said(places)


def real(name: str, make: Callable[[], Made]) -> Real:
    """Make a session."""
    return Real(name, *make())
