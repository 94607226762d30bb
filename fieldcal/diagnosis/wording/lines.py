"""Each effect in one line: what, how big, how sure, what it does to the calibration."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from fieldcal.calibration.wording import format_unit, parameter_title
from fieldcal.diagnosis.result import EffectLine, FoundEffect, Quantity
from fieldcal.diagnosis.wording.paragraph import with_uncertainty
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.physics.effect import Chain, Line, Scatter

UNITS = frozenset({"hz", "ppm", "seconds", "relative"})
"""Names of parameters that say no more than their unit does."""

TREATED = {
    "mend": "nothing: corrected",
    "mask": "nothing: left out",
    "note": "nothing known",
}
"""Effect of faults of samples on a calibration, by their treatment."""


def by_impact(effects: Iterable[FoundEffect]) -> list[FoundEffect]:
    """Effects by decreasing change of the calibration, in its sigmas.

    Random effects, which only widen it, come next. Those that are corrected, left out
    or subtracted come last.
    """
    return sorted(effects, key=_impact, reverse=True)


def _impact(finding: FoundEffect) -> tuple[int, float]:
    """Rank of what an effect does to the calibration, and by how many sigmas."""
    effect = catalogue()[finding.id]
    if isinstance(effect, Chain | Line):
        return 0, 0.0
    if isinstance(effect, Scatter):
        return 1, 0.0
    return 2, max((q.sigmas for q in finding.moves.values()), default=0.0)


def effect_lines(effects: Sequence[FoundEffect]) -> tuple[EffectLine, ...]:
    """One line for each effect; of repeated ones, the largest."""
    alike: dict[str, list[FoundEffect]] = {}
    for effect in effects:
        alike.setdefault(effect.id, []).append(effect)
    return tuple(_line(name, same) for name, same in alike.items())


def _line(name: str, effects: Sequence[FoundEffect]) -> EffectLine:
    largest = max(
        effects, key=lambda f: max((q.sigmas for q in f.parameters.values()), default=0)
    )
    often = f" ({len(effects)} times)" if len(effects) > 1 else ""
    what = name.replace("_", " ") + often
    if others := largest.aliases:
        what += f", or {' or '.join(o.replace('_', ' ') for o in others)}"
    sure = format_probability(min(f.probability for f in effects))
    return EffectLine(
        what, clearest_parameter(largest.parameters), sure, _calibration_change(largest)
    )


def clearest_parameter(parameters: Mapping[str, Quantity]) -> str:
    """The most significant parameter of an effect, and the number of further ones.

    Times are used only where the effect has no other parameter.

    >>> k12, k13 = Quantity(0.008, 1e-4, "1"), Quantity(0.0, 1e-4, "1")
    >>> clearest_parameter({"k12": k12, "k13": k13})
    'k12 0.00800 ± 0.00010'
    >>> clearest_parameter({"hz": Quantity(28.25, 0.01, "Hz")})
    '28.250 ± 0.010 Hz'
    >>> clearest_parameter({"at_s": Quantity(4, 1, "s")})
    'at 4.0 ± 1.0 s'
    """
    if not parameters:
        return "not known"
    names = [n for n, q in parameters.items() if q.unit != "s"] or list(parameters)
    name = max(names, key=lambda n: parameters[n].sigmas)
    clear = sum(
        q.sigmas > thresholds.STANDS_OUT for n, q in parameters.items() if n != name
    )
    more = f" (+{clear})" if clear else ""
    called = "" if name in UNITS else name.removesuffix("_deg").removesuffix("_s")
    return f"{called} {pretty_quantity(parameters[name])}{more}".lstrip()


def pretty_quantity(quantity: Quantity) -> str:
    """A value with its uncertainty and its unit with superscripts."""
    text = with_uncertainty(quantity)
    unit = quantity.unit
    return text.removesuffix(unit) + format_unit(unit) if unit != "1" else text


def _calibration_change(finding: FoundEffect) -> str:
    """What it does to the calibration, in a few words."""
    effect = catalogue()[finding.id]
    if isinstance(effect, Chain):
        return TREATED[effect.treatment]
    if isinstance(effect, Scatter):
        return "widens its ±"
    if isinstance(effect, Line):
        return "nothing: subtracted"
    if not finding.moves:
        return "nothing that shows"
    name = max(finding.moves, key=lambda n: finding.moves[n].sigmas)
    most = finding.moves[name]
    sigmas = most.sigmas
    if sigmas < thresholds.MOVED:
        return f"less than {thresholds.MOVED:g} σ"
    unit = format_unit(most.unit)
    by = f"{most.value:+.2g} {unit}".rstrip()
    return f"{parameter_title(name)} {by} ({sigmas:.0f} σ) {effect.absent}".rstrip()


def calibration_holds(names: Iterable[str]) -> str:
    """When the biases and scale factors that are fitted beside some effects hold.

    Empty if none of the effects changes them during a recording; ids that are not in
    the catalogue are passed over.

    >>> calibration_holds(["bias_drift", "quadratic", "warm_up"]).partition(";")[0]
    'Biases and scale factors are without the effects (at the start, when warmed up)'
    """
    known = (catalogue()[name].absent for name in names if name in catalogue())
    when = [text for text in dict.fromkeys(known) if text]
    if not when:
        return ""
    return (
        f"Biases and scale factors are without the effects ({', '.join(when)});"
        " fieldcal solve states them for the end of the recording."
    )


def verdict_probability(verdict: str, probability: float, named: int) -> str:
    """Probability of a verdict that names some effects, in words.

    >>> verdict_probability("left_out", 0.51, 3)
    'probability 0.51 for all of it together'
    """
    together = (
        named > 1 and verdict != "consistent" and probability <= thresholds.CERTAIN
    )
    text = f"probability {format_probability(probability)}"
    return f"{text} for all of it together" if together else text


def format_probability(probability: float) -> str:
    """A probability, without more digits than are worth saying.

    >>> format_probability(0.873), format_probability(0.9996)
    ('0.87', 'above 0.99')
    """
    if not math.isfinite(probability):
        return "not known"
    sure = thresholds.CERTAIN
    return f"above {sure}" if probability > sure else f"{probability:.2f}"
