"""Answers to the question what the times of a file count, by how gravity turns.

Of times in ticks of another length, rates in a usual unit seem to be in none: they turn
gravity by as much more or less as a tick is longer or shorter than was assumed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.importing.units.scales import GYR_OUT, GYR_SCALES, Scale, rounded_text
from fieldcal.importing.words.tick_units import SECONDS, tick_seconds

TICKS = ("0.1ms", "10us", "1/32768s", "31.25us", "39.0625us", "100ns")
"""Ticks of usual timers: decimal ones, those of a watch crystal and of 32 kHz, those of
Bosch's sensors, and those of Windows."""

PLAIN = GYR_SCALES[:2]
"""Units of rates beside which a tick is looked for: rad/s and deg/s."""

SI = PLAIN[:1]
"""That of rates whose unit is known, in which they are then."""


def tick_options(
    reads: float, second: float, scales: Sequence[Scale] = PLAIN
) -> list[str]:
    """Options for the user to paste: ticks that make a usual unit of the rates.

    Parameters
    ----------
    reads : what 1 rad/s reads in the unit of time that was assumed
    second : s, of one in that unit
    scales : usual units of the rates

    >>> tick_options(10.2, 1e-3)
    ['--time-unit 0.1ms, if that is what its times count and its rates are rad/s']
    >>> len(tick_options(32.0, 1e-3)), tick_options(1.0, 1e-3)
    (2, [])
    """
    lengths = {str(scale): second * scale.size / reads for scale in scales}
    return [
        f"--time-unit {tick}, if that is what its times count and its rates are {unit}"
        for unit, length in lengths.items()
        for tick in TICKS
        if _are_near(length, tick_seconds(tick))
    ]


def unknown_tick_option(reads: float, second: float) -> str:
    """Option for a tick of a timer that is none of the usual, about as long.

    >>> unknown_tick_option(0.168, 1e-9)
    '--time-unit 5.95ns, if its times count about so much and its rates are rad/s (the \
clock of its timer says it exactly)'
    """
    return (
        f"--time-unit {written_tick(second / reads, 3)}, if its times count about so"
        f" much and its rates are {PLAIN[0].unit} (the clock of its timer says it"
        " exactly)"
    )


def written_tick(length: float, digits: int) -> str:
    """A tick of some seconds as so many of the largest unit of which it is one or more.

    >>> written_tick(3.125e-5, 6), written_tick(2e-10, 3)
    ('31.25us', '0.2ns')
    """
    unit = next((u for u, size in SECONDS.items() if length >= size), "ns")
    return f"{rounded_text(length / SECONDS[unit], digits)}{unit}"


def _are_near(length: float, tick: float | None) -> bool:
    """Whether a tick is as long as turns say, which a factory scale makes uncertain."""
    return tick is not None and abs(float(np.log(length / tick))) < GYR_OUT[0]
