"""What positions will read, against devices turned another way."""

from typing import Any

import numpy as np
import pytest
from observed import BIAS, COUPLING, SCALE, G, outputs

from fieldcal.core.frames import direction_cosines
from fieldcal.core.positions import Position
from fieldcal.core.samples import Array
from fieldcal.model.causes.planned import (
    ACC_CALIBRATION,
    design_matrix,
    parameters,
    predict_outputs,
    rows_at_session_end,
)
from fieldcal.physics.experience import Experience
from fieldcal.physics.joint_turns import JointTurns

PLACES = tuple(
    Position.deg(a, b) for a, b in [(-40, -30), (0, 0), (5, 0), (30, -20), (170, 35)]
)
MOUNTINGS = [
    np.eye(3),
    np.array([[0.0, 1, 0], [0, 0, -1], [-1, 0, 0]]),
    np.diag([-1.0, 1, -1]),
]
OFF = COUPLING[~np.eye(3, dtype=bool)]
TILTS = {"none": (), "angle_offset": (1.3, -0.7), "base_tilt": (-0.7, 1.3)}
KEYS = {"angle_offset": "offset_deg", "base_tilt": "base_deg"}
STEP = 1e-4


def shown(x: Array, tilt: str, cross: bool, mounting: Array) -> Array:
    """Outputs of a device with parameters in the order of `names_of`."""
    coupling = np.zeros((3, 3))
    if cross:
        coupling[~np.eye(3, dtype=bool)] = x[6:12]
    tilted: dict[str, Any] = {KEYS[tilt]: x[-2:]} if tilt != "none" else {}
    return outputs(
        PLACES, bias=x[:3], scale=x[3:6], coupling=coupling, mounting=mounting, **tilted
    )


def names_of(tilt: str, cross: bool) -> tuple[str, ...]:
    groups = ["cross_coupling"] * cross + [tilt] * (tilt != "none")
    return parameters(*groups)


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("cross", [False, True])
@pytest.mark.parametrize("mounting", MOUNTINGS)
def test_what_is_foretold_and_its_derivatives(
    tilt: str, cross: bool, mounting: Array
) -> None:
    truth = np.array([*BIAS, *SCALE, *(OFF if cross else ()), *TILTS[tilt]])
    u, slope = predict_outputs(names_of(tilt, cross), truth, PLACES, G, mounting)
    np.testing.assert_allclose(u, shown(truth, tilt, cross, mounting), atol=1e-9)
    for k, step in enumerate(STEP * np.eye(len(truth))):
        up, down = (shown(truth + s, tilt, cross, mounting) for s in (step, -step))
        apart = (up - down) / (2 * STEP)
        np.testing.assert_allclose(slope[..., k], apart, atol=2e-7)


@pytest.mark.parametrize("tilt", TILTS)
def test_a_design_is_about_a_perfect_device(tilt: str) -> None:
    names = names_of(tilt, True)
    perfect = np.zeros(len(names))
    perfect[3:6] = 1.0
    table = design_matrix(names, PLACES, G, MOUNTINGS[1])
    for k, step in enumerate(STEP * np.eye(len(names))):
        up, down = (shown(perfect + s, tilt, True, MOUNTINGS[1]) for s in (step, -step))
        np.testing.assert_allclose(table[..., k], (up - down) / (2 * STEP), atol=2e-7)


def test_what_is_not_named_is_perfect_and_the_order_is_as_asked() -> None:
    u, slope = predict_outputs(["acc_bias.z"], np.array([0.5]), PLACES, G)
    perfect = outputs(PLACES, bias=np.array([0, 0, 0.5]), scale=np.ones(3))
    np.testing.assert_allclose(u, perfect, atol=1e-12)
    assert slope.shape == (5, 3, 1)
    names = ("acc_scale.y", "base_tilt.about_z_deg", "acc_bias.x")
    whole = parameters("base_tilt")
    some = design_matrix(names, PLACES, G)
    rows = [whole.index(n) for n in names]
    np.testing.assert_array_equal(some, design_matrix(whole, PLACES, G)[..., rows])


def test_every_device_has_bias_and_scale_factor() -> None:
    assert parameters() == ACC_CALIBRATION and len(ACC_CALIBRATION) == 6
    assert parameters("angle_offset")[6:] == (
        "angle_offset.alpha0_deg", "angle_offset.beta0_deg",
    )  # fmt: skip


def test_further_positions_are_as_warm_and_as_late_as_the_session_ends() -> None:
    """Of all that rows have by themselves, the last; the site is the same."""
    rng = np.random.default_rng(4)
    per_row = {n: rng.uniform(1.0, 9.0, 4) for n in
               ("t", "since_start", "since_turn", "warming", "heating")}  # fmt: skip
    earth = np.array([0.0, 5e-5, 4e-5])
    force = np.array([0.3, -9.7, 0.2])
    joints = JointTurns.of(np.arange(4.0), rng.normal(size=(4, 3)))
    x = Experience.at_rest(
        rng.normal(size=4), rng.normal(size=4), G, variance=rng.uniform(size=(4, 3)),
        base_force=force, base_rate=earth, mounting=MOUNTINGS[1], latitude=0.7,
        gravity_sigma=3e-4, transport=np.array([1e-5, 2e-5, 3e-5]),
        joint_turns=joints, **per_row,
    )  # fmt: skip
    alpha, beta = np.array([0.4, -0.9, np.nan]), np.array([0.2, 0.7, 0.1])
    found = rows_at_session_end(x, alpha, beta)
    np.testing.assert_array_equal(found.alpha, alpha)
    np.testing.assert_array_equal(found.beta, beta)
    np.testing.assert_array_equal(found.position, [-1, -1, -1])
    for name, values in per_row.items():
        np.testing.assert_array_equal(getattr(found, name), values[[3, 3, 3]])
    np.testing.assert_array_equal(found.variance, x.variance[[3, 3, 3]])
    for k in range(2):
        held = direction_cosines(alpha[k : k + 1], beta[k : k + 1])[0]
        np.testing.assert_allclose(found.f[k], MOUNTINGS[1].T @ held @ force)
        np.testing.assert_allclose(found.w[k], MOUNTINGS[1].T @ held @ earth)
    assert found.latitude == 0.7 and found.gravity_sigma == 3e-4
    assert found.gravity == pytest.approx(np.linalg.norm(force))
    np.testing.assert_array_equal(found.transport, x.transport)
    assert found.joint_turns is joints
