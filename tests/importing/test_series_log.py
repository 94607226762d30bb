"""Texts with a line for each value, whose series stand one behind the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned

from fieldcal.core.errors import InputError
from fieldcal.importers.series_log import recognises
from fieldcal.importing.records.series_rows import (
    MOST,
    SeriesColumns,
    read_series,
)

ROWS = turned(47, 50.0, 2.0)
AXES = ("ax", "ay", "az", "gx", "gy", "gz")


def clock(t: float) -> str:
    return f"2026-03-14T10:{int(t // 60):02d}:{t % 60:09.6f}Z"


def values() -> Iterator[tuple[str, float, float]]:
    """Name, time and value, one series behind the other."""
    for name, column in zip(AXES, ROWS[:, 1:].T.tolist(), strict=True):
        for t, x in zip(ROWS[:, 0].tolist(), column, strict=True):
            yield name, t, x


def melted() -> str:
    lines = [f"{t:.3f},{name},{x:.9g}" for name, t, x in values()]
    return "\n".join(["time,variable,value", *lines]) + "\n"


def asked() -> str:
    """As a database of time series answers, with what it was asked in each line."""
    top = ["#group,false,false,true,true,false,false,true,true",
           "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,"
           "double,string,string", "#default,_result,,,,,,,",
           ",result,table,_start,_stop,_time,_value,_field,_measurement"]  # fmt: skip
    asks = "2026-03-14T00:00:00Z,2026-03-15T00:00:00Z"
    lines = [f",,{AXES.index(name)},{asks},{clock(t)},{x:.9g},{name},imu"
             for name, t, x in values()]  # fmt: skip
    return "\r\n".join([*top, *lines]) + "\r\n"


def shown() -> str:
    """With decimal commas, and a zone."""
    lines = [f'"imu.{name}";{clock(t)[:-1]}+01:00;"{x:.9g}"'.replace(".", ",", 3)
             .replace("imu,", "imu.") for name, t, x in values()]  # fmt: skip
    return "\n".join(['"Series";"Time";"Value"', *lines]) + "\n"


def apart() -> str:
    """With names of nodes, and the values of a time a little apart."""
    found = ["NodeId,SourceTimestamp,Value,Status"]
    for t, *row in ROWS.tolist():
        for i, (name, x) in enumerate(zip(AXES, row, strict=True)):
            sensor = "Acc" if name[0] == "a" else "Gyro"
            node = f"ns=2;s=IMU.{sensor}{name[1].upper()}"
            found.append(f"{node},{clock(t + i * 1e-4)},{x:.9g},Good")
    return "\n".join(found) + "\n"


@pytest.mark.parametrize("written", [melted, asked, shown, apart])
def test_series_are_read_side_by_side(
    written: Callable[[], str], tmp_path: Path
) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(written().encode())
    assert recognises(path.read_bytes()[:4096], path)
    block, _ = read_files([path])
    np.testing.assert_allclose(np.diff(block.t), 0.02, atol=2e-6)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-6)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-6)


def test_a_value_that_is_missing_costs_its_row_alone(tmp_path: Path) -> None:
    lines = [line for i, line in enumerate(melted().split("\n")) if i != 1500]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines))
    block, _ = read_files([path])
    lost = np.isnan(block.acc).any(axis=1)
    assert lost.sum() <= 1
    np.testing.assert_allclose(np.diff(block.t)[:100], 0.02, atol=2e-6)


def test_names_that_count_are_no_series(tmp_path: Path) -> None:
    lines = [f"{i / 100},ax{i},1.0" for i in range(2 * MOST)]
    path = tmp_path / "log.csv"
    path.write_text(
        "\n".join(["time,name,value", "0,ax,1", "0,ay,1", "0,az,1", *lines])
    )
    with pytest.raises(InputError, match="series|columns"):
        read_files([path])


@pytest.mark.parametrize(
    "text", ["t,ax,ay,az\n0,1,2,3\n0.1,1,2,3\n", "time,value\n0,1\n0.1,2\n", "a\nb\n"]
)
def test_other_tables_are_none(text: str) -> None:
    assert not recognises(text.encode(), Path("log.csv"))


@given(st.lists(st.tuples(st.sampled_from(AXES), st.floats(0, 1e6), st.floats(-9, 9))))
def test_each_value_is_in_its_series(rows: list[tuple[str, float, float]]) -> None:
    columns = SeriesColumns.of(melted().split("\n")[:60])
    assert columns is not None
    found, _ = read_series((f"{t!r},{name},{x!r}" for name, t, x in rows), columns)
    for name in {name for name, _, _ in rows}:
        own = [(t, x) for one, t, x in rows if one == name]
        assert [*zip(*found[name], strict=True)] == own
