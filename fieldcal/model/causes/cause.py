"""Causes, and the groups of columns that each of them may be."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.model import priors, tolerances
from fieldcal.model.causes.basis import Course, General
from fieldcal.physics.effect import Effect

Basis = Course | General
Point = tuple[Mapping[str, float], int]
"""Values of an effect's shape parameters, and the index of the origin of its times."""

CLOSURE = len(CHANNELS)
"""Index of the instability of turns' closures; 0 to 5 are those of the six outputs."""

TRIADS = (("acc", (0, 1, 2)), ("gyr", (3, 4, 5)))

BOTH = frozenset({"acc", "gyr"})
"""Accelerometers and gyroscopes."""

Kind = Literal["effect", "random", "noise", "unknown", "position", "given"]


def triads_of(part: str) -> frozenset[str]:
    """Triads of a part: of a triad itself, of a channel, or both if it is empty.

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
    cause : id of the effect; a name of its own if there is no effect
    part : "acc", "gyr", a channel, or "" for all channels it changes
    columns : (k,) indices in the dictionary
    typical : (k,) standard deviation of each column at size v = 1
    effect : effect of the catalogue, if its columns follow from an equation
    shape, origin : grid point of the effect's shape parameters, and its origin of times
    params : (k,) index of each column among the effect's parameters
    position : position that it belongs to, -1 for all
    moved_positions : positions that it rotates by the same angle, or windows that a
        single turn connects; empty if it acts on all
    in_state : whether the base state contains its estimate
    changes_together : whether a single cause may change all columns by the same amount
    shape_covariance : (m, m) of the natural coordinates of its m shape parameters
        (`Shape.moved`), in the effect's order; None unless they were refined
    fixed_size : v, if it is known; None if it is estimated
    random : whether it is a random process: it is not subtracted from residuals and
        not used for predictions
    largest : size v beyond which it has another cause

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
    moved_positions: tuple[int, ...] = ()
    in_state: bool = False
    changes_together: bool = False
    shape_covariance: Array | None = None
    fixed_size: float | None = None
    random: bool = False
    largest: float = np.inf

    @property
    def log_density(self) -> Array:
        """Log prior of each of `priors.SIZES`."""
        return priors.log_density(self.largest)

    @property
    def names(self) -> list[str]:
        """Names of its parameters, of an effect, (k,)."""
        return [self.effect.params[j].name for j in self.params] if self.effect else []

    @property
    def leading(self) -> tuple[Index, Array]:
        """The columns of largest typical size, and these sizes, in their order.

        They predict the gain of log evidence by the group. The fast cosines of a course
        hardly change this gain, except for a random walk far above the noise. They are
        all columns if the group has at most `tolerances.MAX_OFFERED_COLUMNS`.
        """
        if len(self.columns) <= tolerances.MAX_OFFERED_COLUMNS:
            return self.columns, self.typical
        order = np.argsort(-self.typical, kind="stable")
        largest = np.sort(order[: tolerances.MAX_OFFERED_COLUMNS])
        return self.columns[largest], self.typical[largest]

    def with_same_parameters(self, others: Iterable[Group]) -> list[Group]:
        """Groups among `others` with the same parameters, origin and positions."""
        return [g for g in others if g.identity == self.identity]

    @property
    def identity(self) -> tuple[object, ...]:
        """What tells it from other groups of its cause, but for its shape."""
        where = (self.origin, self.position, self.moved_positions)
        known = () if self.fixed_size is None else (*self.own_sigma().tolist(),)
        return *where, self.params, self.shape.keys(), known

    def with_same_shape(self, others: Iterable[Group]) -> list[Group]:
        """Groups among `others` with the same shape, origin and position."""
        own = (self.origin, self.position, self.shape)
        return [g for g in others if (g.origin, g.position, g.shape) == own]

    @property
    def event(self) -> str:
        """What happens when it begins: its effects come together."""
        return (self.effect.event if self.effect else "") or self.cause

    @property
    def begins_at_instant(self) -> bool:
        """Whether its shape is the instant at which the effect begins."""
        shapes = self.effect.shapes if self.effect and self.shape else ()
        return [s.kind for s in shapes] == ["instant"]

    @property
    def begins_within(self) -> bool:
        """Whether it begins within the recording: by a jump, or to change gradually."""
        shapes = self.effect.shapes if self.effect and self.shape else ()
        return any(s.is_instant for s in shapes)

    def shape_sigma(self, name: str) -> float:
        """Standard uncertainty of a shape parameter; nan unless it was refined."""
        if self.effect is None or self.shape_covariance is None:
            return np.nan
        number = [s.name for s in self.effect.shapes].index(name)
        step = float(np.sqrt(self.shape_covariance[number, number]))
        return self.effect.shapes[number].sigma(self.shape[name], step)

    def moved_shape(self, step: Array) -> dict[str, float]:
        """Its shape, moved by a step (m,) of the natural coordinates."""
        shapes = self.effect.shapes if self.effect else ()
        return {
            s.name: s.moved(self.shape[s.name], float(d))
            for s, d in zip(shapes, step, strict=True)
        }

    def shape_distance(self, other: Group) -> float:
        """Largest relative difference of its shape from that of another group."""
        return max((abs(other.shape[k] - v) / max(abs(v), 1e-9)
                    for k, v in self.shape.items()), default=0.0)  # fmt: skip

    def prior_sigma(self, v: float) -> Array:
        """Prior standard deviation of each column at size v, (k,)."""
        return v * self.typical

    def own_sigma(self, v: float = 1.0) -> Array:
        """The same at its known size; at size v if that is not known."""
        return self.prior_sigma(v if self.fixed_size is None else self.fixed_size)


@dataclass(frozen=True, slots=True, eq=False)
class Cause:
    """One possible cause on one triad, with all its variants.

    Attributes
    ----------
    name : of the effect, or of the unknown function
    part : "acc", "gyr" or ""
    chance : prior probability that a session has it
    variants : groups, one for each value of the shape
    kind : "effect" of the catalogue, "random" effect, "noise" that every device has,
        "unknown" function without physics, error of a "position", or "given"
    position : position whose angles it changes, one of several causes of the same name;
        -1 if it does not belong to one
    expected : variants that begin when the device may have been switched off; they have
        a higher prior probability

    """

    name: str
    part: str
    chance: float
    variants: tuple[Group, ...]
    kind: Kind = "effect"
    position: int = -1
    expected: frozenset[Group] = frozenset()
    _nearest: dict[Group, tuple[Group, ...]] = field(
        default_factory=dict, init=False, repr=False
    )
    """Cached results of `simultaneous_variants`."""

    def simultaneous_variants(self, other: Group) -> tuple[Group, ...]:
        """Variants that begin at the same instant as a group of the same event.

        These are the variants with the nearest shape. Empty if the group is of an
        effect with which this one does not come, or that does not begin within the
        recording.
        """
        if other.event != self.event or not other.begins_within:
            return ()
        if other not in self._nearest:
            distances = [g.shape_distance(other) for g in self.variants]
            pairs = zip(self.variants, distances, strict=True)
            nearest = min(distances)
            self._nearest[other] = tuple(g for g, d in pairs if d == nearest)
        return self._nearest[other]

    def full_variant(self, group: Group) -> Group:
        """The variant with all its parameters; the group itself if it has them."""
        whole = self.variants[0]
        part = not group.shape and set(group.params) < set(whole.params)
        return whole if part else group

    def single_errors_of(self, group: Group) -> tuple[Group, ...]:
        """The variants of single angle errors that a variant combines, or itself."""
        if self.kind != "position":
            return (group,)  # only angle errors have variants that combine others
        own = {*group.columns.tolist()}
        parts = tuple(g for g in self.variants if own > {*g.columns.tolist()})
        return parts or (group,)

    def with_size(self, v: float | None) -> Cause:
        """The cause with all variants of known size v; unchanged if v is None."""
        if v is None:
            return self
        variants = tuple(replace(group, fixed_size=v) for group in self.variants)
        return replace(self, variants=variants)

    def expecting_within(self, spans: Sequence[tuple[float, float]]) -> Cause:
        """The cause with additional variants that begin within some spans, s.

        `spans` are pairs of start and end. The new variants have all axes and one of
        `priors.RESTART_SIZES`, and are `expected`: their prior probability is higher.
        """
        if not (spans and self.variants and self.variants[0].begins_at_instant):
            return self
        all_params = max((g.params for g in self.variants), key=len)
        within = [
            replace(g, typical=v * g.typical, fixed_size=1.0)
            for v in priors.RESTART_SIZES.tolist()
            for g in self.variants
            if g.params == all_params
            and any(a <= at <= b for at in g.shape.values() for a, b in spans)
        ]
        variants = (*self.variants, *within)
        return replace(self, variants=variants, expected=frozenset(within))

    @property
    def event(self) -> str:
        """What happens when it begins; its own name if no other effect comes of it."""
        return self.variants[0].event if self.variants else self.name

    @property
    def usual(self) -> bool:
        """Whether every uncalibrated triad has it."""
        return any(g.effect is not None and g.effect.usual for g in self.variants[:1])

    @property
    def by_window(self) -> bool:
        """Whether it acts on each window separately, as angle errors and offsets do."""
        return self.kind == "position" or self.name in ("window", "position")

    @property
    def reportable(self) -> bool:
        """Whether it is reported as a cause. Noise, which every device has, is not."""
        return self.kind != "noise"

    @property
    def key(self) -> str:
        """Unique among the causes of a session."""
        name = self.name if self.position < 0 else f"{self.name} {self.position}"
        return f"{name}:{self.part}" if self.part else name

    @property
    def name_and_part(self) -> tuple[str, str]:
        """Common to causes that differ only in the position they belong to."""
        return self.name, self.part
