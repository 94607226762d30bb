"""Causes, and the groups of columns that each of them may be."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.model.causes.columns import Course, General
from fieldcal.physics.effect import Effect

Basis = Course | General
Point = tuple[Mapping[str, float], int]
"""Values of an effect's shape parameters, and the origin of its times."""

FEW = 3
"""Windows below which nobody can tell what each is off by from the bias."""

CLOSURE = 6
"""Kind of the closures of turns, beside the six outputs."""

TRIADS = (("acc", (0, 1, 2)), ("gyr", (3, 4, 5)))

BOTH = frozenset({"acc", "gyr"})
"""Accelerometers and gyroscopes."""

OFFERED = 60
"""Columns by which a group is offered: a course on three axes by twenty waves each."""

Kind = Literal["effect", "random", "noise", "unknown", "position", "given"]


def triads_of(part: str) -> frozenset[str]:
    """Triads that a triad, a channel or, if it is empty, everything belongs to.

    >>> sorted(triads_of("gx")), sorted(triads_of(""))
    (['gyr'], ['acc', 'gyr'])
    """
    if part in CHANNELS:
        return frozenset({TRIADS[CHANNELS.index(part) // 3][0]})
    return frozenset({part}) if part else BOTH


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Columns that share one size.

    Attributes
    ----------
    cause : id of the effect, or what it is called where it is none
    part : "acc", "gyr", a channel, or "" for all it touches
    columns : (k,) of the dictionary
    typical : (k,) size of each at v = 1
    effect, shape, origin : where it is an effect with an equation
    params : (k,) index of each column among the effect's parameters
    position : the one it belongs to, -1 for all
    together : positions that it moves alike, if it moves some only
    in_state : whether its estimate is in the base state, and not only in the columns
    unsure : standard uncertainty of the shape, where it was refined
    in_step : whether one cause may change all its columns by the same
    fixed : v, where that is known
    random : whether it is what is drawn anew all the time: it takes nothing from a
        residual, and predicts nothing

    """

    cause: str
    part: str
    columns: Index
    typical: Array
    effect: Effect | None = None
    shape: Mapping[str, float] = field(default_factory=dict)
    origin: int = 0
    params: tuple[int, ...] = ()
    position: int = -1
    together: tuple[int, ...] = ()
    in_state: bool = False
    in_step: bool = False
    unsure: float = np.nan
    fixed: float | None = None
    random: bool = False

    @property
    def foremost(self) -> Index:
        """The largest of its columns, by their place among them; all but of wide ones.

        By these it is offered: what the quick waves of a course add decides no rank,
        but for a walk far above the noise.
        """
        if len(self.columns) <= OFFERED:
            return np.arange(len(self.columns))
        order = np.argsort(-self.typical, kind="stable")
        return np.sort(order[:OFFERED])

    def alike(self, others: Iterable[Group]) -> list[Group]:
        """Those of others that are of the same parameters, whatever their shapes."""
        own = (self.params, self.origin, self.position, self.shape.keys())
        return [
            g for g in others if (g.params, g.origin, g.position, g.shape.keys()) == own
        ]

    def siblings(self, others: Iterable[Group]) -> list[Group]:
        """Those of others that are of the same shape, whatever their parameters."""
        own = (self.origin, self.position, self.shape)
        return [g for g in others if (g.origin, g.position, g.shape) == own]

    @property
    def begins(self) -> bool:
        """Whether its shape is the instant from which it is there."""
        shapes = self.effect.shapes if self.effect and self.shape else ()
        return [s.kind for s in shapes] == ["instant"]

    def apart(self, other: Group) -> float:
        """How far the shape of one alike is from its own."""
        return max((abs(other.shape[k] - v) / max(abs(v), 1e-9)
                    for k, v in self.shape.items()), default=0.0)  # fmt: skip

    def sizes(self, v: float) -> Array:
        """Standard deviation of each column before the rows are seen, (k,)."""
        wide: Array = v * self.typical
        return wide


@dataclass(frozen=True, slots=True, eq=False)
class Cause:
    """One explanation on one triad, with every variant of it.

    Attributes
    ----------
    name : of the effect, or of the unknown function
    part : "acc", "gyr" or ""
    chance : that a session has it
    variants : groups, one for each value of the shape
    kind : of the catalogue, random, noise that every device has, without physics, an
        angle, or asked for
    expected : variants that are likelier than others, as the device may have been off

    """

    name: str
    part: str
    chance: float
    variants: tuple[Group, ...]
    kind: Kind = "effect"
    expected: frozenset[Group] = frozenset()
    _nearest: dict[Group, tuple[Group, ...]] = field(
        default_factory=dict, init=False, repr=False
    )
    """What `at_once` found, as every pair of a search asks again."""

    def at_once(self, other: Group) -> tuple[Group, ...]:
        """Variants that happen when a group does of the same effect on the other triad.

        Those of the instants next to it; none where the effect has no instant.
        """
        if other.cause != self.name or not other.begins:
            return ()
        if other not in self._nearest:
            apart = [g.apart(other) for g in self.variants]
            least, each = min(apart), zip(self.variants, apart, strict=True)
            self._nearest[other] = tuple(g for g, d in each if d == least)
        return self._nearest[other]

    def parts_of(self, group: Group) -> tuple[Group, ...]:
        """The single mistakes that a variant combines; the variant itself if one."""
        if self.kind != "position":
            return (group,)  # fewer columns are a weaker form of it, and no part
        own = {*group.columns.tolist()}
        parts = tuple(g for g in self.variants if own > {*g.columns.tolist()})
        return parts or (group,)

    def of_size(self, v: float | None) -> Cause:
        """The same with variants of size v; itself where that is not known."""
        if v is None:
            return self
        every = tuple(replace(group, fixed=v) for group in self.variants)
        return replace(self, variants=every)

    def expecting(self, spans: Sequence[tuple[float, float]]) -> Cause:
        """The same with what begins within some spans, s, likelier in all its axes.

        It is as large as is typical there: nothing shrinks what the rows do not show.
        """
        if not (spans and self.variants and self.variants[0].begins):
            return self
        every = max((g.params for g in self.variants), key=len)
        some = [
            replace(g, fixed=1.0)
            for g in self.variants
            if g.params == every
            and any(a <= at <= b for at in g.shape.values() for a, b in spans)
        ]
        variants = (*self.variants, *some)
        return replace(self, variants=variants, expected=frozenset(some))

    @property
    def usual(self) -> bool:
        """Whether every triad has it until it is calibrated."""
        return any(g.effect is not None and g.effect.usual for g in self.variants[:1])

    @property
    def by_window(self) -> bool:
        """Whether windows are off by it one by one: angles, offsets without physics."""
        return self.kind == "position" or self.name in ("window", "position")

    @property
    def told(self) -> bool:
        """Whether it is something that is left out, and no noise."""
        return self.kind != "noise"

    @property
    def key(self) -> str:
        """Unique among the causes of a session."""
        return f"{self.name}:{self.part}" if self.part else self.name
