"""Numbers that loggers write where there is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fieldcal.cli import main
from fieldcal.core.samples import CHANNELS
from fieldcal.importing.units.missing_numbers import MissingNumbers
from fieldcal.session.folder import Session

Columns = dict[str, "np.ndarray[tuple[int], np.dtype[np.float64]]"]


def columns(n: int = 200, sensors: int = 6) -> Columns:
    """A device that is turned all the time: m/s^2, rad/s, deg C."""
    rng = np.random.default_rng(5)
    up = rng.normal(size=(n, 3))
    up *= 9.81 / np.linalg.norm(up, axis=1)[:, None]
    values = np.hstack([up, rng.normal(0, 0.5, (n, 3))])[:, :sensors]
    found = dict(zip(CHANNELS, values.T, strict=False))
    return {**found, "temperature": np.full(n, 25.0)}


@pytest.mark.parametrize("number", [-999.0, 9999.0, 32768.0, -99.9])
@pytest.mark.parametrize("some", [CHANNELS, CHANNELS[:3], CHANNELS[3:]])
def test_a_number_far_beyond_all_others_in_all_axes_is_none(
    number: float, some: tuple[str, ...]
) -> None:
    given, missing = columns(), MissingNumbers()
    for name in some:
        given[name][[3, 70, 71]] = number
    found = missing.without(given)
    for name in CHANNELS:
        gone = np.zeros(200, bool)
        gone[[3, 70, 71]] = name in some
        np.testing.assert_array_equal(np.isnan(found[name]), gone)
        np.testing.assert_array_equal(found[name][~gone], given[name][~gone])
    assert missing.rows == {number: 3} and f"{number:g}" in missing.says[0]


def test_one_number_in_accelerometers_and_gyroscopes_alike_is_none() -> None:
    """Though forces are as large; in a later piece it is known already."""
    given, missing = columns(), MissingNumbers()
    for name in CHANNELS:
        given[name][9] = -1.0
    assert np.isnan(missing.without(given)["ay"][9])
    for name in CHANNELS[:3]:
        given[name][9] = 0.3
    found = missing.without(given)
    assert np.isnan(found["gz"][9]) and found["az"][9] == 0.3
    assert missing.rows == {-1.0: 2}


def test_what_a_sensor_may_give_stays() -> None:
    given, missing = columns(), MissingNumbers()
    for name in CHANNELS[:3]:
        given[name][5:9] = 9.81 / np.sqrt(3)  # an edge of a cube upwards
        given[name][20] = 0.0
    given["gx"][30] = -999.0  # one axis alone is no row without a value
    for name in CHANNELS[3:]:
        given[name][40:150] = 4.0  # most rows are no exception
    found = missing.without(given)
    for name in CHANNELS:
        np.testing.assert_array_equal(found[name], given[name])
    assert missing.says == []
    alone = columns(sensors=3)
    assert missing.without(alone).keys() == alone.keys()


def test_such_rows_are_no_samples(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = np.column_stack([np.arange(2000) / 100, *columns(2000).values()])
    table[:, 1:4], table[:, 4:7] = [0.1, 0.2, 9.8], [0.01, -0.02, 0.03]
    table[:, 1:7] += np.random.default_rng(2).normal(0, 0.01, (2000, 6))
    lost = np.arange(50, 2000, 97)
    table[lost, 1:] = -999.0
    head = "time_s,ax_mps2,ay_mps2,az_mps2,gx_rads,gy_rads,gz_rads"
    file = tmp_path / "log.csv"
    np.savetxt(file, table[:, :7], delimiter=",", header=head, comments="")
    assert main(["import", str(file), "-o", str(tmp_path / "s")]) == 0
    assert "-999 stands for a missing value: 21 rows" in capsys.readouterr().err
    block = Session.open(tmp_path / "s").block
    assert len(block) == 2000 - len(lost)
    assert np.abs(block.acc).max() < 11
