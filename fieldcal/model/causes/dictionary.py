"""What could have made the rows: causes, each with the groups of columns it may be.

A session's dictionary holds each column once. A group states which columns belong to it
and their typical sizes. Some groups are always included: bias, scale factor if the rows
determine it, instability, the uncertainty of gravity, the Earth's rate, and rotations
of the positions whose orientation is not known.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array, Index
from fieldcal.model import priors
from fieldcal.model.causes import columns
from fieldcal.model.causes.cause import CLOSURE, FEW, TRIADS, Cause, Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.columns import Course, General
from fieldcal.model.causes.effect_causes import at_points, of_effects
from fieldcal.model.causes.filtered_turns import FILTERED, filtered_turns
from fieldcal.model.causes.known import KnownRows
from fieldcal.model.causes.random_causes import flicker_of_few, of_chance
from fieldcal.model.causes.unknown_causes import of_no_effect
from fieldcal.model.causes.wander import Wander
from fieldcal.physics.experience import Experience


@dataclass(frozen=True, slots=True)
class AlikeGroups:
    """Groups that are alike in width, by the columns that they are offered by.

    Attributes
    ----------
    blocks : (b, k) columns, each block once, as several groups may be made of it
    block : (m,) the block of each group
    typical : (m, k) sizes
    cause, variant : (m,) their numbers

    """

    blocks: Index
    block: Index
    typical: Array
    cause: Index
    variant: Index

    @classmethod
    def of(cls, some: Sequence[tuple[int, int, Group]]) -> AlikeGroups:
        """Of groups with the numbers of their causes and variants."""
        columns = np.array([g.columns[g.foremost] for _, _, g in some])
        blocks, block = np.unique(columns, axis=0, return_inverse=True)
        typical = np.array([g.typical[g.foremost] for _, _, g in some])
        cause, variant = np.array([(i, j) for i, j, _ in some]).T
        return cls(blocks, block.ravel(), typical, cause, variant)


class Dictionary(ColumnTable):
    """All columns of a session, and the groups made of them.

    Parameters
    ----------
    x : rows of the windows
    used : (n, 6) rows that say something, by channel
    since : (o, n) s since the turn, by origin
    common : (p, 6) standard deviation of an error that all rows of a window share
    unit : (6,) outputs per SI unit
    turns : whether the way between positions is seen
    wander : how the biases wander inside windows

    Attributes
    ----------
    known : what is known of columns from elsewhere; None where nothing is
    unfitted : effects, each named by `part`, that may be in the device although a set
        has them not: numbers are less certain for them

    """

    known: KnownRows | None = None
    unfitted: tuple[Group, ...] = ()

    def __init__(
        self,
        x: Experience,
        used: NDArray[np.bool_],
        since: Array,
        common: Array,
        unit: Array,
        turns: bool,
        wander: Wander,
        alike: Array | None = None,
    ) -> None:
        super().__init__(x, used, since, unit, wander)
        self.common, self.turns = common, turns
        self.earth = self.attitude = -1
        self.always: list[Group] = [
            *self._calibration(), *self._gravity(), *self._unoriented_earth(),
            *self._attitudes(), *self._speeds(), *self._filters(), *self._alike(alike),
        ]  # fmt: skip
        self.free = np.array([self._is_free(p) for p in self.held])
        self._instability()
        if wander.series is not None:
            self.always += flicker_of_few(self, wander.series)
        self.causes: list[Cause] = list(self._causes())

    def plain(self) -> Dictionary:
        """The same with what a simulation has only, bias and scale factor being free.

        There is no Earth's rate beside its own, and nothing random: that predicts.
        """
        out = copy(self)
        known = (g for g in self.always if g.in_state and g.cause != "earth")
        free = float(priors.SIZES[-1])
        out.always = [replace(g, fixed=free) for g in known]
        return out

    def apart(self) -> Self:
        """The same, of which columns that are added are its own."""
        out = copy(self)
        out.bases = list(self.bases)
        return out

    def like(
        self, members: Iterable[tuple[Cause, Group]]
    ) -> tuple[tuple[Cause, Group], ...]:
        """Causes of another dictionary as they are here, each at its nearest variant.

        Those that are not here, or of which nothing tells which variant is meant, are
        left out.
        """
        here = {cause.key: cause for cause in self.causes}
        found = {}
        for cause, group in members:
            same = here.get(cause.key)
            some = [] if same is None else group.alike(same.variants)
            if same is not None and some:
                found[same.key] = (same, min(some, key=group.apart))
        return tuple(found.values())

    @property
    def filters(self) -> Group | None:
        """What filters of the sensors make of turns; None where no turn is used."""
        return next((g for g in self.always if g.part == FILTERED), None)

    @cached_property
    def by_width(self) -> list[AlikeGroups]:
        """Groups of causes, those alike in width together."""
        found: dict[int, list[tuple[int, int, Group]]] = {}
        for i, cause in enumerate(self.causes):
            for j, group in enumerate(cause.variants):
                found.setdefault(len(group.foremost), []).append((i, j, group))
        return [AlikeGroups.of(some) for some in found.values()]

    @cached_property
    def chances(self) -> Array:
        """Of each variant of every cause, ln."""
        return np.array([np.log(c.chance / len(c.variants)) for c in self.causes])

    @cached_property
    def typical(self) -> Array:
        """The largest typical size of each column."""
        out = np.ones(self.width)
        for cause in self.causes:
            for group in cause.variants:
                out[group.columns] = group.typical
        return out

    @cached_property
    def shown(self) -> NDArray[np.bool_]:
        """Columns that windows show; filled in by the first linearisation."""
        return np.zeros(self.width, dtype=bool)

    def _causes(self) -> Iterator[Cause]:
        """Everything that may be there."""
        yield from of_effects(self)
        yield from of_chance(self)
        yield from of_no_effect(self)

    def _calibration(self) -> Iterator[Group]:
        """Bias, scale factor, Earth's rate."""
        sizes = np.repeat([priors.BIAS_ACC, priors.BIAS_GYR], 3) * self.unit
        for part, channels in TRIADS:
            at = np.intersect1d(channels, self.observed)
            if len(at):
                yield Group("bias", part, self.bias + at, sizes[at], in_state=True)
        rated = bool(self.x.rate.any())
        for part, channels in TRIADS:
            at = np.intersect1d(channels, self.observed)
            if len(at) and (part == "acc" or rated):
                yield Group(
                    "scale", part, self.scale + at, priors.SCALE * self.unit[at],
                    in_state=True, in_step=True,
                )  # fmt: skip
        gyro = bool(len(np.intersect1d(self.observed, (3, 4, 5))))
        if gyro and self.x.oriented.any() and not self.x.base_rate.any():
            earth = General("earth", columns.earth, sides=columns.earth_sides)
            self.earth = self.add(earth, 3)
            size = np.full(3, EARTH_RATE)
            at = self.earth + np.arange(3)
            yield Group("earth", "", at, size, fixed=1.0, in_state=True)

    def _gravity(self) -> Iterator[Group]:
        """What is not known of gravity: all accelerometers are measured by it."""
        if self.x.gravity_sigma and np.isin(self.observed, (0, 1, 2)).any():
            at = self.add(General("gravity", columns.gravity), 1)
            size = np.array([self.x.gravity_sigma / self.x.gravity])
            yield Group("gravity", "acc", np.array([at]), size, fixed=1.0)

    def _attitudes(self) -> Iterator[Group]:
        """What attitudes are off by whose uncertainty is stated for each."""
        sigma = np.array([self.x.attitude_sigma[self.x.position == p][0]
                          for p in self.held])  # fmt: skip
        if not np.isfinite(sigma).any():
            return
        sides = columns.attitude_sides
        basis = General("attitude", columns.attitude, sides=sides, each=True)
        self.attitude = self.add(basis, 3 * self.places)
        known = np.isfinite(sigma)
        at = self.attitude + 3 * self.held[known][:, None] + np.arange(3)
        wide = np.repeat(sigma[known], 3)
        yield Group("attitude", "", at.ravel(), wide, fixed=1.0, in_state=True)

    def _speeds(self) -> Iterator[Group]:
        """What the rate about an axis that nobody knows is off by, alike at each speed.

        The Earth adds what of it lies along the axis, which is the same wherever the
        device stands on the table.
        """
        known = np.unique(self.x.speed[self.x.speed > 0])
        if not len(known) or not np.isin(self.observed, (3, 4, 5)).any():
            return
        at = self.add(General("speed", columns.speed(known)), len(known))
        off = np.array([self.x.speed_sigma[self.x.speed == v].max() for v in known])
        wide = np.hypot(off, EARTH_RATE / 3**0.5) / known
        yield Group("speed", "gyr", at + np.arange(len(known)), wide, fixed=1.0)

    def _filters(self) -> Iterator[Group]:
        """What filters of the sensors make of turns."""
        if self.turns and np.isin(self.observed, (3, 4, 5)).any():
            yield filtered_turns(self)

    def _unoriented_earth(self) -> Iterator[Group]:
        """What the Earth may add wherever nobody knows the orientation.

        One position alone has it in its bias.
        """
        if not np.isin(self.observed, (3, 4, 5)).any() or len(self.held) < 2:
            return
        shown = self.x.earth_seen
        if shown.any():
            basis = General("earth aside", columns.earth_aside)
            held = np.unique(self.x.position[shown])
            own = (2 * held[:, None] + [0, 1]).ravel()
            wide = np.full(len(own), 1 / priors.FREE)
            own = self.add(basis, 2 * self.places) + own
            yield Group("earth aside", "gyr", own, wide, fixed=priors.FREE)
        if self.x.earth_unseen.any():
            at = self.add(General("earth anyhow", columns.earth_anyhow), 4)
            size = EARTH_RATE * np.array([3**-0.5, 3**-0.5, 3**-0.5, 1.0])
            yield Group("earth anyhow", "gyr", at + np.arange(4), size, fixed=1.0)

    def _alike(self, sizes: Array | None) -> Iterator[Group]:
        """What rounding makes of all windows; where outputs change it averages out."""
        if sizes is None or not len(some := np.flatnonzero(sizes)):
            return
        even = Course("rounding", lambda v: np.ones((len(v.x.t), 1)), 1, standing=True)
        at = self.add(even, 6)
        yield Group("rounding", "", at + some, sizes[some], fixed=1.0, random=True)

    def _is_free(self, p: int) -> bool:
        """Whether nobody knows where the force of a position points, or its axis."""
        there = self.x.position == p
        spun = self.used[there, 3:].any() and self.x.speed[there].any()
        force = self.used[there, :3].any() and not self.x.oriented[there].all()
        return bool(spun or force)

    def _instability(self) -> None:
        """What each window is off by for itself, by channel."""
        self.unstable = np.zeros(7)
        if len(self.held) >= FEW:
            typical = np.repeat([priors.INSTABILITY_ACC, priors.INSTABILITY_GYR], 3)
            self.unstable[:6] = typical * self.unit * self.used.any(axis=0)
            self.unstable[CLOSURE] = priors.CLOSURE * self.turns

    def refined(
        self, cause: Cause, group: Group, values: Sequence[float]
    ) -> tuple[Cause, list[Group]]:
        """A cause with more variants, those of one group with its shape elsewhere.

        `group` is one of an effect with an equation.
        """
        (name,) = group.shape
        new = at_points(self, group, [({name: float(v)}, group.origin) for v in values])
        return self.exchanged(cause, (*cause.variants, *new)), new

    def tried_at(self, instants: Sequence[float]) -> None:
        """Have effects that begin at an instant begin at these as well."""
        for cause in self.causes:
            begin = {g.params: g for g in cause.variants if g.begins}
            for group in begin.values():
                cause, _ = self.refined(cause, group, instants)

    def expected_within(self, spans: Sequence[tuple[float, float]]) -> None:
        """Have effects that begin at an instant be likelier within these, s.

        There they are as large as is typical, and in all axes of a triad.
        """
        self.causes = [c.expecting(spans) for c in self.causes]
        self._changed()

    def exchanged(self, cause: Cause, variants: tuple[Group, ...]) -> Cause:
        """A cause with other variants, in the place of the one that was."""
        more = replace(cause, variants=variants)
        self.causes = [more if c is cause else c for c in self.causes]
        self._changed()
        return more

    def joined(self, causes: Iterable[Cause]) -> None:
        """Take in causes that are made of what others leave."""
        self.causes = [*self.causes, *causes]
        self._changed()

    def chosen(self, causes: Iterable[Cause]) -> None:
        """Leave only some of its causes."""
        self.causes = list(causes)
        self._changed()

    def _changed(self) -> None:
        """Forget what was made of the causes as they were."""
        self.shown = np.pad(self.shown, (0, self.width - len(self.shown)))
        for cached in ("by_width", "chances", "typical"):
            self.__dict__.pop(cached, None)
