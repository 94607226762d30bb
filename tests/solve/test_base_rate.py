"""What latitude and heading say of the Earth's rate."""

import numpy as np
import pytest

from fieldcal.solve.base_rate import known_earth_rate

OMEGA = 7.292115e-5


def test_the_earth_is_known_by_latitude_and_heading() -> None:
    phi = 0.7
    home = OMEGA * np.array([0, -np.sin(phi), np.cos(phi)])
    level = OMEGA * np.cos(phi)
    base, unsure = known_earth_rate(phi, True, None)
    np.testing.assert_allclose(base, home)
    assert unsure == (0.0, 0.0, 0.0)
    for navigation in (False, True):
        base, unsure = known_earth_rate(phi, navigation, 0.02)
        np.testing.assert_allclose(base, home)
        np.testing.assert_allclose(unsure, [0.02 * level, 0, 0])
    base, unsure = known_earth_rate(phi, False, None)
    np.testing.assert_allclose(base, [0, home[1], 0])
    np.testing.assert_allclose(unsure, [level / np.sqrt(2), 0, level / np.sqrt(2)])
    # as far as it may be in any direction: its mean square is that of the rate
    base, unsure = known_earth_rate(None, False, None)
    assert not base.any()
    assert np.sum(np.square(unsure)) == pytest.approx(OMEGA**2)
