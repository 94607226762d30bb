"""Bias and scale factor of a recording in motion, against its reference.

Their prior sizes are wide, as in a calibration, so that the rows alone determine them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.against.calibrations import DETERMINED
from fieldcal.against.joint import probability_of_difference
from fieldcal.against.motion.explanation import MotionExplanation
from fieldcal.against.motion.fit import column_estimates
from fieldcal.against.result import Difference, RealAndSimulated
from fieldcal.core.samples import Array, Index
from fieldcal.diagnosis.findings.calibrated import GROUP_UNITS
from fieldcal.diagnosis.result import Quantity
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.eliminated import Eliminated


def free_calibration_sizes(found: MotionExplanation, sizes: Array) -> Array:
    """Prior sizes of all columns, with wide ones for bias and scale factor."""
    wide, first = sizes.copy(), 0
    for group in found.dictionary.always:
        some = slice(first, first := first + len(group.columns))
        if group.fixed_size is None:
            wide[some] = group.prior_sigma(priors.FREE_SIZE)
    return wide


def calibration_differences(
    found: MotionExplanation, state: Eliminated
) -> Iterator[Difference]:
    """Differences of bias and scale factor from the reference."""
    for name, group, known in _determined_groups(found, state):
        value, covariance, _ = column_estimates(state, group.columns)
        inner = np.ix_(known, known)
        probability = probability_of_difference(
            value[known], covariance[inner], group.typical[known]
        )
        if probability >= thresholds.NAMED:
            told = _values_by_axis(found, state, name, group, known)
            nominal = 1.0 if name.endswith("scale") else 0.0
            pairs = {
                axis: RealAndSimulated.of(q, Quantity(nominal, 0.0, q.unit))
                for axis, q in told.items()
            }
            yield Difference(name, "resized", probability, pairs)


def determined_calibration(
    found: MotionExplanation, state: Eliminated
) -> dict[str, dict[str, Quantity]]:
    """Determined values of the calibration, by group and axis."""
    return {
        name: _values_by_axis(found, state, name, group, known)
        for name, group, known in _determined_groups(found, state)
    }


def _determined_groups(
    found: MotionExplanation, state: Eliminated
) -> Iterator[tuple[str, Group, Index]]:
    """Groups of the calibration, each with the indices of its determined columns."""
    for name in GROUP_UNITS:
        part, _, cause = name.partition("_")
        always = found.dictionary.always
        group = next((g for g in always if g.cause == cause and g.part == part), None)
        if group is None:
            continue
        _, covariance, before = column_estimates(state, group.columns)
        sigma = np.sqrt(np.diag(covariance))
        free = (sigma < DETERMINED[name]) & (
            sigma**2 < thresholds.DETERMINED * before**2
        )
        if free.any():
            yield name, group, np.flatnonzero(free)


def _values_by_axis(
    found: MotionExplanation, state: Eliminated, name: str, group: Group, known: Index
) -> dict[str, Quantity]:
    """Values of a group of the calibration by axis."""
    d, nominal = found.dictionary, found.fit.nominal
    bias = group.cause == "bias"
    axes = group.columns - (d.bias if bias else d.scale)
    base = nominal.bias if bias else nominal.scale
    value, covariance, _ = column_estimates(state, group.columns)
    return {
        "xyz"[int(axes[i]) % 3]: Quantity(
            float(base[axes[i]] + value[i]),
            float(np.sqrt(covariance[i, i])),
            GROUP_UNITS[name],
        )
        for i in known
    }
