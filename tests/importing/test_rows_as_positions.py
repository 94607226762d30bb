"""Rows of which each is a position: a few readings at each, or a slow tumble."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from laid_about import G, write

from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.diagnosis.fit import times_since_turn
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.importing.tables.means import (
    MOST_ROWS,
    row_scatter,
)
from fieldcal.session.folder import Session

BIAS, GAIN, NOISE = np.array([-0.23, 0.07, 0.01]), np.array([1.0, 1.003, 0.985]), 0.02


def outputs(up: Array, seed: int) -> Array:
    """Accelerometers (n, 3), m/s^2, of which directions (n, 3) are up."""
    noise = np.random.default_rng(seed).normal(0, NOISE, up.shape)
    out: Array = noise + G * up * GAIN + BIAS
    return out


def few_readings(seed: int, faces: int = 9, readings: int = 6) -> Array:
    """Lines that were copied from a monitor, a few of each of many faces."""
    up = np.random.default_rng(seed).normal(size=(faces, 3))
    up[:6] = np.vstack([np.eye(3), -np.eye(3)]) + 0.05 * up[:6]
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    return outputs(np.repeat(up, readings, axis=0), seed)


def slow_tumble(seed: int, rows: int = 240) -> Array:
    """A device that is turned once about two axes, at a few degrees a row."""
    angle = np.linspace(0, 2 * np.pi, rows // 2)
    zero, s, c = 0 * angle, np.sin(angle), np.cos(angle)
    lean = np.array([[1.0, 0.2, 0.1], [-0.2, 1.0, 0.1], [-0.1, -0.1, 1.0]])
    up = np.vstack([np.column_stack([zero, s, c]), np.column_stack([s, zero, c])])
    up = up @ np.linalg.qr(lean)[0].T
    return outputs(up, seed)


def test_a_few_readings_at_each_position_are_solved(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    acc = few_readings(1)
    path = write(tmp_path, np.round(acc * 8192 / G), heading="ax,ay,az")
    call = ["import", str(path), "--gravity", str(G)]
    assert main([*call, "--rate", "5", "-o", str(tmp_path / "samples")]) == 0
    said = capsys.readouterr().err
    assert "no still stretch" in said and "import it again with --sigma 0.0" in said
    out = str(tmp_path / "rows")
    assert main([*call, "--sigma", f"{NOISE}", "-o", out]) == 0
    assert "54 positions, means only" in capsys.readouterr().err
    assert main(["solve", out, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["parameters"]
    for name, truth in (("acc_bias", BIAS), ("acc_scale", GAIN)):
        off = np.abs(np.array(found[name]["value"]) - truth) / found[name]["sigma"]
        assert off.max() < 4 and max(found[name]["sigma"]) < 0.02


@pytest.mark.parametrize("seed", range(3))
def test_what_feels_gravity_alone_is_told_from_what_is_moved(seed: int) -> None:
    rows = slow_tumble(seed)
    for each in (rows, few_readings(seed)):
        assert row_scatter(each, G) == pytest.approx(NOISE, rel=0.25)
    # a hand adds forces of its own, which go on from row to row; and of few positions
    # M = 0 and |b| = g leave nothing of |M a - b| = g
    for each, size in ((rows, 0.03), (rows, 0.3), (few_readings(seed), 0.3)):
        swing = 1 + size * np.sin(np.arange(len(each)) / 5)[:, None]
        assert row_scatter(each * swing, G) is None
    # at rest in one position, |a| says nothing
    assert row_scatter(outputs(np.tile([0.0, 0.0, 1.0], (60, 1)), seed), G) is None
    assert row_scatter(np.tile(few_readings(seed), (40, 1)), G) is None


def test_how_well_rows_are_known_is_said_of_a_table_of_means_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    many = outputs(np.tile([0.0, 0.0, 1.0], (MOST_ROWS + 1, 1)), 1)
    path = write(tmp_path, many, heading="ax,ay,az")
    call = ["import", str(path), "-o", str(tmp_path / "s"), "--sigma", "0.02"]
    assert main(call) == 2
    assert f"no more than {MOST_ROWS} are taken" in capsys.readouterr().err
    assert main(["import", str(path), "--in-order", *call[2:]]) == 2
    said = capsys.readouterr().err
    assert "leave --sigma out" in said or "give the rate" in said


def test_of_means_nothing_settles(tmp_path: Path) -> None:
    path = write(tmp_path, few_readings(2), heading="ax,ay,az")
    out = tmp_path / "s"
    assert main(["import", str(path), "-o", str(out), "--sigma", "0.02"]) == 0
    session = Session.open(out)
    ready = prepare_recording(session.block, session.about)
    assert np.isinf(times_since_turn(ready.source, ready.rows)).all()
