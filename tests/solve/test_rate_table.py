"""A rate table on the turning Earth, by rotations of another library."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from session_folders import NINE, places, recorded, write_session

from fieldcal.calibration import Calibration
from fieldcal.core.errors import NotObservable
from fieldcal.core.samples import Block
from fieldcal.diagnosis import diagnose
from fieldcal.evaluation.observations import observe
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.vocabulary import parse
from fieldcal.solve import solve

Array = NDArray[np.float64]

LATITUDE_DEG, OMEGA, G = 50.45, 7.292115e-5, 9.81
WINDOW_S, GAP_S, RATE_HZ = 40.0, 10.0, 50.0
RATES = [
    *([v, 0, 0] for v in (-30.0, 20.0, 40.0)),
    *([0, v, 0] for v in (-25.0, 15.0, 35.0)),
    *([0, 0, v] for v in (-30.0, 25.0, 45.0)),
    [20.0, -15.0, 0.0],
    [0.0, 20.0, 25.0],
]
"""Of the table, deg/s: two of three axes are level."""

BIAS = np.array([0.004, -0.007, 0.002])
MATRIX = np.array(
    [[1.004, 0.002, -0.001], [0.003, 0.997, 0.0015], [-0.002, 0.001, 1.0]]
)


def spun(
    noise: float,
    seed: int,
    turning: list[list[float]] = RATES,
    setting_deg: float = 0.0,
) -> tuple[Block, list[dict[str, Any]]]:
    """The samples, with the axis pointing where it did from any angle on.

    Both angles of each position are off by so much, one standard deviation.
    """
    rng = np.random.default_rng(seed)
    phi = np.deg2rad(LATITUDE_DEG)
    earth = OMEGA * np.array([0.0, -np.sin(phi), np.cos(phi)])
    times, outputs, positions = [], [], []
    for i, rate in enumerate(turning):
        start = 3.0 + i * (WINDOW_S + GAP_S)
        t = start + np.arange(0.0, WINDOW_S, 1 / RATE_HZ)
        w = np.deg2rad(rate)
        phase = rng.uniform(0, 2 * np.pi) / max(float(np.linalg.norm(w)), 1e-9)
        seen = Rotation.from_rotvec(-np.outer(t - start + phase, w))
        force, rates = seen.apply([0.0, -G, 0.0]), w + seen.apply(earth)
        if setting_deg:
            off = rng.normal(0.0, setting_deg, 2)
            tilted = Rotation.from_euler("zx", off, degrees=True)
            force, rates = tilted.apply(force), tilted.apply(rates)
        times.append(t)
        outputs.append(np.hstack([force, BIAS + rates @ MATRIX.T]))
        positions.append(
            {"alpha_deg": 0.0, "beta_deg": 0.0, "rate_deg_s": rate}
            | {"start_s": start, "end_s": start + WINDOW_S}
        )
    six = np.vstack(outputs)
    six += rng.standard_normal(six.shape) * np.repeat([0.005, noise], 3)
    return Block.of(np.concatenate(times), six[:, :3], six[:, 3:]), positions


def session(folder: Path, noise: float, seed: int, grade: str = "tactical") -> Session:
    block, positions = spun(noise, seed)
    nominal = {"gyr_bias": BIAS.tolist(), "gyr_scale": np.diag(MATRIX).tolist()}
    device = {"name": "on a table", "grade": grade}
    write_session(folder, block, positions, device=device, nominal=nominal)
    return Session.open(folder)


def pulls(found: Calibration) -> Array:
    """Of bias and every entry of the matrix, (12,)."""
    out = []
    for i in range(3):
        axis = "xyz"[i]
        out.append((found.value(f"gyr_bias.{axis}"), BIAS[i], f"gyr_bias.{axis}"))
        for j in range(3):
            name = f"gyro_cross_coupling.s{i + 1}{j + 1}"
            name = f"gyr_scale.{axis}" if i == j else name
            out.append((found.value(name), MATRIX[i, j], name))
    return np.array([(v - true) / found.uncertainty(n) for v, true, n in out])


def test_angles_that_are_a_little_off_let_some_of_the_rate_in_across(
    tmp_path: Path,
) -> None:
    """Of 45 deg/s a hundredth of a degree makes 1.4e-4 rad/s, the same in all of it."""
    every, chi2 = [], []
    for seed in range(4):
        block, positions = spun(2e-4, seed, RATES * 2, setting_deg=0.01)
        nominal = {"gyr_bias": BIAS.tolist(), "gyr_scale": np.diag(MATRIX).tolist()}
        folder = write_session(tmp_path / str(seed), block, positions, nominal=nominal)
        found = solve(observe(Session.open(folder))[0], angle_sigma_deg=0.01)
        agreed = found.info["gyroscopes"]
        chi2.append(agreed["chi2"] / agreed["dof"])
        every.append(pulls(found))
    assert 0.4 < np.mean(chi2) < 1.6
    assert np.abs(every).max() < 4 and 0.4 < np.mean(np.square(every)) < 1.6


@pytest.mark.parametrize(
    ("noise", "grade", "seeds"),
    [
        (2e-3, "tactical", 2),
        pytest.param(2e-3, "tactical", 5, marks=pytest.mark.thorough),
        pytest.param(1e-4, "tactical", 5, marks=pytest.mark.thorough),
        pytest.param(1e-5, "navigation", 5, marks=pytest.mark.thorough),
    ],
)
def test_axes_that_lie_level_count_and_the_earth_is_taken_out(
    noise: float, grade: str, seeds: int, tmp_path: Path
) -> None:
    found = []
    for seed in range(seeds):
        seen, said = observe(session(tmp_path / str(seed), noise, seed, grade))
        assert len(seen) == len(RATES) and not said
        found.append(solve(seen))
        assert found[-1].method == "least_squares"
    every = np.array([pulls(one) for one in found])
    # what is not known of the heading is the same in all: the bias is not off by it
    assert np.sqrt((every**2).mean()) < 1.2
    assert np.abs(every).max() < 4.5
    chi2 = sum(one.chi2 for one in found) / sum(one.dof for one in found)
    assert 0.5 < chi2 < 1.2


def test_a_ladder_and_a_table_in_one_session(tmp_path: Path) -> None:
    device = Profile(
        effects=(parse("earth_rate:"), parse("gyro_cross_coupling:s12=0.004"))
    )
    rates = [[v, 0, 0] for v in (30.0, -30.0)] + [[0, 0, v] for v in (30.0, -30.0)]
    positions = places([*NINE, *[(0.0, 0.0)] * len(rates)], 15.0)
    for place, rate in zip(positions[len(NINE) :], rates, strict=True):
        place["rate_deg_s"] = rate
    write_session(tmp_path, recorded(device, positions), positions)
    found = solve(observe(Session.open(tmp_path))[0])
    assert found.method == "joint" and found.good
    assert np.isfinite(found.covariance).all()
    for name, true in (("acc_scale.x", device.truth.acc_scale[0]),
                       ("gyr_bias.x", device.truth.gyr_bias[0]),
                       ("gyr_scale.x", device.truth.gyr_scale[0])):  # fmt: skip
        assert abs(found.value(name) - true) < 4 * found.uncertainty(name), name


def test_left_in_as_printed_the_earth_is_in_the_bias(tmp_path: Path) -> None:
    seen, _ = observe(session(tmp_path, 1e-4, 1))
    printed, found = solve(seen, as_printed=True), solve(seen)
    # y points down: the Earth turns the other way
    assert printed.value("gyr_bias.y") < BIAS[1] - 1e-5
    assert abs(found.value("gyr_bias.y") - BIAS[1]) < 5e-6


@pytest.mark.thorough
def test_windows_on_a_table_are_no_rests_between_turns(tmp_path: Path) -> None:
    opened = session(tmp_path, 1e-4, 1)
    still = usable_windows(opened)
    assert not still.at_rest(opened).position_numbers
    found = solve_session(opened, still)
    assert found.method == "least_squares" and "turns" not in found.info
    assert (np.abs(pulls(found)) < 4).all()
    with pytest.raises(NotObservable, match="no position was held at rest"):
        solve_session(opened, still, "yes")


@pytest.mark.parametrize(
    ("rates", "says"),
    [
        ([[0.0, 0.0, 0.0]] * len(RATES), "does not follow at all"),
        ((-np.array(RATES)).tolist(), "points the other way"),
    ],
)
def test_a_table_that_turned_otherwise_than_is_said_is_no_calibration(
    rates: list[list[float]], says: str, tmp_path: Path
) -> None:
    block, positions = spun(1e-4, 1, rates)
    said = [p | {"rate_deg_s": r} for p, r in zip(positions, RATES, strict=True)]
    write_session(tmp_path, block, said)
    found = solve(observe(Session.open(tmp_path))[0])
    assert not found.good
    assert sum(says in warning for warning in found.warnings) == 3


@pytest.mark.thorough
def test_what_goes_round_is_no_walk_of_the_gyroscopes(tmp_path: Path) -> None:
    opened = session(tmp_path, 1e-4, 2)
    said = diagnose(opened.block, opened.about)
    assert {e.id for e in said.effects} <= {"gyro_cross_coupling", "earth_rate"}
    (cross,) = [e for e in said.effects if e.id == "gyro_cross_coupling"]
    for name in ("s12", "s13", "s21", "s23", "s31", "s32"):
        i, j = int(name[1]) - 1, int(name[2]) - 1
        found = cross.parameters[name]
        assert isinstance(found.value, float) and found.sigma
        assert abs(found.value - MATRIX[i, j]) < 4 * found.sigma
    assert said.after.chi2_per_dof < 1.15
