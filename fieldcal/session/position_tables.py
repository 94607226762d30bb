"""The [[position]] tables of session.toml: attitudes, rates and windows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.escaping import escape_line
from fieldcal.core.positions import Position
from fieldcal.session.attitude import parse_attitude


def parse_positions(
    tables: Iterable[Mapping[str, Any]],
) -> tuple[tuple[Position, ...], tuple[tuple[float, float] | None, ...]]:
    """Positions and their windows, s of device time; None without a window.

    Raises
    ------
    InputError
        Naming the position, counted from 1, and the key.

    """
    rows = [(_position(i, t), _window(i, t)) for i, t in enumerate(tables, 1)]
    return tuple(p for p, _ in rows), tuple(w for _, w in rows)


def position_table(position: Position) -> dict[str, Any]:
    """Table of a position; `parse_positions` reads the same position from it."""
    out: dict[str, Any] = {"name": position.name}
    if (angles := position.all_degrees) is not None:
        out["alpha_deg"], out["beta_deg"], gamma = angles
        if gamma:
            out["gamma_deg"] = gamma
    if position.sigma is not None:
        out["attitude_sigma_deg"] = _degrees(position.sigma)
    if position.rate is not None:
        out["rate_deg_s"] = [_degrees(rate) for rate in position.rate]
    if position.speed:
        out["speed_deg_s"] = _degrees(position.speed)
        out["speed_sd_deg_s"] = _degrees(position.speed_sigma)
    return out


def _degrees(angle: float) -> float:
    """Degrees without what the conversion rounds."""
    return round(float(np.rad2deg(angle)), 12)


def _position(number: int, table: Mapping[str, Any]) -> Position:
    label = escape_line(str(table.get("name", "")))
    position = parse_attitude(number, table, label)
    if "speed_deg_s" in table:
        return _on_turning_table(number, table, position)
    rate = table.get("rate_deg_s")
    if rate is None:
        return position
    if any(rate) and not label:
        turning = " ".join(f"{r:g}" for r in rate)
        position = replace(position, name=f"{position.name}, {turning} °/s")
    return replace(position, rate=tuple(np.deg2rad(rate)))


def _on_turning_table(
    number: int, table: Mapping[str, Any], position: Position
) -> Position:
    """A position in which a table turns the device about an unknown axis."""
    if "rate_deg_s" in table or position.oriented:
        other = "rate_deg_s" if "rate_deg_s" in table else "an attitude"
        raise InputError(
            f"[[position]] number {number} has speed_deg_s and {other}: speed_deg_s is"
            " for an axis that nobody knows; where it is known give rate_deg_s"
        )
    speed, sigma = table["speed_deg_s"], table.get("speed_sd_deg_s", 0.0)
    label = table.get("name") or f"position {number}, {speed:g} °/s about any axis"
    return replace(
        position,
        name=escape_line(str(label)),
        speed=float(np.deg2rad(speed)),
        speed_sigma=float(np.deg2rad(sigma)),
    )


def excluded_spans(
    tables: Iterable[Mapping[str, Any]],
) -> tuple[tuple[float, float], ...]:
    """Spans of time that are excluded from the windows around them, s, in order.

    Raises
    ------
    InputError
        Naming the position, counted from 1.

    """
    out: list[tuple[float, float]] = []
    for number, table in enumerate(tables, 1):
        last = -np.inf
        for start, end in sorted(map(tuple, table.get("without_s", ()))):
            inside = "start_s" in table and table["start_s"] < start < end
            if not (inside and last < start and end < table["end_s"]):
                raise InputError(
                    f"[[position]] number {number} without_s = [{start:g}, {end:g}]"
                    " cannot be: it must lie between start_s and end_s, its start come"
                    " before its end, and none may overlap"
                )
            out.append((float(start), last := float(end)))
    return tuple(sorted(out))


def _window(number: int, table: Mapping[str, Any]) -> tuple[float, float] | None:
    if "start_s" not in table:
        return None
    start, end = float(table["start_s"]), float(table["end_s"])
    if start >= end:
        raise InputError(
            f"[[position]] number {number} start_s = {start:g} cannot be: it must come"
            f" before end_s = {end:g}"
        )
    return start, end
