"""The paper's formulas as they stand in print, with its misprints, to compare.

Tactical gyroscopes: the mean output is the bias, (36). Navigation: bias and scale
factor from the Earth's rate, (42)-(48), with +sin phi in (39)-(41), -sin phi for cos
phi in the third line of (40), and sin alpha for cos alpha in the third line of (41). On
a rate table: least squares, (3.3), the Earth's rate left in. Nothing here is for use.
Source: Avrutov and Pozniak 2023; Avrutov, Sapegin, Stefanishin, Tsisarzh 2017.
"""

from __future__ import annotations

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.names import group_of
from fieldcal.core.errors import InputError, NotObservable
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.solve import least_squares
from fieldcal.solve.closed_form import ClosedFormEstimate, two_position
from fieldcal.solve.five_position import five_position
from fieldcal.solve.observations import Observations
from fieldcal.solve.options import SolveOptions
from fieldcal.solve.rank import determined_parameters
from fieldcal.solve.result import UNITS

METHODS = ("two_position", "five_position")

TWO_POSITION_MISPRINTS = (
    "as printed: the sign of (5) makes the scale factor of z negative"
)
FIVE_POSITION_MISPRINTS = "as printed: (23) is inverted, (22), (30), (34) lose the sign"
"""Warning about the misprints of each method."""


def solve(observations: Observations, options: SolveOptions) -> Calibration:
    """Calibration by the printed formulas.

    Raises
    ------
    InputError
        If no formula is printed for the method, or for one of the positions.

    """
    _check_supported(observations, options)
    parts, sentences, method = [], [], options.method
    still = np.flatnonzero(~observations.rotating)
    if len(still) and observations.has_acc:
        two = len(still) == 2 if method == "auto" else method == "two_position"
        method = "two_position" if two else "five_position"
        formulas, misprints = five_position, FIVE_POSITION_MISPRINTS
        if two:
            formulas, misprints = two_position, TWO_POSITION_MISPRINTS
        parts.append(formulas(observations[still], as_printed=True))
        sentences.append(misprints)
    if observations.has_gyr:
        parts.append(_gyroscopes(observations))
    if not parts:
        raise NotObservable("no sensor was measured; the print gives nothing")
    names = tuple(n for p in parts for n in p.names)
    covariance = np.zeros((len(names), len(names)))
    first = 0
    for part in parts:
        place = slice(first, first := first + len(part.names))
        covariance[place, place] = part.covariance
    return Calibration(
        method="least_squares" if method == "auto" else method, names=names,
        values=np.concatenate([p.values for p in parts]), covariance=covariance,
        units=tuple(UNITS[group_of(n)] for n in names), chi2=0.0, dof=0,
        rms=float("nan"), warnings=tuple(sentences),
    )  # fmt: skip


def _check_supported(observations: Observations, options: SolveOptions) -> None:
    """Refuse methods and positions for which no formula is printed."""
    if options.method not in ("auto", *METHODS):
        raise InputError(
            f"the paper prints no {options.method} method: as printed are two_position"
            " and five_position"
        )
    if third := [p.name for p in observations.positions if p.gamma]:
        raise InputError(
            f"the paper prints formulas for two angles, and {third[0]} has three: leave"
            " out --as-printed"
        )
    if spun := [p.name for p in observations.positions if p.speed]:
        raise InputError(
            f"the paper prints formulas for known rates, and {spun[0]} turns about an"
            " axis that nobody knows: leave out --as-printed"
        )
    felt = np.isfinite(observations.mean[:, ACC]).all(axis=1)
    nowhere = felt & ~observations.rotating & ~observations.oriented
    if nowhere.any():
        unknown = observations.positions[int(np.argmax(nowhere))].name
        raise InputError(
            f"the paper prints formulas for known angles, and those of {unknown} are"
            " not stated: leave out --as-printed"
        )


def _gyroscopes(observations: Observations) -> ClosedFormEstimate:
    """Bias of the gyroscopes, and what positions or rates determine besides."""
    n = len(observations)
    if observations.rotating.any():
        return least_squares.gyroscopes(observations)
    if (
        observations.grade == "navigation"
        and observations.latitude is not None
        and n > 1
    ):
        return _bias_and_scale_by_earth_rate(observations)
    gain = np.tile(np.eye(3)[:, None] / n, (1, n, 1))  # (36)
    return ClosedFormEstimate.of(
        [f"gyr_bias.{a}" for a in "xyz"], gain, observations, GYR
    )


def _bias_and_scale_by_earth_rate(observations: Observations) -> ClosedFormEstimate:
    """Bias and scale factor, (42)-(48), channel by channel."""
    w = printed_earth_rate(observations) @ observations.mounting
    gain = np.zeros((6, len(observations), 3))
    kept = np.ones(6, dtype=bool)
    for axis in range(3):
        design = np.column_stack([np.ones(len(observations)), w[:, axis]])  # (42)
        known, _ = determined_parameters(design)
        kept[[axis, 3 + axis]] = known
        gain[axis, :, axis], gain[3 + axis, :, axis] = np.linalg.pinv(design)
    names = [f"gyr_{kind}.{a}" for kind in ("bias", "scale") for a in "xyz"]
    return ClosedFormEstimate.of(names, gain, observations, GYR).subset(kept)


def printed_earth_rate(observations: Observations) -> Array:
    """Earth's rate by (40), (41) as printed, in procedure axes, (n, 3) rad/s."""
    a, b = observations.angles
    up, north = (EARTH_RATE * f(observations.known_latitude) for f in (np.sin, np.cos))
    third = -up * np.sin(a) * np.sin(b) + north * np.cos(b)  # (41), sin for cos alpha
    third = np.where((a == 0) & (b == 0), -up, third)  # (40)
    second = up * np.cos(a) * np.cos(b) + north * np.sin(b)
    return np.stack([up * np.sin(a), second, third], axis=1)
