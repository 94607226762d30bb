"""Errors that the factory left in the device of a session."""

from __future__ import annotations

from dataclasses import replace

from fieldcal.calibration import limits
from fieldcal.core.factory import FACTORY_KEYS, FactoryErrors
from fieldcal.core.grade import Grade
from fieldcal.session.description import Description

FIELDS = {
    name: "cross_coupling" if name == "squareness" else name for name in FACTORY_KEYS
}
"""Attributes of `FactoryErrors` by the keys of session.toml."""


def factory_errors(about: Description, grade: Grade | None = None) -> FactoryErrors:
    """Errors that the factory left; sizes that are not stated are those of the grade.

    `grade` is by default that of the device.
    """
    usual = limits.read(grade or about.grade).factory
    said = {name: getattr(about, name) for name in FACTORY_KEYS}
    stated = {FIELDS[name]: size for name, size in said.items() if size is not None}
    return replace(usual, **stated)
