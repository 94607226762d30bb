"""What is taken for units that neither the file nor the user says, and why.

What physics tells is taken, said, and kept as a guess until the user confirms it; where
it leaves a choice, the user is asked, with what to add to the command.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array, Block, concat
from fieldcal.importing import physical_units as physics
from fieldcal.importing.merge import MergedFiles
from fieldcal.importing.physical_units import Gravity, Scale
from fieldcal.importing.recording import ReadOptions, Recording
from fieldcal.session.description import UNSCALED

ROWS = 1 << 17
"""Rows at the beginning by which units are told."""

FAST = 0.5
"""Rate, rad/s, that nothing at rest shows: 30 deg/s."""

ROUGH = 0.02
"""Scatter of rates from sample to sample, rad/s, that nothing at rest shows."""

FAR = 0.25
"""Logarithm of what no sensor in the unit that is said is out by."""

NO_GRAVITY = 0.05
"""Part of g below which gravity was taken out; mg and g in m/s^2 read otherwise."""

OFFSET = 0.25
"""Part of g that no bias is: what raw counts show more is where their zero lies."""


class Settled(NamedTuple):
    """What was taken for what nobody said.

    Attributes
    ----------
    guessed : a sentence each, by quantity
    acc_bias : x y z of [nominal], m/s^2; None where zero lies at zero

    """

    guessed: dict[str, str]
    acc_bias: list[float] | None = None


def settle_units(recording: Recording, stream: str) -> Settled:
    """Give a recording the units that its numbers tell.

    Raises
    ------
    InputError
        With a question and its answers, where several or none would do.

    """
    parts = recording.parts if isinstance(recording, MergedFiles) else [recording]
    block = _beginning(recording.alone(stream), stream)
    if not all(part.asks_units for part in parts):
        _hold_against_physics(recording, block)
        return Settled({})
    guess = _Guess(str(recording.path), _said(parts), block)
    for part in parts:
        part.wanted = guess.on(part.wanted)
    parts[0].says += guess.doubts
    columns = {k: why for part in parts for k, why in part.guessed.items()}
    return Settled(columns | guess.found, guess.acc_bias)


def _hold_against_physics(recording: Recording, block: Block) -> None:
    """Ask or say where a format's own units cannot be.

    Raises
    ------
    InputError
        If the format has an option that would make them right.

    """
    gravity = physics.gravity_in(block.acc)
    if gravity is None or abs(np.log(gravity.size / G0)) < FAR:
        return
    turned = physics.rate_in(block.t, block.acc, block.gyr, gravity)
    odd = (
        f"|a| at rest is {gravity.size:.4g} m/s^2, {gravity.size / G0:.3g} times"
        " gravity: its full scale or unit is another"
    )
    if answer := recording.rescaled(gravity.size / G0, turned or 1.0):
        raise InputError(f"{recording.path}: {odd}: add {answer}")
    recording.says.append(odd)


def _beginning(recording: Recording, stream: str) -> Block:
    blocks, rows = [], 0
    for block in recording.blocks(stream):
        blocks.append(block)
        rows += len(block)
        if rows >= ROWS:
            break
    return concat(blocks)[:ROWS]


def _said(parts: Sequence[Recording]) -> ReadOptions:
    """What is said of any part: each channel stands in one of them."""
    said = parts[0].wanted
    for part in parts[1:]:
        w = part.wanted
        said = replace(
            said,
            acc_unit=said.acc_unit or w.acc_unit,
            gyr_unit=said.gyr_unit or w.gyr_unit,
            time_unit=said.time_unit or w.time_unit,
            named=said.named | w.named,
        )
    return said


class _Guess:
    """Units of the beginning of a recording.

    Attributes
    ----------
    found : what was guessed, by quantity
    said : what is said, with what was found
    acc_bias : as in `Settled`
    doubts : what the user says and physics does not, a sentence each

    """

    def __init__(self, name: str, said: ReadOptions, block: Block) -> None:
        self.found: dict[str, str] = {}
        self.acc_bias: list[float] | None = None
        self.doubts: list[str] = []
        self._name, self.said, self._read = name, said, said
        if not (said.time_unit or said.rate_hz):
            self._time(block.t)
        gravity = physics.gravity_in(block.acc)
        t = block.t * (self.said.time_scale / said.time_scale)
        block = replace(block, t=t)
        if gravity and not said.acc_unit and said.acc_lsb == 1:
            self._acceleration(gravity, block.acc)
        elif gravity and said.acc_lsb != 1:
            gravity = physics.with_length(block.acc, G0) or gravity
        if gravity and self.said.acc_lsb != 1:
            self._offset(gravity)
        if not said.gyr_unit and said.gyr_lsb == 1:
            self._rates(block, gravity)
        self._doubt(block, gravity)
        if not said.temp_unit:
            self._temperature(block.temperature)

    def on(self, wanted: ReadOptions) -> ReadOptions:
        """Options of a part with what was found."""
        found = self.said
        if "time" in self.found:
            wanted = replace(wanted, time_unit=found.time_unit)
        if "acceleration" in self.found:
            wanted = replace(wanted, acc_unit=found.acc_unit, acc_lsb=found.acc_lsb)
        if "angular_rate" in self.found:
            wanted = replace(wanted, gyr_unit=found.gyr_unit, gyr_lsb=found.gyr_lsb)
        if "temperature" in self.found:
            wanted = replace(wanted, temp_unit=found.temp_unit)
        return wanted

    def _time(self, t: Array) -> None:
        fits = physics.time_units(t)
        steps = np.diff(t[np.isfinite(t)])
        step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
        if len(fits) == 1 and fits != ["s"]:
            rate = physics.TIME_SIZES[fits[0]] / step if step else np.nan
            self.said = replace(self.said, time_unit=fits[0])
            self.found["time"] = f"{fits[0]}, which makes {rate:.4g} Hz"
        elif len(fits) > 1:
            rates = (f"{physics.TIME_SIZES[u] / step:.4g} Hz in {u}" for u in fits)
            self._ask(
                f"its times may be {' or '.join(rates)}",
                [f"--time-unit {u}" for u in fits],
            )

    def _acceleration(self, gravity: Gravity, acc: Array) -> None:
        fits = physics.fitting(
            gravity.size, physics.ACC_SCALES, physics.ACC_OUT[not gravity.round]
        )
        fits = _as_written(fits, acc)
        shows = f"|a| at rest is {gravity.size:.4g}"
        if gravity.round:
            shows += " (from a sphere through the rests)"
        if len(fits) != 1:
            self._ask(
                f"{shows}, which is gravity in"
                f" {' or '.join(map(str, fits)) or 'no usual unit'}",
                _answers("acc", fits, "g", 2048),
            )
        if fits[0].unit != "m/s^2":
            self.found["acceleration"] = f"{fits[0]}: {shows}"
            self.said = replace(self.said, acc_unit=fits[0].unit, acc_lsb=fits[0].lsb)

    def _offset(self, gravity: Gravity) -> None:
        if (np.abs(gravity.offset) > OFFSET * gravity.size).any():
            counts = gravity.offset / self._read.acc_scale
            reads = " ".join(f"{number:.5g}" for number in counts)
            self.acc_bias = [round(b * self.said.acc_scale, 4) for b in counts]
            self.found["acc_bias"] = f"{reads} counts: the sphere lies about it"

    def _rates(self, block: Block, gravity: Gravity | None) -> None:
        gyr = block.gyr[np.isfinite(block.gyr).all(axis=1)]
        if len(gyr) < physics.FEWEST:
            return
        reads = gravity and physics.rate_in(block.t, block.acc, block.gyr, gravity)
        if reads is None or gravity is None:
            usual = float(np.median(np.abs(gyr).max(axis=1)))
            noise = float(np.nanmedian(np.abs(np.diff(gyr, axis=0)), axis=0).max())
            if usual > FAST or noise > ROUGH:
                shown = f"{usual:.4g}" if usual > FAST else f"a scatter of {noise:.2g}"
                self._ask(
                    f"nothing says the unit of its rates, and {shown} rad/s is no rest",
                    _unusual(gyr),
                )
            self.found["angular_rate"] = "rad/s: it is the usual one, and no turn tells"
            self.said = replace(self.said, gyr_unit="rad/s")
            return
        fits = physics.fitting(
            reads, physics.GYR_SCALES, physics.GYR_OUT[not gravity.round]
        )
        fits = _as_written(fits, block.gyr)
        if self.said.acc_lsb != 1 and (counts := [f for f in fits if f.lsb != 1]):
            # who writes one sensor's registers as they are, writes the other's so too
            fits = counts
        shows = f"as gravity turns, 1 rad/s reads {reads:.4g}"
        if len(fits) != 1:
            self._ask(
                f"{shows}, which is {' or '.join(map(str, fits)) or 'no usual unit'}",
                _answers("gyr", fits, "deg/s", 16.4),
            )
        if fits[0].unit != "rad/s":
            self.found["angular_rate"] = f"{fits[0]}: {shows}"
            self.said = replace(self.said, gyr_unit=fits[0].unit, gyr_lsb=fits[0].lsb)

    def _doubt(self, block: Block, gravity: Gravity | None) -> None:
        """Hold units that are said against physics."""
        if gravity is None:
            return
        reads, option = gravity.size / G0, "--acc-unit"
        if reads < NO_GRAVITY and self._said_of("a"):
            raise InputError(
                f"{self._name}: |a| at rest is {gravity.size:.3g} m/s^2: gravity was"
                " taken out of these accelerations, and nothing can be calibrated by"
                " them; log those with gravity in them"
            )
        if self._said_of("a") and abs(np.log(reads)) > FAR:
            fits = [
                s.unit
                for s in physics.ACC_SCALES[:3]
                if abs(np.log(gravity.size / self.said.acc_scale / s.size)) < FAR
            ]
            shows = f"|a| at rest is {gravity.size:.4g} m/s^2 then, not gravity"
            self._contradict("a", self.said.acc_unit, shows, option, fits)
        if not self._said_of("g"):
            return
        turned = physics.rate_in(block.t, block.acc, block.gyr, gravity)
        if turned is not None and abs(np.log(turned)) > FAR:
            scale = self.said.gyr_scale
            fits = [
                s.unit
                for s in physics.GYR_SCALES[:3]
                if abs(np.log(turned / scale / s.size)) < FAR
            ]
            shows = f"rates are {turned:.4g} times those at which gravity turns"
            self._contradict("g", self.said.gyr_unit, shows, "--gyr-unit", fits)

    def _said_of(self, kind: str) -> bool:
        """Whether the user or the file says a unit that has a size."""
        unit, what = {
            "a": (self.said.acc_unit, "acceleration"),
            "g": (self.said.gyr_unit, "angular_rate"),
        }[kind]
        return bool(unit) and what not in self.found and unit not in UNSCALED

    def _contradict(
        self, kind: str, unit: str, shows: str, option: str, fits: list[str]
    ) -> None:
        """Ask about a unit of the file's; of the user's only say what is odd."""
        if kind not in self.said.named:
            self.doubts.append(f"{unit} as you say, but {shows}")
            return
        answers = [f"{option} {one}" for one in fits if one != unit]
        self._ask(
            f"the names of its columns say {unit}, but {shows}",
            [*answers, f"{option} {unit}, if it is so"],
        )

    def _temperature(self, values: Array) -> None:
        fits = physics.temperature_fits(values)
        if "degC" in fits:
            return
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        if len(fits) != 1:
            self._ask(
                f"its temperature reads {low:.6g} to {high:.6g}, which is no deg C",
                [
                    *(f"--temp-unit {unit}" for unit in fits),
                    *physics.temperature_counts(low, high),
                    "--temp-unit none, which leaves it out",
                ],
            )
        ((unit, middle),) = fits.items()
        self.said = replace(self.said, temp_unit=unit)
        self.found["temperature"] = f"{unit}: it is {middle:.1f} deg C then"

    def _ask(self, what: str, answers: list[str]) -> None:
        raise InputError(f"{self._name}: {what}: add {' or '.join(answers)}")


def _as_written(fits: list[Scale], values: Array) -> list[Scale]:
    """Scales without counts, where values are no whole numbers and others do."""
    known = values[np.isfinite(values)]
    plain = [fit for fit in fits if fit.lsb == 1]
    return plain if plain and (known != np.round(known)).any() else fits


def _unusual(gyr: Array) -> list[str]:
    """Options for rates of which no turn tells: counts, if they are whole numbers."""
    if (gyr == np.round(gyr)).all():
        counts = [s for s in physics.GYR_SCALES if s.lsb != 1][1:5]
        return _answers("gyr", counts, "deg/s", 16.4)
    return ["--gyr-unit deg/s", "--gyr-unit rad/s, if it is so"]


def _answers(kind: str, fits: list[Scale], unit: str, lsb: float) -> list[str]:
    """Options to paste: those that fit, or examples."""
    lines = [
        f"--{kind}-unit {s.unit}" + (f" --{kind}-lsb {s.lsb:.6g}" if s.lsb != 1 else "")
        for s in fits
    ]
    return lines or [
        f"--{kind}-unit {unit} --{kind}-lsb {lsb:g} (counts in one {unit}, as its data"
        " sheet says)",
        f"--{kind}-unit {unit}",
    ]
