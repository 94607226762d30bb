"""Differences of bias and scale factor, and of the Earth's rate."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.against.calibrations import (
    DETERMINED,
    calibration_group,
    scatter_between_sets,
    shared_axes,
)
from fieldcal.against.causes import DecidedCauses, instead_of_calibration
from fieldcal.against.joint import probability_of_difference
from fieldcal.against.result import Difference, Direction, RealAndSimulated
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.diagnosis.findings.calibrated import GROUP_UNITS
from fieldcal.diagnosis.result import Mismatch, Quantity
from fieldcal.model import thresholds


def calibration_differences(found: DecidedCauses) -> Iterator[Difference]:
    """Differences of the groups of the calibration."""
    for name, axes in shared_axes(found.real, found.sim):
        yield from _difference(found, name, axes)


def earth_rate_difference(found: DecidedCauses) -> Iterator[Difference]:
    """Difference of the Earth's rate, where only one of the two shows it.

    In base axes: x East, y down, z north, if the fixture points north. If both show it
    with different headings, an effect of the catalogue covers that.
    """
    first = [w.fit.dictionary.earth for w in (found.real, found.sim)]
    if min(first) < 0:
        return
    (one, cov), (two, more) = (
        w.estimate(at + np.arange(3))
        for w, at in zip((found.real, found.sim), first, strict=True)
    )
    total, typical = cov + more, np.full(3, EARTH_RATE)
    probability = probability_of_difference(one - two, total, typical)
    felt = [_feels_rate(rate, its) for rate, its in ((one, cov), (two, more))]
    if probability < thresholds.NAMED or felt[0] == felt[1]:
        return
    direction: Direction = "left_out" if felt[0] else "added"
    parameters = _pairs(np.arange(3), (one, cov), (two, more), "rad/s")
    yield Difference("earth_rate", direction, probability, parameters)


def _pairs(
    axes: Index, real: tuple[Array, Array], sim: tuple[Array, Array], unit: str
) -> dict[str, RealAndSimulated]:
    """Values of both by axis, from values and covariance of some channels."""
    out: dict[str, RealAndSimulated] = {}
    for i, c in enumerate(axes.tolist()):
        one, two = (Quantity(float(value[i]), float(np.sqrt(cov[i, i])), unit)
                    for value, cov in (real, sim))  # fmt: skip
        out["xyz"[c % 3]] = RealAndSimulated.of(one, two)
    return out


def _feels_rate(rate: Array, covariance: Array) -> bool:
    """Whether a rate of the base is more likely than none."""
    return (
        probability_of_difference(rate, covariance, np.full(3, EARTH_RATE))
        > thresholds.NAMED
    )


def _difference(found: DecidedCauses, name: str, axes: Index) -> Iterator[Difference]:
    (one, cov, typical), (two, more, _) = (
        calibration_group(w, name, axes) for w in (found.real, found.sim)
    )
    for side in (found.pairing.real, found.pairing.sim):
        cov = cov + scatter_between_sets(side.explanation, name, axes)
    sigma = np.sqrt(np.diag(cov + more))
    known = np.flatnonzero(sigma < DETERMINED[name])
    if not len(known):
        return
    inner = np.ix_(known, known)
    probability = probability_of_difference(
        (one - two)[known], (cov + more)[inner], typical[known]
    )
    if probability < thresholds.NAMED:
        return
    parameters = _pairs(
        axes[known],
        (one[known], cov[inner]),
        (two[known], more[inner]),
        GROUP_UNITS[name],
    )
    where = tuple(
        _mismatch_everywhere(
            found,
            name.endswith("scale"),
            CHANNELS[axes[i]],
            float(one[i] - two[i]),
            float(sigma[i]),
        )
        for i in known
        if abs(one[i] - two[i]) > thresholds.STANDS_OUT * sigma[i]
    )
    instead = instead_of_calibration(found, name)
    yield Difference(name, "resized", probability, parameters, instead, where)


def _mismatch_everywhere(
    found: DecidedCauses, scale: bool, channel: str, off: float, sigma: float
) -> Mismatch:
    """The mismatch of a difference that applies to the whole recording."""
    explanation = found.pairing.real.explanation
    about, span = explanation.prepared.source.about, explanation.rows.span
    held = explanation.dictionary.window_positions.tolist()
    return Mismatch(
        channel=channel,
        kind="position",
        positions=tuple(sorted(about.indices_in_file(held))),
        from_s=float(span[0, 0]),
        to_s=float(span[-1, 1]),
        covariate="specific force" if scale else "",
        rms=abs(off),
        sigma=abs(off) / sigma,
    )
