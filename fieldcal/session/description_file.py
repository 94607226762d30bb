"""session.toml: the file that describes a recording.

`schemas/session.schema.json` states the type and range of each key: another value is an
error that names file, key and remedy. Unknown keys are ignored, so that other programs
may add their own; `Session.open` warns of one that is nearly a known key.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np

from fieldcal.core.documents import json_values, load_toml
from fieldcal.core.errors import InputError, SessionError
from fieldcal.core.factory import FACTORY_KEYS
from fieldcal.core.frames import mounting_matrix
from fieldcal.core.grade import Grade
from fieldcal.core.positions import Position
from fieldcal.session.description import Description
from fieldcal.session.position_tables import (
    excluded_spans,
    parse_positions,
    position_table,
)
from fieldcal.session.schemas import schema_fault, validator
from fieldcal.session.site import Site
from fieldcal.session.units import UNITS, full_scales, output_gauge, parse_nominal

FORMAT_VERSION = 1
"""Version of the format of session.toml."""

NAMES = {
    "device": ("name", "serial", "model", "lot"),
    "site": ("station", "operator"),
}
"""Names by which sessions are grouped, by table."""


def read_description(path: Path) -> Description:
    """Read a session.toml.

    Raises
    ------
    SessionError
        Naming the file, the key and the remedy.

    """
    try:
        raw = load_toml(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        lacks = f"it has no {path.name}" if path.parent.exists() else "it is not there"
        raise SessionError(
            f"{path.parent}: is no session: {lacks}; name a folder that has a"
            f" {path.name}, or make one with fieldcal import"
        ) from error
    except NotADirectoryError as error:
        raise SessionError(
            f"{path.parent}: {_no_session(path.parent, path.name)}"
        ) from error
    except (OSError, UnicodeDecodeError) as error:
        raise SessionError(f"{path}: cannot be read: {error}") from error
    except tomllib.TOMLDecodeError as error:
        raise SessionError(f"{path}: is not TOML: {error}; mend it") from error
    try:
        return parse_description(raw)
    except InputError as error:
        raise SessionError(f"{path}: {error}") from error


def _no_session(file: Path, description: str) -> str:
    """Why a file is no session, and what to name or do instead."""
    if (file.parent / description).is_file():
        return f"is a file of a session; name the session's folder, {file.parent}"
    if file.suffix == ".toml":
        return (
            "is a file, no session; name a session's folder, or record one by this"
            f" plan with fieldcal run {quote(str(file))}"
        )
    return (
        "is a file, no session; make a session of it with fieldcal import"
        f" {quote(str(file))}"
    )


def parse_description(raw: Mapping[str, Any]) -> Description:
    """Check the tables of a session.toml.

    Raises
    ------
    InputError
        Naming the key and the remedy.

    """
    if wrong := schema_fault(raw, validator("session")):
        raise InputError(wrong)
    raw = with_bare_names(raw)
    device, table = raw.get("device", {}), raw.get("site", {})
    sampling = raw.get("sampling", {})
    given = raw.get("units", {})
    units = {k: given.get(k, next(iter(known))) for k, known in UNITS.items()}
    positions, windows = parse_positions(raw.get("position", ()))
    axes = raw.get("frame", {}).get("mounting", ("+x", "+y", "+z"))
    mounting_matrix(axes)
    usual = parse_nominal(raw.get("nominal", {}))
    gauge = output_gauge(units, usual)
    nominal = {n: v / gauge.size[n.startswith("gyr")] for n, v in usual.items()}
    grade: Grade = device.get("grade", "tactical")
    site = Site.of(table)
    moving = site.motion
    level = _optional_float(table.get("level_deg"))
    if grade != "navigation" and level is not None:
        level = float(np.hypot(level, np.rad2deg(moving.force_tilt)))
    return Description(
        device=json_values(device),
        grade=grade,
        rate_hz=_optional_float(sampling.get("rate_hz")),
        clock_sigma=float(sampling.get("rate_sigma_hz", 0.0))
        / float(sampling.get("rate_hz", 1.0)),
        units=units,
        limits=full_scales(raw.get("range", {}), units, gauge),
        latitude_deg=site.latitude_deg,
        height_m=site.height_m,
        gravity=site.gravity,
        base_motion=moving if grade == "navigation" else moving.vertical_part,
        level_deg=level,
        angle_setting_deg=_optional_float(table.get("angle_setting_deg")),
        **{name: _optional_float(device.get(name)) for name in FACTORY_KEYS},
        axes=tuple(axes),
        nominal=nominal,
        nominal_as_sent=nominal,
        gauge=gauge,
        model=_model(raw.get("model", {})),
        positions=positions,
        windows=windows,
        position_numbers=tuple(range(len(positions))),
        excluded_spans=excluded_spans(raw.get("position", ())),
        gaps_without_restart=(),
        raw=raw,
        smoothing=np.zeros((2, 2)),
    )


def with_added_positions(
    about: Description, positions: Iterable[Position]
) -> Description:
    """The description with more positions appended."""
    more = [position_table(position) for position in positions]
    if not more:
        return about
    return parse_description(
        {**about.raw, "position": [*about.raw.get("position", ()), *more]}
    )


def with_bare_names(raw: Mapping[str, Any]) -> dict[str, Any]:
    """The tables, with names of device, lot and station without blanks around them.

    A blank from a bar-code reader or a spreadsheet would make another unit of one.
    """
    out = dict(raw)
    for table, names in NAMES.items():
        if isinstance(given := raw.get(table), Mapping):
            bare = {n: v.strip() for n in names if isinstance(v := given.get(n), str)}
            out[table] = {**given, **bare}
    return out


def _optional_float(value: float | None) -> float | None:
    return None if value is None else float(value)


def _model(table: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    found = {name: table.get(name, {}) for name in table.get("effects", ())}
    for name, parameters in found.items():
        if not isinstance(parameters, Mapping):
            raise InputError(f"[model] {name} cannot be: write a table [model.{name}]")
    return found
