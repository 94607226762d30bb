"""What could have made the rows: causes, each with the groups of columns it may be.

A session's dictionary holds the columns once; groups say which of them they are made
of, and how large these are typically. What a device has anyway is always in: bias,
scale factor where something shows it, instability, the Earth's rate, and the turns of
positions whose orientation nobody knows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from fieldcal.effects import Effect, Experience, Motion, Scatter, Sensor, catalogue
from fieldcal.frames import EARTH_RATE
from fieldcal.model import columns, priors, unknown
from fieldcal.model.causes import CLOSURE, FEW, TRIADS, Basis, Cause, Group, Point
from fieldcal.model.columns import Course, General
from fieldcal.model.evidence import Index
from fieldcal.samples import CHANNELS, Array


class Dictionary:
    """All columns of a session, and the groups made of them.

    Parameters
    ----------
    x : rows of the windows
    used : (n, 6) rows that say something, by channel
    since : (o, n) s since the turn, by origin
    common : (p, 6) standard deviation of an error that all rows of a window share
    unit : (6,) outputs per SI unit
    turns : whether the way between positions is seen

    """

    def __init__(
        self,
        x: Experience,
        used: NDArray[np.bool_],
        since: Array,
        common: Array,
        unit: Array,
        turns: bool,
        known: Sequence[str] = (),
    ) -> None:
        self.x, self.used, self.since, self.unit = x, used, since, unit
        self.seen = np.flatnonzero(np.any(used, axis=0))
        self.held = np.unique(x.position)
        self.places = int(x.position.max()) + 1
        self.span = unknown.Span(x.t)
        self.rated, self.turns = bool(x.rate.any()), turns
        self.bases: list[tuple[int, Basis]] = []
        self.width, self.earth = 0, -1
        self.always: list[Group] = []
        self.causes: list[Cause] = []
        self._calibration(used)
        self.common = common
        self._instability()
        self._effects()
        self._random()
        self._unknown()

    def plain(self) -> Dictionary:
        """The same with what a simulation has only, bias and scale factor being free.

        There is no Earth's rate beside its own, and nothing random: that foretells.
        """
        out = copy(self)
        known = (g for g in self.always if g.in_state and g.cause != "earth")
        free = float(priors.SIZES[-1])
        out.always = [replace(g, fixed=free) for g in known]
        return out

    @cached_property
    def by_width(self) -> list[tuple[Index, Array, Index, Index]]:
        """Groups of causes, those alike in width together.

        Columns (m, k), typical sizes (m, k), number of the cause and of the variant.
        """
        found: dict[int, list[tuple[int, int, Group]]] = {}
        for i, cause in enumerate(self.causes):
            for j, group in enumerate(cause.variants):
                found.setdefault(len(group.columns), []).append((i, j, group))
        return [
            (
                np.array([g.columns for _, _, g in some]),
                np.array([g.typical for _, _, g in some]),
                np.array([i for i, _, _ in some]),
                np.array([j for _, j, _ in some]),
            )
            for some in found.values()
        ]

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

    def _add(self, basis: Basis, width: int) -> int:
        """Append a basis; back comes its first column."""
        start = self.width
        self.bases.append((start, basis))
        self.width += width
        return start

    def _course(
        self,
        name: str,
        of: Callable[[Experience], Array],
        width: int,
        timed: bool,
    ) -> int:
        return self._add(Course(name, lambda v: of(v.x), width, timed), 6 * width)

    def _calibration(self, used: NDArray[np.bool_]) -> None:
        """Bias, scale factor, Earth's rate, unknown orientations."""
        first = self._add(General("bias", columns.bias), 6)
        self.bias = first
        sizes = np.array([priors.BIAS_ACC] * 3 + [priors.BIAS_GYR] * 3) * self.unit
        for part, channels in TRIADS:
            at = np.intersect1d(channels, self.seen)
            if len(at):
                self.always.append(
                    Group("bias", part, first + at, sizes[at], in_state=True)
                )
        first = self.scale = self._add(General("scale", columns.scale), 6)
        for part, channels in TRIADS:
            at = np.intersect1d(channels, self.seen)
            if len(at) and (part == "acc" or self.rated):
                typical = priors.SCALE * self.unit[at]
                self.always.append(
                    Group(
                        "scale",
                        part,
                        first + at,
                        typical,
                        in_state=True,
                        in_step=True,
                    )
                )
        self.free = np.array(
            [
                bool(used[self.x.position == p, :3].any())
                and not self.x.oriented[self.x.position == p].all()
                for p in self.held
            ]
        )
        turns = General("aside", columns.aside, sides=columns.aside_sides)
        self.aside = self._add(turns, 2 * self.places)
        gyro = bool(len(np.intersect1d(self.seen, (3, 4, 5))))
        if gyro and self.x.oriented.any() and not self.x.base_rate.any():
            first = self.earth = self._add(
                General("earth", columns.earth, sides=columns.earth_sides), 3
            )
            size = np.full(3, EARTH_RATE)
            at = first + np.arange(3)
            self.always.append(Group("earth", "", at, size, fixed=1.0, in_state=True))

    def _instability(self) -> None:
        """What each window is off by for itself, by channel."""
        self.windows = self._course("window", self._inside, len(self.held), False)
        self.unstable = np.zeros(7)
        if len(self.held) >= FEW:
            typical = [priors.INSTABILITY_ACC] * 3 + [priors.INSTABILITY_GYR] * 3
            self.unstable[:6] = np.array(typical) * self.unit * self.used.any(axis=0)
            self.unstable[CLOSURE] = priors.CLOSURE * self.turns

    def _inside(self, x: Experience) -> Array:
        inside: Array = np.equal.outer(x.position, self.held).astype(float)
        return inside

    def _effects(self) -> None:
        """Every effect of the catalogue that has columns here."""
        for effect in catalogue().values():
            if not isinstance(effect, Motion | Sensor) or not effect.params:
                continue
            if effect.applies(self.x) and (grid := list(self._grid(effect))):
                self._of_effect(effect, grid)

    def _of_effect(self, effect: Motion | Sensor, grid: Sequence[Point]) -> None:
        """The causes that an effect is: one, or one a triad."""
        places = self._columns(effect, grid)
        for part, at in self._parts(effect):
            variants = tuple(
                self._group(effect, part, some, point, columns)
                for some in self._axes(effect, at)
                for point, columns in zip(grid, places, strict=True)
            )
            if variants:
                chance = effect.chance(self.x)
                self.causes.append(Cause(effect.id, part, chance, variants))

    def _group(
        self, effect: Effect, part: str, some: tuple[int, ...], point: Point, at: Index
    ) -> Group:
        """Some parameters of an effect at one point of its grid."""
        sizes = np.array([effect.params[j].typical for j in some]) * self._unit(effect)
        shape, origin = point
        return Group(
            effect.id, part, at[list(some)], sizes, effect, shape, origin, some,
            in_state=True,
        )  # fmt: skip

    def _columns(self, effect: Motion | Sensor, grid: Sequence[Point]) -> list[Index]:
        """Append the columns of an effect: those of its parameters, for each point."""
        count = len(effect.params)
        if isinstance(effect, Sensor) and _of_channels(effect, self.x):
            course = columns.of_channels(effect, grid)
            start = self._add(course, 6 * len(grid))
            channel = np.array([CHANNELS.index(p.name) for p in effect.params])
            return [start + channel * len(grid) + i for i in range(len(grid))]
        return [
            self._add(columns.of_effect(effect, *point), count) + np.arange(count)
            for point in grid
        ]

    def _parts(self, effect: Effect) -> list[tuple[str, tuple[int, ...]]]:
        """Parameters that go together: those of a triad, where they are by channel."""
        names = [p.name for p in effect.params]
        if not set(names) <= set(CHANNELS):
            return [("", tuple(range(len(names))))]
        seen = {CHANNELS[c] for c in self.seen}
        return [
            (part, tuple(j for j, n in enumerate(names)
                         if CHANNELS.index(n) in at and n in seen))
            for part, at in TRIADS
        ]  # fmt: skip

    def _axes(
        self, effect: Motion | Sensor, at: tuple[int, ...]
    ) -> list[tuple[int, ...]]:
        """Parameters that go together: all, or those of one output or of two alone."""
        if isinstance(effect, Motion) or not at:
            return [at] if at else []
        reach = np.abs(effect.design(self.x, _any(effect))).max(axis=0)[:, at]
        own = [tuple(np.array(at)[reach[c] > 0].tolist()) for c in range(6)]
        own = [o for o in own if o and o != at]
        two = [tuple(sorted(set(o + p))) for o, p in combinations(own, 2)]
        more = [*own, *([] if effect.shapes else two)]
        return [at, *(o for o in dict.fromkeys(more) if o != at)]

    def refined(
        self, cause: Cause, group: Group, values: Sequence[float]
    ) -> tuple[Cause, list[Group]]:
        """A cause with more variants, those of one group with its shape elsewhere.

        `group` is one of an effect with an equation.
        """
        (name,) = group.shape
        grid: list[Point] = [({name: float(v)}, group.origin) for v in values]
        effect, parts = group.effect, group.params
        if not isinstance(effect, Motion | Sensor):
            return cause, []
        places = self._columns(effect, grid) if grid else []
        new = [
            self._group(effect, group.part, parts, point, at)
            for point, at in zip(grid, places, strict=True)
        ]
        return self.exchanged(cause, (*cause.variants, *new)), new

    def exchanged(self, cause: Cause, variants: tuple[Group, ...]) -> Cause:
        """A cause with other variants, in the place of the one that was."""
        more = replace(cause, variants=variants)
        self.causes = [more if c is cause else c for c in self.causes]
        self.shown = np.pad(self.shown, (0, self.width - len(self.shown)))
        for cached in ("by_width", "chances", "typical"):
            self.__dict__.pop(cached, None)
        return more

    def _unit(self, effect: Effect) -> float:
        """Outputs per SI unit, for what adds to outputs in counts or volts."""
        if isinstance(effect, Motion):
            return 1.0
        gyro = all(p.unit.startswith(("rad", "(rad")) for p in effect.params)
        return float(np.abs(self.unit[3 if gyro else 0]))

    def _grid(self, effect: Effect) -> Iterator[tuple[dict[str, float], int]]:
        """Values of the shape parameters to try, with the origin of times."""
        if not effect.shapes:
            yield {}, 0
        for shape in effect.shapes:
            for value, origin in shape.grid(self.x, self.since):
                yield {shape.name: value}, origin

    def _random(self) -> None:
        """Random effects: walks, and angles set by hand."""
        self._waves = self._course("waves", self.span.waves, unknown.WAVES, True)
        if len(self.held) < FEW:
            self._flicker()
        for effect in catalogue().values():
            if isinstance(effect, Scatter) and effect.applies(self.x):
                self._of_scatter(effect)
        oriented = self.held[
            [bool(self.x.oriented[self.x.position == p].all()) for p in self.held]
        ]
        if len(oriented) == len(self.held) > 3:
            size = np.full(2, np.deg2rad(priors.MISSET_DEG))
            groups = tuple(
                Group("misset", "", self.aside + 2 * p + np.arange(2), size,
                      position=int(p), in_state=True)
                for p in oriented
            )  # fmt: skip
            self.causes.append(Cause("misset", "", priors.PRESENT, groups, "position"))

    def _of_scatter(self, effect: Scatter) -> None:
        """A random effect by the kind of its parameters."""
        names = [p.name for p in effect.params]
        if not set(names) <= set(CHANNELS):  # of the positions' angles
            if len(self.held) < 3 or not self.x.oriented.all():
                return
            at = (self.aside + 2 * self.held[:, None] + [0, 1]).ravel()
            size = np.full(len(at), np.deg2rad(effect.params[0].typical))
            group = Group(effect.id, "", at, size, effect, in_state=True)
            self.causes.append(
                Cause(effect.id, "", effect.chance(self.x), (group,), "random")
            )
            return
        for part, channels in TRIADS:
            some = [c for c in channels if c in self.seen]
            if some:
                self._walks(effect, part, [some], 1.0)
                each = [[c] for c in some]
                self._walks(effect, f"{part}, one axis", each, priors.ALONE)

    def _walks(
        self, effect: Scatter, part: str, sets: Sequence[Sequence[int]], share: float
    ) -> None:
        """Walks of some channels together, or of one of them."""
        shape = self.span.walk()
        if sets[0]:
            groups = tuple(
                Group(
                    effect.id, "".join(CHANNELS[c] for c in some),
                    np.concatenate([self._wave(c) for c in some]),
                    np.concatenate(
                        [shape * effect.params[c].typical * self.unit[c] for c in some]
                    ),
                    effect,
                    params=tuple(some),
                )
                for some in sets
            )  # fmt: skip
            chance = share * effect.chance(self.x)
            self.causes.append(Cause(effect.id, part, chance, groups, "random"))

    def _flicker(self) -> None:
        """Instability within the windows, where there are too few to have it between.

        Of equal power in every octave: a cosine k has a variance as 1/k.
        """
        shape = 1 / np.sqrt(np.arange(1, unknown.WAVES + 1))
        for part, channels in TRIADS:
            at = [c for c in channels if c in self.seen]
            if at:
                size = (
                    priors.INSTABILITY_ACC
                    if part == "acc"
                    else (priors.INSTABILITY_GYR)
                )
                columns = np.concatenate([self._wave(c) for c in at])
                sizes = np.concatenate([shape * size * self.unit[c] for c in at])
                self.always.append(Group("flicker", part, columns, sizes))

    def _wave(self, channel: int) -> Index:
        at: Index = self._waves + channel * unknown.WAVES + np.arange(unknown.WAVES)
        return at

    def _unknown(self) -> None:
        """Functions that no effect makes, on each channel."""
        for c in self.seen.tolist():
            size = priors.UNKNOWN_ACC if c < 3 else priors.UNKNOWN_GYR
            size = size * self.unit[c]
            name = CHANNELS[c]
            groups = [
                Group("time", name, self._wave(c), size * unknown.smooth(span),
                      shape={"waves": span})
                for span in unknown.SPANS
            ]  # fmt: skip
            self._add_unknown("time", name, groups)
            if len(self.held) > 3:
                groups = [
                    Group("window", name,
                          np.array([self.windows + c * len(self.held) + i]),
                          np.array([size]), position=int(p))
                    for i, p in enumerate(self.held)
                ]  # fmt: skip
                self._add_unknown("window", name, groups)
        if len(self.held) > FEW:
            for c in self.seen.tolist():
                size = priors.UNKNOWN_ACC if c < 3 else priors.UNKNOWN_GYR
                at = self.windows + c * len(self.held) + np.arange(len(self.held))
                group = Group(
                    "position", CHANNELS[c], at, np.full(len(at), size * self.unit[c])
                )
                self._add_unknown("position", CHANNELS[c], [group])
        self._together()
        for covariate, of in unknown.covariates(self.span).items():
            if not self._shows(covariate):
                continue
            width = of(self.x).shape[1]
            first = self._course(covariate, of, width, False)
            for c in self.seen.tolist():
                size = priors.UNKNOWN_ACC if c < 3 else priors.UNKNOWN_GYR
                at = first + c * width + np.arange(width)
                group = Group(
                    covariate, CHANNELS[c], at, np.full(width, size * self.unit[c])
                )
                self._add_unknown(covariate, CHANNELS[c], [group])

    def _together(self) -> None:
        """The same on all axes of a triad: one cause, not one for each of them."""
        for part, channels in TRIADS:
            some = [c for c in channels if c in self.seen]
            if len(some) < 2:
                continue
            size = priors.UNKNOWN_ACC if part == "acc" else priors.UNKNOWN_GYR
            unit = size * self.unit[some]
            waves = np.concatenate([self._wave(c) for c in some])
            groups = [
                Group("time", part, waves, np.outer(unit, unknown.smooth(span)).ravel(),
                      shape={"waves": span})
                for span in unknown.SPANS
            ]  # fmt: skip
            self._add_unknown("time", part, groups)

    def _add_unknown(self, name: str, part: str, groups: Sequence[Group]) -> None:
        self.causes.append(Cause(name, part, priors.UNKNOWN, tuple(groups), "unknown"))

    def _shows(self, covariate: str) -> bool:
        x = self.x
        if covariate in ("alpha", "beta", "joints"):
            return bool(x.oriented.all()) and len(self.held) > 3
        if covariate == "temperature":
            return x.warms
        if covariate == "force and time":
            return len(self.held) > FEW
        if covariate == "since turn":
            return bool(np.isfinite(x.since_turn).all())
        return len(self.held) > 3


def _of_channels(effect: Sensor, x: Experience) -> bool:
    """Whether an effect does the same to every output, each by its own parameter."""
    if {p.name for p in effect.params} != set(CHANNELS):
        return False
    design = effect.design(x, _any(effect))
    return bool((design == np.eye(6) * design[:, :1, :1]).all())


def _any(effect: Effect) -> dict[str, float]:
    """Some shape, where only which output has a column is asked."""
    return {
        s.name: max(s.low, 1.0) if np.isfinite(s.low) else 0.0 for s in effect.shapes
    }
