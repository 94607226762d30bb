"""What is planned for a table of known speed is what an estimate from it states."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from session_folders import write_session

from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.core.errors import PlanError
from fieldcal.core.samples import Array, Block
from fieldcal.evaluation.observations import observe
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.planning.table_speed import NAMES, expected_by_speed, spin_axes
from fieldcal.session.folder import Session
from fieldcal.solve import solve

RATE_HZ, WINDOW_S, NOISE, RESTS = 50.0, 40.0, 2e-3, 2
SPEED, SPEED_SIGMA = np.deg2rad([20.0, 0.02])


def turned(folder: Path, axes: Array, seed: int) -> Session:
    """A device that a table turned about some axes of it."""
    rng = np.random.default_rng(seed)
    turns = [*(SPEED * axes), *np.zeros((RESTS, 3))]
    times, outputs, positions = [], [], []
    for i, rate in enumerate(turns):
        start = 3.0 + i * (WINDOW_S + 10.0)
        t = start + np.arange(0.0, WINDOW_S, 1 / RATE_HZ)
        around = Rotation.from_rotvec(-np.outer(t - start, rate))
        up = Rotation.random(random_state=rng).apply([0.0, -9.81, 0.0])
        times.append(t)
        outputs.append(np.hstack([around.apply(up), np.tile(rate, (len(t), 1))]))
        known = {"speed_deg_s": 20.0, "speed_sd_deg_s": 0.02} if rate.any() else {}
        positions.append({"start_s": start, "end_s": start + WINDOW_S, **known})
    six = np.vstack(outputs)
    six += rng.standard_normal(six.shape) * np.repeat([0.005, NOISE], 3)
    block = Block.of(np.concatenate(times), six[:, :3], six[:, 3:])
    return Session.open(write_session(folder, block, positions))


def by_means(session: Session) -> Calibration:
    return solve(observe(session)[0])


def by_rows(session: Session) -> Calibration:
    perfect = {"squareness": 0.0, "quadratic": 0.0, "g_sensitivity": 0.0}
    return solve_session(session, usable_windows(session), left=perfect)


@pytest.mark.parametrize(
    ("spins", "estimate", "most"),
    [
        (9, by_means, 1.25),
        pytest.param(6, by_rows, 1.6, marks=pytest.mark.thorough),
        pytest.param(6, by_means, 1.25, marks=pytest.mark.thorough),
        pytest.param(9, by_rows, 1.6, marks=pytest.mark.thorough),
    ],
)
def test_the_estimate_is_as_uncertain_as_planned(
    tmp_path: Path,
    spins: int,
    estimate: Callable[[Session], Calibration],
    most: float,
) -> None:
    axes = spin_axes(spins)
    found = estimate(turned(tmp_path, axes, spins))
    sigma = NOISE / np.sqrt(RATE_HZ * WINDOW_S)
    said = expected_by_speed(axes, SPEED, SPEED_SIGMA, sigma, RESTS)
    at = [found.names.index(name) for name in NAMES]
    stated = np.sqrt(np.diag(found.covariance))[at]
    # the estimate has scatter of the windows beside their noise, which few leave open
    wider = stated / np.array(list(said.values()))
    assert wider.min() > 0.95 and wider.max() < most


def test_what_the_speed_is_off_by_is_off_in_every_scale_factor() -> None:
    axes = spin_axes(6)
    exact, loose = (
        expected_by_speed(axes, SPEED, off, 1e-9) for off in (0.0, 0.01 * SPEED)
    )
    assert loose["gyr_scale.x"] == pytest.approx(0.01, rel=1e-3)
    assert loose["gyr_bias.x"] == pytest.approx(exact["gyr_bias.x"])
    # of the Earth's rate as much as lies along any axis
    assert exact["gyr_scale.x"] == pytest.approx(7.292e-5 / 3**0.5 / SPEED, rel=1e-3)


def test_six_axes_determine_all_and_fewer_do_not() -> None:
    determined = [
        set(expected_by_speed(spin_axes(n), SPEED, 0.0, 1e-5, RESTS)) for n in (3, 5, 6)
    ]
    assert determined[0] == {*NAMES} - {"gyr_scale.z"}
    assert determined[1] == determined[2] == {*NAMES}
    alone = expected_by_speed(spin_axes(5), SPEED, 0.0, 1e-5)
    assert set(NAMES) - set(alone) == {"gyr_bias.z", "gyr_scale.z"}


def test_no_random_axes_are_much_better() -> None:
    rng = np.random.default_rng(0)

    def cost(axes: Array) -> float:
        found = expected_by_speed(axes, 1.0, 0.0, 1.0)
        return sum(found.get(name, np.inf) ** 2 for name in NAMES)

    for n in (6, 8, 12):
        others = [Rotation.random(n, rng).apply([0.0, 0.0, 1.0]) for _ in range(200)]
        assert cost(spin_axes(n)) < 1.1 * min(cost(axes) for axes in others)


def test_the_command_says_how_to_set_the_device(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    words = ["plan", "--speed", "20", "--speed-sd", "0.02", "--minutes", "8"]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert "6 spins and 2 rests, 50 s each" in out and "6  -z" in out
    assert "gyr_scale.z" in out and "not determined" not in out
    assert main([*words, "--positions", "3", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["not_determined"] == ["gyr_scale.z"]
    assert found["sigma"]["gyr_scale.x"] > 0.001
    file = tmp_path / "session.toml"
    file.write_text("format = 1\n")
    for wrong in (
        ["-o", str(tmp_path / "plan.toml")], ["--set", "two"], ["--sways", "0.2"],
        ["--of", str(file)],
    ):  # fmt: skip
        assert main([*words, *wrong]) == 2
    assert "speed_deg_s" in capsys.readouterr().err


def test_a_table_that_does_not_turn_is_refused() -> None:
    with pytest.raises(PlanError, match="above 0"):
        expected_by_speed(spin_axes(6), 0.0, 0.0, 1e-5)
    with pytest.raises(PlanError, match="six or more"):
        spin_axes(0)
