"""session.toml: description of a recording: device, site, frame, positions.

`schemas/session.schema.json` says what each key may be: a key of another kind is an
error that names file, key and remedy. Keys that it does not have are left alone, so
that others may add theirs.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.calibration import Gauge
from fieldcal.core.documents import load_toml
from fieldcal.core.errors import InputError, SessionError
from fieldcal.core.factory import FACTORY
from fieldcal.core.frames import earth_rate_home, force_home, mounting_matrix
from fieldcal.core.grade import Grade
from fieldcal.core.gravity import gravity
from fieldcal.core.positions import Position
from fieldcal.core.samples import Array
from fieldcal.core.under_way import UnderWay
from fieldcal.session.position_tables import left_out, positions_of
from fieldcal.session.schemas import refusal, validator
from fieldcal.session.units import UNITS, full_scales, gauge_of, nominal_of

FORMAT = 1
"""The format of session.toml."""


@dataclass(frozen=True, slots=True)
class Description:
    """Content of session.toml, checked and in SI units.

    Attributes
    ----------
    device : name, serial and whatever else [device] holds
    grade : "consumer", "tactical", or "navigation" when the gyroscopes see the Earth
        rate
    rate_hz : nominal sampling rate, None where unknown
    units : of "acceleration" and "angular_rate" in the samples
    limits : full scale of the same two, in SI; absent where unknown
    latitude_deg, height_m, gravity : the site; gravity in m/s^2, less what makes a base
        under way lighter
    under_way : what the motion of the base adds; of tactical grade, whose z points
        anywhere, about and along the vertical only
    level_deg : how level the base was made, one sigma about each level axis; None where
        not stated
    angle_setting_deg : how well each position's angles are set, likewise
    squareness : one sigma of each coefficient of the accelerometers' cross-coupling
        that is left in the device, likewise
    quadratic, g_sensitivity : the same of `FactoryErrors`, SI units
    axes : the mounting, procedure axis x, y, z is device axis ...
    nominal : (3,) for each key of `units.NOMINAL`: what a simulation starts from
    sent : the same as it is in samples that the device corrects before it sends them
    gauge : volts or counts in one m/s^2 and rad/s, by which outputs are divided
    model : parameters of the effects that the simulation includes, by id
    positions : as session.toml lists them
    windows : (start, end) of each position, s of device time; None where not yet known
    numbers : what session.toml counts each position as, from 0
    without : (start, end) of what is no part of the windows it lies in, s, in order

    """

    device: Mapping[str, Any]
    grade: Grade
    rate_hz: float | None
    units: Mapping[str, str]
    limits: Mapping[str, float]
    latitude_deg: float
    height_m: float
    gravity: float
    under_way: UnderWay
    level_deg: float | None
    angle_setting_deg: float | None
    squareness: float | None
    quadratic: float | None
    g_sensitivity: float | None
    axes: tuple[str, ...]
    nominal: Mapping[str, Array]
    sent: Mapping[str, Array]
    gauge: Gauge
    model: Mapping[str, Mapping[str, Any]]
    positions: tuple[Position, ...]
    windows: tuple[tuple[float, float] | None, ...]
    numbers: tuple[int, ...]
    without: tuple[tuple[float, float], ...]
    raw: Mapping[str, Any] = field(repr=False)

    @property
    def mounting(self) -> Array:
        """P of procedure = P @ device, (3, 3)."""
        return mounting_matrix(self.axes)

    @property
    def latitude(self) -> float:
        """Latitude in rad."""
        return float(np.deg2rad(self.latitude_deg))

    @property
    def velocity(self) -> tuple[float, float]:
        """Of the base towards north and East, m/s."""
        return _velocity(self.raw.get("site", {}))

    @property
    def base_force(self) -> Array:
        """Specific force of a device at rest on the base, base axes, (3,) m/s^2."""
        return force_home(self.gravity) + self.under_way.force * [1.0, 0.0, 1.0]

    @property
    def base_rate(self) -> Array:
        """Rate of the base as navigation grade sees it, (3,) rad/s; 0 for tactical."""
        rate: Array = earth_rate_home(self.latitude) + self.under_way.rate
        return rate * (self.grade == "navigation")

    @property
    def gravity_said(self) -> bool:
        """Whether somebody said how strong gravity is, or where that is."""
        return bool({"latitude_deg", "gravity"} & set(self.raw.get("site", {})))

    @property
    def sways(self) -> bool:
        """Whether somebody said that the base sways."""
        return bool(self.raw.get("site", {}).get("sways", False))

    @property
    def angles_from(self) -> str:
        """Who vouches for the angles; empty where nobody does."""
        return str(self.raw.get("site", {}).get("angles_from", ""))

    @property
    def means_only(self) -> bool:
        """Whether samples are means, one for each position."""
        return "means" in self.raw

    @property
    def timed(self) -> bool:
        """Whether anybody wrote down when means were taken; true of samples."""
        return bool(self.raw.get("means", {}).get("timed", True))

    @property
    def mean_sigma(self) -> Array:
        """Standard deviation of each position's means, (p, 6) SI; nan where unknown."""
        tables = self.raw.get("position", ())
        given = [tables[i].get("sigma", ()) for i in self.numbers]
        rows = [[*row, *[np.nan] * (6 - len(row))] for row in given]
        return np.array(rows, dtype=float).reshape(-1, 6)

    def in_time(self) -> Description:
        """The same with the positions in the order in which they were held."""
        begins = [w[0] for w in self.windows if w is not None]
        if begins == sorted(begins):
            return self
        last = [np.inf if w is None else w[0] for w in self.windows]
        order = sorted(range(len(last)), key=last.__getitem__)
        return replace(
            self,
            positions=tuple(self.positions[i] for i in order),
            windows=tuple(self.windows[i] for i in order),
            numbers=tuple(self.numbers[i] for i in order),
        )

    def refuse_overlap(self) -> None:
        """Refuse windows that do not follow each other.

        Samples in two windows would count twice, and turns lie between windows.

        Raises
        ------
        InputError
            Naming both positions.

        """
        ordered = self.in_time()
        rows = zip(ordered.windows, ordered.numbers, strict=True)
        held = [(window, number) for window, number in rows if window]
        for (window, number), (then, following) in pairwise(held):
            if then[0] < window[1]:
                raise InputError(
                    f"position {following + 1}: its window starts at {then[0]:g} s,"
                    f" before that of position {number + 1} ends ({window[1]:g} s): the"
                    " device cannot be in both; mend start_s and end_s"
                )

    def with_angles_times(self, size: float) -> Description:
        """The same with all angles of positions so many times as large."""
        if size == 1.0:
            return self
        return replace(self, positions=tuple(p.times(size) for p in self.positions))

    def numbered(self, positions: Iterable[int]) -> tuple[int, ...]:
        """Return what session.toml counts them as; a recording without any is 0."""
        numbers = self.numbers or (0,)
        return tuple(numbers[p] for p in positions)


def read(path: Path) -> Description:
    """Read a session.toml.

    Raises
    ------
    SessionError
        Naming the file, the key and the remedy.

    """
    try:
        raw = load_toml(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise SessionError(
            f"{path.parent}: is no session: it has no {path.name}; name a folder that"
            " has one, or make one with fieldcal import"
        ) from error
    except (OSError, UnicodeDecodeError) as error:
        raise SessionError(f"{path}: cannot be read: {error}") from error
    except tomllib.TOMLDecodeError as error:
        raise SessionError(f"{path}: is not TOML: {error}") from error
    try:
        return parse(raw)
    except InputError as error:
        raise SessionError(f"{path}: {error}") from error


def parse(raw: Mapping[str, Any]) -> Description:
    """Check the tables of a session.toml.

    Raises
    ------
    InputError
        Naming the key and the remedy.

    """
    if wrong := refusal(raw, validator("session")):
        raise InputError(wrong)
    device, site = raw.get("device", {}), raw.get("site", {})
    given = raw.get("units", {})
    units = {k: given.get(k, next(iter(known))) for k, known in UNITS.items()}
    latitude = float(site.get("latitude_deg", 45.0))
    height = float(site.get("height_m", 0.0))
    positions, windows = positions_of(raw.get("position", ()))
    axes = raw.get("frame", {}).get("mounting", ("+x", "+y", "+z"))
    mounting_matrix(axes)
    usual = nominal_of(raw.get("nominal", {}))
    gauge = gauge_of(units, usual)
    nominal = {n: v / gauge.size[n.startswith("gyr")] for n, v in usual.items()}
    grade: Grade = device.get("grade", "tactical")
    moving = UnderWay.at(*_velocity(site), float(np.deg2rad(latitude)), height)
    level = _known(site.get("level_deg"))
    if grade != "navigation" and level is not None:
        level = float(np.hypot(level, np.rad2deg(moving.lean)))
    return Description(
        device=device,
        grade=grade,
        rate_hz=_known(raw.get("sampling", {}).get("rate_hz")),
        units=units,
        limits=full_scales(raw.get("range", {}), units, gauge),
        latitude_deg=latitude,
        height_m=height,
        gravity=float(site.get("gravity") or gravity(latitude, height))
        - float(moving.force[1]),
        under_way=moving if grade == "navigation" else moving.level,
        level_deg=level,
        angle_setting_deg=_known(site.get("angle_setting_deg")),
        **{name: _known(device.get(name)) for name in FACTORY},
        axes=tuple(axes),
        nominal=nominal,
        sent=nominal,
        gauge=gauge,
        model=_model(raw.get("model", {})),
        positions=positions,
        windows=windows,
        numbers=tuple(range(len(positions))),
        without=left_out(raw.get("position", ())),
        raw=raw,
    )


def with_more(about: Description, positions: Iterable[Position]) -> Description:
    """The same with positions of known angles behind those that it has."""
    more = []
    for position in positions:
        alpha, beta = position.degrees or (0.0, 0.0)
        more.append({"name": position.name, "alpha_deg": alpha, "beta_deg": beta})
    if not more:
        return about
    return parse({**about.raw, "position": [*about.raw.get("position", ()), *more]})


def _velocity(site: Mapping[str, Any]) -> tuple[float, float]:
    """Towards north and East, m/s."""
    return float(site.get("north_m_s", 0.0)), float(site.get("east_m_s", 0.0))


def _known(value: float | None) -> float | None:
    return None if value is None else float(value)


def _model(table: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    found = {name: table.get(name, {}) for name in table.get("effects", ())}
    for name, parameters in found.items():
        if not isinstance(parameters, Mapping):
            raise InputError(f"[model] {name} cannot be: write a table [model.{name}]")
    return found
