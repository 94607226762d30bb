"""Differences in what explains the windows and turns of both recordings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.against.joint import (
    Relation,
    apart,
    as_large,
    both,
    likeliest,
    proportional,
    weighed,
)
from fieldcal.against.pairing import Pairing
from fieldcal.against.result import Difference, Direction, RealAndSimulated
from fieldcal.against.side import Side
from fieldcal.against.widened import Widened, on_all_axes
from fieldcal.core.samples import Array
from fieldcal.diagnosis.findings import found_effects, mismatches
from fieldcal.diagnosis.result import Mismatch, Quantity
from fieldcal.effects import catalogue
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.reported import reported
from fieldcal.model.search.selection import Search
from fieldcal.physics.effect import CHANCE, Motion, Scatter, Sensor

DIRECTION: dict[Relation, Direction] = {
    "real": "left_out", "simulator": "added", "other": "resized",
}  # fmt: skip


@dataclass(frozen=True)
class Decided:
    """The causes of two sessions, with what each has.

    Attributes
    ----------
    pairing : of the sessions
    relations : of each cause by its key, with the probability that they differ
    real, sim : each session with the causes that it has

    """

    pairing: Pairing
    relations: dict[str, tuple[Relation, float]]
    real: Widened
    sim: Widened


def decided(pairing: Pairing) -> Decided:
    """Weigh for each cause who has it."""
    relations = {key: _relation(pairing, key) for key in pairing.keys}
    real, sim = pairing.asked
    ours, theirs = (
        [k for k, (r, _) in relations.items() if r not in (alone, "neither")]
        for alone in ("simulator", "real")
    )
    return Decided(pairing, relations, _with(real, ours), _with(sim, theirs))


def _relation(pairing: Pairing, key: str) -> tuple[Relation, float]:
    """The likeliest relation as to one cause, and the probability of a difference."""
    real, sim = pairing.asked
    one, two = real.told(key), sim.told(key)
    member = real.member(key) or sim.member(key)
    alike = scaled = None
    if one and two and member:
        if member[0].kind in ("random", "unknown"):
            alike = as_large(one, two)
        else:
            scaled = proportional(one, two)
    if pairs := pairing.with_shape_of(key):
        told = [(a.told(key), b.told(key)) for a, b in pairs]
        alike = max(both(a, b) for a, b in told if a is not None and b is not None)
    chance = member[0].chance if member is not None else CHANCE
    found = weighed(one, two, chance, alike, scaled)
    differ = apart(found)
    if differ < thresholds.NAMED:
        none: list[Relation] = ["same", "neither"]
        return max(none, key=lambda n: found.get(n, 0.0)), differ
    return likeliest(found), differ


def _with(there: Widened, keys: Sequence[str]) -> Widened:
    """A session with some of its causes, and the numbers that it then has."""
    some = tuple(m for m in there.set.members if m[0].key in keys)
    kept = tuple(map(on_all_axes, some))
    found = there.search.evaluated(kept, Search.sizes_of(there.set, some))
    return replace(there, set=found, told_from=reported(there.search, found))


def differences(found: Decided) -> Iterator[Difference]:
    """What differs, each name and direction once: triads are put together."""
    parts: dict[tuple[str, Direction], list[str]] = {}
    for key, (relation, probability) in found.relations.items():
        if relation in DIRECTION and probability >= thresholds.NAMED:
            member = _of(found, key)
            parts.setdefault((member[0].name, DIRECTION[relation]), []).append(key)
    for (name, direction), keys in parts.items():
        yield _difference(found, name, direction, keys)


def alike(found: Decided) -> tuple[str, ...]:
    """Names of what both have to the same size."""
    names = [
        _of(found, k)[0].name for k, (r, _) in found.relations.items() if r == "same"
    ]
    return tuple(dict.fromkeys(names))


def _of(found: Decided, key: str) -> Member:
    member = next(
        (m for one in found.pairing.asked if (m := one.member(key)) is not None), None
    )
    if member is None:
        raise KeyError(key)
    return member


def _difference(
    found: Decided, name: str, direction: Direction, keys: Sequence[str]
) -> Difference:
    pairing, (real, sim) = found.pairing, found.pairing.asked
    source = pairing.sim if direction == "added" else pairing.real
    other = real if direction == "added" else sim
    parameters: dict[str, RealAndSimulated] = {}
    for key in keys:
        parameters |= _pairs(found.real.member(key), found.sim.member(key), found)
    told = [other.told(key) for key in keys]
    return Difference(
        id=name,
        direction=direction,
        probability=max(found.relations[k][1] for k in keys),
        parameters=parameters,
        aliases=_aliases(source, pairing.instead.get(name, name)),
        where=_where(source, pairing.instead.get(name, name)),
        shown=any(t is not None and t.shows for t in told),
        explained=name in catalogue(),
    )


def _pairs(
    one: Member | None, two: Member | None, found: Decided
) -> dict[str, RealAndSimulated]:
    """Parameters of a cause in both sessions, as far as one determines them.

    Of what is in both to another size, one may show too little to tell a size by
    itself: its numbers, which would be too small, are told with that of the other.
    """
    real = quantities(found.real, one) if one else {}
    sim = quantities(found.sim, two) if two else {}
    if one and two:
        ours, theirs = _size_of(found.real, one), _size_of(found.sim, two)
        if ours < theirs:
            real |= _of_size(found.real, one, theirs)
        elif theirs < ours:
            sim |= _of_size(found.sim, two, ours)
    return {
        name: RealAndSimulated.of(real.get(name), sim.get(name))
        for name in dict.fromkeys([*real, *sim])
        if (one is None or name in real) and (two is None or name in sim)
    }


def _of_size(there: Widened, member: Member, size: float) -> dict[str, Quantity]:
    """Numbers of a cause with an equation, `size` times as large as is typical."""
    group, told = member[1], there.told(member[0].key)
    if told is None or not isinstance(group.effect, Motion | Sensor):
        return {}
    before = size * group.typical
    known = np.linalg.inv(told.inner + np.eye(len(told.pull)) / size**2)
    covariance = known * np.outer(group.typical, group.typical)
    return _determined(there, group, group.typical * (known @ told.pull), covariance,
                       before)  # fmt: skip


def _determined(
    there: Widened, group: Group, values: Array, covariance: Array, before: Array
) -> dict[str, Quantity]:
    """Parameters (k,) of an effect that the rows tell more of than sizes `before`."""
    effect, sigma = group.effect, np.sqrt(np.diag(covariance))
    if effect is None:
        return {}
    params = [effect.params[j] for j in group.params]
    out = {
        p.name: Quantity(float(v), float(s), p.unit)
        for p, v, s, b in zip(params, values, sigma, before, strict=True)
        if s**2 < thresholds.DETERMINED * b**2
    }
    if there.inference.dictionary.free.all():
        out = found_effects.merge_turned_parameters(
            group, values, covariance, before, out
        )
    return out


def quantities(there: Widened, member: Member) -> dict[str, Quantity]:
    """Numbers of a cause, as far as the rows determine them."""
    group = member[1]
    if group.effect is None:
        return {}
    if isinstance(group.effect, Scatter):
        d = there.inference.dictionary
        return found_effects.random_sizes_of_group(
            there.set, d, group, _size_of(there, member)
        )
    values, covariance = there.estimate(group.columns)
    before = group.sizes(_size_of(there, member))
    out = _determined(there, group, values, covariance, before)
    for shape in group.effect.shapes:
        at = group.shape[shape.name]
        unsure = min(group.unsure, at) if np.isfinite(group.unsure) else None
        out[shape.name] = Quantity(float(at), unsure, shape.unit)
    return out


def _size_of(there: Widened, member: Member) -> float:
    at = there.set.members.index(member)
    return float(priors.SIZES[there.set.sizes.members[at]])


def _aliases(source: Side, name: str) -> tuple[str, ...]:
    """Effects that may stand in the place of one, as its own session says."""
    stands = source.explanation.posterior.instead.get(name, {})
    return tuple(n for n in stands if n in catalogue())


def _where(source: Side, name: str) -> tuple[Mismatch, ...]:
    """Where the one that has a cause shows it; positions as they are listed."""
    explanation = source.explanation
    standing = next((s for s in explanation.probable_causes if s.name == name), None)
    if standing is None:
        return ()
    lost = found_effects.remove_cause(explanation, standing)
    of = mismatches.of_cause if name in catalogue() else mismatches.of_unknown
    numbered = explanation.prepared.source.about.numbered
    return tuple(
        replace(m, positions=tuple(sorted(numbered(m.positions))))
        for m in of(explanation, standing, lost)
    )
