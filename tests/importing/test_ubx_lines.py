"""Messages of a u-blox receiver as pyubx2 prints them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned

from fieldcal.importing.text.ubx_lines import UbxLines

ROWS = turned(45, 50.0, 2.0)
T, A, DEG = ROWS[:, 0], ROWS[:, 1:4], np.rad2deg(ROWS[:, 4:])
WARM = 24.0 + T / 20
REAL = ("<UBX(ESF-MEAS, timeTag=514162, timeMarkSent=0, timeMarkEdge=0,"
        " calibTtagValid=1, numMeas=3, id=0, dataField_01=16776523, dataType_01=16,"
        " dataField_02=576, dataType_02=17, dataField_03=10275, dataType_03=18,"
        " dataField_04=514162, dataType_04=0)>")  # fmt: skip


def unsigned(value: float, scale: float) -> int:
    return round(value / scale) & 0xFFFFFF


def fields(values: list[tuple[int, int]], tag: int | None = None) -> str:
    found = []
    for i, (kind, value) in enumerate(values, 1):
        found += [f"dataField_{i:02d}={value}", f"dataType_{i:02d}={kind}"]
        found += [] if tag is None else [f"sTtag_{i:02d}={tag}"]
    return ", ".join(found)


def of_row(i: int) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Values of the gyroscope, with the temperature, and of the accelerometer."""
    rates = [(14, DEG[i, 0]), (13, DEG[i, 1]), (5, DEG[i, 2])]
    forces = zip((16, 17, 18), A[i].tolist(), strict=True)
    warm = (12, unsigned(WARM[i], 0.01))
    return ([*((k, unsigned(x, 2.0**-12)) for k, x in rates), warm],
            [(k, unsigned(x, 2.0**-10)) for k, x in forces])  # fmt: skip


def measured() -> str:
    lines = []
    for i, t in enumerate(T.tolist()):
        for late, values in zip((0, 5), of_row(i), strict=True):
            lines += [f"<UBX(ESF-MEAS, timeTag={514157 + round(t * 1e3) + late},"
                      f" timeMarkSent=0, numMeas={len(values)}, id=0,"
                      f" {fields(values)})>"]  # fmt: skip
        if i % 10 == 0:
            lines.append("<NMEA(GNRMC, time=10:36:07, status=A, lat=53.45)>")
    return "\n".join(lines) + "\n"


def raw() -> str:
    """With a clock that begins again, and the other message between."""
    ticks = (np.round(T / 39.0625e-6).astype(int) + 2**24 - 200_000) % 2**24
    lines = []
    for i, tag in enumerate(ticks.tolist()):
        rates, forces = of_row(i)
        both = fields(rates + forces, tag)
        lines += [f"12:00:00 <UBX(ESF-RAW, reserved0=0, {both})>", REAL]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("text", [measured(), raw()])
def test_samples_are_read(text: str, tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text(text)
    block, _ = read_files([path])
    np.testing.assert_allclose(block.t, T, atol=4e-5)
    np.testing.assert_allclose(block.acc, A, atol=2.0**-11 + 1e-6)
    np.testing.assert_allclose(np.rad2deg(block.gyr), DEG, atol=2.0**-13 + 1e-6)
    np.testing.assert_allclose(block.temperature, WARM, atol=5.1e-3)


def test_a_message_of_the_library_is_as_it_says() -> None:
    form = UbxLines.of([REAL], None)
    assert form is not None
    read = form.reader()
    row = [*read([REAL]), *read([])][0].split(",")
    assert [float(x) for x in row[:4]] == [514.162, -693 / 1024, 0.5625, 10275 / 1024]


@given(st.lists(st.text(alphabet="<UBX(ESF-RAWMS, dataFieldTyp_012=6)>", max_size=80)))
def test_no_line_breaks_the_reader(lines: list[str]) -> None:
    form = UbxLines.of([REAL], None)
    assert form is not None
    read = form.reader()
    assert len([*read([*lines, REAL]), *read([])]) >= 1
