"""The summary of a diagnosis, as one paragraph."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from fieldcal.core.sentences import join_words
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.unknown_mismatch import UnknownMismatch, list_positions
from fieldcal.diagnosis.result import FoundEffect, Mismatch, Quality, Quantity, Verdict
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.physics.effect import Scatter


def with_uncertainty(quantity: Quantity) -> str:
    """A value with its uncertainty and unit, to the second digit of the uncertainty.

    >>> with_uncertainty(Quantity(0.00312, 0.00011, "1"))
    '0.00312 ± 0.00011'
    >>> with_uncertainty(Quantity(1.0040123, 4.2e-6, "1"))
    '1.0040123 ± 4.2e-06'
    """
    if isinstance(quantity.value, str):
        return quantity.value
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    sigma = quantity.sigma
    if sigma is None or not math.isfinite(sigma) or sigma <= 0:
        return f"{quantity.value:.4g}{unit}"
    digits = 1 - math.floor(math.log10(sigma))
    if digits > thresholds.MAX_DECIMALS:
        size = abs(quantity.value) or sigma
        significant = max(math.floor(math.log10(size)) + digits + 1, 2)
        return f"{quantity.value:#.{significant}g} ± {sigma:#.2g}{unit}"
    return f"{quantity.value:.{max(digits, 0)}f} ± {sigma:.{max(digits, 0)}f}{unit}"


def effect_with_parameters(effect: FoundEffect) -> str:
    """An effect with its significant parameters."""
    parts = []
    for name, q in effect.parameters.items():
        if (
            isinstance(q.value, str)
            or not q.sigma
            or abs(q.value) > thresholds.STANDS_OUT * q.sigma
        ):
            parts.append(f"{name} = {with_uncertainty(q)}")
    return f"{effect.id} ({', '.join(parts)})" if parts else effect.id


def paragraph(
    verdict: Verdict,
    effects: Sequence[FoundEffect],
    mismatch: Sequence[Mismatch],
    unknown: Sequence[UnknownMismatch],
    quality: tuple[Quality, Quality, str],
    notes: Sequence[str],
    odd: Sequence[str] = (),
) -> str:
    """Verdict, effects, improvement and doubts in sentences; remedies are in `advice`.

    `odd` are impossible facts of the recording.
    """
    out = [_wrong_description(odd)] if odd else []
    if mismatch or not odd:
        unexplained = [u.mismatch for u in unknown] or mismatch
        out.append(_opening(verdict, effects, unexplained))
    out += [_how_random(f) for f in effects if _is_random(f)]
    if verdict in ("left_out", "ambiguous") and effects:
        out += _improvement(*quality)
    for effect in effects:
        if effect.aliases:
            others = join_words(effect.aliases, "or")
            out.append(f"{others} would explain it as well as {effect.id}.")
    out += dict.fromkeys(_unexplained(u, unknown) for u in unknown)
    return " ".join([*filter(None, out), *notes])


def _wrong_description(odd: Sequence[str]) -> str:
    return f"The description of the recording is wrong: {'; '.join(odd)}."


def _opening(
    verdict: Verdict, effects: Sequence[FoundEffect], unexplained: Sequence[Mismatch]
) -> str:
    listed = _listed(effects)
    if verdict == "consistent":
        return (
            "Recording and simulation agree: beyond bias and scale factor, which were"
            " fitted, this recording shows no effect."
        )
    if verdict == "left_out":
        return f"The simulation leaves out {listed}."
    if verdict == "ambiguous":
        return f"Something is left out, and it may be {listed}." if effects else ""
    where = _places(unexplained)
    omitted = f" Besides, it leaves out {listed}." if listed else ""
    return (
        "Recording and simulation differ, and no effect in the catalogue explains it"
        f" ({where}).{omitted}"
    )


def _listed(effects: Sequence[FoundEffect]) -> str:
    """List of the effects; repeated ones are named once."""
    often = Counter(f.id for f in effects)
    names = [
        effect_with_parameters(f)
        if often[f.id] <= thresholds.MAX_LISTED_OCCURRENCES
        else f"{f.id} ({often[f.id]} times)"
        for f in effects
    ]
    return " and ".join(dict.fromkeys(names))


def _places(mismatch: Sequence[Mismatch]) -> str:
    """Where they differ, the largest difference first, and in which outputs."""
    clearest = sorted(mismatch, key=lambda m: -m.sigma)
    channels: dict[str, list[str]] = {}
    for m in clearest:
        channels.setdefault(_where(m), []).append(m.channel)
    places = [
        f"{join_words(list(dict.fromkeys(off)))}, {where}"
        for where, off in channels.items()
    ]
    more = len(places) - thresholds.MAX_LISTED_PLACES
    return "; ".join(places[: thresholds.MAX_LISTED_PLACES]) + (
        f"; {more} more places" if more > 0 else ""
    )


def _where(m: Mismatch) -> str:
    places = list_positions(m.positions, thresholds.MAX_LISTED_PLACES)
    digits = 0 if m.to_s - m.from_s > 10.0 else 1
    return f"{places}, at {m.from_s:.{digits}f} to {m.to_s:.{digits}f} s"


def _is_random(effect: FoundEffect) -> bool:
    return isinstance(catalogue()[effect.id], Scatter)


def _how_random(effect: FoundEffect) -> str:
    return (
        f"{effect.id} is random: the uncertainties include it, and no equation is"
        " fitted to it."
    )


def _improvement(before: Quality, after: Quality, unit: str) -> list[str]:
    """Decrease of the residuals; empty if the held-out rms does not decrease."""
    if not after.held_out_rms < before.held_out_rms:
        return []
    fell = ""
    if after.rms < before.rms:
        fell = f"rms falls from {before.rms:.2g} to {after.rms:.2g} {unit}, and the "
    return [
        f"With it the {fell}held-out rms falls from {before.held_out_rms:.2g} to"
        f" {after.held_out_rms:.2g} {unit}."
    ]


def _unexplained(mismatch: UnknownMismatch, all_: Sequence[UnknownMismatch]) -> str:
    """A mismatch in a sentence that names all channels with the same mismatch."""
    where = mismatch.mismatch
    if np.isfinite(where.correlation):
        return (
            f"{where.channel} follows {where.covariate} (correlation"
            f" {where.correlation:+.2f}); a smooth function of {mismatch.cause}"
            f" explains {100 * where.share:.0f} % of its variance."
        )
    places = list_positions(where.positions)
    if mismatch.exchanged:
        return exchange_text(mismatch.exchanged).capitalize() + "."
    if mismatch.angle_errors:
        angles = angle_errors_text(mismatch.angle_errors, "had been")
        if len(where.positions) > 1:
            return (
                f"{places.capitalize()} are off in the same way, as if {angles} in each"
                " of them."
            )
        return f"Only {places} is off, as if {angles} there."
    alike = [
        u
        for u in all_
        if (u.cause, u.mismatch.positions) == (mismatch.cause, where.positions)
    ]
    channels = " and ".join(dict.fromkeys(u.mismatch.channel for u in alike))
    verb = "is" if len(alike) == 1 else "are"
    return f"{channels} {verb} off in {places} only."


def exchange_text(pair: Sequence[int]) -> str:
    """Two positions whose angles were exchanged, as part of a sentence.

    >>> exchange_text([3, 6])
    'positions 4 and 7 are exchanged: each was held at the angles of the other'
    """
    one, two = (p + 1 for p in pair)
    return (
        f"positions {one} and {two} are exchanged: each was held at the angles of the"
        " other"
    )


def angle_errors_text(turned: Sequence[tuple[str, Quantity]], verb: str = "was") -> str:
    """Joints with the error of each angle, deg, as part of a sentence.

    >>> angle_errors_text([("α", Quantity(0.21, 0.02, "deg"))])
    'α was off by 0.210 ± 0.020 deg'
    """
    return " and ".join(f"{j} {verb} off by {with_uncertainty(a)}" for j, a in turned)


def setup_notes(explanation: Explanation) -> list[str]:
    """Sentences about turns and base that are no effects of the device."""
    indices_in_file = explanation.source.about.indices_in_file
    ways = [indices_in_file(pair) for pair in explanation.untracked_turns]
    notes = [
        f"The turn from position {start + 1} to {end + 1} is not the one that the"
        " gyroscopes measured: samples may be lost there, or an output ran against its"
        " range; it has no weight"
        for start, end in ways
    ]
    if explanation.base_sinks:
        notes.append(
            "The base turned slowly while it was used, as what it stands on gives way:"
            " each ± includes it; set it on firm ground"
        )
    return notes


def _undecided(explanation: Explanation) -> str:
    """Sentence about an effect that cannot be named, with the likeliest names."""
    posterior = explanation.posterior
    likeliest = [
        f"{name} ({probability:.2f})"
        for name, probability in posterior.ranked_causes()
        if probability > thresholds.MENTIONED and name in catalogue()
    ]
    sentence = (
        "The simulation leaves something out, which this recording shows too weakly to"
        f" name it (probability {1 - posterior.probability_of_noise_alone:.2f})"
    )
    return (
        f"{sentence}; likeliest: {', '.join(likeliest)}."
        if likeliest
        else f"{sentence}."
    )


def notes(explanation: Explanation, left: Sequence[str]) -> list[str]:
    """Further sentences for the user; `left` are parameters left undetermined."""
    out = [_undecided(explanation)] if explanation.undecided else []
    if explanation.shows_earth_rate and not explanation.each_window_shows_earth_rate:
        out.append("The gyroscopes show the Earth's rate, which is taken into account.")
    out += [f"{sentence}." for sentence in setup_notes(explanation)]
    if left:
        out.append(f"These positions do not determine {', '.join(left)}.")
    return out
