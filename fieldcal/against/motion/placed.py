"""Clocks and axes of a recording and its reference: where the two stand."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from fieldcal.against.joint import differs
from fieldcal.against.motion.fit import estimates
from fieldcal.against.motion.following import Following
from fieldcal.against.result import Aligned, Difference, RealAndSimulated
from fieldcal.core.samples import Array
from fieldcal.diagnosis.result import Quantity
from fieldcal.model import priors, thresholds
from fieldcal.model.evidence.gram import Eliminated

PPM = 1e6


def placed(found: Following, state: Eliminated) -> Aligned:
    """Where the two stand beside each other."""
    rows = found.rows
    _, covariance, _ = estimates(state, found.dictionary.clock + np.arange(2))
    delay, drift = np.sqrt(np.diag(covariance)).tolist()
    return Aligned(
        delay=Quantity(rows.alignment.delay, delay, "s"),
        drift=Quantity(PPM * rows.alignment.drift, PPM * drift, "ppm"),
        turn=_angles(*_turn(found, state)),
        at_s=rows.alignment.middle,
        compared_s=len(rows) * rows.step,
    )


def turned(found: Following, state: Eliminated) -> Iterator[Difference]:
    """Axes that are turned against the reference's."""
    angle, sigma = _turn(found, state)
    probability = differs(angle, np.diag(sigma**2), np.full(3, priors.AXES_TURNED))
    if probability >= thresholds.NAMED and (sigma < priors.AXES_TURNED).all():
        pairs = {
            axis: RealAndSimulated.of(q, None)
            for axis, q in _angles(angle, sigma).items()
        }
        yield Difference("misalignment", "left_out", probability, pairs)


def _turn(found: Following, state: Eliminated) -> tuple[Array, Array]:
    """The turn from the reference's axes to the device's, (3,) rad, and its sigmas."""
    rows, first = found.rows, found.dictionary.turn
    _, covariance, _ = estimates(state, first + np.arange(3))
    turn = Rotation.from_matrix(rows.alignment.rotation)
    return turn.as_rotvec(), np.sqrt(np.diag(covariance))


def _angles(angle: Array, sigma: Array) -> dict[str, Quantity]:
    degrees, unsure = np.rad2deg(angle).tolist(), np.rad2deg(sigma).tolist()
    return {
        axis: Quantity(v, s, "deg")
        for axis, v, s in zip("xyz", degrees, unsure, strict=True)
    }
