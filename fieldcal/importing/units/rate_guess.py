"""Unit of rates that nobody says, by how gravity turns."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.units.calm_rates import HALVED, guess_unit_of_calm_rates
from fieldcal.importing.units.gravity_size import GravityReading
from fieldcal.importing.units.rate_size import compare_turns, estimate_rate_unit
from fieldcal.importing.units.scales import (
    GYR_OUT,
    MIN_ROWS_ALONE,
    USUAL_COUNTS,
    Scale,
    fitting_scales,
    gain_scales,
    half_angle_scales,
    rate_scales,
    rounded_text,
)
from fieldcal.importing.units.tick_answers import tick_options, unknown_tick_option
from fieldcal.importing.units.turned_axes import NamedColumns
from fieldcal.importing.units.unit_answers import (
    ask_unit,
    rate_options,
    scales_of_decimals,
    unit_options,
)
from fieldcal.importing.words.heading_units import HALF_ANGLE

BESIDE = {"mg": "mrad/s"}
"""Unit of the rates that programs write beside accelerations in another."""


class RateGuess:
    """Unit of the rates of a recording.

    Parameters
    ----------
    name, said : of the recording, and what is known of its other units
    times_are_said : whether the file or the user states what times count, or the rate
    columns : in which the rates stand
    step : s, from row to row; 0 if unknown

    Attributes
    ----------
    doubts : what gravity does not turn by, a sentence each

    """

    def __init__(
        self,
        name: str,
        said: ReadOptions,
        times_are_said: bool,
        columns: NamedColumns,
        step: float,
    ) -> None:
        self._name, self._said, self._times_are_said = name, said, times_are_said
        self._columns, self._step = columns, step
        self.doubts: list[str] = []

    def of(
        self, block: Block, gravity: GravityReading | None
    ) -> tuple[Scale, str] | None:
        """Unit of the rates of a recording, and why; None of rad/s, or of no rates.

        Raises
        ------
        InputError
            With a question and its answers.

        """
        gyr = block.gyr[np.isfinite(block.gyr).all(axis=1)]
        if len(gyr) < MIN_ROWS_ALONE:
            return None
        reads = gravity and estimate_rate_unit(block.t, block.acc, block.gyr, gravity)
        if reads is None or gravity is None:
            if gravity is not None:
                rows = block.t, block.acc, block.gyr
                self.doubts += self._columns.doubts(*rows, gravity)
            return self._calm(block, gyr, gravity)
        known = rate_scales(self._said.acc_unit, self._said.acc_lsb)
        fits = fitting_scales(reads, known, GYR_OUT[not gravity.round])
        fits = scales_of_decimals(fits, block.gyr)
        if self._halved:
            halves = half_angle_scales(self._step)
            fits = fitting_scales(reads, halves, GYR_OUT[not gravity.round])
        elif self._gained:
            # who writes gains of velocity, writes gains of angle beside them
            fits = self._angle_gains(reads, GYR_OUT[not gravity.round])
        elif self._said.acc_lsb != 1 and (counts := [f for f in fits if f.lsb != 1]):
            # who writes one sensor's registers as they are, writes the other's so too
            fits = counts
        # some write gains of angle beside the force itself; a wrong rate comes near
        fits = fits or self._angle_gains(reads, GYR_OUT[0])
        ticks = self._ticks(reads, fits, gyr)
        fits = [] if ticks else fits
        shows = f"as gravity turns, 1 rad/s reads {rounded_text(reads, 4)}"
        shows = f"{HALVED}; {shows}" if self._halved else shows
        if len(fits) != 1:
            ask_unit(
                self._name,
                f"{shows}, which is {' or '.join(map(str, fits)) or 'no usual unit'}",
                [
                    *ticks,
                    *unit_options("gyr", fits, "deg/s", np.deg2rad(reads)),
                    *(
                        []
                        if fits
                        else rate_options(reads, self._said.rate_hz or 0, gyr)
                    ),
                ],
            )
        plain = (fits[0].unit, fits[0].lsb) == ("rad/s", 1)
        return None if plain else (fits[0], f"{fits[0]}: {shows}")

    def _ticks(self, reads: float, fits: list[Scale], gyr: Array) -> list[str]:
        """Options for times of which nothing says what they count.

        Rates with decimals are no counts: rather than in these, they are in a usual
        unit beside times in another than was assumed.
        """
        decimals = bool((gyr != np.round(gyr)).any())
        if self._times_are_said or (fits and (fits[0].lsb <= 1 or not decimals)):
            return []
        known = {} if decimals else {"scales": USUAL_COUNTS}
        usual = tick_options(reads, self._said.time_scale, **known)
        if usual or fits:
            return usual
        return [unknown_tick_option(reads, self._said.time_scale)] if decimals else []

    def _angle_gains(self, reads: float, within: float) -> list[Scale]:
        """Scales of what an angle gains in a row, by what 1 rad/s reads in it."""
        if not self._step:
            return []
        degrees = gain_scales(self._step, "deg/s", 180 / np.pi)
        scales = (*gain_scales(self._step, "rad/s"), *degrees)
        return fitting_scales(reads, scales, within)

    @property
    def _gained(self) -> bool:
        """Whether accelerations are gains of velocity since the row before."""
        return self._said.acc_lsb != 1 and self._said.acc_lsb == self._step

    @property
    def _halved(self) -> bool:
        """Whether rates are half the angle that was gained since the row before."""
        return bool(self._said.usual == HALF_ANGLE and self._step)

    def _calm(
        self, block: Block, gyr: Array, gravity: GravityReading | None
    ) -> tuple[Scale, str]:
        """Rates of which no turn tells."""
        turns = gravity and compare_turns(block.t, block.acc, block.gyr, gravity)
        gained = self._step if self._gained or self._halved else None
        counts = self._said.acc_lsb != 1 and gained is None
        usual = self._said.usual
        if self._said.usual_acc and self._said.usual_acc == self._said.acc_unit:
            usual = BESIDE[self._said.usual_acc]
        found = guess_unit_of_calm_rates(gyr, turns, gained, usual, counts)
        if found.scale is None:
            ask_unit(self._name, found.asks, [*found.answers])
        return found.scale, f"{found.scale}: {found.why}"
