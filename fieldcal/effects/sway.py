"""The base rocks: a ship, a soft floor, a mast.

    f = A(alpha, beta) (f_base - d x f_base),    w = A(alpha, beta) dd/dt

with the small turn d(t) = amplitude cos(2 pi hz t + phi) about a horizontal axis, rad.
So the horizontal force and the rate about the axis are in quadrature, in the ratio g
to 2 pi hz. Source: kinematics of a small rotation.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 10.0)
>>> about_z = Sway().response(x, 1 / (2 * np.pi))[0, :, 1]
>>> np.round(about_z * 180 / np.pi, 6) + 0.0  # f_x = -10 d, w_z = i d
array([-10.+0.j,   0.+0.j,   0.+0.j,   0.+0.j,   0.+0.j,   0.+1.j])
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.physics.effect import Line, Param
from fieldcal.physics.experience import Experience
from fieldcal.physics.shape import Shape


class Sway(Line):
    """Rocking of the base about its horizontal axes."""

    kind = "motion"
    params = (Param("amplitude_deg", "deg", 0.2),)
    shapes = (Shape("hz", "Hz", 0.1, 2.0),)
    covariate = "line in horizontal force, rate in quadrature"
    decided_by = "the same window on firm ground"
    cure = (
        "Put the device on firm ground, or let each position last for many periods: "
        "what sways by more than 0.2 deg is taken out, and needed_s says how long."
    )
    source = "kinematics of a small rotation; 0.001 to 0.2 deg, 0.1 to 2 Hz"
    band = (0.08, 2.5)

    def response(self, x: Experience, hz: float) -> NDArray[np.complexfloating]:
        """Two causes: degrees about x, degrees about z of the base."""
        axes = np.eye(3)[:, [0, 2]]
        force = -np.cross(axes.T, x.base_force).T
        pattern = np.vstack([force.astype(complex), 2j * np.pi * hz * axes])
        six = [x.to_device @ pattern[:3], x.to_device @ pattern[3:]]
        out = np.concatenate(six, axis=1).astype(np.complex128)
        return out * (np.pi / 180)
