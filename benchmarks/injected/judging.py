"""What a diagnosis lost, found and invented when something was added."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fieldcal.diagnosis import Diagnosis
from fieldcal.diagnosis.result import FoundEffect

ALWAYS = frozenset({"earth_rate"})
"""True of every session, so never a false alarm."""

LINE_HZ = 0.25
"""How near a line must be to the one that was added."""

LATE_S = 0.5
"""How far a stretch may be beside the one that was added."""

CONTROL = "thermometer"
"""A case in which nothing that could be named is added."""


@dataclass(frozen=True)
class Outcome:
    """What became of one recording with one effect in it.

    Attributes
    ----------
    effect, recording, sigmas, seed : of the case
    added : what was added, a few words
    already : whether the untouched diagnosis says the effect
    named, aliased : whether it is named now, or is an alias of what is named now
    lost : what the untouched diagnosis says and this one does not
    invented : what only this one says and is not there
    said : everything that it says, and the verdict
    seconds : that it took

    """

    effect: str
    recording: str
    sigmas: float
    seed: int
    added: str
    already: bool
    named: bool
    aliased: bool
    lost: tuple[str, ...]
    invented: tuple[str, ...]
    said: str
    seconds: float

    @property
    def missed(self) -> bool:
        """Whether what was added is not said."""
        return self.effect != CONTROL and not (
            self.already or self.named or self.aliased
        )

    @property
    def right(self) -> bool:
        """Whether nothing was missed, lost or invented."""
        return not (self.missed or self.lost or self.invented)


def said(told: Diagnosis) -> set[str]:
    """Ids of what a diagnosis names, with the aliases."""
    return {i for e in told.effects for i in (e.id, *e.aliases)}


def lost(before: Diagnosis, after: Diagnosis) -> tuple[str, ...]:
    """What is said before and not after, not even by an alias."""
    there = said(after)
    gone = [e.id for e in before.effects if not {e.id, *e.aliases} & there]
    if before.verdict != "consistent" == after.verdict:
        gone.append("the verdict")
    return tuple(dict.fromkeys(gone))


def invented(before: Diagnosis, after: Diagnosis, effect: str) -> tuple[str, ...]:
    """What is named after, neither before nor added, nor stands for what was."""
    known = said(before) | ALWAYS | {effect}
    out = [e.id for e in after.effects if not {e.id, *e.aliases} & known]
    if after.verdict == "unexplained" != before.verdict:
        out.append("unexplained")
    return tuple(dict.fromkeys(out))


def matches(found: FoundEffect, effect: str, where: Mapping[str, float | str]) -> bool:
    """Whether an effect that was found is the one that was added."""
    if found.id != effect:
        return False
    value = {n: q.value for n, q in found.parameters.items()}
    if "parameter" in where and where["parameter"] not in value:
        return False
    if "channel" in where and value.get("channel") != where["channel"]:
        return False
    if "hz" in where:
        return abs(float(value["hz"]) - float(where["hz"])) < LINE_HZ
    if "at_s" in where:
        start, end = _stretch(value)
        first = float(where["at_s"])
        return start < first + float(where["for_s"]) + LATE_S and end > first - LATE_S
    return True


def _stretch(value: Mapping[str, float | str]) -> tuple[float, float]:
    if "from_s" in value:
        return float(value["from_s"]), float(value["to_s"])
    start = float(value["at_s"])
    return start, start + float(value.get("for_s", 0.0))


def is_said(
    told: Diagnosis, effect: str, where: Mapping[str, float | str]
) -> tuple[bool, bool]:
    """Whether an effect is named, and whether it is only as an alias."""
    named = any(matches(e, effect, where) for e in told.effects)
    aliased = any(effect in e.aliases for e in told.effects)
    return named, aliased and not named


def summary(told: Diagnosis) -> str:
    """What a diagnosis says, in a few words."""
    each = [
        e.id + (f" ({', '.join(e.aliases)})" if e.aliases else "") for e in told.effects
    ]
    return f"{told.verdict}: {' + '.join(dict.fromkeys(each)) or 'nothing'}"
