"""Differences in the causes that explain windows and turns of both recordings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.against.calibrations import sides_of_device
from fieldcal.against.cause_values import (
    cause_quantities,
    quantities_at_size,
    size_of_cause,
)
from fieldcal.against.joint import (
    Relation,
    evidence_of_proportional,
    evidence_of_same,
    evidence_of_same_size,
    likeliest_difference,
    probability_of_differing,
    relation_probabilities,
)
from fieldcal.against.one_device import evidence_of_one_device
from fieldcal.against.pairing import CausePairing
from fieldcal.against.result import Difference, Direction, RealAndSimulated
from fieldcal.against.side import DiagnosedRecording
from fieldcal.against.widened import WidenedSet, with_all_parameters
from fieldcal.diagnosis.findings import found_effects, mismatches
from fieldcal.diagnosis.result import Mismatch
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.model.evidence.sizing import Member

DIRECTION: dict[Relation, Direction] = {
    "real": "left_out", "simulator": "added", "other": "resized",
}  # fmt: skip

EQUAL: tuple[Relation, ...] = ("same", "neither")
"""Relations of two sessions that do not differ."""


@dataclass(frozen=True, slots=True)
class DecidedRelation:
    """The likeliest relation of two sessions in one cause.

    Attributes
    ----------
    name : of the relation
    differs : probability that they differ in it
    either : probability that they differ in it, or in what a calibration has like it
    who : probability of `name` among the relations in which they differ

    """

    name: Relation
    differs: float
    either: float
    who: float = 1.0


@dataclass(frozen=True)
class DecidedCauses:
    """The causes of two sessions, and which session has which.

    Attributes
    ----------
    pairing : both sessions, with the causes of either
    relations : of the sessions, by the key of a cause
    real, sim : each session with the causes that it has

    """

    pairing: CausePairing
    relations: dict[str, DecidedRelation]
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
        [k for k, r in relations.items() if r.name not in (alone, "neither")]
        for alone in ("simulator", "real")
    )
    return DecidedCauses(
        pairing, relations, _with_causes(real, ours), _with_causes(sim, theirs)
    )


def _relation(pairing: CausePairing, key: str) -> DecidedRelation:
    """The likeliest relation in one cause."""
    real, sim = pairing.widened
    member = real.member(key) or sim.member(key)
    if member is None:
        raise KeyError(key)
    random = member[0].kind in ("random", "unknown")
    sides = sides_of_device(real, sim, key)
    of_one = evidence_of_one_device(*sides, random)
    found = relation_probabilities(
        real.effect_information(key),
        sim.effect_information(key),
        member[0].chance,
        *_evidence_of_alike_and_scaled(pairing, key, random),
        of_one,
    )
    differ = probability_of_differing(found)
    either = differ
    if _calibration_like(member):
        equal = evidence_of_one_device(*sides, random, differs=0.0)
        either = 1 - sum(
            found.get(n, 0.0) * float(np.exp(equal[n] - of_one[n]))
            for n in EQUAL
            if n in of_one
        )
    if differ < thresholds.NAMED:
        name = max(EQUAL, key=lambda n: found.get(n, 0.0))
        return DecidedRelation(name, differ, either)
    name = likeliest_difference(found)
    return DecidedRelation(name, differ, either, found[name] / differ)


def _evidence_of_alike_and_scaled(
    pairing: CausePairing, key: str, random: bool
) -> tuple[float | None, float | None]:
    """Ln evidence of the same cause in both, and of proportional ones; None if open."""
    one, two = (w.effect_information(key) for w in pairing.widened)
    alike = scaled = None
    if one and two:
        if random:
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
    return alike, scaled


def _calibration_like(member: Member) -> str:
    """Group of the calibration that changes as a cause would change it; or none."""
    effect = member[1].effect
    return "" if effect is None else effect.like_calibration


def _with_causes(there: WidenedSet, keys: Sequence[str]) -> WidenedSet:
    """A session with some of its causes only, and its estimates with these."""
    some = tuple(m for m in there.set.members if m[0].key in keys)
    kept = tuple(map(with_all_parameters, some))
    return there.having(there.sets.evaluate(kept, there.set.sizes_of(some)))


def differences(found: DecidedCauses) -> Iterator[Difference]:
    """Differences, one for each name and direction; triads are combined."""
    parts: dict[tuple[str, Direction], list[str]] = {}
    for key, relation in found.relations.items():
        if relation.name in DIRECTION and relation.differs >= thresholds.NAMED:
            name = _member(found, key)[0].name
            parts.setdefault((name, DIRECTION[relation.name]), []).append(key)
    for (name, direction), keys in parts.items():
        yield _difference(found, name, direction, keys)


def instead_of_calibration(found: DecidedCauses, group: str) -> tuple[str, ...]:
    """Causes that may differ instead of a group of the calibration."""
    return tuple(
        member[0].name
        for key, relation in found.relations.items()
        if _calibration_like(member := _member(found, key)) == group
        and 1 - thresholds.DIFFERS < relation.differs < thresholds.NAMED
    )


def shared_causes(found: DecidedCauses) -> tuple[str, ...]:
    """Names of the causes that both have with the same size."""
    names = [
        _member(found, k)[0].name
        for k, relation in found.relations.items()
        if relation.name == "same"
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
    decided = [found.relations[key] for key in keys]
    aliases = aliases_of(name, _having(pairing, direction), pairing.instead)
    if max(d.differs for d in decided) < thresholds.DIFFERS:
        like = (_calibration_like(_member(found, key)) for key in keys)
        aliases += tuple(dict.fromkeys(filter(None, like)))
    return Difference(
        id=name,
        direction=direction,
        probability=max(d.either for d in decided),
        direction_probability=max(d.who for d in decided),
        parameters=parameters,
        aliases=aliases,
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
        ours, theirs = size_of_cause(found.real, one), size_of_cause(found.sim, two)
        if ours < theirs:
            real |= quantities_at_size(found.real, one, theirs)
        elif theirs < ours:
            sim |= quantities_at_size(found.sim, two, ours)
    return {
        name: RealAndSimulated.of(real.get(name), sim.get(name))
        for name in dict.fromkeys([*real, *sim])
        if (one is None or name in real) and (two is None or name in sim)
    }


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
