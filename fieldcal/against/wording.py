"""A comparison in sentences and in rows of a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fieldcal.against.result import (
    Difference,
    Direction,
    RealAndSimulated,
    SimulatorPrediction,
)
from fieldcal.calibration.wording import format_unit
from fieldcal.core.sentences import join_words
from fieldcal.diagnosis.result import Quantity, Verdict
from fieldcal.diagnosis.wording.lines import format_probability, pretty_quantity
from fieldcal.diagnosis.wording.paragraph import with_uncertainty
from fieldcal.model import thresholds

STANDS_OUT = 3.0
"""Standard deviations from which a sentence names a parameter."""

DIRECTION_LEADS: Mapping[Direction, str] = {
    "left_out": "The simulator leaves out",
    "added": "The simulator adds",
    "resized": "Both have, but not alike:",
}

DIRECTION_WORDS: Mapping[Direction, str] = {
    "left_out": "left out", "added": "added", "resized": "another size",
}  # fmt: skip


def paragraph(
    verdict: Verdict,
    differences: Sequence[Difference],
    predicted: tuple[SimulatorPrediction, SimulatorPrediction],
    parts: str = "Positions",
    possible: Sequence[Difference] = (),
) -> str:
    """Verdict, differences and their effect on the prediction, in sentences.

    `parts` names what was held out, positions or stretches; `possible` are differences
    that are not probable enough to be reported.
    """
    if verdict == "consistent":
        return (
            "Recording and simulator agree: the simulator predicts the recording with"
            f" χ²/dof {predicted[0].chi2_per_dof:.2f}, and {_nothing_else(possible)}."
        )
    out = []
    for direction, lead in DIRECTION_LEADS.items():
        some = [d for d in differences if d.direction == direction]
        if some:
            out.append(f"{lead} {'; '.join(map(difference_with_parameters, some))}.")
    out += [_other_direction(d) for d in differences if is_direction_open(d)]
    unseen = [d.id for d in differences if not d.shown]
    if unseen:
        out.append(
            f"The other recording could not have shown {', '.join(unseen)}: whether it"
            " is there as well is not known."
        )
    return " ".join([*out, _predicted(*predicted, parts)])


def _nothing_else(possible: Sequence[Difference]) -> str:
    perhaps = [
        f"{one.id.replace('_', ' ')} (P {one.probability:.2f})"
        for one in possible
        if one.shown
    ]
    if not perhaps:
        return "nothing differs that these recordings can show"
    return f"nothing differs for certain, but {join_words(perhaps)} may"


def is_direction_open(one: Difference) -> bool:
    """Whether it is not certain which of the two has an effect."""
    return one.direction_probability < thresholds.DIFFERS


def _other_direction(one: Difference) -> str:
    """Sentence about a direction that is not certain."""
    name, sure = one.id.replace("_", " "), one.direction_probability
    if one.direction == "resized":
        return (
            f"That both have {name} is not certain (P {sure:.2f}): one of them may have"
            " nothing of it."
        )
    other = "recording" if one.direction == "added" else "simulator"
    return (
        f"That the {other} has nothing of {name} is not certain (P {sure:.2f}): it may"
        " have too little."
    )


def _predicted(
    before: SimulatorPrediction, after: SimulatorPrediction, parts: str
) -> str:
    said = []
    for one, two, unit in (
        (before.rms_acc, after.rms_acc, "m/s^2"),
        (before.rms_gyr, after.rms_gyr, "rad/s"),
    ):
        if one == one and two == two:
            said.append(f"{one:.2g} to {two:.2g} {unit}")
    return (
        f"{parts} that it was not fitted to are predicted with what was found: the rms"
        f" goes from {' and from '.join(said)}, χ²/dof from"
        f" {before.chi2_per_dof:.3g} to {after.chi2_per_dof:.3g}."
    )


def difference_with_parameters(one: Difference) -> str:
    """A difference with its significant parameters."""
    told = []
    for name, pair in one.parameters.items():
        off = pair.difference
        if isinstance(off.value, str):
            told.append(f"{name} {off.value}")
        elif not off.sigma or abs(off.value) > STANDS_OUT * off.sigma:
            told.append(_parameter_in_words(name, one.direction, pair))
    name, sizes = one.id.replace("_", " "), f" ({', '.join(told)})" if told else ""
    return f"{name}{sizes}{_or_else(one)}"


def possible_difference(one: Difference) -> str:
    """Sentence about a difference that is not probable enough to be reported."""
    if not one.shown:
        who = "recording" if one.direction == "added" else "simulator"
        return (
            f"{difference_with_parameters(one)} is not compared: nothing in the output"
            f" of the {who} would show it"
        )
    return (
        f"{difference_with_parameters(one)} may differ, with a probability of"
        f" {one.probability:.2f}; from"
        f" {thresholds.DIFFERS} on it counts as a difference. A longer recording would"
        " tell"
    )


def _or_else(one: Difference) -> str:
    """The aliases of a difference, as part of a sentence."""
    names = " or ".join(alias.replace("_", " ") for alias in one.aliases)
    return f", or {names}" if names else ""


def _parameter_in_words(name: str, direction: Direction, pair: RealAndSimulated) -> str:
    """A parameter in words: its value where only one has it, else its difference."""
    alone = pair.simulator if direction == "added" else pair.real
    if direction != "resized" and alone is not None:
        return f"{name} = {with_uncertainty(alone)}"
    return f"{name} by {with_sign(pair.difference)}"


def with_sign(quantity: Quantity) -> str:
    """A difference with its sign and uncertainty."""
    text = with_uncertainty(quantity)
    plus = not isinstance(quantity.value, str) and quantity.value >= 0
    return f"+{text}" if plus else text


def difference_rows(
    found: Sequence[Difference],
) -> list[tuple[str, str, str, str, str]]:
    """Rows of a table; repeated differences are one row, with the most significant.

    Columns: what, direction, size in each, difference, probability.
    """
    alike: dict[tuple[str, str, str], list[Difference]] = {}
    for one in found:
        part = "".join(one.parameters) if one.id == "noise" else ""
        alike.setdefault((one.id, one.direction, part), []).append(one)
    out = []
    for some in alike.values():
        what, who, size, off = difference_row(max(some, key=_clearest))
        often = f" ({len(some)} times)" if len(some) > 1 else ""
        sure = format_probability(min(one.probability for one in some))
        out.append((what + often, who, size, off, sure))
    return out


def _clearest(one: Difference) -> float:
    return max((p.difference.sigmas for p in one.parameters.values()), default=0.0)


def difference_row(one: Difference) -> tuple[str, str, str, str]:
    """One row of the table: what, direction, size in each, difference."""
    who = DIRECTION_WORDS[one.direction] + ("?" if is_direction_open(one) else "")
    told = {
        n: p
        for n, p in (one.sizes or one.parameters).items()
        if not isinstance(p.difference.value, str)
    }
    what = one.id.replace("_", " ") + _or_else(one)
    if not told:
        return what, who, "", ""
    name = max(told, key=lambda n: told[n].difference.sigmas)
    pair = told[name]
    more = sum(p.difference.sigmas > STANDS_OUT for p in told.values()) - 1
    also = f" (+{more})" if more > 0 else ""
    both = (
        "real "
        + _quantity_or_none(pair.real)
        + ", simulator "
        + _quantity_or_none(pair.simulator)
    )
    return (
        what,
        who,
        f"{name}: {both}{also}",
        format_unit(with_sign(pair.difference)),
    )


def _quantity_or_none(quantity: Quantity | None) -> str:
    return "none" if quantity is None else pretty_quantity(quantity)
