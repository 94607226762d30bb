"""Units of temperatures that nobody says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laid_about import COLUMNS, turned, write

from fieldcal.cli import main
from fieldcal.session.folder import Session


@pytest.mark.parametrize(
    ("reads", "celsius"),
    [((24.0, 30.0), None), ((-20.0, -5.0), None), ((2400, 3000), (24.0, 30.0)),
     ((63123, 65249), "asked"), ((296.0, 301.0), (22.85, 27.85)), ((180, 200), "asked"),
     ],
)  # fmt: skip
def test_temperatures(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    reads: tuple[float, float],
    celsius: object,
) -> None:
    rows = turned(5, 50.0)
    warm = np.linspace(*reads, len(rows))
    path, out = write(tmp_path, np.column_stack([rows, warm])), tmp_path / "out"
    call = ["import", str(path), "--columns", f"{COLUMNS},temperature", "-o", str(out)]
    if celsius == "asked":
        assert main(call) == 2
        said = capsys.readouterr().err
        assert "which is no deg C: add --temp-unit count" in said
        assert main([*call, "--temp-unit", "none"]) == 0
        assert np.isnan(Session.open(out).block.temperature).all()
        return
    assert main(call) == 0
    session = Session.open(out)
    expected = reads if celsius is None else celsius
    found = session.block.temperature[[0, -1]]
    np.testing.assert_allclose(found, np.array(expected), atol=1e-6)
    assert ("temperature" in session.about.raw.get("guessed", {})) == bool(celsius)


def test_counts_of_temperature_are_scaled_as_said(tmp_path: Path) -> None:
    rows = turned(6, 20.0)
    counts = np.linspace(0, 1024, len(rows))
    path, out = write(tmp_path, np.column_stack([rows, counts])), tmp_path / "out"
    call = ["import", str(path), "--columns", f"{COLUMNS},temperature", "-o", str(out)]
    call += ["--temp-unit", "count", "--temp-lsb", "256", "--temp-zero", "25"]
    assert main(call) == 0
    found = Session.open(out).block.temperature[[0, -1]]
    np.testing.assert_allclose(found, [25, 29])


@pytest.mark.parametrize(
    ("unit", "of_one"), [("milli deg", 1000), ("mdegC", 1000), ("c°C", 100)]
)
def test_parts_of_a_degree_are_what_a_heading_says(
    tmp_path: Path, unit: str, of_one: float
) -> None:
    table = turned(8, 50.0)
    warm = np.linspace(21.5, 26.5, len(table))
    rows = np.column_stack([table, np.round(warm * of_one)])
    path = write(tmp_path, rows, heading=f"{COLUMNS},Temperature [{unit}]")
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 0
    np.testing.assert_allclose(
        Session.open(tmp_path / "out").block.temperature, warm, atol=0.51 / of_one
    )
