"""Columns of what a device feels, against whole small rotations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from small_sessions import LADDER, ladder, nominal

from fieldcal.core.frames import earth_rate_at_home
from fieldcal.model.causes.basis import RowView
from fieldcal.model.causes.columns import attitude
from fieldcal.physics.experience import Experience

SCALE = np.array([1.1, 0.9, 1.05, 1.02, 0.97, 1.01])
SMALL = 1e-5


@pytest.mark.parametrize("axis", range(3))
def test_an_attitude_that_was_measured_wrongly_turns_force_and_rate(axis: int) -> None:
    """About an axis of the base; in its own position, and not while it is turned."""
    base_rate = 1e3 * earth_rate_at_home(0.8)
    plain = ladder(2)
    x = Experience.at_rest(
        plain.alpha, plain.beta, 9.81, position=plain.position, base_rate=base_rate
    )
    x.position[1] = -1
    state = replace(nominal(), scale=SCALE)
    found = attitude(RowView.of(x, np.zeros((1, len(x))), state))
    assert found.shape == (len(x), 6, 3 * len(LADDER))
    # what is at rest in the base turns the other way in a device that is turned
    back = Rotation.from_rotvec(-SMALL * np.eye(3)[axis])
    turned = Experience.at_rest(
        plain.alpha, plain.beta, 9.81,
        base_force=back.apply(x.base_force), base_rate=back.apply(base_rate),
    )  # fmt: skip
    change = SCALE * np.hstack([turned.f - x.f, turned.w - x.w]) / SMALL
    for p in range(len(LADDER)):
        own = x.position == p
        column = found[:, :, 3 * p + axis]
        np.testing.assert_allclose(column[own], change[own], atol=2e-4)
        assert np.abs(column[own]).max() > 0.01 and not column[~own].any()
