"""Causes without physics: smooth functions of a row's covariates, and offsets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.core.samples import ACC, CHANNELS, Array, Index
from fieldcal.model import priors, thresholds
from fieldcal.model.causes import smooth
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.column_table import ColumnTable


def unknown_causes(table: ColumnTable) -> Iterator[Cause]:
    """Causes without physics: functions on single channels and on triads."""
    sizes = typical_unknown_sizes(table)
    for c in table.observed.tolist():
        if _has_times(table):
            yield _course_cause(table, CHANNELS[c], [c], sizes)
        at = table.window_columns(c)
        if len(table.window_positions) > 3:
            groups = [
                Group("window", CHANNELS[c], at[i : i + 1], sizes[c : c + 1],
                      position=int(p))
                for i, p in enumerate(table.window_positions)
            ]  # fmt: skip
            yield _cause("window", CHANNELS[c], groups)
        if len(table.window_positions) > thresholds.MIN_ALIKE:
            wide = np.full(len(at), sizes[c])
            yield _cause(
                "position", CHANNELS[c], [Group("position", CHANNELS[c], at, wide)]
            )
    for part, channels in table.triads if _has_times(table) else ():
        if len(channels) > 1:
            yield _course_cause(table, part, channels, sizes)
    yield from _covariate_causes(table, sizes)


def _has_times(table: ColumnTable) -> bool:
    """Whether rows have different times; if not, a course in time is like a bias."""
    return bool(np.ptp(table.x.t) > 0)


def typical_unknown_sizes(table: ColumnTable) -> Array:
    """Typical size of functions without physics on each channel, (6,), outputs."""
    return priors.UNKNOWN * table.unit


def _course_cause(
    table: ColumnTable, part: str, channels: Sequence[int] | Index, sizes: Array
) -> Cause:
    """Cause of a smooth course in time on some channels at once."""
    groups = []
    for span in priors.HALF_WAVES:
        shape = smooth.smooth_course_sizes(span)
        waves = np.concatenate([table.cosine_columns(c, len(shape)) for c in channels])
        size = np.outer(sizes[channels], shape).ravel()
        groups.append(Group("time", part, waves, size, shape={"waves": span}))
    return _cause("time", part, groups)


def _covariate_causes(table: ColumnTable, sizes: Array) -> Iterator[Cause]:
    """Causes of functions of a row's covariates other than time."""
    for covariate, of in smooth.covariates(table.span).items():
        if not _covers(table, covariate):
            continue
        width = of(table.x).shape[1]
        every = table.add_course(covariate, of, width, False).reshape(6, width)
        for c in table.observed.tolist():
            parts = [every[c]]
            if covariate == "force and time" and c < ACC.stop:
                # a scale factor that changes
                parts.append(every[c, smooth.force_time_columns(c)])
            groups = [
                Group(covariate, CHANNELS[c], at, np.full(len(at), sizes[c]))
                for at in parts
            ]
            yield _cause(covariate, CHANNELS[c], groups)


def _cause(name: str, part: str, groups: Sequence[Group]) -> Cause:
    return Cause(name, part, priors.UNKNOWN_FUNCTION_CHANCE, tuple(groups), "unknown")


def _covers(table: ColumnTable, covariate: str) -> bool:
    """Whether the rows vary in a covariate and their windows are numerous enough."""
    x = table.x
    if covariate in ("alpha", "beta", "joints"):
        return bool(x.oriented.all()) and len(table.window_positions) > 3
    if covariate == "temperature":
        return x.warms
    if covariate == "force and time":
        return len(table.window_positions) > thresholds.MIN_ALIKE and _has_times(table)
    if covariate == "since turn":
        return bool(np.isfinite(x.since_turn).all())
    return len(table.window_positions) > 3
