"""Description of a recording: device, site, frame, positions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from fieldcal.calibration import Gauge
from fieldcal.core.base_motion import BaseMotion
from fieldcal.core.errors import InputError
from fieldcal.core.frames import (
    earth_rate_at_home,
    mounting_matrix,
    specific_force_at_home,
)
from fieldcal.core.grade import Grade
from fieldcal.core.positions import Position
from fieldcal.core.samples import Array
from fieldcal.session.site import velocity


@dataclass(frozen=True, slots=True)
class Description:
    """Content of session.toml, checked and in SI units.

    Attributes
    ----------
    device : table [device]: name, serial, …; values that JSON can represent
    grade : "consumer", "tactical", or "navigation" if the gyroscopes measure the
        Earth's rate
    rate_hz : nominal sampling rate, None where unknown
    clock_sigma : relative standard deviation of the times, which were counted from the
        rate; 0 if the device or a host measured them
    units : of "acceleration" and "angular_rate" in the samples
    limits : full scale of the same two, in SI; absent where unknown
    latitude_deg, height_m, gravity : the site; latitude_deg is None if it is not
        stated, and gravity then that of 45 degrees; gravity in m/s^2, less the vertical
        force due to the motion of the base
    base_motion : rate and force due to the motion of the base; without navigation grade
        the heading is unknown, and only the parts about and along the vertical are kept
    level_deg : standard deviation of the level of the base about each level axis; None
        if not stated
    angle_setting_deg : standard deviation of each position's angles; None if not stated
    squareness : standard deviation of each coefficient of the accelerometers'
        cross-coupling that the factory left; None if not stated
    quadratic, g_sensitivity : as in `FactoryErrors`, SI units; None if not stated
    axes : the mounting: names of the device axes along procedure axes x, y, z
    nominal : calibration that a simulation starts from, (3,) for each key of
        `units.NOMINAL`
    nominal_as_sent : the same in the samples of a device that corrects
        them before it sends them
    gauge : volts or counts per m/s^2 and per rad/s, by which outputs are divided
    model : parameters of the effects that the simulation includes, by id
    positions : as session.toml lists them
    windows : (start, end) of each position, s of device time; None if not yet known
    position_numbers : index of each position in session.toml, from 0
    excluded_spans : (start, end) of samples that are excluded from the windows that
        contain them, or that are damaged in the file, s, in order
    gaps_without_restart : (last, first) time of the samples around each gap through
        which the device's clock, which begins anew at a restart, went on, s
    smoothing : (2, 2) time constants of a smoothing that was undone in the samples of
        accelerometers and of gyroscopes, and their standard deviations, s; 0 if there
        was none

    """

    device: Mapping[str, Any]
    grade: Grade
    rate_hz: float | None
    clock_sigma: float
    units: Mapping[str, str]
    limits: Mapping[str, float]
    latitude_deg: float | None
    height_m: float
    gravity: float
    base_motion: BaseMotion
    level_deg: float | None
    angle_setting_deg: float | None
    squareness: float | None
    quadratic: float | None
    g_sensitivity: float | None
    axes: tuple[str, ...]
    nominal: Mapping[str, Array]
    nominal_as_sent: Mapping[str, Array]
    gauge: Gauge
    model: Mapping[str, Mapping[str, Any]]
    positions: tuple[Position, ...]
    windows: tuple[tuple[float, float] | None, ...]
    position_numbers: tuple[int, ...]
    excluded_spans: tuple[tuple[float, float], ...]
    gaps_without_restart: tuple[tuple[float, float], ...]
    raw: Mapping[str, Any] = field(repr=False)
    smoothing: Array

    @property
    def mounting(self) -> Array:
        """P of procedure = P @ device, (3, 3)."""
        return mounting_matrix(self.axes)

    @property
    def latitude(self) -> float:
        """Latitude in rad; nan if it is not stated."""
        stated = np.nan if self.latitude_deg is None else self.latitude_deg
        return float(np.deg2rad(stated))

    @property
    def velocity(self) -> tuple[float, float]:
        """Velocity of the base towards north and east, m/s."""
        return velocity(self.raw.get("site", {}))

    @property
    def base_force(self) -> Array:
        """Specific force of a device at rest on the base, base axes, (3,) m/s^2."""
        return specific_force_at_home(self.gravity) + self.base_motion.force * [
            1.0,
            0.0,
            1.0,
        ]

    @property
    def base_rate(self) -> Array:
        """Known rate of the base in base axes, (3,) rad/s.

        Zero unless the grade is navigation and the latitude is stated.
        """
        if self.grade != "navigation" or self.latitude_deg is None:
            return np.zeros(3)
        rate: Array = earth_rate_at_home(self.latitude) + self.base_motion.rate
        return rate

    @property
    def gravity_stated(self) -> bool:
        """Whether gravity or a latitude is stated."""
        return bool({"latitude_deg", "gravity"} & set(self.raw.get("site", {})))

    @property
    def base_sways(self) -> bool:
        """Whether the session states that the base sways."""
        return bool(self.raw.get("site", {}).get("sways", False))

    @property
    def keeps_gyro_bias(self) -> bool:
        """Whether it is stated that the device subtracts no bias at rest."""
        return bool(self.device.get("keeps_gyro_bias", False))

    @property
    def recording_id(self) -> str:
        """Id that the recorder wrote into the session; empty without one."""
        return str(self.raw.get("recording", {}).get("id", ""))

    @property
    def angles_from(self) -> str:
        """Source of the stated angles; empty if not stated."""
        return str(self.raw.get("site", {}).get("angles_from", ""))

    @property
    def means_only(self) -> bool:
        """Whether each sample is the mean of one position."""
        return "means" in self.raw

    @property
    def means_timed(self) -> bool:
        """Whether the times of means are known; true for samples."""
        return bool(self.raw.get("means", {}).get("timed", True))

    @property
    def mean_sigma(self) -> Array:
        """Standard deviation of each position's means, (p, 6) SI; nan where unknown."""
        tables = self.raw.get("position", ())
        given = [tables[i].get("sigma", ()) for i in self.position_numbers]
        known = [[np.nan if one == "unknown" else one for one in row] for row in given]
        rows = [[*row, *[np.nan] * (6 - len(row))] for row in known]
        return np.array(rows, dtype=float).reshape(-1, 6)

    def in_time_order(self) -> Description:
        """The description with positions in the order in which they were held."""
        begins = [w[0] for w in self.windows if w is not None]
        if begins == sorted(begins):
            return self
        last = [np.inf if w is None else w[0] for w in self.windows]
        order = sorted(range(len(last)), key=last.__getitem__)
        return replace(
            self,
            positions=tuple(self.positions[i] for i in order),
            windows=tuple(self.windows[i] for i in order),
            position_numbers=tuple(self.position_numbers[i] for i in order),
        )

    def refuse_overlap(self) -> None:
        """Refuse windows that do not follow each other.

        Samples in two windows would count twice, and a turn needs time between windows.

        Raises
        ------
        InputError
            Naming both positions.

        """
        ordered = self.in_time_order()
        rows = zip(ordered.windows, ordered.position_numbers, strict=True)
        held = [(window, number) for window, number in rows if window]
        for (window, number), (then, following) in pairwise(held):
            if then[0] < window[1]:
                raise InputError(
                    f"position {following + 1}: its window starts at {then[0]:g} s,"
                    f" before that of position {number + 1} ends ({window[1]:g} s): the"
                    " device cannot be in both; mend start_s and end_s"
                )

    def with_scaled_angles(self, size: float) -> Description:
        """The description with all angles of its positions multiplied by `size`."""
        if size == 1.0:
            return self
        return replace(self, positions=tuple(p.scaled(size) for p in self.positions))

    def indices_in_file(self, positions: Iterable[int]) -> tuple[int, ...]:
        """Return the index of positions in session.toml; 0 if the session has none."""
        numbers = self.position_numbers or (0,)
        return tuple(numbers[p] for p in positions)
