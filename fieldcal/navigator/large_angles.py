"""What errors of attitude beyond small ones do to a run at rest.

    C'(t) = exp(-W t) C exp((A^T W + e) t),    A = exp(phi_0) C                     (1)
    phi(t) = phi_0 - C e t - W x (phi_0 t - C e t^2 / 2)          to first order    (2)
    d(t) = C'(t) (A^T f + a) - f - (f x phi(t) + C a)                               (3)

C is the attitude that was entered, with which the navigator begins, and A the true one:
a drift goes where the entered one says, the Earth's rate is felt as the true one is. d
is what the computed force is off by beyond what `growth` has, integrated once for the
velocity and twice for the position: a gyroscope that drifts by 2e-4 rad/s leans by a
degree in two minutes, and the force by 1 mm/s^2 more than to first order. [v] stands
for v x in the exponents. SI units; W, phi, f in base axes, e, a in device axes. Source:
rotation kinematics.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.rotation import rotation_matrices
from fieldcal.core.samples import Array

STEPS_PER_SAMPLE = 5
"""Steps of the integration in one of the run."""


def beyond_first_order(
    step: float, count: int, c: Array, inputs: tuple[Array, Array], errors: Array
) -> Array:
    """Velocity and position, (m, 6), that `growth` has not.

    Parameters
    ----------
    step, count : s between instants, and how many there are
    c : (3, 3) from device to base axes, as entered
    inputs : Earth's rate and force in base axes, (3,) each
    errors : (9,) e, a and phi_0, device and base axes

    """
    (earth, force), (e, a, phi) = inputs, np.split(errors, 3)
    t = np.arange(count * STEPS_PER_SAMPLE + 1) * (step / STEPS_PER_SAMPLE)
    true = rotation_matrices(phi) @ c
    turned = rotation_matrices(-t[:, None] * earth) @ c
    computed = turned @ rotation_matrices(t[:, None] * (true.T @ earth + e))  # (1)
    drift = c @ e
    once, twice = t[:, None], t[:, None] ** 2 / 2
    angle = phi - drift * once - np.cross(earth, phi * once - drift * twice)  # (2)
    off = computed @ (true.T @ force + a) - force
    off -= np.cross(force, angle) + c @ a  # (3)
    velocity = _integral(off, step / STEPS_PER_SAMPLE)
    place = _integral(velocity, step / STEPS_PER_SAMPLE)
    return np.hstack([velocity, place])[STEPS_PER_SAMPLE::STEPS_PER_SAMPLE]


def _integral(values: Array, step: float) -> Array:
    """Cumulated trapezia, (n, 3)."""
    area = (values[1:] + values[:-1]) / 2 * step
    return np.vstack([np.zeros(3), np.cumsum(area, axis=0)])
