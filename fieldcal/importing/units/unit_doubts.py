"""Units that somebody says, held against the physics of what a recording holds."""

from __future__ import annotations

from collections.abc import Container, Sequence

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Block
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.recording import Recording
from fieldcal.importing.units.gravity_size import GravityReading, estimate_gravity
from fieldcal.importing.units.rate_size import compare_turns, estimate_rate_unit
from fieldcal.importing.units.scales import ACC_SCALES, GYR_SCALES, Scale, rounded_text
from fieldcal.importing.units.tick_answers import SI, tick_options
from fieldcal.importing.units.turned_axes import NamedColumns
from fieldcal.importing.units.unit_answers import zero_options
from fieldcal.session.units import UNSCALED

MAX_LOG_SCALE = 0.25
"""Logarithm of what no sensor in the unit that is said is out by."""

FACTORY_SCALE = 0.15
"""Logarithm of what rates in a known unit are out by: their scale factor by a
twentieth, and the turns of a hand, by which it is seen, by a tenth."""

OTHER_UNIT = 3.0
"""Ratio of what gravity reads in two files from which their units differ: those of
m/s^2 and g by ten, and what biases make of it by less than two."""

FIRST_ROWS = 1 << 14
"""Rows at the beginning of a file by which that is told."""

NO_GRAVITY = 0.05
"""Part of g below which gravity was taken out; mg and g in m/s^2 read otherwise."""


def check_format_units(recording: Recording, block: Block) -> None:
    """Check the units of a format against the numbers; ask or report if they disagree.

    Raises
    ------
    InputError
        If the format has an option that would make them right.

    """
    gravity = estimate_gravity(block.acc)
    if gravity is None or abs(np.log(gravity.size / G0)) < MAX_LOG_SCALE:
        return
    turned = estimate_rate_unit(block.t, block.acc, block.gyr, gravity)
    odd = (
        f"|a| at rest is {gravity.size:.4g} m/s^2, {gravity.size / G0:.3g} times"
        " gravity: its full scale or unit is another"
    )
    if answer := recording.rescaled(gravity.size / G0, turned or 1.0):
        raise InputError(f"{recording.path}: {odd}: add {answer}")
    recording.says.append(odd)


def check_one_unit(parts: Sequence[Recording]) -> None:
    """Check that several files have their accelerations in one unit, as far as told.

    Raises
    ------
    InputError
        Naming two files that do not.

    """
    sizes = {
        part.path.name: gravity.size
        for part in parts if len(parts) > 1 and not part.lacks_gravity
        if (gravity := _gravity_of_file(part)) is not None
    }  # fmt: skip
    low, high = (f(sizes, key=sizes.__getitem__, default="") for f in (min, max))
    if sizes and sizes[high] > OTHER_UNIT * sizes[low]:
        raise InputError(
            f"{high}: |a| at rest is {sizes[high]:.4g}, and {sizes[low]:.4g} in {low}:"
            " their units differ; import each alone, or write one unit into all"
        )


def _gravity_of_file(part: Recording) -> GravityReading | None:
    """Gravity at the beginning of a file, in the unit that is stated of it or none."""
    name = part.streams()[0].name
    acc = part.alone(name).first_rows(name, FIRST_ROWS).acc
    return estimate_gravity(acc - part.wanted.acc_scale * part.wanted.zero)


LOG_GRAVITY = (
    "log those with gravity in them, or import the file of gravity beside them with"
    " --join (Accelerometer.csv Gravity.csv)"
)
"""What to do about accelerations from which gravity was taken."""


class StatedUnits:
    """Units stated by the user or by the names of columns.

    Parameters
    ----------
    name : of the recording
    said : units, those that were guessed included
    guessed : quantities of which they were
    columns : in which the rates stand

    """

    def __init__(
        self,
        name: str,
        said: ReadOptions,
        guessed: Container[str],
        columns: NamedColumns,
    ) -> None:
        self._name, self._said, self._guessed = name, said, guessed
        self._columns = columns

    def doubts(self, block: Block, gravity: GravityReading) -> list[str]:
        """What the user says and physics does not, a sentence each.

        Raises
        ------
        InputError
            If gravity was taken out, or the names of the columns say what cannot be.

        """
        return self._of_forces(gravity) + self._of_rates(block, gravity)

    def _of_forces(self, gravity: GravityReading) -> list[str]:
        reads = gravity.size / G0
        if not self._has_size("a") or abs(np.log(reads)) <= MAX_LOG_SCALE:
            return []
        if reads < NO_GRAVITY:
            raise InputError(
                f"{self._name}: |a| at rest is {gravity.size:.3g} m/s^2: gravity was"
                " taken out of these accelerations, and nothing can be calibrated by"
                f" them; {LOG_GRAVITY}"
            )
        if self._said.free and "a" in self._said.named:
            raise InputError(
                f"{self._name}: |a| at rest is {gravity.size:.3g} m/s^2, and the names"
                " of its columns are those of accelerations without gravity: nothing"
                f" can be calibrated by them; {LOG_GRAVITY}"
            )
        fits = _within(gravity.size / self._said.acc_scale, ACC_SCALES)
        shows = f"|a| at rest is {gravity.size:.4g} m/s^2 then, not gravity"
        self._ask_zero(gravity, shows)
        return self._contradict("a", shows, "--acc-unit", fits)

    def _ask_zero(self, gravity: GravityReading, shows: str) -> None:
        """Ask where the zero of counts lies whose size the user says."""
        unit, lsb = self._unit("a"), self._said.acc_lsb
        zero = zero_options(self._said, gravity)
        if lsb != 1 and "a" not in self._said.named and zero:
            raise InputError(
                f"{self._name}: {lsb:g} counts in a {unit} as you say, but {shows}: add"
                f" {zero[0]} or --acc-zero 0,0,0, if it is so"
            )

    def _of_rates(self, block: Block, gravity: GravityReading) -> list[str]:
        if not self._has_size("g"):
            return []
        turned = estimate_rate_unit(block.t, block.acc, block.gyr, gravity)
        if turned is None:
            odd = self._columns.doubts(block.t, block.acc, block.gyr, gravity)
            return odd or self._of_calm(block, gravity)
        if abs(np.log(turned)) <= MAX_LOG_SCALE:
            return self._of_ticks(block, turned)
        fits = _within(turned / self._said.gyr_scale, GYR_SCALES)
        shows = f"rates are {turned:.4g} times those at which gravity turns"
        others = self._other_times(turned)
        return self._contradict("g", shows, "--gyr-unit", fits, others)

    def _other_times(self, turned: float) -> list[str]:
        """Options for other times by which rates turn gravity as they say.

        Parameters
        ----------
        turned : how many times those at which gravity turns the rates are

        """
        if rate := self._said.rate_hz:
            return [f"--rate {rounded_text(rate * turned)}"]
        if self._said.time_unit and "time" not in self._guessed:
            return []
        return tick_options(turned, self._said.time_scale, SI)

    def _of_ticks(self, block: Block, turned: float) -> list[str]:
        """Times of a guessed unit in which rates are out by more than a factory leaves.

        A timer counts what its processor divides, such as 0.79 us, and is near a unit.
        """
        if "time" not in self._guessed or abs(np.log(turned)) <= FACTORY_SCALE:
            return []
        steps = np.diff(block.t)
        rate = turned / float(np.median(steps[steps > 0]))
        return [
            f"rates are {turned:.3g} times those at which gravity turns, and nothing"
            f" says the unit of its times: if one is no {self._said.time_unit}, name"
            f" their column _ in --columns and give --rate (about {rounded_text(rate)})"
        ]

    def _of_calm(self, block: Block, gravity: GravityReading) -> list[str]:
        """Rates by which gravity would turn where it does not."""
        turns = compare_turns(block.t, block.acc, block.gyr, gravity)
        if turns is None or turns.allow(1):
            return []
        plain = [s for s in GYR_SCALES if s.lsb == 1]
        size = self._said.gyr_scale
        fits = [s.unit for s in plain if turns.allow(size * s.size)][:1]
        return self._contradict("g", turns.odd(), "--gyr-unit", fits)

    def _unit(self, kind: str) -> str:
        return self._said.acc_unit if kind == "a" else self._said.gyr_unit

    def _has_size(self, kind: str) -> bool:
        """Whether the user or the file says a unit that has a size."""
        what = {"a": "acceleration", "g": "angular_rate"}[kind]
        unit = self._unit(kind)
        return bool(unit) and what not in self._guessed and unit not in UNSCALED

    def _contradict(
        self,
        kind: str,
        shows: str,
        option: str,
        fits: list[str],
        others: Sequence[str] = (),
    ) -> list[str]:
        """Ask about a unit of the file's; of the user's only say what is odd."""
        unit = self._unit(kind)
        if kind not in self._said.named:
            return [f"{unit} as you say, but {shows}"]
        answers = [*others]
        answers += [f"{option} {one}" for one in fits if one != unit]
        answers.append(f"{option} {unit}, if it is so")
        raise InputError(
            f"{self._name}: the names of its columns say {unit}, but {shows}: add"
            f" {' or '.join(answers)}"
        )


def _within(size: float, scales: tuple[Scale, ...]) -> list[str]:
    """Units without counts in which a quantity may show as `size`."""
    plain = [s for s in scales if s.lsb == 1]
    return [s.unit for s in plain if abs(np.log(size / s.size)) < MAX_LOG_SCALE]
