"""The alignment of a recording with its reference, as a result: clocks and axes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from fieldcal.against.joint import probability_of_difference
from fieldcal.against.motion.explanation import MotionExplanation
from fieldcal.against.motion.fit import column_estimates
from fieldcal.against.result import Aligned, Difference, RealAndSimulated
from fieldcal.core.samples import Array
from fieldcal.diagnosis.result import Quantity
from fieldcal.model import priors, thresholds
from fieldcal.model.evidence.eliminated import Eliminated

PPM = 1e6


def alignment_result(found: MotionExplanation, state: Eliminated) -> Aligned:
    """Delay, drift and rotation with their uncertainty."""
    rows = found.rows
    _, covariance, _ = column_estimates(state, found.dictionary.clock + np.arange(2))
    delay, drift = np.sqrt(np.diag(covariance)).tolist()
    return Aligned(
        delay=Quantity(rows.alignment.delay, delay, "s"),
        drift=Quantity(PPM * rows.alignment.drift, PPM * drift, "ppm"),
        turn=_quantities_in_degrees(*_rotation_vector(found, state)),
        at_s=rows.alignment.middle,
        compared_s=len(rows) * rows.step,
    )


def axes_difference(
    found: MotionExplanation, state: Eliminated
) -> Iterator[Difference]:
    """The difference "misalignment", if the axes are rotated against the reference."""
    angle, sigma = _rotation_vector(found, state)
    probability = probability_of_difference(
        angle, np.diag(sigma**2), np.full(3, priors.AXES_TURNED)
    )
    if probability >= thresholds.NAMED and (sigma < priors.AXES_TURNED).all():
        pairs = {
            axis: RealAndSimulated.of(q, None)
            for axis, q in _quantities_in_degrees(angle, sigma).items()
        }
        yield Difference("misalignment", "left_out", probability, pairs)


def _rotation_vector(
    found: MotionExplanation, state: Eliminated
) -> tuple[Array, Array]:
    """Rotation from the reference's axes to the device's, (3,) rad, and its sigmas."""
    rows, first = found.rows, found.dictionary.turn
    _, covariance, _ = column_estimates(state, first + np.arange(3))
    turn = Rotation.from_matrix(rows.alignment.rotation)
    return turn.as_rotvec(), np.sqrt(np.diag(covariance))


def _quantities_in_degrees(angle: Array, sigma: Array) -> dict[str, Quantity]:
    degrees, unsure = np.rad2deg(angle).tolist(), np.rad2deg(sigma).tolist()
    return {
        axis: Quantity(v, s, "deg")
        for axis, v, s in zip("xyz", degrees, unsure, strict=True)
    }
