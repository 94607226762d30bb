"""Units that are assumed where neither the file nor the user states them, and why.

What physics tells is taken and said; where it leaves a choice, the user is asked, with
what to add to the command.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array, Block
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.units.calm_rates import HALVED, guess_unit_of_calm_rates
from fieldcal.importing.units.changed_unit import changed_unit
from fieldcal.importing.units.gravity_size import (
    GravityReading,
    are_means,
    estimate_gravity,
    gravity_of_length,
    unequal_lengths,
)
from fieldcal.importing.units.rate_size import compare_turns, estimate_rate_unit
from fieldcal.importing.units.scales import (
    ACC_OUT,
    ACC_SCALES,
    ANALOG,
    GYR_OUT,
    MIN_ROWS_ALONE,
    USUAL_COUNTS,
    Scale,
    binary_counts,
    fitting_scales,
    gain_scales,
    half_angle_scales,
    rate_scales,
    rounded_text,
)
from fieldcal.importing.units.thermometers import (
    ANALOG_THERMOMETERS,
    is_usual_temperature,
    may_be_fahrenheit,
    temperature_counts,
    temperature_fits,
)
from fieldcal.importing.units.tick_answers import tick_options, unknown_tick_option
from fieldcal.importing.units.time_units import (
    assumed_time_unit,
    check_stated_times,
    usual_step,
)
from fieldcal.importing.units.turned_axes import NamedColumns
from fieldcal.importing.units.unit_answers import (
    rate_options,
    scales_of_decimals,
    unit_options,
    zero_options,
)
from fieldcal.importing.units.unit_doubts import (
    LOG_GRAVITY,
    StatedUnits,
)
from fieldcal.importing.words.heading_units import HALF_ANGLE
from fieldcal.session.units import UNSCALED

NO_UNIT = 0.75
"""What gravity reads at least in any unit, less what no factory scale is out by."""

OFFSET = 0.25
"""Part of g that no bias is: what raw counts show more is where their zero lies."""


BESIDE = {"mg": "mrad/s"}
"""Unit of the rates that programs write beside accelerations in another."""

PLAIN_UNITS = ["--acc-unit m/s^2", "--acc-unit g"]
"""What accelerations are in, where their lengths tell nothing."""


class UnitGuess:
    """Units of the beginning of a recording.

    Parameters
    ----------
    name, said, block : of the recording, what is said of it, and its beginning
    columns : in which the rates stand
    alone : whether it is one file: those of several may be in different units
    began : time of the first row by the clock of the file, 0 if unknown

    Attributes
    ----------
    found : what was guessed, by quantity
    said : what is said, with what was found
    acc_bias : x y z of [nominal], m/s^2; None where zero lies at zero
    doubts : what the user says and physics does not, a sentence each

    """

    def __init__(
        self,
        name: str,
        said: ReadOptions,
        block: Block,
        columns: NamedColumns,
        alone: bool = True,
        began: float = 0.0,
    ) -> None:
        self._alone, self._columns = alone, columns
        self.found: dict[str, str] = {}
        self.acc_bias: list[float] | None = None
        self.doubts: list[str] = []
        self._name, self.said, self._read = name, said, said
        # a rate is that of samples, or of means that are counted
        of_rows = None if said.rate_hz else block.t
        means = said.means or are_means(block.acc, of_rows)
        # of means, the pauses between them say nothing
        if not (said.time_unit or said.rate_hz or means):
            unit, why = assumed_time_unit(name, block.t, block.acc, began)
            self.said = replace(said, time_unit=unit)
            self.found |= {"time": why} if why else {}
        elif "t" in said.named and not (said.batch or means):
            check_stated_times(name, said.time_unit, block.t)
        t = block.t * (self.said.time_scale / said.time_scale)
        block = replace(block, t=t)
        self._zero = said.acc_scale * said.zero
        written, block = block.acc, replace(block, acc=block.acc - self._zero)
        self._refuse_changes(block.acc / said.acc_scale)
        gravity = estimate_gravity(block.acc, of_rows, said.means)
        self._step = usual_step(t) if said.rate_hz is None else 1 / said.rate_hz
        if gravity and not said.acc_unit and said.acc_lsb == 1:
            self._acceleration(gravity, written)
        elif gravity and said.acc_lsb != 1:
            gravity = gravity_of_length(block.acc, G0) or gravity
        if said.acc_zero:
            self._lies_at(self._zero)
        if gravity and self.said.acc_lsb != 1:
            self._offset(gravity)
        if not said.gyr_unit and said.gyr_lsb == 1:
            self._rates(block, gravity)
        if gravity:
            said_units = StatedUnits(name, self.said, self.found, columns)
            self.doubts += said_units.doubts(block, gravity)
        if self.said.usual_acc and self.said.usual_acc == self.said.acc_unit:
            self.said = replace(self.said, cut=_are_whole(written / said.acc_scale))
        if not said.temp_unit:
            self._temperature(block.temperature)

    def on(self, wanted: ReadOptions) -> ReadOptions:
        """Options of a part with what was found."""
        found = self.said
        wanted = replace(wanted, cut=found.cut)
        if "time" in self.found:
            wanted = replace(wanted, time_unit=found.time_unit)
        if "acceleration" in self.found:
            wanted = replace(wanted, acc_unit=found.acc_unit, acc_lsb=found.acc_lsb)
        if "angular_rate" in self.found:
            wanted = replace(wanted, gyr_unit=found.gyr_unit, gyr_lsb=found.gyr_lsb)
        if "temperature" in self.found:
            wanted = replace(wanted, temp_unit=found.temp_unit)
        return wanted

    def _acceleration(self, gravity: GravityReading, acc: Array) -> None:
        fits = fitting_scales(gravity.size, ACC_SCALES, ACC_OUT[not gravity.round])
        fits = scales_of_decimals(fits, acc)
        shows = f"|a| at rest is {rounded_text(gravity.size, 4)}"
        if gravity.round:
            shows += " (from a sphere through the rests)"
        named = [scale for scale in fits if str(scale) == self.said.usual_acc]
        if named and len(fits) > 1:
            fits = named
            shows += ", and so are accelerations of such names"
        if not fits and gravity.size >= NO_UNIT and (lsb := binary_counts(acc)):
            fits = [scale for scale in ACC_SCALES if str(scale) == "g"]
            shows += f", and its steps are those of {lsb} counts in a g"
        if not fits and self._step and not self.said.no_gain:
            scales = gain_scales(self._step, "m/s^2", G0)
            fits = fitting_scales(gravity.size, scales, ACC_OUT[not gravity.round])
        if not fits and gravity.size < NO_UNIT:
            raise InputError(
                f"{self._name}: {shows}, less than gravity reads in any unit: it seems"
                " to be taken out of these accelerations, and nothing can be"
                f" calibrated by them; {LOG_GRAVITY}, or, if it is so, add"
                f" --acc-unit g --acc-lsb {rounded_text(gravity.size)}"
            )
        whole = acc[acc.any(axis=1)] - self._zero
        if self._alone and (lengths := unequal_lengths(whole)) is not None:
            low, high = (rounded_text(one, 2) for one in lengths)
            self._ask(
                f"|a| where it changes least is {low} to {high}, and gravity is the"
                " same everywhere: it may be taken out of these accelerations, and"
                f" nothing can be calibrated by them then ({LOG_GRAVITY}); if it is"
                " not, say the unit",
                (unit_options("acc", fits, "g", 1) if fits else PLAIN_UNITS)
                + zero_options(self.said, gravity),
            )
        if self.said.free and fits and fits[0].unit != "m/s^2" and not gravity.round:
            self._ask(
                f"{shows}, and the names of its columns are those of accelerations"
                f" without gravity, by which nothing can be calibrated ({LOG_GRAVITY});"
                " if it is in them, say the unit",
                unit_options("acc", fits, "g", gravity.size),
            )
        if len(fits) != 1:
            self._ask(
                f"{shows}, which is gravity in"
                f" {' or '.join(map(str, fits)) or 'no usual unit'}",
                unit_options("acc", fits, "g", gravity.size)
                + zero_options(self.said, gravity),
            )
        if (fits[0].unit, fits[0].lsb) != ("m/s^2", 1):
            self.found["acceleration"] = f"{fits[0]}: {shows}"
            self.said = replace(self.said, acc_unit=fits[0].unit, acc_lsb=fits[0].lsb)

    def _refuse_changes(self, acc: Array) -> None:
        """Refuse rows of which a part is in another unit."""
        if (changed := changed_unit(acc)) is not None:
            before, behind = (rounded_text(x) for x in changed[1:])
            raise InputError(
                f"{self._name}: |a| at rest is {before} up to row {changed.row} of its"
                f" samples, and {behind} behind it, and gravity is the same everywhere:"
                " its unit or its full scale changes there; make two files of it, and"
                " import each"
            )

    def _offset(self, gravity: GravityReading) -> None:
        if (np.abs(gravity.offset) > OFFSET * gravity.size).any():
            counts = self._lies_at(self._zero + gravity.offset)
            reads = " ".join(f"{number:.5g}" for number in counts)
            self.found["acc_bias"] = f"{reads} counts: the sphere lies about it"

    def _lies_at(self, zero: Array) -> Array:
        """Take a zero, as read, for the nominal bias; return it as the file has it."""
        counts: Array = zero / self._read.acc_scale
        self.acc_bias = [round(b * self.said.acc_scale, 4) for b in counts]
        return counts

    def _rates(self, block: Block, gravity: GravityReading | None) -> None:
        gyr = block.gyr[np.isfinite(block.gyr).all(axis=1)]
        if len(gyr) < MIN_ROWS_ALONE:
            return
        reads = gravity and estimate_rate_unit(block.t, block.acc, block.gyr, gravity)
        if reads is None or gravity is None:
            if gravity is not None:
                rows = block.t, block.acc, block.gyr
                self.doubts += self._columns.doubts(*rows, gravity)
            self._calm(block, gyr, gravity)
            return
        known = rate_scales(self.said.acc_unit, self.said.acc_lsb)
        fits = fitting_scales(reads, known, GYR_OUT[not gravity.round])
        fits = scales_of_decimals(fits, block.gyr)
        if self._halved:
            halves = half_angle_scales(self._step)
            fits = fitting_scales(reads, halves, GYR_OUT[not gravity.round])
        elif self._gained:
            # who writes gains of velocity, writes gains of angle beside them
            fits = self._angle_gains(reads, GYR_OUT[not gravity.round])
        elif self.said.acc_lsb != 1 and (counts := [f for f in fits if f.lsb != 1]):
            # who writes one sensor's registers as they are, writes the other's so too
            fits = counts
        # some write gains of angle beside the force itself; a wrong rate comes near
        fits = fits or self._angle_gains(reads, GYR_OUT[0])
        ticks = self._ticks(reads, fits, gyr)
        fits = [] if ticks else fits
        shows = f"as gravity turns, 1 rad/s reads {rounded_text(reads, 4)}"
        shows = f"{HALVED}; {shows}" if self._halved else shows
        if len(fits) != 1:
            self._ask(
                f"{shows}, which is {' or '.join(map(str, fits)) or 'no usual unit'}",
                ticks
                + unit_options("gyr", fits, "deg/s", np.deg2rad(reads))
                + (
                    rate_options(reads, self.said.rate_hz or 0, gyr) if not fits else []
                ),
            )
        if (fits[0].unit, fits[0].lsb) != ("rad/s", 1):
            self.found["angular_rate"] = f"{fits[0]}: {shows}"
            self.said = replace(self.said, gyr_unit=fits[0].unit, gyr_lsb=fits[0].lsb)

    def _ticks(self, reads: float, fits: list[Scale], gyr: Array) -> list[str]:
        """Options for times of which nothing says what they count.

        Rates with decimals are no counts: rather than in these, they are in a usual
        unit beside times in another than was assumed.
        """
        decimals = bool((gyr != np.round(gyr)).any())
        if self._times_are_said or (fits and (fits[0].lsb <= 1 or not decimals)):
            return []
        known = {} if decimals else {"scales": USUAL_COUNTS}
        usual = tick_options(reads, self.said.time_scale, **known)
        if usual or fits:
            return usual
        return [unknown_tick_option(reads, self.said.time_scale)] if decimals else []

    @property
    def _times_are_said(self) -> bool:
        """Whether the file or the user states what times count, or the rate."""
        return bool(self._read.time_unit or self._read.rate_hz)

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
        return self.said.acc_lsb != 1 and self.said.acc_lsb == self._step

    @property
    def _halved(self) -> bool:
        """Whether rates are half the angle that was gained since the row before."""
        return bool(self.said.usual == HALF_ANGLE and self._step)

    def _calm(self, block: Block, gyr: Array, gravity: GravityReading | None) -> None:
        """Rates of which no turn tells."""
        turns = gravity and compare_turns(block.t, block.acc, block.gyr, gravity)
        gained = self._step if self._gained or self._halved else None
        counts = self.said.acc_lsb != 1 and gained is None
        usual = self.said.usual
        if self.said.usual_acc and self.said.usual_acc == self.said.acc_unit:
            usual = BESIDE[self.said.usual_acc]
        found = guess_unit_of_calm_rates(gyr, turns, gained, usual, counts)
        if found.scale is None:
            self._ask(found.asks, [*found.answers])
        else:
            unit, lsb = found.scale.unit, found.scale.lsb
            self.found["angular_rate"] = f"{found.scale}: {found.why}"
            self.said = replace(self.said, gyr_unit=unit, gyr_lsb=lsb)

    def _temperature(self, values: Array) -> None:
        fits = temperature_fits(values)
        known = values[np.isfinite(values)]
        whole = bool(len(known) and (known == np.round(known)).all())
        analog = whole and self.said.acc_lsb in {acc for acc, _ in ANALOG}
        if not len(known):
            return
        low, high = float(known.min()), float(known.max())
        if "degC" in fits and not analog:
            if may_be_fahrenheit(low, high):
                self._ask(
                    f"its temperature reads {low:.6g} to {high:.6g}, which is hot in"
                    " deg C and usual in deg F",
                    ["--temp-unit degF", "--temp-unit degC, if it is so"],
                )
            return
        if analog:
            self._ask(
                f"its temperature reads {low:.6g} to {high:.6g} beside counts of"
                " which Analog Devices have so many in a g, so it may be counts too",
                [
                    *temperature_counts(low, high, ANALOG_THERMOMETERS),
                    *(["--temp-unit degC, if it is so"] if "degC" in fits else []),
                    "--temp-unit none, which leaves it out",
                ],
            )
        # who writes one sensor's registers as they are, may write the other's so too
        scaled = self.said.acc_lsb == self.said.gyr_lsb == 1
        scaled &= self.said.acc_unit not in UNSCALED
        raw = not scaled and whole
        if len(fits) != 1 or raw or not is_usual_temperature(*fits.values()):
            self._ask(
                f"its temperature reads {low:.6g} to {high:.6g}, which is no deg C",
                [
                    *(f"--temp-unit {unit}" for unit in fits),
                    *temperature_counts(low, high),
                    "--temp-unit none, which leaves it out",
                ],
            )
        ((unit, middle),) = fits.items()
        self.said = replace(self.said, temp_unit=unit)
        self.found["temperature"] = f"{unit}: it is {middle:.1f} deg C then"

    def _ask(self, what: str, answers: list[str]) -> None:
        raise InputError(f"{self._name}: {what}: add {' or '.join(answers)}")


def _are_whole(values: Array) -> bool:
    """Whether numbers (n, 3) are whole, as fields of whole numbers are."""
    known = values[np.isfinite(values)]
    return bool(len(known) and np.allclose(known, np.round(known), rtol=0, atol=1e-6))
