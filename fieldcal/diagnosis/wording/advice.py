"""What to do in the field next, in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.core.positions import ladder_settings
from fieldcal.core.sentences import join_words
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.unknown_mismatch import UnknownMismatch, list_positions
from fieldcal.diagnosis.result import FoundEffect, Mismatch
from fieldcal.diagnosis.wording.deciding_position import (
    deciding_position,
    ladder_extent,
)
from fieldcal.diagnosis.wording.paragraph import angle_errors_text
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.physics.effect import Chain, Scatter


def advice(
    explanation: Explanation,
    effects: Sequence[FoundEffect],
    unknown: Sequence[UnknownMismatch],
    mismatch: Sequence[Mismatch],
    odd: Sequence[str],
) -> Iterator[str]:
    """Sentences, the most urgent first; `mismatch` names positions as listed.

    `odd` are impossible facts of the recording.
    """
    if odd:
        yield (
            "Correct session.toml with the drawing on the device and its data sheet"
            " (axes, signs, units, angles), and diagnose again: until then no other"
            " effect can be found."
        )
    yield from advice_on_mismatches(unknown)
    if explanation.undecided:
        yield (
            "Record again with more positions, or longer ones: the simulation leaves"
            " something out, but too weakly to name it."
        )
    yield from _how_to_decide(explanation, effects)
    for name in dict.fromkeys(f.id for f in effects):
        yield _cure(name, mismatch)
    known = dict.fromkeys(f.id for f in effects if not f.aliases and _deterministic(f))
    if known and not unknown:
        ids = ", ".join(f'"{i}"' for i in known)
        yield (
            f"To simulate it: put effects = [{ids}] with the values found into [model]"
            " of session.toml, or keep the device file that --twin writes."
        )
    if any(isinstance(catalogue()[f.id], Scatter) for f in effects):
        yield "Hold more positions, or hold them longer: random errors average out."
    held = len(explanation.dictionary.window_positions)
    if held < thresholds.MIN_ALIKE:
        yield f"Record more than {held} position{'s' * (held > 1)}: so few show little."


def _cure(name: str, mismatch: Sequence[Mismatch]) -> str:
    """What to do about an effect; for a fault of samples, also where it was."""
    effect = catalogue()[name]
    places = {
        p
        for m in mismatch
        if (m.kind, m.covariate) == (effect.seen_in, effect.covariate)
        for p in m.positions
    }
    if not isinstance(effect, Chain) or not places:
        return f"{name}: {effect.cure}"
    listed = list_positions(sorted(places), thresholds.MAX_LISTED_PLACES)
    return f"{name} at {listed}: {effect.cure}"


def _how_to_decide(
    explanation: Explanation, effects: Sequence[FoundEffect]
) -> Iterator[str]:
    """How to distinguish an effect from its aliases, one sentence for each way."""
    for effect in effects:
        ways: dict[str, list[str]] = {}
        open_ = []
        for other in effect.aliases:
            place = deciding_position(explanation, effect.id, other)
            if place is None:
                open_.append(other)
            else:
                apart = f"{other} ({place.apart:.0f} σ apart there)"
                ways.setdefault(place.text, []).append(apart)
        for way, others in ways.items():
            alternatives = join_words(others, "and")
            yield f"{_capital(way)}: it distinguishes {effect.id} from {alternatives}."
        if open_:
            yield (
                f"{effect.id} or {join_words(open_, 'or')}?"
                f" {_none_in_reach(explanation)}"
                f"{catalogue()[effect.id].decided_by}."
            )


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]


def _none_in_reach(explanation: Explanation) -> str:
    """Beginning of a sentence: no position of the ladder decides, if any is known."""
    positions = explanation.source.about.positions
    if not explanation.rows.x.oriented.all() or not ladder_settings(positions):
        return "To decide: "
    return f"No position {ladder_extent(positions)} decides; what does: "


def advice_on_mismatches(unknown: Sequence[UnknownMismatch]) -> Iterator[str]:
    """What to do about unexplained mismatches, one sentence for each remedy."""
    alike: dict[tuple[str, str], list[str]] = {}
    for mystery in unknown:
        alike.setdefault(_remedy(mystery), []).append(mystery.mismatch.channel)
    for (what, why), names in alike.items():
        once = list(dict.fromkeys(names))
        several = len(once) > 1
        yield what + why.format(
            channels=join_words(once, "and"),
            follow="follow" if several else "follows",
            be="are" if several else "is",
        )


MISMATCH_REMEDIES = {
    "time": (
        "Hold one position for longer, and record the temperature",
        "the time, as biases do that follow a temperature",
    ),
    "temperature": (
        "Heat and cool the device in one position, each at half the pace",
        "the temperature",
    ),
    "since turn": (
        "Turn away from a position and back, and hold it for longer",
        "the time since the turn",
    ),
    "force": (
        "Hold positions in which each axis feels other parts of gravity",
        "the specific force",
    ),
    "force and time": (
        "Hold the first positions once more at the end",
        "a specific force whose effect changes with time",
    ),
    "alpha": ("Hold more angles α at one angle β", "the angle α"),
    "beta": ("Hold more angles β at one angle α", "the angle β"),
    "joints": ("Hold each angle α with each angle β", "both angles together"),
}
"""Remedy for a mismatch by the covariate that it follows, and that covariate."""


def _remedy(unknown: UnknownMismatch) -> tuple[str, str]:
    """Remedy for a mismatch, and its reason with placeholders for the channels."""
    places = list_positions(unknown.mismatch.positions)
    if unknown.exchanged:
        one, two = (p + 1 for p in unknown.exchanged)
        return (
            f"Exchange the angles of positions {one} and {two} in session.toml",
            ": each was held at those of the other.",
        )
    if unknown.angle_errors and len(unknown.mismatch.positions) > 1:
        joints = join_words([joint for joint, _ in unknown.angle_errors], "and")
        return (
            f"Set the angle {joints} of {places} again and repeat these positions",
            f": {angle_errors_text(unknown.angle_errors)} in each of them.",
        )
    if unknown.angle_errors:
        return (
            f"Set {places} again and repeat it",
            f": {angle_errors_text(unknown.angle_errors)} there.",
        )
    what, follows = MISMATCH_REMEDIES.get(unknown.cause, ("", ""))
    if not what or not np.isfinite(unknown.mismatch.correlation):
        return (
            f"Repeat {places}, and look for what was different there",
            ": {channels} {be} off only there.",
        )
    return (
        what,
        f": {{channels}} {{follow}} {follows}, and no effect in the catalogue does.",
    )


def _deterministic(effect: FoundEffect) -> bool:
    return not isinstance(catalogue()[effect.id], Scatter | Chain)
