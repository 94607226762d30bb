"""Bias and scale factor of a recording in motion, against what its reference says.

Their sizes are those of what a calibration is to find, so that the rows alone say how
well each is known.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.against.joint import differs
from fieldcal.against.motion.fit import estimates
from fieldcal.against.motion.following import Following
from fieldcal.against.offsets import DETERMINED
from fieldcal.against.result import Difference, RealAndSimulated
from fieldcal.core.samples import Array, Index
from fieldcal.diagnosis.findings.calibrated import GROUP_UNITS
from fieldcal.diagnosis.result import Quantity
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.gram import Eliminated


def freed(found: Following, sizes: Array) -> Array:
    """Sizes with those of bias and scale factor as of what is to be found."""
    wide, first = sizes.copy(), 0
    for group in found.dictionary.always:
        some = slice(first, first := first + len(group.columns))
        if group.fixed is None:
            wide[some] = group.sizes(priors.FREE)
    return wide


def differing(found: Following, state: Eliminated) -> Iterator[Difference]:
    """Bias and scale factor of both triads against what the reference says."""
    for name, group, known in _groups(found, state):
        value, covariance, _ = estimates(state, group.columns)
        inner = np.ix_(known, known)
        probability = differs(value[known], covariance[inner], group.typical[known])
        if probability >= thresholds.NAMED:
            told = _told(found, state, name, group, known)
            nominal = 1.0 if name.endswith("scale") else 0.0
            pairs = {
                axis: RealAndSimulated.of(q, Quantity(nominal, 0.0, q.unit))
                for axis, q in told.items()
            }
            yield Difference(name, "resized", probability, pairs)


def calibration(found: Following, state: Eliminated) -> dict[str, dict[str, Quantity]]:
    """Groups of the calibration by axis, as far as they are determined."""
    return {
        name: _told(found, state, name, group, known)
        for name, group, known in _groups(found, state)
    }


def _groups(found: Following, state: Eliminated) -> Iterator[tuple[str, Group, Index]]:
    """Groups of the calibration, each with which of its columns are determined."""
    for name in GROUP_UNITS:
        part, _, cause = name.partition("_")
        always = found.dictionary.always
        group = next((g for g in always if g.cause == cause and g.part == part), None)
        if group is None:
            continue
        _, covariance, before = estimates(state, group.columns)
        sigma = np.sqrt(np.diag(covariance))
        free = (sigma < DETERMINED[name]) & (
            sigma**2 < thresholds.DETERMINED * before**2
        )
        if free.any():
            yield name, group, np.flatnonzero(free)


def _told(
    found: Following, state: Eliminated, name: str, group: Group, known: Index
) -> dict[str, Quantity]:
    """Values of a group of the calibration by axis."""
    d, nominal = found.dictionary, found.fit.nominal
    bias = group.cause == "bias"
    axes = group.columns - (d.bias if bias else d.scale)
    base = nominal.bias if bias else nominal.scale
    value, covariance, _ = estimates(state, group.columns)
    return {
        "xyz"[int(axes[i]) % 3]: Quantity(
            float(base[axes[i]] + value[i]),
            float(np.sqrt(covariance[i, i])),
            GROUP_UNITS[name],
        )
        for i in known
    }
