"""Whether a diagnosis says what was concealed, and how far its numbers are off."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.concealed.sessions import Session
from fieldcal.diagnosis import Diagnosis
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Line

ALWAYS = frozenset({"earth_rate"})
"""True of every session, so never a false alarm."""

AS_WELL = {name: frozenset({"bump"}) for name in ("base_step", "mount_slip")}
"""What else is there with an effect: what is knocked, or slips, is bumped."""


@dataclass(frozen=True)
class Outcome:
    """What became of one session.

    Attributes
    ----------
    label, sigmas, seed : of the session
    verdict : of the diagnosis
    named : what it named, with the aliases it gave
    right : whether that is what was concealed
    aliased : whether it is so by an alias only
    extra : effects named that are not there
    pulls : (value - truth) / sigma of every number given, by its name
    before, after : held-out rms
    seconds : that the diagnosis took
    where : channels and kinds of the largest mismatches
    claims : probability of the verdict and of each effect that was named, with whether
        it is so

    """

    label: str
    sigmas: float
    seed: int
    verdict: str
    named: dict[str, tuple[str, ...]]
    right: bool
    aliased: bool
    extra: tuple[str, ...] = ()
    pulls: dict[str, float] = field(default_factory=dict)
    before: float = np.nan
    after: float = np.nan
    seconds: float = np.nan
    where: tuple[str, ...] = ()
    claims: tuple[tuple[float, bool], ...] = ()


def judged(session: Session, seed: int, told: Diagnosis, seconds: float) -> Outcome:
    """Hold a diagnosis against what was concealed."""
    named = {e.id: tuple(e.aliases) for e in told.effects}
    where = tuple(f"{m.channel} {m.kind}" for m in told.mismatch[:3])
    extra = _extra(session, named)
    right, aliased = _right(session, told.verdict, named, where)
    return Outcome(
        session.label,
        session.sigmas,
        seed,
        told.verdict,
        named,
        right,
        aliased,
        extra,
        dict(_pulls(session, told)),
        told.before.held_out_rms,
        told.after.held_out_rms,
        seconds,
        where,
        ((told.probability, right), *_claims(session, told)),
    )


def _claims(session: Session, told: Diagnosis) -> Iterator[tuple[float, bool]]:
    """Probability of each effect that is named by evidence, and whether it is there."""
    truth = set(session.concealed) | _anyway(session)
    for one in told.effects:
        if one.id not in ALWAYS:
            yield one.probability, bool(truth & {one.id, *one.aliases})


def _anyway(session: Session) -> frozenset[str]:
    """Effects that are true of a session and not asked for."""
    more = (AS_WELL.get(name, frozenset()) for name in session.concealed)
    return ALWAYS.union(*more)


def _right(
    session: Session,
    verdict: str,
    named: dict[str, tuple[str, ...]],
    where: tuple[str, ...],
) -> tuple[bool, bool]:
    truth = set(session.concealed)
    if session.added is not None:
        located = bool(where) and where[0].split()[0] == session.channel
        return verdict == "unexplained" and located, False
    extra = _extra(session, named)
    if not truth:
        return not extra and verdict in ("consistent", "left_out"), False
    said = set(named).union(*named.values()) if named else set()
    good = truth <= said and not extra and verdict in ("left_out", "ambiguous")
    return good, good and not truth <= set(named)


def _extra(session: Session, named: dict[str, tuple[str, ...]]) -> tuple[str, ...]:
    """Effects that are named and not there, nor stand for one that is."""
    truth = set(session.concealed)
    return tuple(
        name
        for name, others in named.items()
        if name not in truth | _anyway(session) and not truth & set(others)
    )


def _pulls(session: Session, told: Diagnosis) -> Iterator[tuple[str, float]]:
    """How far numbers are off, in their standard deviations."""
    for effect in told.effects:
        truth = session.concealed.get(effect.id)
        if not truth:  # not there, or several of it
            continue
        if not session.angles:
            truth = _by_own_axes(effect.id, truth, set(effect.parameters))
        for name, quantity in effect.parameters.items():
            value, sigma = quantity.value, quantity.sigma
            if isinstance(value, str) or not sigma:
                continue
            there = truth.get(name, 0.0)
            if isinstance(catalogue()[effect.id], Line):
                there = abs(there)  # each channel has a phase, which takes the sign
            yield f"{effect.id}.{name}", (value - there) / sigma


def _by_own_axes(
    name: str, truth: Mapping[str, Any], told: set[str]
) -> Mapping[str, Any]:
    """Parameters in the axes that a device has where nothing says how it stood.

    Axes turned by an angle take from one coefficient what they give to its mirror:
    where one of the two is told alone, it stands for both.
    """
    out = dict(truth)
    for gone, taker in getattr(catalogue()[name], "turned_into", {}).items():
        if taker in told and gone not in told:
            out[taker] = out.get(taker, 0.0) + out.pop(gone, 0.0)
    return out
