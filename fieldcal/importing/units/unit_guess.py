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
from fieldcal.importing.units.acceleration_guess import guess_acceleration
from fieldcal.importing.units.changed_unit import changed_unit
from fieldcal.importing.units.fixed_forces import forces_are_fixed
from fieldcal.importing.units.gravity_size import (
    GravityReading,
    are_means,
    estimate_gravity,
    gravity_of_length,
)
from fieldcal.importing.units.rate_guess import RateGuess
from fieldcal.importing.units.scales import Scale, rounded_text
from fieldcal.importing.units.temperature_guess import guess_temperature
from fieldcal.importing.units.time_units import (
    assumed_time_unit,
    check_stated_times,
    usual_step,
)
from fieldcal.importing.units.turned_axes import NamedColumns
from fieldcal.importing.units.unit_answers import ask_unit
from fieldcal.importing.units.unit_doubts import StatedUnits

OFFSET = 0.25
"""Part of g that no bias is: what raw counts show more is where their zero lies."""


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
            self._take("acceleration", guess_acceleration(
                name, self.said, gravity, written, self._step, alone
            ))  # fmt: skip
        elif gravity and said.acc_lsb != 1:
            gravity = gravity_of_length(block.acc, G0) or gravity
        if said.acc_zero:
            self._lies_at(self._zero)
        if gravity and self.said.acc_lsb != 1:
            self._offset(gravity)
        if not said.gyr_unit and said.gyr_lsb == 1:
            times_are_said = bool(said.time_unit or said.rate_hz)
            rates = RateGuess(name, self.said, times_are_said, columns, self._step)
            self._take("angular_rate", rates.of(block, gravity))
            self.doubts += rates.doubts
        if gravity:
            said_units = StatedUnits(name, self.said, self.found, columns)
            self.doubts += said_units.doubts(block, gravity)
            guessed = not said.gyr_unit and said.gyr_lsb == 1
            if not means and (guessed or "g" in said.named):
                size = self.said.gyr_scale / said.gyr_scale
                self._ask_of_fixed_forces(replace(block, gyr=block.gyr * size), gravity)
        if self.said.usual_acc and self.said.usual_acc == self.said.acc_unit:
            self.said = replace(self.said, cut=_are_whole(written / said.acc_scale))
        warm = None if said.temp_unit else block.temperature
        if warm is not None and (kind := guess_temperature(name, self.said, warm)):
            self.said = replace(self.said, temp_unit=kind[0])
            self.found["temperature"] = kind[1]

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

    def _take(self, quantity: str, found: tuple[Scale, str] | None) -> None:
        """Take a unit that was found, and why."""
        if found is None:
            return
        (unit, lsb), self.found[quantity] = (found[0].unit, found[0].lsb), found[1]
        if quantity == "acceleration":
            self.said = replace(self.said, acc_unit=unit, acc_lsb=lsb)
        else:
            self.said = replace(self.said, gyr_unit=unit, gyr_lsb=lsb)

    def _ask_of_fixed_forces(self, block: Block, gravity: GravityReading) -> None:
        """Ask about accelerations that do not turn with the device."""
        if forces_are_fixed(block.t, block.acc, block.gyr, gravity):
            unit = self.said.gyr_unit or "rad/s"
            ask_unit(
                self._name,
                "its accelerations stay as they are whatever turns its rates tell: a"
                " filter seems to have turned them into the frame of the earth, or the"
                " sensor is dead, and nothing can be calibrated by them; log those in"
                " the axes of the sensor, or, if they are",
                [f"--gyr-unit {unit}"],
            )

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


def _are_whole(values: Array) -> bool:
    """Whether numbers (n, 3) are whole, as fields of whole numbers are."""
    known = values[np.isfinite(values)]
    return bool(len(known) and np.allclose(known, np.round(known), rtol=0, atol=1e-6))
