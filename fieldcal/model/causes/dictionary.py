"""What could have made the rows: causes, each with the groups of columns it may be.

A session's dictionary holds each column once. A group states which columns belong to it
and their typical sizes. Some groups are always included: bias, scale factor if the rows
determine it, instability, the uncertainty of gravity, the Earth's rate, and rotations
of the positions whose orientation is not known.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Self

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model import priors, thresholds
from fieldcal.model.causes import columns
from fieldcal.model.causes.basis import General
from fieldcal.model.causes.cause import CLOSURE, Cause, Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.effect_causes import effect_causes, groups_at_points
from fieldcal.model.causes.equal_width_groups import EqualWidthGroups
from fieldcal.model.causes.filtered_turns import FILTERED, filtered_turns
from fieldcal.model.causes.known_rows import KnownRows
from fieldcal.model.causes.random_causes import random_causes, series_flicker
from fieldcal.model.causes.site_groups import (
    clock_group,
    gravity_group,
    rounding_group,
    speed_group,
    unoriented_earth_groups,
)
from fieldcal.model.causes.unknown_causes import unknown_causes
from fieldcal.model.causes.wander import Wander
from fieldcal.physics.experience import Experience


class Dictionary(ColumnTable):
    """All columns of a session, and the groups made of them.

    Parameters
    ----------
    x : rows of the windows
    used : (n, 6) rows with information, by channel
    since : (o, n) s since the turn, by origin
    common : (p, 6) standard deviation of an error that all rows of a window share,
        units of the output
    unit : (6,) outputs per SI unit
    turns : whether the turns between positions were recorded
    wander : how the biases wander inside windows
    shared_error : (6,) standard deviation of an error that all windows share, units of
        the output; None if there is none

    Attributes
    ----------
    known : prior knowledge of columns from another source; None if there is none
    unfitted : groups of effects, each named by `part`, that the device may have
        although a set does not contain them; they widen the uncertainties
    unoriented : (p,) windows whose orientation or axis of rotation is not known
    typical_instability : (7,) typical size of the instability of each channel and of
        the closures; 0 where there is none

    """

    known: KnownRows | None = None
    unfitted: tuple[Group, ...] = ()

    def __init__(
        self,
        x: Experience,
        used: Mask,
        since: Array,
        common: Array,
        unit: Array,
        turns: bool,
        wander: Wander,
        shared_error: Array | None = None,
    ) -> None:
        super().__init__(x, used, since, unit, wander)
        self.window_error, self.turns = common, turns
        self.earth = self.attitude = -1
        self.always: list[Group] = [
            *self._calibration(), *gravity_group(self), *self._unoriented_earth(),
            *self._attitudes(), *speed_group(self), *self._clock(), *self._filters(),
            *rounding_group(self, shared_error),
        ]  # fmt: skip
        self.unoriented = np.array(
            [self._is_unoriented(p) for p in self.window_positions]
        )
        self._instability()
        if wander.series is not None:
            self.always += series_flicker(self, wander.series)
        self.causes: list[Cause] = list(self._causes())

    def calibration_only(self) -> Dictionary:
        """A copy whose permanent groups are bias and scale factor with wide priors.

        Like a simulation it has no random group and no unknown part of the Earth's
        rate. Errors of measured attitudes keep their stated size. The priors are those
        of a calibration: without any, a parameter that the positions do not determine
        follows the noise to values that no device has.
        """
        out = copy(self)
        known = (g for g in self.always if g.in_state and g.cause != "earth")
        out.always = [
            replace(g, fixed_size=g.fixed_size or priors.FREE_SIZE) for g in known
        ]
        return out

    def instability_sigma(self, instability: Sequence[int]) -> Array:
        """Standard deviation (7,) of instabilities, from indices in `priors.SIZES`."""
        return priors.SIZES[list(instability)] * self.typical_instability

    def independent_copy(self) -> Self:
        """A copy to which columns can be added without changing this one."""
        out = copy(self)
        out.bases = list(self.bases)
        return out

    def match_members(
        self, members: Iterable[tuple[Cause, Group]]
    ) -> tuple[tuple[Cause, Group], ...]:
        """Members of another dictionary's set, as members of this one.

        Each is matched to the cause of the same key and the variant of nearest shape.
        Members without a counterpart are omitted.
        """
        here = {cause.key: cause for cause in self.causes}
        matched = {}
        for cause, group in members:
            same = here.get(cause.key)
            variants = [] if same is None else group.with_same_parameters(same.variants)
            if same is not None and variants:
                matched[same.key] = (same, min(variants, key=group.shape_distance))
        return tuple(matched.values())

    @property
    def filters(self) -> Group | None:
        """Group of the sensors' filters during turns; None if no turn is used."""
        return next((g for g in self.always if g.part == FILTERED), None)

    @cached_property
    def groups_by_width(self) -> list[EqualWidthGroups]:
        """All groups of all causes, stacked by their number of leading columns."""
        by_width: dict[int, list[tuple[int, int, Group]]] = {}
        for i, cause in enumerate(self.causes):
            for j, group in enumerate(cause.variants):
                width = len(group.leading[0])
                by_width.setdefault(width, []).append((i, j, group))
        return [EqualWidthGroups.of(groups) for groups in by_width.values()]

    @cached_property
    def cause_log_priors(self) -> Array:
        """Log prior probability of a variant of each cause, (causes,)."""
        return np.array([np.log(c.chance / len(c.variants)) for c in self.causes])

    @cached_property
    def typical(self) -> Array:
        """The largest typical size of each column; 1 if it is in no cause."""
        out = np.zeros(self.width)
        for cause in self.causes:
            for group in cause.variants:
                np.maximum.at(out, group.columns, group.typical)
        return np.where(out > 0, out, 1.0)

    @cached_property
    def shown(self) -> Mask:
        """Columns that are visible in windows; set by the first linearisation."""
        return np.zeros(self.width, dtype=bool)

    def _causes(self) -> Iterator[Cause]:
        """All causes of the session."""
        yield from effect_causes(self)
        yield from random_causes(self)
        yield from unknown_causes(self)

    def _calibration(self) -> Iterator[Group]:
        """Groups of bias, scale factor and Earth's rate."""
        sizes = priors.BIAS * self.unit
        for part, at in self.triads:
            yield Group("bias", part, self.bias + at, sizes[at], in_state=True)
        for part, at in self.triads:
            if part == "acc" or self.x.rate.any():
                yield Group(
                    "scale", part, self.scale + at, priors.SCALE * self.unit[at],
                    in_state=True, changes_together=True,
                )  # fmt: skip
        known = self.x.oriented.any() and not self.x.base_rate.any()
        if self.has_gyroscopes and known:
            size = np.full(3, EARTH_RATE)
            yield Group("earth", "", self.add_earth(), size,
                        fixed_size=1.0, in_state=True)  # fmt: skip

    def add_earth(self) -> Index:
        """Append the columns of the base's rate about each of its axes, (3,) rad/s."""
        at = self.add(General("earth", columns.earth, columns.earth_sides), 3)
        self.earth = int(at[0])
        return at

    def _clock(self) -> Iterator[Group]:
        """Group of the error of counted times, if turns are used."""
        yield from clock_group(self) if self.turns else ()

    def _unoriented_earth(self) -> Iterator[Group]:
        """Groups of the Earth's rate in positions of unknown orientation."""
        yield from unoriented_earth_groups(self)

    def _attitudes(self) -> Iterator[Group]:
        """Group of the errors of attitudes that have a stated uncertainty."""
        sigma = np.array([self.x.attitude_sigma[self.x.position == p][0]
                          for p in self.window_positions])  # fmt: skip
        if not np.isfinite(sigma).any():
            return
        sides = columns.attitude_sides
        basis = General("attitude", columns.attitude, sides, per_position=True)
        every = self.add(basis, 3 * self.position_count)
        self.attitude = int(every[0])
        known = np.isfinite(sigma)
        at = every.reshape(-1, 3)[self.window_positions[known]].ravel()
        wide = np.repeat(sigma[known], 3)
        yield Group("attitude", "", at, wide, fixed_size=1.0, in_state=True)

    def _filters(self) -> Iterator[Group]:
        """Group of the sensors' filters during turns."""
        if self.turns and self.has_gyroscopes:
            yield filtered_turns(self)

    def _is_unoriented(self, p: int) -> bool:
        """Whether the direction of a position's force, or of its rate, is not known."""
        inside = self.x.position == p
        spun = self.used[inside, 3:].any() and self.x.speed[inside].any()
        force = self.used[inside, :3].any() and not self.x.oriented[inside].all()
        return bool(spun or force)

    def _instability(self) -> None:
        """Set the typical instability of windows, by channel, and of closures."""
        self.typical_instability = np.zeros(7)
        if len(self.window_positions) >= thresholds.MIN_ALIKE:
            measured = self.used.any(axis=0)
            self.typical_instability[:6] = priors.INSTABILITY * self.unit * measured
            self.typical_instability[CLOSURE] = priors.CLOSURE_RAD * self.turns

    def add_shapes(
        self, cause: Cause, group: Group, shapes: Sequence[Mapping[str, float]]
    ) -> tuple[Cause, list[Group]]:
        """Add variants of a group with other shapes; the cause and these.

        `group` is one of an effect with an equation.
        """
        new = groups_at_points(self, group, [(s, group.origin) for s in shapes])
        return self.replace_variants(cause, (*cause.variants, *new)), new

    def add_instants(self, instants: Sequence[float]) -> None:
        """Add variants that begin at these instants, s, to effects that do so."""
        for cause in self.causes:
            begin = {g.params: g for g in cause.variants if g.begins_at_instant}
            for group in begin.values():
                (name,) = group.shape
                shapes = [{name: float(at)} for at in instants]
                cause, _ = self.add_shapes(cause, group, shapes)

    def expect_within(self, spans: Sequence[tuple[float, float]]) -> None:
        """Make effects that begin within these spans, s, likelier (`expected`)."""
        self.causes = [c.expecting_within(spans) for c in self.causes]
        self._clear_caches()

    def replace_variants(self, cause: Cause, variants: tuple[Group, ...]) -> Cause:
        """Replace a cause by one with other variants; returns the new cause."""
        more = replace(cause, variants=variants)
        self.causes = [more if c is cause else c for c in self.causes]
        self._clear_caches()
        return more

    def add_causes(self, causes: Iterable[Cause]) -> None:
        """Add causes."""
        self.causes = [*self.causes, *causes]
        self._clear_caches()

    def _clear_caches(self) -> None:
        """Discard cached values that depend on the causes."""
        self.shown = np.pad(self.shown, (0, self.width - len(self.shown)))
        for cached in ("groups_by_width", "cause_log_priors", "typical"):
            self.__dict__.pop(cached, None)
