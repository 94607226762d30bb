"""Limits that a calibration must meet to be GO, by grade, from a file.

``limits.toml`` beside this module holds the defaults and says what each bound means; a
file of the user's has the same tables and may leave out whatever it does not change.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.documents import load_toml
from fieldcal.core.errors import InputError
from fieldcal.core.factory import WARM_UP_TIME_CONSTANT, FactoryErrors
from fieldcal.core.grade import GRADES

DEFAULTS = "limits.toml"


@dataclass(frozen=True, slots=True)
class GradeLimits:
    """Bounds for one grade of device; units as in ``limits.toml``."""

    acc_bias_sigma: float
    acc_scale_sigma: float
    gyr_bias_sigma: float
    gyr_scale_sigma: float
    acc_bias_repeat: float
    acc_scale_repeat: float
    gyr_bias_repeat: float
    gyr_scale_repeat: float
    acc_bias_tolerance: float
    acc_scale_tolerance: float
    gyr_bias_tolerance: float
    gyr_scale_tolerance: float
    family_chance: float
    fit_chance: float
    verification_residual: float
    verification_chance: float
    angle_setting_deg: float
    squareness: float
    quadratic: float
    g_sensitivity: float
    acc_bias_per_k: float
    gyr_bias_per_k: float
    acc_hysteresis: float
    temperature_min_c: float
    temperature_max_c: float
    temperature_span_k: float
    temperature_rate_k_min: float
    lost_share: float
    bad_share: float

    @property
    def factory(self) -> FactoryErrors:
        """Sizes of the errors that the factory leaves and that are not estimated."""
        # a device that warms up faster than allowed is waited for: 2 sigma
        warming_k = self.temperature_rate_k_min / 2 * WARM_UP_TIME_CONSTANT / 60
        return FactoryErrors(
            self.squareness, self.quadratic, self.g_sensitivity,
            self.acc_bias_per_k, self.gyr_bias_per_k, self.acc_hysteresis, warming_k,
        )  # fmt: skip

    def sigma(self, group: str) -> float | None:
        """Largest uncertainty of a group's parameters; None where none is set."""
        return getattr(self, f"{group}_sigma", None)

    def per_kelvin(self, group: str) -> float:
        """Usual temperature coefficient of a group, 1 sigma; 0 where none is set."""
        return float(getattr(self, f"{group}_per_k", 0.0))

    def repeat(self, group: str) -> float | None:
        """Spread of a group from run to run if there is no history; None if not set."""
        return getattr(self, f"{group}_repeat", None)

    def tolerance(self, group: str) -> float | None:
        """How far a group's parameters may be from nominal; None where none is set."""
        return getattr(self, f"{group}_tolerance", None)


NAMES = tuple(f.name for f in fields(GradeLimits))
_ANY_SIGN = ("temperature_min_c", "temperature_max_c")


def read(grade: str, path: Path | None = None) -> GradeLimits:
    """Limits of a grade, from a file over the defaults.

    Raises
    ------
    InputError
        Naming the file, the key and the remedy.

    """
    text = files("fieldcal.calibration").joinpath(DEFAULTS).read_text("utf-8")
    values = dict(_table(load_toml(text), grade, DEFAULTS))
    if path is not None:
        values |= _table(_load(path), grade, str(path))
    made = GradeLimits(**values)
    if made.temperature_min_c >= made.temperature_max_c:
        raise InputError(
            f"{path}: [{grade}] temperature_min_c = {made.temperature_min_c:g} °C must"
            f" be below temperature_max_c = {made.temperature_max_c:g} °C"
        )
    return made


def check_every_grade(path: Path) -> None:
    """Refuse a file of limits before work on sessions whose grades are not known yet.

    Raises
    ------
    InputError
        As `read` does, whatever the grade.

    """
    for grade in GRADES:
        read(grade, path)


def _load(path: Path) -> Mapping[str, Any]:
    try:
        tables = load_toml(path.read_text("utf-8"))
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file of limits; check --limits") from error
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: is no file of limits: {error}") from error
    grades = load_toml(
        files("fieldcal.calibration").joinpath(DEFAULTS).read_text("utf-8")
    )
    odd = [name for name in tables if name not in grades]
    if odd:
        raise InputError(f"{path}: [{odd[0]}] is no grade: {', '.join(grades)}")
    return tables


def _table(tables: Mapping[str, Any], grade: str, name: str) -> dict[str, float]:
    table = tables.get(grade, {})
    if not isinstance(table, Mapping):
        raise InputError(f"{name}: {grade} must be a table: write [{grade}]")
    return {key: _bound(f"{name}: [{grade}]", key, v) for key, v in table.items()}


def _bound(where: str, key: str, value: Any) -> float:
    if key not in NAMES:
        raise InputError(f"{where} {key} is no limit; there are {', '.join(NAMES)}")
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not np.isfinite(value) or (key not in _ANY_SIGN and value <= 0):
        raise InputError(f"{where} {key} = {value!r} must be a number above 0")
    return float(value)
