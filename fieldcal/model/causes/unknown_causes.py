"""Causes without physics: smooth functions of a row's covariates, and offsets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.model import priors
from fieldcal.model.causes import smooth
from fieldcal.model.causes.cause import FEW, TRIADS, Cause, Group
from fieldcal.model.causes.column_table import ColumnTable

FORCES = 3
"""Channels that feel a force, those of the accelerometers."""


def of_no_effect(table: ColumnTable) -> Iterator[Cause]:
    """Functions that no effect makes, on each channel."""
    sizes = typical(table)
    for c in table.observed.tolist():
        if _has_times(table):
            groups = [
                _smooth_course(table, CHANNELS[c], [c], sizes, span)
                for span in smooth.SPANS
            ]
            yield _cause("time", CHANNELS[c], groups)
        at = table.window(c)
        if len(table.held) > 3:
            groups = [
                Group("window", CHANNELS[c], at[i : i + 1], sizes[c : c + 1],
                      position=int(p))
                for i, p in enumerate(table.held)
            ]  # fmt: skip
            yield _cause("window", CHANNELS[c], groups)
        if len(table.held) > FEW:
            wide = np.full(len(at), sizes[c])
            yield _cause(
                "position", CHANNELS[c], [Group("position", CHANNELS[c], at, wide)]
            )
    if _has_times(table):
        yield from _together(table, sizes)
    yield from _of_covariates(table, sizes)


def _has_times(table: ColumnTable) -> bool:
    """Whether rows have times: without, a course is a constant, as a bias is."""
    return bool(np.ptp(table.x.t) > 0)


def typical(table: ColumnTable) -> Array:
    """Size of what no effect makes on each channel, (6,)."""
    out: Array = np.repeat([priors.UNKNOWN_ACC, priors.UNKNOWN_GYR], 3) * table.unit
    return out


def _together(table: ColumnTable, sizes: Array) -> Iterator[Cause]:
    """The same on all axes of a triad: one cause, not one for each of them."""
    for part, channels in TRIADS:
        some = [c for c in channels if c in table.observed]
        if len(some) < 2:
            continue
        groups = [
            _smooth_course(table, part, some, sizes, span) for span in smooth.SPANS
        ]
        yield _cause("time", part, groups)


def _smooth_course(
    table: ColumnTable, part: str, channels: Sequence[int], sizes: Array, span: float
) -> Group:
    """A smooth course in time on some channels."""
    shape = smooth.smooth(span)
    waves = np.concatenate([table.wave(c, len(shape)) for c in channels])
    size = np.outer(sizes[channels], shape).ravel()
    return Group("time", part, waves, size, shape={"waves": span})


def _of_covariates(table: ColumnTable, sizes: Array) -> Iterator[Cause]:
    """Functions of what is known of a row beside the time."""
    for covariate, of in smooth.covariates(table.span).items():
        if not _covers(table, covariate):
            continue
        width = of(table.x).shape[1]
        first = table.course(covariate, of, width, False)
        for c in table.observed.tolist():
            at = first + c * width + np.arange(width)
            parts = [at]
            if covariate == "force and time" and c < FORCES:
                parts.append(at[smooth.along(c)])  # a scale factor that changes
            groups = [Group(covariate, CHANNELS[c], some, np.full(len(some), sizes[c]))
                      for some in parts]  # fmt: skip
            yield _cause(covariate, CHANNELS[c], groups)


def _cause(name: str, part: str, groups: Sequence[Group]) -> Cause:
    return Cause(name, part, priors.UNKNOWN, tuple(groups), "unknown")


def _covers(table: ColumnTable, covariate: str) -> bool:
    x = table.x
    if covariate in ("alpha", "beta", "joints"):
        return bool(x.oriented.all()) and len(table.held) > 3
    if covariate == "temperature":
        return x.warms
    if covariate == "force and time":
        return len(table.held) > FEW and _has_times(table)
    if covariate == "since turn":
        return bool(np.isfinite(x.since_turn).all())
    return len(table.held) > 3
