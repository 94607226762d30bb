"""A log of a device at rest on a table that is knocked, from the file to the report."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session

RATE, KNOCKS, PER_KELVIN = 20.0, (70.0, 150.0, 260.0, 330.0), 4e-3


def course(t: Array) -> Array:
    """Temperature, deg C."""
    out: Array = 25 + 4 * np.sin(2 * np.pi * t / 500)
    return out


@pytest.fixture(scope="module")
def knocked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Seven minutes; the bias of ax follows the temperature."""
    rng = np.random.default_rng(4)
    t = np.arange(round(420 * RATE)) / RATE
    six = rng.normal(0, [0.004] * 3 + [3e-4] * 3, (len(t), 6))
    six += [0.3, -4.0, 8.95, 0.002, 0.001, -0.003]
    six[:, 0] += PER_KELVIN * (course(t) - 25)
    for at in KNOCKS:
        s = np.maximum(t - at, 0)
        ring = np.exp(-s / 0.3) * np.sin(2 * np.pi * 6 * s)
        six += ring[:, None] * rng.normal(0, [1.0] * 3 + [0.05] * 3)
    folder = tmp_path_factory.mktemp("knocked")
    table = np.column_stack([t, six, course(t)])
    heading = "t,ax,ay,az,gx,gy,gz,temperature"
    np.savetxt(folder / "log.csv", table, "%.7g", ",", header=heading, comments="")
    session = folder / "s"
    words = [str(folder / "log.csv"), "-o", str(session), "--gyr-unit", "rad/s"]
    assert main(["import", *words]) == 0
    return session


def test_it_is_one_position_without_the_knocks(knocked: Path) -> None:
    (place,) = tomllib.loads((knocked / "session.toml").read_text())["position"]
    assert len(place["without_s"]) == len(KNOCKS)
    for at, (start, end) in zip(KNOCKS, place["without_s"], strict=True):
        assert at - 1.5 < start <= at and at + 0.2 < end < at + 3
    lines = (knocked / "marks.jsonl").read_text().splitlines()
    (still,) = [m for m in map(json.loads, lines) if m["event"] == "still"]
    assert [len(still["without_s"]), len(still["bumped"])] == [len(KNOCKS)] * 2
    (imported,) = [m for m in map(json.loads, lines) if m["event"] == "imported"]
    assert any("4 bumps at 69" in said for said in imported["says"])


def test_its_mean_is_that_of_the_calm_parts(knocked: Path) -> None:
    session = Session.open(knocked)
    (window,) = usable_windows(session).averages
    calm = np.isfinite(session.block.acc).all(axis=1)
    assert 0.96 < calm.mean() < 0.995
    np.testing.assert_allclose(
        window.mean, session.block.six[calm].mean(axis=0), rtol=1e-3, atol=1e-5
    )


@pytest.mark.thorough
def test_the_temperature_is_named_across_the_knocks(knocked: Path) -> None:
    assert main(["solve", str(knocked)]) == 0
    assert main(["diagnose", str(knocked)]) == 1
    told = json.loads((knocked / "diagnosis.json").read_text())
    (effect,) = told["effects"]
    assert effect["id"] == "temperature_bias"
    seen = effect["parameters"]["ax"]
    assert seen["value"] == pytest.approx(PER_KELVIN, abs=4 * seen["sigma"])
    assert seen["sigma"] < PER_KELVIN / 5
    assert main(["report", str(knocked)]) == 0
    assert "bumps left out" in (knocked / "report.html").read_text()
