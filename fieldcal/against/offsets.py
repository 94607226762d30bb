"""Differences of bias and scale factor, and of the Earth's rate.

Biases wander between sessions as much as within one, since flicker has the same power
in every octave. The covariance of a bias difference includes that scatter.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.against.causes import DecidedCauses, cause_quantities
from fieldcal.against.joint import probability_of_difference
from fieldcal.against.result import Difference, Direction, RealAndSimulated
from fieldcal.against.widened import WidenedSet
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.calibrated import GROUP_UNITS
from fieldcal.diagnosis.result import Mismatch, Quantity
from fieldcal.model import thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.posterior.mixture import covariance_of_means
from fieldcal.model.posterior.model_average import average_of_columns

DETERMINED = {"acc_bias": 1.0, "acc_scale": 0.1, "gyr_bias": 0.1, "gyr_scale": 0.1}
"""Sigma from which a difference counts as not determined, m/s^2, rad/s, 1."""


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


def shared_axes(one: WidenedSet, two: WidenedSet) -> Iterator[tuple[str, Index]]:
    """Groups of a calibration, with the channels that two sessions both have."""
    for name in GROUP_UNITS:
        groups = [_group(w, name) for w in (one, two)]
        axes = [
            _channels_of_group(w, g)
            for w, g in zip((one, two), groups, strict=True)
            if g
        ]
        if len(axes) == len(groups) and len(both := np.intersect1d(axes[0], axes[1])):
            yield name, both


def calibration_group(
    there: WidenedSet, name: str, axes: Index
) -> tuple[Array, Array, Array]:
    """A group of one session's calibration.

    Parameters
    ----------
    there : the session
    name : acc_bias, acc_scale, gyr_bias or gyr_scale
    axes : (k,) channels

    Returns
    -------
    values (k,) and covariance (k, k), m/s^2, rad/s or 1, and typical sizes (k,)

    """
    d, nominal = there.fit.dictionary, there.fit.nominal
    first, base = (
        (d.bias, nominal.bias) if name.endswith("bias") else (d.scale, nominal.scale)
    )
    group = _group(there, name)
    if group is None:
        raise KeyError(name)
    values, covariance = there.estimate(first + axes)
    typical = group.typical[np.isin(group.columns, first + axes)]
    if name.endswith("bias"):
        covariance = covariance + np.diag(bias_wander(there, axes) ** 2)
    return base[axes] + values, covariance, typical


def scatter_between_sets(explanation: Explanation, name: str, axes: Index) -> Array:
    """Covariance of a calibration's scatter over the probable sets, (k, k).

    A cause and its alias lead to different biases and scale factors.
    """
    d = explanation.dictionary
    columns = (d.bias if name.endswith("bias") else d.scale) + axes
    sets = explanation.model_average.sets
    weight = np.array([w for _, w in sets])
    weight /= weight.sum()
    means = np.array([average_of_columns([(s, 1.0)], columns)[0] for s, _ in sets])
    return covariance_of_means(means, weight)


def bias_wander(there: WidenedSet, axes: Index) -> Array:
    """Standard deviation of biases within a session, (k,) of some channels.

    It combines the instability from window to window and the rms q sqrt(T / 3) of the
    mean of a random walk.
    """
    tau = there.sets.instability_sigma(there.set.sizes.instability)
    square = tau[axes] ** 2
    length = float(np.ptp(there.fit.dictionary.x.t))
    for member in there.set.members:
        for name, q in cause_quantities(there, member).items():
            if member[0].kind == "random" and name in CHANNELS:
                square[axes == CHANNELS.index(name)] += float(q.value) ** 2 * length / 3
    out: Array = np.sqrt(square)
    return out


def _group(there: WidenedSet, name: str) -> Group | None:
    part, _, cause = name.partition("_")
    always = there.fit.dictionary.always
    return next((g for g in always if g.cause == cause and g.part == part), None)


def _channels_of_group(there: WidenedSet, group: Group) -> Index:
    d = there.fit.dictionary
    return group.columns - (d.bias if group.cause == "bias" else d.scale)


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
    yield Difference(name, "resized", probability, parameters, where=where)


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
