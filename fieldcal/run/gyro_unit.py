"""Whether the gyroscopes are in the unit that they are taken for, by the first turns.

The rotation of gravity in device axes gives the true rate. A reading of 1 per rad/s
means rad/s, one of 57.3 means deg/s. Before the first turn there is a hint: at rest by
the accelerometers, while the rates change more than those of any device at rest.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.importing.units.gravity_size import GravityReading
from fieldcal.importing.units.rate_size import estimate_rate_unit
from fieldcal.importing.units.scales import GYR_OUT, GYR_SCALES, fitting_scales

MEAN_S = 0.05
"""Length of each mean that is kept, s of device time."""

MEANS_KEPT = 2400
"""Means that are kept: two minutes."""

CHECK_EVERY_S = 2.0
"""Device time between two checks, s."""

ACC_REST_SCATTER = 0.1
"""Largest scatter of means of the accelerometers at rest, m/s^2."""

LEAST_TURN = 0.15
"""Turn of gravity that shows the unit, as of `rate_size.TURNED`, rad: 45° within 9 s,
or 22° within 4 s there and back. On a bench nothing else moves gravity, so a smaller
turn is enough than in an unknown recording."""

HINT_AFTER_S = 5.0
"""Rest by the accelerometers alone after which changing rates are reported, s."""

SMALLER_UNITS = {"deg/s": np.pi / 180, "mrad/s": 1e-3}
"""Units that an address may state in place of rad/s, in rad/s."""


class GyroUnitWatch:
    """Determines the unit of the angular rates from samples as they arrive.

    Parameters
    ----------
    gravity : m/s^2

    Attributes
    ----------
    notice : sentence about a wrong unit that a turn has shown; empty without one
    unit : unit of the rates by a turn; empty before the first turn

    """

    def __init__(self, gravity: float) -> None:
        self._gravity = GravityReading(gravity, np.zeros(3), False)
        self._means: deque[Array] = deque(maxlen=MEANS_KEPT)
        self._part: list[Block] = []
        self._looked = -np.inf
        self._proved = False
        self.notice = self.unit = ""

    def add(self, block: Block) -> None:
        """Take in the block that follows; costs nothing once the unit is known."""
        if self.unit:
            return
        last = float(block.t[-1])
        self._part.append(block)
        if last - self._part[0].t[0] >= MEAN_S:
            rows = [np.column_stack([b.t, b.acc, b.gyr]) for b in self._part]
            self._means.append(np.vstack(rows).mean(axis=0))
            self._part = []
        if last - self._looked >= CHECK_EVERY_S and not self.notice:
            self._looked = last
            self.notice = self._check_unit()

    def _check_unit(self) -> str:
        if not self._means:
            return ""
        table = np.array(self._means)
        reads = estimate_rate_unit(
            table[:, 0], table[:, 1:4], table[:, 4:], self._gravity, LEAST_TURN
        )
        if reads is None:
            return ""
        fits = fitting_scales(reads, GYR_SCALES, GYR_OUT[1])
        self.unit = fits[0].unit if fits and fits[0].lsb == 1 else ""
        self._proved = bool(fits) and fits[0].unit == "rad/s"
        if self._proved:
            return ""
        if not fits:
            return _taken_for_less(reads)
        said = f"as gravity turns, the gyroscopes read {reads:.3g} for 1 rad/s: they"
        if fits[0].lsb != 1:
            return (
                f"{said} send {fits[0]}, and are taken for rad/s; end this (q), and say"
                " so in the device's address: the range, or where it takes units"
                f" gyr_unit={1 / fits[0].lsb:.6g}*{fits[0].unit}"
            )
        return (
            f"{said} are in {fits[0].unit} and not in rad/s; end this (q) and begin"
            f" again with gyr_unit={fits[0].unit} in the device's address"
        )

    def _last_means(self, moving: float) -> Array:
        """Means (n, 7) of the time in which it did not come to rest; none of less."""
        count = int(HINT_AFTER_S / MEAN_S)
        enough = moving >= HINT_AFTER_S and len(self._means) >= count
        return np.array(self._means)[-count:] if enough else np.zeros((0, 7))

    def steady_norm(self, moving: float) -> float:
        """Length of a force that is steady, though not at rest for `moving` s, m/s^2.

        Steady in parts of its own length, whatever unit that is in; nan if it is not.
        """
        acc = self._last_means(moving)[:, 1:4]
        if not len(acc):
            return float("nan")
        norm = float(np.linalg.norm(acc.mean(axis=0)))
        steady = (acc.std(axis=0) < ACC_REST_SCATTER / self._gravity.size * norm).all()
        return norm if steady else float("nan")

    def question(self, moving: float) -> str:
        """Question about the unit if the device has not come to rest for `moving` s.

        Empty unless it rests by its accelerometers, and no turn has shown the unit.
        """
        lately = self._last_means(moving)
        if self.notice or self._proved or not len(lately):
            return ""
        if not (lately[:, 1:4].std(axis=0) < ACC_REST_SCATTER).all():
            return ""
        size = float(np.nanmax(np.abs(lately[:, 4:]), initial=0.0))
        return (
            f"the accelerometers rest, the gyroscopes read up to {size:.2g} rad/s: if"
            " they are in deg/s, begin again with gyr_unit=deg/s in the device's"
            " address; a turn by 45° will tell"
        )


def _taken_for_less(reads: float) -> str:
    """Notice for rates in rad/s that the address declares to be in a smaller unit.

    `reads` is what they read for 1 rad/s. Empty for any other reading.
    """
    for unit, size in SMALLER_UNITS.items():
        if abs(np.log(max(reads, 1e-9) / size)) < GYR_OUT[1]:
            return (
                f"as gravity turns, the gyroscopes read {reads:.3g} for 1 rad/s: they"
                f" are in rad/s, and are taken for {unit}; end this (q) and begin again"
                " with gyr_unit=rad/s in the device's address"
            )
    return ""
