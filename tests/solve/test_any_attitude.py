"""Positions in any attitude, with angles that are exact or measured, against truth."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from session_folders import SITE, write_session

from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.frames import angles_of_direction_cosines
from fieldcal.core.gravity import normal_gravity
from fieldcal.core.samples import Block
from fieldcal.session.attitude import parse_attitude
from fieldcal.solve import Observations, solve

G = 9.80665
BIAS, SCALE = np.array([0.1, -0.2, 0.05]), np.array([1.01, 0.99, 1.005])
GYRO = np.array([1e-3, -2e-3, 5e-4])
NOISE = np.repeat([2e-4, 2e-6], 3)
UPRIGHT = Rotation.from_rotvec([[np.pi / 2, 0, 0], [-np.pi / 2, 0, 0]])


def attitudes(seed: int, count: int = 12) -> Rotation:
    """All over, and two in which the first and the third turn are about one axis."""
    return Rotation.concatenate(
        [Rotation.random(count, rng=np.random.default_rng(seed)), UPRIGHT]
    )


def table_of(form: str, r: Rotation, error: float = 0.0) -> dict[str, Any]:
    """A [[position]] that says where a device was held."""
    out: dict[str, Any] = {}
    if form == "vector":
        out["rotation_vector_deg"] = np.rad2deg(r.as_rotvec()).tolist()
    elif form == "quaternion":
        x, y, z, w = r.as_quat().tolist()
        out["quaternion"] = [w, x, y, z]
    else:
        angles = np.rad2deg(angles_of_direction_cosines(r.as_matrix().T)).tolist()
        names = ("alpha_deg", "beta_deg", "gamma_deg")
        out |= dict(zip(names, angles, strict=True))
    return {**out, "attitude_sigma_deg": error} if error else out


def means(stood: Rotation, rng: np.random.Generator) -> np.ndarray:
    """What the device puts out in some attitudes, (n, 6); y of the base is down."""
    force = stood.inv().apply([0.0, -G, 0.0])
    six = np.hstack([BIAS + SCALE * force, np.tile(GYRO, (len(force), 1))])
    return six + rng.normal(0, NOISE, six.shape)


def solved(form: str, seed: int, error: float = 0.0) -> Calibration:
    rng, said = np.random.default_rng([seed, 7]), attitudes(seed)
    off = Rotation.from_rotvec(np.deg2rad(error) * rng.normal(size=(len(said), 3)))
    mean = means(off * said, rng)
    places = tuple(
        parse_attitude(i, table_of(form, r, error), "") for i, r in enumerate(said, 1)
    )
    covariance = np.tile(np.diag(NOISE**2), (len(places), 1, 1))
    return solve(Observations(places, mean, covariance, G), angle_sigma_deg=0.001)


def pulls(found: Calibration) -> list[float]:
    out: list[float] = []
    for group, truth in (("acc_bias", BIAS), ("acc_scale", SCALE), ("gyr_bias", GYRO)):
        value, sigma = found.vector(group)
        out += ((value - truth) / sigma).tolist()
    return out


def test_all_forms_of_an_attitude_are_the_same() -> None:
    found = [solved(form, 1) for form in ("angles", "vector", "quaternion")]
    for one in found[1:]:
        assert one.names == found[0].names
        np.testing.assert_allclose(one.values, found[0].values, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(one.covariance, found[0].covariance, atol=1e-14)


@pytest.mark.parametrize(
    ("error", "seeds"),
    [
        pytest.param(0.2, 4, marks=pytest.mark.thorough),
        (3.0, 2),
        pytest.param(3.0, 4, marks=pytest.mark.thorough),
    ],
)
def test_intervals_hold_however_well_attitudes_are_measured(
    error: float, seeds: int
) -> None:
    """At 3 degrees what is not linear in an attitude is 1 cm/s^2, 100 sigma."""
    every = [solved("quaternion", seed, error) for seed in range(seeds)]
    assert all(one.good for one in every)
    rms = float(np.sqrt(np.mean(np.square([pulls(one) for one in every]))))
    assert 0.5 < rms < 1.25


def test_attitudes_that_are_off_and_said_to_be_exact_are_not_believed() -> None:
    rng, said = np.random.default_rng(4), attitudes(4)
    off = Rotation.from_rotvec(np.deg2rad(0.5) * rng.normal(size=(len(said), 3)))
    mean = means(off * said, rng)
    places = tuple(
        parse_attitude(i, table_of("vector", r), "") for i, r in enumerate(said, 1)
    )
    covariance = np.tile(np.diag(NOISE**2), (len(places), 1, 1))
    found = solve(Observations(places, mean, covariance, G), angle_sigma_deg=0.001)
    assert not found.good


def test_example_1_of_the_earlier_paper() -> None:
    """Three equal angles from 0 by 10 degrees, 40 positions; biases a tenth of 2.5."""
    matrix = np.array([[1.0, 0.01, -0.01], [-0.01, 1.0, 0.01], [0.01, -0.01, 1.0]])
    angles = np.arange(0.0, 400.0, 10.0)
    names = ("alpha_deg", "beta_deg", "gamma_deg")
    tables = [dict.fromkeys(names, float(angle)) for angle in angles]
    places = tuple(parse_attitude(i, table, "") for i, table in enumerate(tables, 1))
    stood = Rotation.from_euler("ZXY", np.repeat(angles[:, None], 3, 1), degrees=True)
    force = stood.inv().apply([0.0, -G, 0.0])
    mean = np.hstack([0.25 + force @ matrix.T, np.zeros((40, 3))])
    covariance = np.tile(np.diag(np.repeat([1e-4, 1e-6], 3) ** 2), (40, 1, 1))
    seen = Observations(places, mean, covariance, G)
    found = solve(seen, cross=True, tilt="none", angle_sigma_deg=1e-4)
    np.testing.assert_allclose(found.vector("acc_bias")[0], 0.25, atol=1e-5)
    for i in range(3):
        for j in range(3):
            name = f"cross_coupling.k{i + 1}{j + 1}"
            value = found.value(f"acc_scale.{'xyz'[i]}" if i == j else name)
            assert value == pytest.approx(matrix[i, j], abs=1e-6)


def test_the_print_is_for_two_angles() -> None:
    place = parse_attitude(1, {"alpha_deg": 45, "beta_deg": 5, "gamma_deg": 20}, "")
    mean, cov = np.ones((2, 6)), np.tile(np.eye(6), (2, 1, 1))
    seen = Observations(
        (parse_attitude(2, {"alpha_deg": 0, "beta_deg": 0}, ""), place), mean, cov, G
    )
    with pytest.raises(InputError, match="two angles, and α = 45°, β = 5°, γ = 20°"):
        solve(seen, as_printed=True)


@pytest.mark.thorough
def test_a_recorded_session_goes_to_a_verdict(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Put there by an arm between recordings: nothing is known of the ways."""
    rng, said = np.random.default_rng(9), attitudes(9, 7)
    there = Rotation.from_rotvec(np.deg2rad(0.3) * rng.normal(size=(len(said), 3)))
    stood, local = there * said, normal_gravity(**SITE)
    tables, blocks = [], []
    for i, r in enumerate(said):
        start, n = 300.0 * i, 400
        force = stood[i].inv().apply([0.0, -local, 0.0])
        six = np.concatenate([BIAS + SCALE * force, GYRO])
        tables.append(
            {**table_of("quaternion", r, 0.3), "start_s": start, "end_s": start + 7.9}
        )
        t = start + np.arange(n) / 50.0
        noise = rng.normal(0, np.repeat([2e-3, 2e-5], 3), (n, 6))
        blocks.append((t, six + noise))
    t = np.concatenate([b[0] for b in blocks])
    values = np.concatenate([b[1] for b in blocks])
    block = Block.of(t, values[:, :3], values[:, 3:])
    write_session(tmp_path / "s", block, tables)
    assert main(["solve", str(tmp_path / "s"), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)["parameters"]
    for group, truth in (("acc_bias", BIAS), ("acc_scale", SCALE), ("gyr_bias", GYRO)):
        off = np.array(result[group]["value"]) - truth
        assert (np.abs(off) < 4 * np.array(result[group]["sigma"])).all()
    main(["diagnose", str(tmp_path / "s"), "--json"])
    verdict = json.loads(capsys.readouterr().out)
    named = {e["id"] for e in verdict["effects"]}
    assert not named - {"earth_rate"}
