"""Differences in the causes that explain windows and turns of both recordings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.against.joint import (
    Relation,
    evidence_of_proportional,
    evidence_of_same,
    evidence_of_same_size,
    likeliest_difference,
    probability_of_differing,
    relation_probabilities,
)
from fieldcal.against.pairing import CausePairing
from fieldcal.against.result import Difference, Direction, RealAndSimulated
from fieldcal.against.side import DiagnosedRecording
from fieldcal.against.widened import WidenedSet, with_all_parameters
from fieldcal.core.samples import Array
from fieldcal.diagnosis.findings import found_effects, mismatches, random_sizes
from fieldcal.diagnosis.result import Mismatch, Quantity
from fieldcal.effects import catalogue
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.model_average import average_over_sizes
from fieldcal.physics.effect import CHANCE, Motion, Scatter, Sensor

DIRECTION: dict[Relation, Direction] = {
    "real": "left_out", "simulator": "added", "other": "resized",
}  # fmt: skip


@dataclass(frozen=True)
class DecidedCauses:
    """The causes of two sessions, and which session has which.

    Attributes
    ----------
    pairing : both sessions, with the causes of either
    relations : relation of the sessions by the key of a cause, with the probability
        that they differ in it
    real, sim : each session with the causes that it has

    """

    pairing: CausePairing
    relations: dict[str, tuple[Relation, float]]
    real: WidenedSet
    sim: WidenedSet

    def both_show(self, key: str) -> bool:
        """Whether both recordings could show a cause of typical size."""
        told = [one.effect_information(key) for one in self.pairing.widened]
        return all(one is not None and one.shows for one in told)


def decide_causes(pairing: CausePairing) -> DecidedCauses:
    """Decide for each cause whether recording and simulator have it."""
    relations = {key: _relation(pairing, key) for key in pairing.keys}
    real, sim = pairing.widened
    ours, theirs = (
        [k for k, (r, _) in relations.items() if r not in (alone, "neither")]
        for alone in ("simulator", "real")
    )
    return DecidedCauses(
        pairing, relations, _with_causes(real, ours), _with_causes(sim, theirs)
    )


def _relation(pairing: CausePairing, key: str) -> tuple[Relation, float]:
    """The likeliest relation in one cause, and the probability of a difference."""
    real, sim = pairing.widened
    one, two = real.effect_information(key), sim.effect_information(key)
    member = real.member(key) or sim.member(key)
    alike = scaled = None
    if one and two and member:
        if member[0].kind in ("random", "unknown"):
            alike = evidence_of_same_size(one, two)
        else:
            scaled = evidence_of_proportional(one, two)
    if pairs := pairing.with_shape_of(key):
        told = [
            (a.effect_information(key), b.effect_information(key)) for a, b in pairs
        ]
        alike = max(
            evidence_of_same(a, b) for a, b in told if a is not None and b is not None
        )
    chance = member[0].chance if member is not None else CHANCE
    found = relation_probabilities(one, two, chance, alike, scaled)
    differ = probability_of_differing(found)
    if differ < thresholds.NAMED:
        none: list[Relation] = ["same", "neither"]
        return max(none, key=lambda n: found.get(n, 0.0)), differ
    return likeliest_difference(found), differ


def _with_causes(there: WidenedSet, keys: Sequence[str]) -> WidenedSet:
    """A session with some of its causes only, and its estimates with these."""
    some = tuple(m for m in there.set.members if m[0].key in keys)
    kept = tuple(map(with_all_parameters, some))
    found = there.sets.evaluate(kept, there.set.sizes_of(some))
    return replace(there, set=found, reported_set=average_over_sizes(there.sets, found))


def differences(found: DecidedCauses) -> Iterator[Difference]:
    """Differences, one for each name and direction; triads are combined."""
    parts: dict[tuple[str, Direction], list[str]] = {}
    for key, (relation, probability) in found.relations.items():
        if relation in DIRECTION and probability >= thresholds.NAMED:
            member = _member(found, key)
            parts.setdefault((member[0].name, DIRECTION[relation]), []).append(key)
    for (name, direction), keys in parts.items():
        yield _difference(found, name, direction, keys)


def shared_causes(found: DecidedCauses) -> tuple[str, ...]:
    """Names of the causes that both have with the same size."""
    names = [
        _member(found, k)[0].name
        for k, (r, _) in found.relations.items()
        if r == "same"
    ]
    return tuple(dict.fromkeys(names))


def _member(found: DecidedCauses, key: str) -> Member:
    member = next(
        (m for one in found.pairing.widened if (m := one.member(key)) is not None), None
    )
    if member is None:
        raise KeyError(key)
    return member


def _difference(
    found: DecidedCauses, name: str, direction: Direction, keys: Sequence[str]
) -> Difference:
    pairing, (real, sim) = found.pairing, found.pairing.widened
    source = pairing.sim if direction == "added" else pairing.real
    other = real if direction == "added" else sim
    parameters: dict[str, RealAndSimulated] = {}
    for key in keys:
        parameters |= _parameter_pairs(
            found.real.member(key), found.sim.member(key), found
        )
    told = [other.effect_information(key) for key in keys]
    return Difference(
        id=name,
        direction=direction,
        probability=max(found.relations[k][1] for k in keys),
        parameters=parameters,
        aliases=aliases_of(name, _having(pairing, direction), pairing.instead),
        where=_mismatches_of_cause(source, pairing.instead.get(name, name)),
        shown=any(t is not None and t.shows for t in told),
        explained=name in catalogue(),
    )


def _parameter_pairs(
    one: Member | None, two: Member | None, found: DecidedCauses
) -> dict[str, RealAndSimulated]:
    """Parameters of a cause in both sessions, as far as they are determined.

    If both have the cause, one session may show too little of it to determine its size.
    Its values, which would be too small, are then estimated with the other's size.
    """
    real = cause_quantities(found.real, one) if one else {}
    sim = cause_quantities(found.sim, two) if two else {}
    if one and two:
        ours, theirs = _size_of(found.real, one), _size_of(found.sim, two)
        if ours < theirs:
            real |= _quantities_at_size(found.real, one, theirs)
        elif theirs < ours:
            sim |= _quantities_at_size(found.sim, two, ours)
    return {
        name: RealAndSimulated.of(real.get(name), sim.get(name))
        for name in dict.fromkeys([*real, *sim])
        if (one is None or name in real) and (two is None or name in sim)
    }


def _quantities_at_size(
    there: WidenedSet, member: Member, size: float
) -> dict[str, Quantity]:
    """Parameters of a cause with an equation, given `size` in units of typical."""
    group, told = member[1], there.effect_information(member[0].key)
    if told is None or not isinstance(group.effect, Motion | Sensor):
        return {}
    before = size * group.typical
    known = np.linalg.inv(told.inner + np.eye(len(told.rhs)) / size**2)
    covariance = known * np.outer(group.typical, group.typical)
    values = group.typical * (known @ told.rhs)
    return _determined_parameters(there, group, values, covariance, before)


def _determined_parameters(
    there: WidenedSet, group: Group, values: Array, covariance: Array, before: Array
) -> dict[str, Quantity]:
    """Parameters (k,) of an effect that the rows determine.

    That is: their variance is clearly less than that of the prior, `before` (k,).
    """
    effect, sigma = group.effect, np.sqrt(np.diag(covariance))
    if effect is None:
        return {}
    params = [effect.params[j] for j in group.params]
    out = {
        p.name: Quantity(float(v), float(s), p.unit)
        for p, v, s, b in zip(params, values, sigma, before, strict=True)
        if s**2 < thresholds.DETERMINED * b**2
    }
    if there.fit.dictionary.unoriented.all():
        out = found_effects.merge_turned_parameters(
            group, values, covariance, before, out
        )
    return out


def cause_quantities(there: WidenedSet, member: Member) -> dict[str, Quantity]:
    """Parameters of a cause that the rows determine."""
    group = member[1]
    if group.effect is None:
        return {}
    if isinstance(group.effect, Scatter):
        d = there.fit.dictionary
        return random_sizes.random_sizes_of_group(
            there.set, d, group, _size_of(there, member)
        )
    values, covariance = there.estimate(group.columns)
    before = group.prior_sigma(_size_of(there, member))
    out = _determined_parameters(there, group, values, covariance, before)
    for shape in group.effect.shapes:
        at = group.shape[shape.name]
        unsure = min(group.shape_sigma, at) if np.isfinite(group.shape_sigma) else None
        out[shape.name] = Quantity(float(at), unsure, shape.unit)
    return out


def _size_of(there: WidenedSet, member: Member) -> float:
    at = there.set.members.index(member)
    return float(priors.SIZES[there.set.sizes.members[at]])


def _having(pairing: CausePairing, direction: Direction) -> list[DiagnosedRecording]:
    """The recordings that have an effect."""
    some = {"left_out": [pairing.real], "added": [pairing.sim]}
    return some.get(direction, [pairing.real, pairing.sim])


def aliases_of(
    name: str, having: Sequence[DiagnosedRecording], instead: Mapping[str, str]
) -> tuple[str, ...]:
    """Effects that explain as well what an effect explains, in any recording with it.

    `instead` has the name by which a recording knew the effect before it got that of
    the other recording; it is an alias itself.
    """
    out: dict[str, None] = {}
    for one in having:
        alternatives = one.explanation.posterior.alternatives
        own = instead.get(name, name)
        own = own if own in alternatives else name
        if own in alternatives:
            out |= dict.fromkeys([own, *alternatives[own]])
    return tuple(n for n in out if n != name and n in catalogue())


def _mismatches_of_cause(source: DiagnosedRecording, name: str) -> tuple[Mismatch, ...]:
    """Mismatches that a cause makes in its session; positions as in session.toml."""
    explanation = source.explanation
    standing = next((s for s in explanation.probable_causes if s.name == name), None)
    if standing is None:
        return ()
    lost = found_effects.remove_cause(explanation, standing)
    of = mismatches.of_cause if name in catalogue() else mismatches.of_unknown
    indices_in_file = explanation.prepared.source.about.indices_in_file
    return tuple(
        replace(m, positions=tuple(sorted(indices_in_file(m.positions))))
        for m in of(explanation, standing, lost)
    )
