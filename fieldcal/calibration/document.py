"""A calibration as the object of ``result.json``, and back; its JSON Schema.

``schemas/result.schema.json`` describes the same object for other programs. Reading is
strict: a key that is missing or of the wrong kind is named, none is guessed. Keys that
the schema does not know are kept in `Calibration.info`.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from typing import Any, get_args

import numpy as np

from fieldcal.calibration.gauge import in_sample_units, in_si_units
from fieldcal.calibration.names import group_of, possible_components
from fieldcal.calibration.parameters import COMPONENTS, Calibration, Method
from fieldcal.core.documents import load_json
from fieldcal.core.errors import InputError

FORMAT = 1
KEYS = ("format", "method", "verdict", "warnings", "parameters", "covariance", "fit")


def schema() -> dict[str, Any]:
    """Return the JSON Schema of ``result.json``."""
    text = files("fieldcal").joinpath("schemas/result.schema.json").read_text("utf-8")
    found: dict[str, Any] = load_json(text)
    return found


def to_json(calibration: Calibration) -> dict[str, Any]:
    """Return the object, in the unit of the samples; what is not determined is null."""
    calibration = in_sample_units(calibration)
    return {
        "format": FORMAT,
        "method": calibration.method,
        "verdict": "good" if calibration.good else "bad",
        "warnings": list(calibration.warnings),
        "parameters": {g: _group(calibration, g) for g in calibration.groups},
        "covariance": {
            "names": list(calibration.names),
            "matrix": np.asarray(calibration.covariance).tolist(),
        },
        "fit": {
            "chi2": _number(calibration.chi2),
            "dof": calibration.dof,
            "rms": _number(calibration.rms),
            "unit": "m/s^2",
        },
        **calibration.info,
    }


def from_json(document: Any) -> Calibration:
    """Read the object.

    Raises
    ------
    InputError
        If a key is missing or holds something else than it should.

    """
    top = _mapping(document, "result.json")
    if _at(top, "format", int) != FORMAT:
        raise InputError(
            f"result.json is of format {top['format']}; this program reads {FORMAT}"
        )
    method = _at(top, "method", str)
    if method not in get_args(Method):
        raise InputError(f"result.json: method {method!r} is none that exists")
    covariance = _mapping(top.get("covariance"), "covariance")
    names = tuple(_texts(covariance.get("names"), "covariance.names"))
    matrix = _numbers(covariance.get("matrix"), "covariance.matrix", (len(names),) * 2)
    values, units = _parameters(_mapping(top.get("parameters"), "parameters"), names)
    fit = _mapping(top.get("fit"), "fit")
    found = Calibration(
        method=method,
        names=names,
        values=values,
        covariance=matrix,
        units=units,
        chi2=_float(fit.get("chi2"), "fit.chi2"),
        dof=_at(fit, "dof", int, "fit.dof"),
        rms=_float(fit.get("rms"), "fit.rms"),
        warnings=tuple(_texts(top.get("warnings"), "warnings")),
        good=_verdict(top),
        info={k: v for k, v in top.items() if k not in KEYS},
    )
    return in_si_units(found)


def _group(calibration: Calibration, group: str) -> dict[str, Any]:
    values, sigmas = calibration.vector(group)
    units = [
        u for n, u in zip(calibration.names, calibration.units, strict=True)
        if group_of(n) == group
    ]  # fmt: skip
    out: dict[str, Any] = {
        "value": [_number(v) for v in values],
        "sigma": [_number(s) for s in sigmas],
        "unit": units[0],
    }
    if group not in COMPONENTS:
        out["names"] = list(calibration.components(group))
    if len(set(units)) > 1:
        out["units"] = units
    return out


def _parameters(
    groups: dict[str, Any], names: Sequence[str]
) -> tuple[np.ndarray[Any, Any], tuple[str, ...]]:
    """Values and units in the order of the covariance's names."""
    found: dict[str, tuple[float, str]] = {}
    for group, entry in groups.items():
        where = f"parameters.{group}"
        entry = _mapping(entry, where)
        usual = list(COMPONENTS[group][0]) if group in COMPONENTS else None
        parts = _texts(entry.get("names", usual), f"{where}.names")
        possible = possible_components(group)
        if possible and (odd := [p for p in parts if p not in possible]):
            raise InputError(
                f"result.json: {where} has no component {odd[0]!r}: it may have"
                f" {', '.join(possible)}"
            )
        numbers = entry.get("value")
        if not isinstance(numbers, list) or len(numbers) != len(parts):
            raise InputError(
                f"result.json: {where}.value is not a list of {len(parts)} numbers"
            )
        unit = _at(entry, "unit", str, f"{where}.unit")
        known = [p for p, v in zip(parts, numbers, strict=True) if v is not None]
        units = _texts(entry.get("units", [unit] * len(known)), f"{where}.units")
        if len(units) != len(known):
            raise InputError(f"result.json: {where}.units does not fit its values")
        for part, u in zip(known, units, strict=True):
            value = _float(numbers[parts.index(part)], f"{where}.value")
            found[f"{group}.{part}"] = (value, u)
    if set(found) != set(names):
        alone = sorted(set(found) ^ set(names))[0]
        raise InputError(
            f"result.json: {alone} stands in parameters or in covariance.names, not in"
            " both"
        )
    return np.array([found[n][0] for n in names]), tuple(found[n][1] for n in names)


def _verdict(top: dict[str, Any]) -> bool:
    verdict = _at(top, "verdict", str)
    if verdict not in ("good", "bad"):
        raise InputError(f"result.json: verdict {verdict!r} is neither good nor bad")
    return bool(verdict == "good")


def _mapping(value: Any, where: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError(f"{where} is missing or not an object")
    return value


def _at(table: dict[str, Any], key: str, kind: type, where: str = "") -> Any:
    value = table.get(key)
    if not isinstance(value, kind) or isinstance(value, bool):
        what = "a whole number" if kind is int else "a text"
        raise InputError(f"result.json: {where or key} is missing or not {what}")
    return value


def _texts(value: Any, where: str) -> list[str]:
    if not isinstance(value, list) or not all(isinstance(v, str) for v in value):
        raise InputError(f"result.json: {where} is missing or not a list of texts")
    return value


def _float(value: Any, where: str) -> float:
    if value is None:
        return float("nan")
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"result.json: {where} is {value!r}, not a number")
    try:
        number = float(value)
    except OverflowError:
        number = float("inf")
    if not np.isfinite(number):
        raise InputError(f"result.json: {where} is too large a number, or none")
    return number


def _numbers(value: Any, where: str, shape: tuple[int, ...]) -> Any:
    try:
        table = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"result.json: {where} is not a table of numbers") from None
    if table.shape != shape or not np.isfinite(table).all():
        raise InputError(f"result.json: {where} is not {shape[0]} x {shape[1]} numbers")
    if (np.diag(table) < 0).any():
        raise InputError(f"result.json: {where} has a negative variance")
    return table


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
