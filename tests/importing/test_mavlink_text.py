"""MAVLink's messages of an IMU as others write them: text, columns and JSON, in mg."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import G, turned

from fieldcal.cli import main
from fieldcal.importing.text.mavlink_text import MavlinkText

ROWS = turned(8, 50.0, 2.0)
T, FORCE, RATE = ROWS[:, 0], ROWS[:, 1:4], ROWS[:, 4:]
CUT = np.trunc(np.hstack([FORCE / G * 1e3, RATE * 1e3])).astype(int)
AXES = ("xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro")
STAMP = "2024-05-03 10:11:12.00: "


def shown(message: str, time: str, values: object, more: str = "") -> str:
    pairs = zip(AXES, values, strict=True)  # type: ignore[call-overload]
    fields = ", ".join([time, *(f"{name} : {x}" for name, x in pairs)])
    return f"{message} {{{fields}, xmag : 1, ymag : -2, zmag : 3{more}}}"


def raw(more: str = ", id : 0, temperature : 2512", message: str = "RAW_IMU") -> str:
    return "\n".join(
        STAMP + shown(message, f"time_usec : {5e6 + t * 1e6:.0f}", row, more)
        for t, row in zip(T, CUT.tolist(), strict=True)
    )


def of_two() -> str:
    """A second IMU of another unit of time, and messages of other kinds between."""
    found = []
    for t, row in zip(T, CUT.tolist(), strict=True):
        found += [
            "ATTITUDE {time_boot_ms : 5000, roll : 0.1, pitch : 0.2, yaw : 0.3}",
            shown("SCALED_IMU2", f"time_boot_ms : {5e3 + t * 1e3:.0f}", row[::-1]),
            shown("RAW_IMU", f"time_usec : {5e6 + t * 1e6:.0f}", row),
        ]
    return "\n".join(found)


def scaled() -> str:
    return "\n".join(
        shown("SCALED_IMU2", f"time_boot_ms : {t * 1e3:.0f}", row, ", temperature : 0")
        for t, row in zip(T, CUT.tolist(), strict=True)
    )


def high_resolution() -> str:
    """With a few messages of whole numbers between."""
    found = []
    for i, (t, row) in enumerate(zip(T, ROWS[:, 1:].tolist(), strict=True)):
        time = f"time_usec : {t * 1e6:.0f}"
        found += [shown("RAW_IMU", time, CUT[i])] if i % 7 == 0 else []
        found.append(shown("HIGHRES_IMU", time, row, ", temperature : 33.5, id : 0"))
    return "\n".join(found)


def columns() -> str:
    head = ",".join(["timestamp", *(f"RAW_IMU.{a}" for a in ("time_usec", *AXES))])
    return "\n".join(
        [head, *(f"{1.7e9 + t},{t * 1e6:.0f}," + ",".join(map(str, row))
                 for t, row in zip(T, CUT.tolist(), strict=True))]
    )  # fmt: skip


def records() -> str:
    found = []
    for t, row in zip(T, CUT.tolist(), strict=True):
        data = {"time_usec": round(t * 1e6), **dict(zip(AXES, row, strict=True))}
        meta = {"type": "RAW_IMU", "timestamp": 1.7e9 + t + 0.004 * np.sin(t)}
        found.append(json.dumps({"meta": meta, "data": data}))
        other = {"meta": meta | {"type": "ATTITUDE"}, "data": {"roll": 0.1}}
        found.append(json.dumps(other))
    return "\n".join(found)


@pytest.mark.parametrize(
    ("text", "step"),
    [(raw, 1.0), (of_two, 1.0), (scaled, 1.0), (high_resolution, 0.0), (columns, 1.0),
     (records, 1.0)],
)  # fmt: skip
def test_messages_are_read_in_their_units(
    tmp_path: Path, text: Callable[[], str], step: float
) -> None:
    path = tmp_path / ("log.json" if text is records else "log.txt")
    path.write_text(text() + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(np.diff(block.t), 0.02, atol=2e-6)
    np.testing.assert_allclose(block.acc, FORCE, atol=step * 1e-3 * G + 1e-6)
    np.testing.assert_allclose(block.gyr, RATE, atol=step * 1e-3 + 1e-6)


def test_temperatures_are_hundredths_of_which_zero_is_none(tmp_path: Path) -> None:
    for text, warm in ((raw(), 25.12), (scaled(), np.nan), (high_resolution(), 33.5)):
        path = tmp_path / "log.txt"
        path.write_text(text + "\n")
        block, _ = read_files([path])
        np.testing.assert_allclose(block.temperature, warm)


def test_of_several_it_is_said_which_is_read(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text(of_two() + "\n")
    _, says = read_files([path])
    assert any("of RAW_IMU are taken, and those of SCALED_IMU2" in one for one in says)


@pytest.mark.parametrize("text", [raw, columns])
def test_whole_numbers_are_known_to_be_cut(
    tmp_path: Path, text: Callable[[], str]
) -> None:
    """Else half a mg would be missing of each output."""
    path = tmp_path / "log.txt"
    path.write_text(text() + "\n")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 0
    marks = (tmp_path / "out" / "marks.jsonl").read_text().splitlines()
    (grain,) = [m for m in map(json.loads, marks) if m["event"] == "grain"]
    assert grain["cut"]
    assert [grain["acc"], grain["gyr"]] == pytest.approx([1e-3 * G, 1e-3])


def test_a_device_at_rest_has_mrad_beside_mg(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    still = np.trunc(rng.normal([0, 0, 1000, 70, -40, 20], 3, (900, 6))).astype(int)
    path = tmp_path / "log.txt"
    lines = [
        shown("RAW_IMU", f"time_usec : {20000 * i}", row)
        for i, row in enumerate(still.tolist())
    ]
    path.write_text("\n".join(lines) + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.gyr, still[:, 3:] * 1e-3, atol=1e-9)


@given(st.lists(st.text(alphabet='RAW_IMUSCLED2{}: ,x"accgyro019-.<>', max_size=60)))
def test_no_text_breaks_the_reader(lines: list[str]) -> None:
    known = raw().split("\n")[:30]
    form = MavlinkText.of(known, None)
    assert form is not None
    assert len(form.reader()([*lines, *known])) >= len(known)
    found = MavlinkText.of([*lines, *lines], None)
    assert found is None or found.names
