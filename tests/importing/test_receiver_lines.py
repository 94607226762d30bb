"""Logs of a receiver that passes on what its IMU counts."""

from __future__ import annotations

import doctest
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laid_about import turned

from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.importing.text import receiver_lines
from fieldcal.importing.text.receiver_lines import ReceiverLines
from fieldcal.session.folder import Session

RATE = 50.0
ACC, GYR = 2.0**-15, 1e-6
"""Velocity, m/s, and angle, rad, of a count."""

POSITION = "%BESTPOSA,2209,491612.250;SOL_COMPUTED,SINGLE,51.1*00000000"


def crc(text: str) -> int:
    """CRC-32 as its manual has it: bit by bit, from 0."""
    value = 0
    for byte in text.encode():
        value ^= byte
        for _ in range(8):
            value = (value >> 1) ^ (0xEDB88320 if value & 1 else 0)
    return value


def message(name: str, t: float, a: Array, w: Array) -> str:
    """What the receiver sends of a row, m/s^2 and rad/s."""
    v, phi = np.round(a / RATE / ACC).astype(int), np.round(w / RATE / GYR).astype(int)
    counts = f"{v[2]},{-v[1]},{v[0]},{phi[2]},{-phi[1]},{phi[0]}"
    head = f"2209,{491612 + t:.3f}" if "S" in name else f"COM1,0,59.5,FINE,2209,{t:.3f}"
    more = "04,41," if "X" in name else ""
    text = f"{name},{head};{more}2209,{491612 + t:.6f},ea5afe00,{counts}"
    return f"{'%' if 'S' in name else '#'}{text}*{crc(text):08x}"


@pytest.mark.parametrize(
    "name",
    [
        "RAWIMUA",
        "RAWIMUSXA",
        pytest.param("RAWIMUSA", marks=pytest.mark.thorough),
        pytest.param("RAWIMUXA", marks=pytest.mark.thorough),
    ],
)
def test_each_message_becomes_a_row_between_others(tmp_path: Path, name: str) -> None:
    rows = turned(4, RATE, hold=4.0)
    lines = [message(name, r[0], r[1:4], r[4:]) for r in rows]
    lines[5:5] = [POSITION]
    path, folder = tmp_path / "log.txt", tmp_path / "s"
    path.write_text("\n".join(lines))
    worth = ["--acc-unit", "m/s^2", "--acc-lsb", f"{1 / (RATE * ACC)}"]
    worth += ["--gyr-unit", "rad/s", "--gyr-lsb", f"{1 / (RATE * GYR)}"]
    assert main(["import", str(path), "-o", str(folder), *worth]) == 0
    block = Session.open(folder).block
    about = Session.open(folder).about
    scale = np.concatenate([about.nominal["acc_scale"], about.nominal["gyr_scale"]])
    np.testing.assert_allclose(block.t - block.t[0], rows[:, 0], atol=1e-6)
    rounded = 0.6 * RATE * np.repeat([ACC, GYR], 3)
    assert (np.abs(block.six / scale - rows[:, 1:]) < rounded).all()


def test_what_a_count_is_is_asked_with_what_gravity_shows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(4, RATE, hold=4.0)
    path = tmp_path / "log.txt"
    path.write_text("\n".join(message("RAWIMUSA", r[0], r[1:4], r[4:]) for r in rows))
    assert main(["import", str(path), "-o", str(tmp_path / "s")]) == 2
    said = capsys.readouterr().err
    found = float(said.split("--acc-lsb ")[1].split()[0])
    assert found == pytest.approx(9.80665 / RATE / ACC, rel=0.05)


def test_a_line_that_fails_its_check_is_no_row_and_not_lost(tmp_path: Path) -> None:
    rows = turned(4, RATE, hold=4.0)
    lines = [message("RAWIMUSA", r[0], r[1:4], r[4:]) for r in rows]
    lines[100] = lines[100].replace(",ea5afe00,", ",ea5afe00,1")
    path, folder = tmp_path / "log.txt", tmp_path / "s"
    path.write_text("\n".join(lines))
    worth = ["--acc-unit", "m/s^2", "--acc-lsb", "655.36", "--gyr-unit", "rad/s"]
    worth += ["--gyr-lsb", "20000", "-o", str(folder)]
    assert main(["import", str(path), *worth]) == 2
    assert main(["import", str(path), *worth, "--repair"]) == 0
    marks = (folder / "marks.jsonl").read_text().splitlines()
    assert json.loads(marks[0])["repairs"][0].startswith("record 101")


@given(st.text(), st.text(alphabet="%#RAWIMUSX,;*0123456789abcdef-.", max_size=80))
def test_any_line_is_read_or_left(line: str, near: str) -> None:
    assert ReceiverLines().reader()([f"x{line}", f"RAWIMU{near}"])[-1] is not None
    assert receiver_lines._row(near) is None


def test_examples() -> None:
    failed, tried = doctest.testmod(receiver_lines)
    assert tried and not failed


def test_what_a_receiver_corrected_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(4, RATE, hold=1.0)
    path = tmp_path / "log.asc"
    path.write_text("\n".join(message("CORRIMUDATASA", r[0], r[1:4], r[4:])
                              for r in rows))  # fmt: skip
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "CORRIMUDATASA hold is corrected" in said and "log RAWIMUSXA" in said
