"""session.toml: what was known and planned about a recording.

Parsing is strict where a slip would change numbers: a key of the wrong kind, an unknown
unit or a mounting that is none is an error that names file, key and remedy. Keys this
version does not know are left alone, so that others may add theirs.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.calibration import Gauge
from fieldcal.calibration.gauge import SI
from fieldcal.core.errors import InputError, SessionError
from fieldcal.core.frames import mounting_matrix
from fieldcal.core.gravity import G0, gravity
from fieldcal.core.positions import Position
from fieldcal.core.samples import Array
from fieldcal.session import fields

FORMAT = 1
STEEPEST = 10.0
"""Largest uncertainty of a base that one may call level, deg."""

GRADES = ("tactical", "navigation")

ACC_UNITS = {"m/s^2": 1.0, "g": G0, "mg": 1e-3 * G0, "V": 1.0, "count": 1.0}
GYR_UNITS = {
    "rad/s": 1.0,
    "deg/s": np.pi / 180,
    "mrad/s": 1e-3,
    "V": 1.0,
    "count": 1.0,
}
"""SI units in one of each; what has no such relation is divided by the gauge."""

WORTHLESS = ("V", "count")
"""Units that only the nominal scale factors say the worth of."""

_UNITS = {"acceleration": ACC_UNITS, "angular_rate": GYR_UNITS}

TRIADS = ("acc_bias", "acc_scale", "gyr_bias", "gyr_scale")
NOMINAL_SCALES = ("acc_scale", "gyr_scale")
NOMINAL = {"acc_bias": 0.0, "acc_scale": 1.0, "gyr_bias": 0.0, "gyr_scale": 1.0}


@dataclass(frozen=True, slots=True)
class Description:
    """What session.toml says, checked and in SI units.

    Attributes
    ----------
    device : name, serial and whatever else [device] holds
    grade : "tactical", or "navigation" when the gyroscopes see the Earth rate
    rate_hz : nominal sampling rate, None where unknown
    units : of "acceleration" and "angular_rate" in the samples
    limits : full scale of the same two, in SI; absent where unknown
    latitude_deg, height_m, gravity : the site; gravity in m/s^2
    level_deg : how level the base was made, one sigma about each level axis; None where
        nobody said
    angle_setting_deg : how well each position's angles are set, likewise
    axes : the mounting, procedure axis x, y, z is device axis ...
    nominal : (3,) for each of `TRIADS`: the calibration a simulation starts from
    gauge : volts or counts in one m/s^2 and rad/s, by which outputs are divided
    model : parameters of the effects that the simulation includes, by id
    positions : as session.toml lists them
    windows : (start, end) of each position, s of device time; None where not yet known
    numbers : what session.toml counts each position as, from 0

    """

    device: Mapping[str, Any]
    grade: str
    rate_hz: float | None
    units: Mapping[str, str]
    limits: Mapping[str, float]
    latitude_deg: float
    height_m: float
    gravity: float
    level_deg: float | None
    angle_setting_deg: float | None
    axes: tuple[str, ...]
    nominal: Mapping[str, Array]
    gauge: Gauge
    model: Mapping[str, Mapping[str, Any]]
    positions: tuple[Position, ...]
    windows: tuple[tuple[float, float] | None, ...]
    numbers: tuple[int, ...]
    raw: Mapping[str, Any] = field(repr=False)

    @property
    def mounting(self) -> Array:
        """P of procedure = P @ device, (3, 3)."""
        return mounting_matrix(self.axes)

    @property
    def latitude(self) -> float:
        """Latitude in rad."""
        return float(np.deg2rad(self.latitude_deg))

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
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
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
    if raw.get("format", FORMAT) != FORMAT:
        raise InputError(
            f"format = {raw['format']!r} is not {FORMAT}; this version reads format"
            f" {FORMAT} only"
        )
    device, site = fields.table(raw, "device"), fields.table(raw, "site")
    units = {
        kind: fields.choice(raw, "units", kind, known, next(iter(known)))
        for kind, known in _UNITS.items()
    }
    latitude = fields.number(site, "site", "latitude_deg", 45.0)
    height = fields.number(site, "site", "height_m", 0.0)
    positions, windows = _positions(raw)
    axes = fields.table(raw, "frame").get("mounting", ["+x", "+y", "+z"])
    if not isinstance(axes, list) or not all(isinstance(a, str) for a in axes):
        raise InputError('[frame] mounting must be like ["+x", "+y", "+z"]')
    mounting_matrix(axes)
    nominal = {name: _triad(fields.table(raw, "nominal"), name) for name in TRIADS}
    gauge = _gauge(units, nominal)
    return Description(
        device=device,
        grade=fields.choice(raw, "device", "grade", GRADES, "tactical"),
        rate_hz=fields.positive(fields.table(raw, "sampling"), "sampling", "rate_hz"),
        units=units,
        limits=_limits(fields.table(raw, "range"), units, gauge),
        latitude_deg=latitude,
        height_m=height,
        gravity=fields.positive(site, "site", "gravity") or gravity(latitude, height),
        level_deg=_angle(site, "level_deg", "no level base"),
        angle_setting_deg=_angle(site, "angle_setting_deg", "no setting of an angle"),
        axes=tuple(axes),
        nominal={n: v / gauge.size[n.startswith("gyr")] for n, v in nominal.items()},
        gauge=gauge,
        model=_model(fields.table(raw, "model")),
        positions=positions,
        windows=windows,
        numbers=tuple(range(len(positions))),
        raw=raw,
    )


def _angle(site: Mapping[str, Any], key: str, what: str) -> float | None:
    """How well an angle is known, deg; None where nobody said."""
    sigma = fields.positive(site, "site", key)
    if sigma is not None and sigma > STEEPEST:
        raise InputError(
            f"[site] {key} = {sigma:g} is {what}: give one sigma in degrees, up to"
            f" {STEEPEST:g}"
        )
    return sigma


def _gauge(units: Mapping[str, str], nominal: Mapping[str, Array]) -> Gauge:
    """By the nominal scale factors, where the unit itself is worth nothing known."""
    size, named = [1.0, 1.0], list(SI)
    for i, (kind, scale) in enumerate(zip(_UNITS, NOMINAL_SCALES, strict=True)):
        if units[kind] in WORTHLESS:
            size[i], named[i] = float(np.abs(nominal[scale]).mean()), units[kind]
    if not all(size):
        raise InputError("[nominal] a scale factor of 0 sees nothing: mend it")
    return Gauge((size[0], size[1]), (named[0], named[1]))


def _limits(
    table: Mapping[str, Any], units: Mapping[str, str], gauge: Gauge
) -> dict[str, float]:
    limits = {kind: fields.positive(table, "range", kind) for kind in _UNITS}
    worth = {
        k: _UNITS[k][units[k]] / c for k, c in zip(_UNITS, gauge.size, strict=True)
    }
    return {k: v * worth[k] for k, v in limits.items() if v is not None}


def _triad(table: Mapping[str, Any], name: str) -> Array:
    value = table.get(name, [NOMINAL[name]] * 3)
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"[nominal] {name} = {value!r} must be three numbers, x y z")
    return np.array([fields.number({name: v}, "nominal", name, 0.0) for v in value])


def _model(table: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    ids = table.get("effects", [])
    if not isinstance(ids, list) or not all(isinstance(i, str) for i in ids):
        raise InputError('[model] effects must be a list of ids, like ["base_tilt"]')
    return {i: fields.table(table, i) for i in ids}


def _positions(
    raw: Mapping[str, Any],
) -> tuple[tuple[Position, ...], tuple[tuple[float, float] | None, ...]]:
    tables = raw.get("position", [])
    if not isinstance(tables, list) or not all(isinstance(t, Mapping) for t in tables):
        raise InputError("position must be tables: write [[position]] above each")
    rows = [_position(i, table) for i, table in enumerate(tables)]
    return tuple(p for p, _ in rows), tuple(w for _, w in rows)


def _position(
    i: int, table: Mapping[str, Any]
) -> tuple[Position, tuple[float, float] | None]:
    name = f"position {i}"
    given = [key for key in ("alpha_deg", "beta_deg") if key in table]
    if len(given) == 1:
        raise InputError(f"{name} has {given[0]} alone; give both angles or neither")
    rate = table.get("rate_deg_s")
    if rate is not None:
        if not isinstance(rate, list) or len(rate) != 3:
            raise InputError(f"{name}: rate_deg_s must be three numbers, deg/s")
        rate = tuple(
            np.deg2rad([fields.number({"r": r}, name, "r", 0.0) for r in rate])
        )
    label = str(table.get("name", ""))
    if given:
        alpha, beta = (
            fields.number(table, name, k, 0.0) for k in ("alpha_deg", "beta_deg")
        )
        position = Position.deg(alpha, beta, label)
    else:
        position = Position(label or name)
    if rate is not None and any(rate) and not label:
        turning = " ".join(f"{r:g}" for r in np.rad2deg(rate).round(6))
        position = replace(position, name=f"{position.name}, {turning} °/s")
    return replace(position, rate=rate), _window(name, table)


def _window(name: str, table: Mapping[str, Any]) -> tuple[float, float] | None:
    given = [key for key in ("start_s", "end_s") if key in table]
    if not given:
        return None
    if len(given) == 1:
        raise InputError(f"{name} has {given[0]} alone; give start_s and end_s")
    start, end = (fields.number(table, name, key, 0.0) for key in ("start_s", "end_s"))
    if start >= end:
        raise InputError(
            f"{name}: start_s = {start:g} must come before end_s = {end:g}"
        )
    return start, end
