"""Sentences about the noise of a device, for the terminal and the report."""

from __future__ import annotations

import math
from datetime import datetime, timedelta

from fieldcal.calibration.wording import format_with_sigma
from fieldcal.noise.document import NoiseResult
from fieldcal.noise.recalibration import CHANCES

PROCESSES = {
    "N": "white",
    "B": "instability",
    "K": "walk",
    "Q": "quantisation",
    "R": "ramp",
    "G": "Gauss-Markov",
}
TRIADS = (("a", "accelerometers"), ("g", "gyroscopes"))


def value_or_bound(value: float, sigma: float) -> str:
    """A parameter of another program with its ±; as a bound where sigma is nan."""
    return f"{value:.3g} ± {sigma:.1g}" if math.isfinite(sigma) else f"< {value:.2g}"


def consequences(found: NoiseResult) -> list[str]:
    """Sentences: factor of the filter noise, date of recalibration, gyrocompassing.

    The date is that of the first bias that leaves its limit.
    """
    left = max(c.pair.left_out for c in found.model.channels.values())
    out = [
        f"white noise and walk that filters are told are {left:.2f} times the fitted"
        " ones at most: what the two leave out",
        f"recalibrate: {_recalibration_sentence(found)}",
    ]
    if found.alignment is not None:
        seconds, sigma, spread = found.alignment.best
        angle = " ± ".join(format_with_sigma(math.degrees(sigma), math.degrees(spread)))
        out.append(
            f"north by gyrocompassing, by noise alone: {angle}° after {seconds:.0f} s;"
            " what a bias has changed by since its calibration adds to it"
        )
    return out


def _recalibration_sentence(found: NoiseResult) -> str:
    """When the first bias leaves its limit, and from what that follows."""
    first = min(found.recalibrate, key=lambda n: found.recalibrate[n].seconds[0])
    when = found.recalibrate[first]
    sure = f"{100 * CHANCES[0]:.0f} %"
    if (when.by_ramp or when.by_unseen_walk) and math.isfinite(when.seconds[0]):
        why = "by a walk that this recording would not show: a longer one tells more"
        if when.by_ramp:
            why = "if the ramp of this recording goes on: a longer one tells whether"
        return (
            f"by {_date(found.since, when.seconds[0])} {first} may be beyond its limit"
            f" ({sure}), {why}"
        )
    whose = "history" if when.from_history else "this recording"
    if not any(map(math.isfinite, when.seconds)):
        return f"no bias leaves its limit within 20 years ({sure}), says {whose}"
    by = "".join(
        f" {100 * chance:.0f} % by {_date(found.since, seconds)},"
        if math.isfinite(seconds)
        else f" {100 * chance:.0f} % not within 20 years,"
        for chance, seconds in zip(CHANCES, when.seconds, strict=True)
    )
    return f"{first} is beyond its limit with{by} says {whose}"


def _date(since: str, seconds: float) -> str:
    then = datetime.fromisoformat(since) + timedelta(seconds=seconds)
    return f"{then:%Y-%m-%d %H:%M}" if seconds < 3 * 86400 else f"{then:%Y-%m-%d}"
