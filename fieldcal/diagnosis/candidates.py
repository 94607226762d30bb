"""What could be behind a mismatch in this session: the hypotheses to be compared.

An effect on accelerometers and gyroscopes alike is two hypotheses, one for each; one
with a shape parameter is tried over a grid of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.model import Term
from fieldcal.effects import Effect, Motion, Sensor, catalogue
from fieldcal.samples import CHANNELS, Array

TURNS = ("time_delay",)
"""Seen while the device turns only, and not in what a table does evenly."""

RATED = ("gyro_cross_coupling", "gyro_products", "lever_arm")
"""Seen in windows only where a table turns the device."""

CALIBRATION = ("gravity_error", "gyro_scale", "earth_rate")
"""Not told from the calibration by what windows show."""

BEYOND = ("warm_up", "bias_drift", "thermal_hysteresis")
"""Meant for what a changing temperature itself does not explain."""

BEYOND_COST = 6.0

POINTS = 8
"""Values of a time constant to try."""


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """One explanation: an effect, or the part of it on one triad.

    `variants` are the terms to try, one for each value of the shape; `cost` is what it
    pays more than others, ln; `known` says that it is bound to be there, and the
    question is only whether it shows.
    """

    effect: Effect
    part: str
    variants: tuple[Term, ...]
    cost: float = 0.0
    known: bool = False

    @property
    def name(self) -> str:
        """Unique name: the id, with the triad where there are two."""
        return f"{self.effect.id}:{self.part}" if self.part else self.effect.id


def hypotheses(bench: Bench, warming: bool, navigation: bool) -> list[Hypothesis]:
    """Whatever the rows can show at all.

    Parameters
    ----------
    warming : whether the temperature is known and changes
    navigation : whether the gyroscopes see the Earth

    """
    found: list[Hypothesis] = []
    x, gyros = bench.rows.x, bench.rows.used[:, 3:]
    if gyros.any() and x.oriented.any() and not x.base_rate.any():
        effect = catalogue()["earth_rate"]
        found.append(Hypothesis(effect, "", (Term(effect, ()),), known=True))
    for effect in catalogue().values():
        if isinstance(effect, Motion | Sensor) and effect.params:
            if _shows(effect, bench, warming, navigation):
                cost = BEYOND_COST if warming and effect.id in BEYOND else 0.0
                found += [replace(h, cost=cost) for h in _parts(effect, bench)]
    return found


def _shows(effect: Effect, bench: Bench, warming: bool, navigation: bool) -> bool:
    x = bench.rows.x
    if effect.id in (*TURNS, *CALIBRATION):
        return False
    if effect.id in RATED and not bench.rated:
        return False
    if effect.id == "settling" and not np.isfinite(x.since_turn).any():
        return False
    if effect.id == "heading_error":
        return navigation and bool(x.oriented.any())
    if effect.id == "vibration_rectification":
        return bool((np.ptp(x.variance, axis=0) > 0).any())
    if effect.covariate.startswith(("temperature", "rate of the temperature")):
        return warming
    return not isinstance(effect, Motion) or bool(x.oriented.any())


def _parts(effect: Effect, bench: Bench) -> Iterator[Hypothesis]:
    shapes = list(_grid(effect, bench))
    seen: NDArray[np.bool_] = np.any(bench.rows.used, axis=0)
    names = [p.name for p in effect.params]
    if set(names) <= set(CHANNELS):
        for part, letter in (("acc", "a"), ("gyr", "g")):
            columns = tuple(
                j
                for j, n in enumerate(names)
                if n[0] == letter and seen[CHANNELS.index(n)]
            )
            if columns and shapes:
                variants = tuple(Term(effect, columns, shape) for shape in shapes)
                yield Hypothesis(effect, part, variants)
    else:
        columns = tuple(range(len(names)))
        yield Hypothesis(
            effect, "", tuple(Term(effect, columns, shape) for shape in shapes)
        )


def _grid(effect: Effect, bench: Bench) -> Iterator[dict[str, float]]:
    x = bench.rows.x
    if not effect.shapes:
        yield {}
    for shape in effect.shapes:
        if shape.name == "at_s":
            for at in instants(bench):
                yield {"at_s": float(at)}
            continue
        span = float(np.ptp(x.t))
        if effect.id == "settling":
            soonest = float(x.since_turn.min())
            if not np.isfinite(soonest):  # it was never turned
                return
            low, high = max(shape.low, soonest / 4), min(shape.high, span / 3)
        else:
            low, high = max(shape.low, span / 20), min(shape.high, 3 * span)
        for tau in np.geomspace(low, max(high, low * 1.01), POINTS):
            yield {shape.name: float(tau)}


def instants(bench: Bench) -> Array:
    """Between one row and the next, (n - 1,) s."""
    t = bench.rows.x.t
    middle: Array = (t[1:] + t[:-1]) / 2
    return middle
