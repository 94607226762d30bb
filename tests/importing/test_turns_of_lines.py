"""Lines of two sensors without times, and values behind cells with their names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laid_about import G, turned

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block, concat
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.text.paired_cells import PairedCells
from fieldcal.importing.units.settled_units import settle_units

ROWS = turned(17, 50.0, 2.0)
T, A, W = ROWS[:, 0], ROWS[:, 1:4], ROWS[:, 4:]
DEG = np.rad2deg(W)


def read(folder: Path, text: str, rate: float | None = 50.0) -> tuple[Block, list[str]]:
    path = folder / "log.txt"
    path.write_text(text, encoding="utf-8")
    recording = open_recording(path, ReadOptions(rate_hz=rate))
    (stream,) = recording.streams()
    settle_units(recording, stream.name)
    one = recording.alone(stream.name)
    return concat(one.blocks(stream.name)), one.says


@pytest.mark.parametrize(
    ("acc", "gyr"),
    [
        ("{:8.5f}   {:8.5f}   {:8.5f}    G", "{:.4f}   {:.4f}   {:.4f}    o/s"),
        ("{:.5f}\t{:.5f}\t{:.5f}\tg", "{:.4f}\t{:.4f}\t{:.4f}\t°/s"),
        ("ACC,{:.5f},{:.5f},{:.5f}", "GYR,{:.4f},{:.4f},{:.4f}"),
        ("A {:.5f} {:.5f} {:.5f}", "G {:.4f} {:.4f} {:.4f}"),
    ],
)
@pytest.mark.parametrize("swapped", [False, True])
def test_lines_of_both_sensors_that_come_in_turn_are_rows(
    tmp_path: Path, acc: str, gyr: str, swapped: bool
) -> None:
    """As examples for boards print them: the unit tells whose they are, or a word."""
    lines = []
    for a, w in zip(A / G, DEG, strict=True):
        both = [acc.format(*a), gyr.format(*w)]
        lines += both[::-1] if swapped else both
    block, _ = read(tmp_path, "\n".join(lines) + "\n")
    np.testing.assert_allclose(block.acc, A, atol=1e-4)
    np.testing.assert_allclose(block.gyr, W, atol=2e-6)


def test_without_times_the_rate_is_asked_for(tmp_path: Path) -> None:
    lines = ("ACC,{},{},{}\nGYR,{},{},{}\n".format(*row[1:]) for row in ROWS)
    with pytest.raises(InputError, match="no column is t, the time: give the rate"):
        read(tmp_path, "".join(lines), None)


def test_a_value_stands_behind_the_cell_with_its_name(tmp_path: Path) -> None:
    names = ("AcX", "AcY", "AcZ", "GyX", "GyY", "GyZ")
    text = "".join(
        ",".join(f"{n},{x:.7f}" for n, x in zip(names, row[1:], strict=True)) + "\n"
        for row in ROWS
    )
    block, _ = read(tmp_path, text)
    np.testing.assert_allclose(block.six, ROWS[:, 1:], atol=1e-6)


@pytest.mark.parametrize("timed", [False, True])
def test_messages_of_other_kinds_stand_between(tmp_path: Path, timed: bool) -> None:
    """As a ground station writes what it heard: a time before each, or named."""
    lines = []
    for t, a, w in zip(T, np.round(A / G * 1000), W, strict=True):
        clock = f"2024-05-03T14:{20 + int(t // 60)}:{t % 60:06.3f},FE , 1C,D5, 1, 1"
        own = f"time_usec,{5e6 + 1e6 * t:.0f}," if timed else ""
        acc = ",".join(f"{x}acc,{v:.0f}" for x, v in zip("xyz", a, strict=True))
        gyr = ",".join(f"{x}gyro,{v:.8f}" for x, v in zip("xyz", w, strict=True))
        lines.append(f"{clock},1B,mavlink_raw_imu_t,{own}{acc},{gyr},,Len,34")
        lines.append(
            f"{clock},1E,mavlink_attitude_t,roll,0.1,pitch,0.2,yaw,0.3,,Len,36"
        )
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    recording = open_recording(path, ReadOptions(acc_unit="mg", gyr_unit="rad/s"))
    block = concat(recording.alone("0").blocks("0"))
    np.testing.assert_allclose(block.t - block.t[0], T, atol=6e-4)
    np.testing.assert_allclose(block.acc, np.round(A / G * 1000) * 1e-3 * G, atol=1e-6)
    np.testing.assert_allclose(block.gyr, W, atol=1e-6)
    assert any("those that name" in one for one in recording.says)


def test_a_lone_g_is_no_unit_without_one_of_rates(tmp_path: Path) -> None:
    """Lines of gyroscopes, of which none of accelerometers are told, are no forces."""
    lines = ["G,{},{},{},{}\nX,{},1,2,3\n".format(*[t, *w], t)
             for t, w in zip(T, W, strict=True)]  # fmt: skip
    with pytest.raises(InputError, match="say what its columns are"):
        read(tmp_path, "".join(lines), None)


def test_sentences_of_a_receiver_name_no_values() -> None:
    lines = ["$GPRMC,1235,A,4807.038,N,01131.000,E,022.4,084.4"] * 9
    assert PairedCells.of(lines, None) is None
