"""Effects that a recording shows in addition to the requested parameters.

The search of the diagnosis gives explanations E of the recording, each a set of causes
with its probability. `solve` fits the requested parameters with each set of causes. The
result is the mean over the explanations,

    mean = sum_E P(E) mean_E,   cov = sum_E P(E) [cov_E + off_E off_E^T]           (1)

so an interval includes the uncertainty of the cause. Source: Hoeting, Madigan, Raftery
and Volinsky 1999 for (1).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from fieldcal.calibration.names import TILTS
from fieldcal.core.samples import CHANNELS
from fieldcal.effects import catalogue
from fieldcal.model import priors, thresholds, tolerances
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.effect_causes import (
    groups_at_points,
    parameter_groups,
    shape_points,
)
from fieldcal.model.causes.random_causes import random_causes
from fieldcal.model.causes.unknown_causes import unknown_causes
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.physics.effect import Effect, Motion, Scatter, Sensor
from fieldcal.physics.experience import Experience


@dataclass(frozen=True, slots=True)
class WeightedExplanation:
    """An explanation of a recording with its probability.

    Attributes
    ----------
    members : its causes, of any dictionary
    probability : probability of the explanation
    possible_members : the same causes on triads that do not show them, and may have
        them
    sizes : size v of each member as found in the recording. It is kept: together with
        the further uncertain parameters here, a new search would find it too small

    """

    members: tuple[Member, ...]
    probability: float
    possible_members: tuple[Member, ...] = ()
    sizes: tuple[float, ...] = ()

    @classmethod
    def of(cls, fitted: Set, probability: float) -> WeightedExplanation:
        """From a set of a search, with the sizes that it has for its causes."""
        sizes = priors.SIZES[list(fitted.sizes.members)].tolist()
        return cls(fitted.members, probability, sizes=tuple(sizes))

    @property
    def sizes_by_key(self) -> dict[str, float]:
        """Size of each cause by its key; empty if not known."""
        keys = [cause.key for cause, _ in self.members]
        return dict(zip(keys, self.sizes, strict=True)) if self.sizes else {}


def translate_explanations(
    d: Dictionary, shown: Sequence[WeightedExplanation], has: set[str]
) -> tuple[WeightedExplanation, ...]:
    """Explanations in the columns of another dictionary, the likeliest first.

    Parameters
    ----------
    d : the dictionary; columns that it lacks are appended
    shown : explanations; those with the same transferred causes become one
    has : names of the effects that the set already contains

    """
    total: dict[frozenset[Group], float] = {}
    own: dict[Group, Cause] = {}
    unseen = _unseen_tilts(shown, has)
    for explanation in shown:
        # one tilt stands for the other, where there are not both
        both_tilts = bool(has & unseen) and unseen <= {
            cause.name for cause, _ in explanation.members
        }
        known = has if both_tilts else has | unseen
        kept = [m for m in explanation.members if _is_missing(m, known)]
        own |= {group: cause for cause, group in kept}
        key = frozenset(group for _, group in kept)
        total[key] = total.get(key, 0.0) + explanation.probability
    least = thresholds.LOOKED_AT * sum(total.values())
    likely = {k: p for k, p in total.items() if p >= least}
    # in their original order: the order of a Python set differs from run to run
    wanted = {g: c for g, c in own.items() if any(g in key for key in likely)}
    size: dict[str, float] = {}
    for explanation in sorted(shown, key=lambda s: s.probability):
        size |= explanation.sizes_by_key
    here = {g: m for g, m in _in_other_dictionary(d, wanted, size)}
    also = list(_of_same_events(d, [c for c, _ in here.values()]))
    out: dict[frozenset[Group], WeightedExplanation] = {}
    for key, p in likely.items():
        members = tuple(m for g, m in here.items() if g in key)
        same = frozenset(g for _, g in members)
        before = out[same].probability if same in out else 0.0
        events = {c.event for c, _ in members}
        maybe = tuple(m for m in also if m[0].event in events)
        out[same] = WeightedExplanation(
            members, before + p / sum(likely.values()), maybe
        )
    return tuple(sorted(out.values(), key=lambda s: -s.probability))


def _unseen_tilts(shown: Sequence[WeightedExplanation], has: set[str]) -> set[str]:
    """Tilts that are not transferred: all if the set has one, otherwise unlikely ones.

    If positions do not show the tilt, the level of the base is stated, or a warning
    says that it is not.
    """
    if has & set(TILTS):
        return set(TILTS)
    share = {
        name: sum(explanation.probability for explanation in shown
                  if any(cause.name == name for cause, _ in explanation.members))
        for name in TILTS
    }  # fmt: skip
    return {name for name, p in share.items() if p < thresholds.NAMED}


def _is_missing(member: Member, has: set[str]) -> bool:
    """Whether the set lacks a cause, so that it has to be transferred."""
    cause, group = member
    if cause.by_window and cause.kind != "position":
        return False  # scatter and bad windows are part of every fit
    effect = group.effect
    if isinstance(effect, Scatter) and not {p.name for p in effect.params} <= set(
        CHANNELS
    ):
        return False  # the uncertainty of angles is always included
    if effect is not None and effect.like_calibration:
        return False  # indistinguishable from the estimated parameters
    carrying = {cause.name, *([effect.carried_by] if effect else [])}
    return not carrying & has


def _in_other_dictionary(
    d: Dictionary, wanted: Mapping[Group, Cause], size: Mapping[str, float]
) -> Iterator[tuple[Group, Member]]:
    """Each group of another dictionary with its member in this one.

    Causes whose size is given by their key take it.
    """
    every: dict[str, Cause] = {}
    if not all(has_equation(g) for g in wanted):
        every = {c.key: c.with_size(size.get(c.key))
                 for c in [*random_causes(d), *unknown_causes(d)]}  # fmt: skip
    new: dict[str, dict[Group, list[Group]]] = {}
    for group, cause in wanted.items():
        if has_equation(group):
            if group.effect is not None and group.effect.acts_on(d.x):
                there = new.setdefault(cause.key, {})
                alike = [there[g] for g in there if _same_but_for_size(g, group)]
                there[group] = alike[0] if alike else _group_variants(d, group)
        elif cause.key in every:
            same = every[cause.key]
            yield group, (same, same.variants[cause.variants.index(group)])
    for cause in {c.key: c for c in wanted.values()}.values():
        pairs = new.get(cause.key, {})
        variants = tuple(dict.fromkeys(v for every in pairs.values() for v in every))
        instants = [(at, at) for g in cause.expected for at in g.shape.values()]
        sized = replace(cause, variants=variants).with_size(size.get(cause.key))
        same = sized.expecting_within(instants)
        for group, own_variants in pairs.items():
            off = (g for g in group.with_same_parameters(same.variants)
                   if g in same.expected and g.shape == group.shape)  # fmt: skip
            own = same.variants[variants.index(own_variants[0])]
            yield group, (same, next(off, own) if group in cause.expected else own)


def _same_but_for_size(one: Group, other: Group) -> bool:
    """Whether two groups differ at most in the size that is known of them."""
    free = (replace(g, fixed_size=None) for g in (one, other))
    (a, b) = (g.identity for g in free)
    return a == b and one.shape == other.shape


def _group_variants(d: Dictionary, group: Group) -> list[Group]:
    """A group of an effect in columns of `d`, followed by its other variants."""
    effect = group.effect
    if not isinstance(effect, Motion | Sensor):
        raise TypeError(f"{group.cause} has no equation")
    whole = next(at for part, at in parameter_groups(d, effect) if part == group.part)
    if isinstance(effect, Motion) or len(whole) > tolerances.MAX_SUBSET_PARAMETERS:
        whole_group = replace(group, params=_in_axes_of(d, group))
        return groups_at_points(d, whole_group, [(group.shape, group.origin)])
    own = (group.shape, group.origin)
    grid = [own, *(point for point in shape_points(d, effect) if point != own)]
    counts = {1, len(whole)} if effect.one_vector else {*range(1, len(whole) + 1)}
    out = [
        whole_group
        if len(params) == len(whole)
        else _with_parameters(whole_group, params)
        for whole_group in groups_at_points(d, replace(group, params=whole), grid)
        for n in sorted(counts)
        for params in combinations(whole, n)
    ]
    return sorted(out, key=lambda g: (g.params, g.shape) != (group.params, group.shape))


def _in_axes_of(d: Dictionary, group: Group) -> tuple[int, ...]:
    """Parameters of an effect in the axes of the parameter set.

    If the orientation is unknown, the axes are chosen so that the parameters that a
    rotation of the device can produce from others are zero. A search keeps all of them;
    a mean of both would be in no axes at all.
    """
    effect = group.effect
    if effect is None or d.x.oriented.any():
        return group.params
    names = [p.name for p in effect.params]
    same = [effect.turned_into.get(names[j], names[j]) for j in group.params]
    return tuple(sorted({names.index(name) for name in same}))


def _of_same_events(d: Dictionary, causes: Sequence[Cause]) -> Iterator[Member]:
    """Effects that often come with others: on the other triad, or of the same event."""
    known = {c.key for c in causes}
    for event in dict.fromkeys(c.event for c in causes if c.kind == "effect"):
        first = next(c for c in causes if c.event == event)
        shown = first.variants[0].effect
        if isinstance(shown, Sensor):
            for effect in _effects_of_event(shown, d.x):
                yield from _begun_with(d, first, effect, known)


def _effects_of_event(shown: Sensor, x: Experience) -> list[Effect]:
    """An effect, and others of the catalogue that come of its event."""
    if not shown.event:
        return [shown]
    every = (e for e in catalogue().values() if e.event == shown.event)
    return [e for e in every if e.acts_on(x)]


def _begun_with(
    d: Dictionary, first: Cause, effect: Effect, known: set[str]
) -> Iterator[Member]:
    """An effect on each triad, beginning as another cause does; none of known keys."""
    group = first.variants[0]
    for part, params in parameter_groups(d, effect):
        other = replace(first, name=effect.id, part=part, chance=effect.chance(d.x))
        if not params or other.key in known:
            continue
        named = replace(group, cause=effect.id, part=part, params=params, effect=effect)
        variants = _group_variants(d, named)
        if effect is not group.effect:
            variants = list(_of_likely_sizes(variants))
        yield replace(other, variants=tuple(variants)), variants[0]


def _of_likely_sizes(variants: Sequence[Group]) -> Iterator[Group]:
    """The variants on all axes, with each of the sizes of a restart.

    Rows that do not show an effect make the smallest size the likeliest one. As none
    of an event that others show, it is as likely to be large.
    """
    axes = max(len(g.params) for g in variants)
    for v in priors.RESTART_SIZES.tolist():
        for group in variants:
            if len(group.params) == axes:
                yield replace(group, typical=v * group.typical, fixed_size=1.0)


def _with_parameters(whole: Group, params: tuple[int, ...]) -> Group:
    """The group with only some of its parameters."""
    at = [whole.params.index(j) for j in params]
    return replace(
        whole, params=params, columns=whole.columns[at], typical=whole.typical[at]
    )


def has_equation(group: Group) -> bool:
    """Whether the group belongs to an effect that has an equation."""
    return isinstance(group.effect, Motion | Sensor)
