"""Random causes: random walks and flicker of the biases, errors of set angles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.effects import catalogue
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.detents import detent_columns, detents
from fieldcal.model.causes.flicker_series import FlickerSeries
from fieldcal.model.causes.leaning import leaning
from fieldcal.model.causes.settling_stops import settling_stops
from fieldcal.model.causes.sinking import sinking
from fieldcal.model.causes.turn_gyro_errors import turn_gyro_errors
from fieldcal.physics.effect import CHANCE, Scatter


def random_causes(table: ColumnTable) -> Iterator[Cause]:
    """Causes of random effects, of noise that devices have, and of wrong angles."""
    held = table.window_positions
    oriented = held[[table.x.oriented[table.x.position == p].all() for p in held]]
    for effect in catalogue().values():
        if isinstance(effect, Scatter) and effect.applies(table.x):
            yield from _causes_of_scatter(table, effect, oriented)
    several = len(table.window_positions) >= thresholds.MIN_ALIKE
    if several:  # else it is a permanent group
        for group in _cosine_flicker(table):
            yield Cause(
                group.cause, group.part, priors.FLICKER_CHANCE, (group,), "noise"
            )
    if (leans := leaning(table)) is not None:
        yield Cause(leans.cause, leans.part, priors.LEAN_CHANCE, (leans,), "noise")
    if several and (stops := settling_stops(table)) is not None:
        yield Cause(
            stops.cause, stops.part, priors.STOP_SETTLING_CHANCE, (stops,), "noise"
        )
    if (sinks := sinking(table)) is not None:
        yield Cause(sinks.cause, sinks.part, priors.SINK_CHANCE, (sinks,), "noise")
    if table.turns:
        yield from turn_gyro_errors(table)
    if len(table.window_positions) > 3 and len(oriented):
        yield from _wrong_angles(table, oriented)


def _wrong_angles(table: ColumnTable, oriented: Index) -> Iterator[Cause]:
    """Causes of a position set at wrong angles, and of an angle with a repeated error.

    Both concern only the positions `oriented`, whose angles are known. Each position is
    a cause of its own, because several may be set wrongly: two, if their angles were
    exchanged. The repeated errors are variants of one cause: the error of one detent,
    or errors of all detents, since a fixture with one worn detent may have others.
    """
    size = np.full(2, np.deg2rad(priors.MISSET_DEG))
    for p in oriented.tolist():
        group = Group("misset", "", table.rotations_of(p), size, params=(0, 1),
                      position=p, in_state=True)  # fmt: skip
        yield Cause(
            "misset", "", CHANCE / len(oriented), (group,), "position", position=p
        )
    repeated = [
        d for d in detents(table.x, oriented) if 1 < len(d.positions) < len(oriented)
    ]
    if not repeated:
        return
    wide = np.full(1, np.deg2rad(priors.REPEATED_MISTAKE_DEG))
    at = detent_columns(table, repeated)
    groups = tuple(
        Group("repeated_angle", "", at[i : i + 1], wide, params=(detent.joint,),
              moved_positions=detent.positions)
        for i, detent in enumerate(repeated)
    )  # fmt: skip
    if len(repeated) > 1:
        moved = tuple(sorted({p for detent in repeated for p in detent.positions}))
        sizes = np.repeat(wide, len(repeated))
        groups += (Group("repeated_angle", "", at, sizes, moved_positions=moved),)
    yield Cause("repeated_angle", "", CHANCE, groups, "position")


def _causes_of_scatter(
    table: ColumnTable, effect: Scatter, oriented: Index
) -> Iterator[Cause]:
    """Causes of a random effect: of the positions' angles, or of the outputs.

    Angles scatter in the positions `oriented`, whose angles are known.
    """
    if not {p.name for p in effect.params} <= set(CHANNELS):  # of the positions' angles
        if len(table.window_positions) < 3 or len(oriented) < 2:
            return
        at = table.rotations_of(oriented)
        size = np.full(len(at), np.deg2rad(effect.params[0].typical))
        group = Group(effect.id, "", at, size, effect, in_state=True)
        yield Cause(effect.id, "", effect.chance(table.x), (group,), "random")
        return
    for part, channels in table.triads:
        yield _walks(table, effect, part, channels[None], 1.0)
        alone = f"{part}, one axis"
        yield _walks(table, effect, alone, channels[:, None], priors.SINGLE_AXIS_SHARE)


def _walks(
    table: ColumnTable, effect: Scatter, part: str, channel_sets: Index, share: float
) -> Cause:
    """Cause of random walks, with a variant for each set of channels, (sets, k).

    `share` is the part of the probability of the effect that this cause has.
    """
    shape, modes = table.span.walk(), table.wander.modes
    groups = tuple(
        Group(
            effect.id, "".join(CHANNELS[c] for c in channels),
            np.concatenate([table.cosine_columns(c, modes[c]) for c in channels]),
            np.concatenate([
                shape[: modes[c]] * effect.params[c].typical * table.unit[c]
                for c in channels
            ]),
            effect,
            params=tuple(channels),
        )
        for channels in channel_sets.tolist()
    )  # fmt: skip
    return Cause(effect.id, part, share * effect.chance(table.x), groups, "random")


def _cosine_flicker(table: ColumnTable) -> Iterator[Group]:
    """Flicker of each triad: bias noise with equal power in every octave.

    The variance of cosine k is proportional to 1/k.
    """
    modes = table.wander.modes
    cosines = [table.cosine_columns(c, modes[c]) for c in range(6)]
    shape = 1 / np.sqrt(np.arange(1, modes.max() + 1))
    yield from _flicker_groups(table, cosines, shape, priors.FLICKER)


def series_flicker(table: ColumnTable, series: FlickerSeries) -> Iterator[Group]:
    """Flicker of each triad as a series, for few windows without other instability.

    It stands for the instability, and is hardly larger than that of devices.
    """
    many = len(series.sizes)
    at = table.add_course("flicker", lambda x: series.at(x.t), many, True)
    terms = list(at.reshape(6, many))
    for group in _flicker_groups(table, terms, series.sizes, priors.INSTABILITY):
        yield replace(group, largest=priors.LARGEST_FLICKER)


def _flicker_groups(
    table: ColumnTable, terms: Sequence[Index], shape: Array, sizes: Array
) -> Iterator[Group]:
    """Group of the flicker of each triad.

    `terms` are the columns of the series of each of the six channels, `shape` (k,) the
    relative standard deviations of the terms, and `sizes` (6,) the typical sizes, SI.
    """
    for part, at in table.triads:
        columns = np.concatenate([terms[c] for c in at])
        wide = [shape[: len(terms[c])] * sizes[c] * table.unit[c] for c in at]
        yield Group("flicker", part, columns, np.concatenate(wide), random=True)
