"""The tilt that the accelerometers find, in the gyroscopes' reference as well."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from closed_circle import one_in
from observed import BIAS, GYR_BIAS, OMEGA, carried, observe, outputs

from fieldcal.core.positions import FIVE_POSITIONS, SIX_FACES, Position
from fieldcal.core.samples import Array
from fieldcal.solve import Observations, solve

LATITUDE = np.deg2rad(50)
EARTH = [0.0, -OMEGA * np.sin(LATITUDE), OMEGA * np.cos(LATITUDE)]
NINE = (
    *FIVE_POSITIONS,
    *(Position.deg(a, b) for a, b in [(-45, 5), (-22, -5), (0, 5), (30, -4)]),
)
TILTS = {"angle_offset": [0.8, -0.6], "base_tilt": [0.7, -0.9]}


def rates(places: Sequence[Position], tilt: str, degrees: Sequence[float]) -> Array:
    """The Earth's rate that the device feels, (n, 3) rad/s."""
    first, second = np.deg2rad(degrees)
    out = []
    for p in places:
        a, b = p.alpha or 0.0, p.beta or 0.0
        if tilt == "base_tilt":
            out.append(carried(a, b, carried(second, first, EARTH).tolist()))
        else:
            out.append(carried(a + first, b + second, EARTH))
    return np.array(out)


def navigation(
    rng: np.random.Generator,
    places: Sequence[Position],
    tilt: str,
) -> Observations:
    degrees = TILTS[tilt]
    if tilt == "base_tilt":
        acc = outputs(places, base_deg=degrees)
    else:
        acc = outputs(places, offset_deg=degrees)
    gyr = GYR_BIAS + rates(places, tilt, degrees)
    return observe(
        places,
        acc + 1e-4 * rng.standard_normal(acc.shape),
        gyr=gyr + 5e-8 * rng.standard_normal(gyr.shape),
        sigma=1e-4,
        sigma_gyr=5e-8,
        latitude=LATITUDE,
        grade="navigation",
    )


@pytest.mark.parametrize(
    ("places", "tilt"),
    one_in(4, [(places, tilt) for places in (FIVE_POSITIONS, NINE) for tilt in TILTS]),
)
@pytest.mark.parametrize(
    ("seed", "count"), [(4, 18), pytest.param(3, 40, marks=pytest.mark.thorough)]
)
def test_navigation_gyroscopes_on_a_tilted_base(
    places: Sequence[Position], tilt: str, seed: int, count: int
) -> None:
    rng = np.random.default_rng(seed)
    pulls, chi2 = [], []
    for _ in range(25 if len(places) > 5 else count):
        found = solve(navigation(rng, places, tilt), tilt=tilt)  # type: ignore[arg-type]
        bias, bias_sigma = found.vector("gyr_bias")
        scale, scale_sigma = found.vector("gyr_scale")
        pulls += [(bias - GYR_BIAS) / bias_sigma, (scale - 1) / scale_sigma]
        gyroscopes = found.info["gyroscopes"]
        chi2.append(gyroscopes["chi2"] / gyroscopes["dof"])
    flat = np.concatenate(pulls)
    # of instability it is only known that it is no larger than the noise
    assert 0.75 < np.std(flat) < 1.1
    assert abs(np.mean(flat)) < 0.25
    assert np.mean(chi2) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize(
    ("seed", "count"), [(10, 15), pytest.param(7, 60, marks=pytest.mark.thorough)]
)
def test_a_base_known_to_be_nearly_level_is_in_the_gyroscopes_uncertainty(
    seed: int, count: int
) -> None:
    rng = np.random.default_rng(seed)
    two = (Position.deg(0, 0), Position.deg(45, 5))
    pulls = []
    for _ in range(count):
        x, z = 0.2 * rng.standard_normal(2)
        gyr = GYR_BIAS + rates(two, "base_tilt", [x, z])
        gyr = gyr + 1e-8 * rng.standard_normal((2, 3))
        seen = observe(
            two, outputs(two, base_deg=(x, z)), gyr=gyr, sigma_gyr=1e-8,
            latitude=LATITUDE, grade="navigation",
        )  # fmt: skip
        found = solve(seen, level_sigma_deg=0.2)
        bias, sigma = found.vector("gyr_bias")
        pulls.append((bias - GYR_BIAS)[[0, 2]] / sigma[[0, 2]])
    assert np.std(pulls) == pytest.approx(1, abs=0.2)


@pytest.mark.thorough
def test_joints_are_off_and_the_base_is_not_level_either() -> None:
    """Two faces with the axis of the joints level would know a bias to their noise."""
    rng = np.random.default_rng(8)
    pulls: dict[float, list[Array]] = {0.0: [], 0.05: []}
    for _ in range(25):
        offset, base = (rng.normal(0, s, 2).tolist() for s in (0.5, 0.05))
        acc = outputs(SIX_FACES, offset_deg=offset, base_deg=base)
        seen = observe(SIX_FACES, acc + 1e-3 * rng.standard_normal(acc.shape))
        for beside, found in pulls.items():
            one = solve(seen, beside_tilt_sigma_deg=beside)
            value, sigma = one.vector("acc_bias")
            found.append((value - BIAS) / sigma)
            assert one.info.get("beside_tilt_sigma_deg", 0.0) == beside
    rms = {beside: np.sqrt(np.mean(np.square(p))) for beside, p in pulls.items()}
    assert rms[0.0] > 1.4
    assert 0.7 < rms[0.05] < 1.3


def test_a_kind_of_tilt_that_is_asked_for_is_the_only_one() -> None:
    seen = observe(SIX_FACES, outputs(SIX_FACES, offset_deg=(0.3, -0.2)))
    alone = solve(seen, tilt="angle_offset")
    asked = solve(seen, tilt="angle_offset", beside_tilt_sigma_deg=0.05)
    np.testing.assert_array_equal(asked.covariance, alone.covariance)
    assert "beside_tilt_sigma_deg" not in asked.info
