"""What nobody said of a recording, in the uncertainties.

Scale factors are measured by gravity, which grows from the equator to the poles:

    k = U / g,   dk_i = -k_i dg / g   of all axes together                         (1)

Values on a grid of steps q that were cut toward zero, as a conversion to integers does,
are q / 2 too small in size. Of an axis that is held up and down that is a scale factor,
of one that is not it is a bias:

    db_i = q_i / 2,   dk_i = q_i / (2 g)                                           (2)

Where the step does not come from whoever knows how values are rounded, (2) is there
with some probability P, and P times its square is added to the variance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.gravity import gravity
from fieldcal.core.samples import Array, Grain
from fieldcal.physics.recording import lsb_of
from fieldcal.session.folder import Session

CUT = 0.3
"""Probability P that values of an unknown rounding were cut toward zero."""


def with_unsaid(found: Calibration, session: Session, grain: Grain) -> Calibration:
    """The calibration with (1) and (2) where they are not known.

    Parameters
    ----------
    found : calibration of the session
    session : the recording
    grain : what is known of its rounding

    """
    about, more = session.about, np.zeros_like(found.covariance)
    names = found.names
    scale = [(names.index(n), n) for n in _of("acc_scale", names)]
    rows = [row for row, _ in scale]
    if not about.gravity_said and rows:
        spread = (gravity(90.0) - gravity(0.0)) / np.sqrt(12.0)
        k = found.values[rows] * spread / about.gravity  # (1)
        more[np.ix_(rows, rows)] += np.outer(k, k)
    half = _half_steps(session, grain)
    for group, size in (("acc_bias", 1.0), ("acc_scale", 1 / about.gravity)):
        for name in _of(group, names):
            row, axis = names.index(name), "xyz".index(name[-1])
            more[row, row] += CUT * (half[axis] * size) ** 2  # (2)
    if not more.any():
        return found
    return replace(found, covariance=found.covariance + more)


def _of(group: str, names: tuple[str, ...]) -> list[str]:
    return [name for name in names if name.startswith(f"{group}.")]


def _half_steps(session: Session, grain: Grain) -> Array:
    """Half of the step that the values of each accelerometer show, (3,) m/s^2.

    0 where they show none, or somebody knows how they are rounded.
    """
    known = grain.step[:3] > 0
    steps = np.array([lsb_of(column) for column in session.block.acc.T])
    half: Array = np.where(known, 0.0, steps / 2)
    return half
