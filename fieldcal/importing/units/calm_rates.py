"""Units of rates of which no turn tells: of a device at rest, driven or flown.

What the accelerometers of a vehicle feel is more than gravity, so nothing says what 1
rad/s reads. Yet they say by how much gravity turns at most, which excludes units; the
rest is what is usual, or is asked.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.units.rate_size import STIRS, TIMES, TurnComparison
from fieldcal.importing.units.scales import (
    GYR_SCALES,
    RATE_SCALES,
    USUAL_COUNTS,
    Scale,
    binary_counts,
    gain_scales,
    half_angle_scales,
)
from fieldcal.importing.units.unit_answers import unit_options
from fieldcal.importing.words.heading_units import HALF_ANGLE

MAX_REST_RATE = 0.5
"""Rate, rad/s, that nothing at rest shows: 30 deg/s."""

ROUGH = 0.02
"""Scatter of rates from sample to sample, rad/s, that nothing at rest shows."""

FASTEST = 4000.0
"""Full scale, deg/s, beyond which no gyroscope in a log goes."""

AS_SHOWN = 1.5
"""How many times what gravity turns at most rates say in their own unit: of mrad/s,
deg/s would say some ten times as much."""

FEWEST_STEPS = 2
"""Steps of an axis that tell by how much it steps."""

SAME_STEP, OFF_STEP = 1.02, 0.1
"""Ratio within which steps are the same, and part of a step by which a number that was
rounded to some decimals is off one."""

FARTHER = (8, 64, 512, 4096, 65536)
"""Steps to the values by which a step is found ever more exactly."""

DECIMAL = (1.0, 2.0, 5.0)
"""First digit of steps that are those of decimals."""

RAD, DEG = GYR_SCALES[:2]


HALVED = "half the angle since the row before, as their names say"
"""What x y z of the quaternion of a turn are."""


class CalmRateUnit(NamedTuple):
    """Assumed unit of rates, or a question about it.

    Attributes
    ----------
    scale, why : the unit, and the reason; None where it is asked
    asks, answers : the question, and options to paste

    """

    scale: Scale | None
    why: str = ""
    asks: str = ""
    answers: tuple[str, ...] = ()


def guess_unit_of_calm_rates(
    gyr: Array,
    turns: TurnComparison | None,
    step: float | None,
    usual: str,
    counts: bool = False,
) -> CalmRateUnit:
    """Guess the unit of rates in a recording without turns.

    Parameters
    ----------
    gyr : (n, 3) numbers of the file, all known
    turns : by how much gravity would turn, were they rad/s, and does; None: not known
    step : s, over which rates are what was gained: accelerations are the gain of
        velocity, or names say half the angle; None where not
    usual : unit that rates of such names are in; "" where names tell none
    counts : whether accelerations are: who writes one sensor's registers as they are,
        writes the other's so too

    """
    named = [s for s in GYR_SCALES if s.lsb == 1 and s.unit == usual]
    plain = [*named, RAD, DEG]
    if step is not None and usual == HALF_ANGLE:
        plain = [*half_angle_scales(step)]
    elif step is not None:
        # who writes gains of velocity, writes gains of angle beside them
        plain = [*gain_scales(step, "rad/s"), *gain_scales(step, "deg/s", DEG.size)]
    allowed = [s for s in plain if turns is None or turns.allow(s.size)]
    whole = bool((gyr == np.round(gyr)).all())
    first = plain[0]
    if step is not None and allowed:
        why = HALVED if usual == HALF_ANGLE else "so are the accelerations"
        return CalmRateUnit(allowed[0], f"{why}, and no turn tells")
    stepped = None if whole else unit_of_steps(gyr)
    if stepped is not None and stepped.scale in allowed:
        return stepped
    if usual and first in allowed:
        return CalmRateUnit(first, "so rates of such names are, and no turn tells")
    if not whole and turns is not None and _in_degrees(turns):
        return CalmRateUnit(DEG, f"as rad/s, {turns.odd()}")
    fast = float(np.median(np.abs(gyr).max(axis=1)))
    noise = float(np.nanmedian(np.abs(np.diff(gyr, axis=0)), axis=0).max())
    if RAD in allowed and fast <= MAX_REST_RATE and noise <= ROUGH:
        return CalmRateUnit(RAD, "it is the usual one, and no turn tells")
    shown = f"{fast:.4g}" if fast > MAX_REST_RATE else f"a scatter of {noise:.2g}"
    asks = f"nothing says the unit of its rates, and {shown} rad/s is no rest"
    return CalmRateUnit(None, "", asks, tuple(_answers(gyr, turns, whole, counts)))


def unit_of_steps(gyr: Array) -> CalmRateUnit | None:
    """The unit in which rates (n, 3) step as those of a usual full scale do.

    None where they do not, or by a decimal digit. No step in deg/s is one in rad/s.

    >>> counts = np.array([[3.0, -2.0, 0.0], [5.0, 1.0, 1.0], [4.0, 0.0, 4.0]] * 20)
    >>> unit_of_steps(counts / 131).scale.unit
    'deg/s'
    >>> unit_of_steps(np.deg2rad(0.07 * counts)).scale.unit
    'rad/s'
    >>> unit_of_steps(0.01 * counts) is None
    True
    >>> unit_of_steps(np.arange(-45.0, 45.0).reshape(-1, 3) / 128).scale.unit
    'deg/s'
    """
    if lsb := binary_counts(gyr, RATE_SCALES):
        why = f"its steps of {1 / lsb:.4g} are those of {lsb} counts in a deg/s"
        return CalmRateUnit(DEG, f"{why}, and no turn tells")
    steps = [step for axis in gyr.T if (step := _step(axis))]
    if not steps or max(steps) > SAME_STEP * min(steps):
        return None
    step = float(np.median(steps))
    for scale in (DEG, RAD):
        for full in GYR_SCALES:
            own = scale.size / full.size
            if full.lsb != 1 and abs(np.log(step / own)) < np.log(SAME_STEP):
                why = f"its steps of {step:.4g} are those of {full.lsb:.6g} counts in a"
                return CalmRateUnit(scale, f"{why} deg/s, and no turn tells")
    return None


def _step(axis: Array) -> float:
    """By how much numbers (n,) step; 0 where they do not, or by a decimal digit."""
    values = np.unique(axis)
    apart = np.diff(values)
    if len(apart) < FEWEST_STEPS:
        return 0.0
    step = float(np.median(apart[apart < SAME_STEP * apart.min()]))
    from_middle = values - values[len(values) // 2]
    # decimals that round a step leave it too rough to count to the farthest values
    for far in FARTHER:
        near = from_middle[np.abs(from_middle) <= far * step]
        counts = np.round(near / step)
        if counts.any():
            step = float(counts @ near / (counts @ counts))
    many = from_middle / step
    if np.abs(many - np.round(many)).max() > OFF_STEP:
        return 0.0
    digits = float(f"{step:.1e}".partition("e")[0])
    decimal = abs(step / float(f"{step:.0e}") - 1) < 1e-3
    return 0.0 if decimal and digits in DECIMAL else step


def _in_degrees(turns: TurnComparison) -> bool:
    """Whether rad/s cannot be by how gravity turns, and deg/s are as it turns."""
    least = max(STIRS, TIMES * turns.shown)
    return turns.said >= least and turns.allow(DEG.size, AS_SHOWN)


def _answers(
    gyr: Array, turns: TurnComparison | None, whole: bool, counts: bool
) -> list[str]:
    """Options: those that can be; of whole numbers counts as well, or alone."""
    scales = [DEG, *(USUAL_COUNTS if whole else [RAD])]
    fits = [s for s in scales if turns is None or turns.allow(s.size)]
    if whole and (counts or np.abs(gyr).max() > FASTEST):
        fits = [s for s in fits if s != DEG]
    said = unit_options("gyr", fits or scales, "deg/s", DEG.size)
    return [f"{a}, if it is so" if a == "--gyr-unit rad/s" else a for a in said]
