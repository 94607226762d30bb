"""Other rates of the Earth from rows that are linearised, against fits of them."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from observed import observe, outputs

from fieldcal.core.positions import Position
from fieldcal.core.samples import Array
from fieldcal.solve.estimation import ParameterEstimate
from fieldcal.solve.options import SolveOptions
from fieldcal.solve.other_earth_rates import OtherEarthRates
from fieldcal.solve.session_fit import SessionFit

EARTH, LATITUDE = 7.292115e-5, 0.8
PLACES = [Position.deg(a, b) for a, b in product((-50, 0, 50), (-40, 0, 40))]


def assert_same(found: ParameterEstimate, expected: ParameterEstimate) -> None:
    assert found.names == expected.names
    off = (found.values - expected.values) / expected.sigma
    np.testing.assert_allclose(off, 0.0, atol=1e-3)  # a fit ends within that
    np.testing.assert_allclose(found.sigma, expected.sigma, rtol=1e-3)


def rates(noise: float) -> Array:
    """Gyroscopes that measure half of the Earth's rate about the vertical."""
    rng = np.random.default_rng(3)
    up = -outputs(PLACES)[:, :3] / 9.80665
    felt = -0.5 * EARTH * np.sin(LATITUDE) * up
    return np.asarray(felt + [1e-3, -2e-3, 5e-4] + rng.normal(0, noise, felt.shape))


@pytest.mark.parametrize("tilt", ["none", "base_tilt"])
def test_they_are_those_of_fits_to_the_same_rows(tilt: str) -> None:
    noise = 2e-5
    seen = observe(PLACES, outputs(PLACES), gyr=rates(noise), sigma_gyr=noise,
                   latitude=LATITUDE)  # fmt: skip
    options = SolveOptions(tilt=tilt)  # type: ignore[arg-type]
    stated, another, none = (
        SessionFit(seen, options, "joint", None, earth) for earth in (True, True, False)
    )
    level = another.earth_sigma[0]
    another.earth_sigma = (level, EARTH, level)
    estimates = [one.best_fit()[0] for one in (stated, another, none)]
    found = OtherEarthRates.of(estimates[0], stated.nominal, stated.base_rate)
    for one, expected in zip(
        (found.stated, found.another, found.none), estimates, strict=True
    ):
        assert_same(one, expected)
        ahead = one.score - found.stated.score
        assert ahead == pytest.approx(expected.score - estimates[0].score, abs=1e-4)
    values = [one.values for one in estimates]
    sigma = estimates[0].sigma
    assert np.abs((values[1] - values[0]) / sigma).max() > 0.1
    assert np.abs((values[2] - values[0]) / sigma).max() > 0.1
