"""What the factory left in the device of a session."""

from __future__ import annotations

from dataclasses import replace

from fieldcal.calibration import limits
from fieldcal.core.factory import FACTORY, FactoryErrors
from fieldcal.core.grade import Grade
from fieldcal.session.description import Description

FIELDS = {name: "cross_coupling" if name == "squareness" else name for name in FACTORY}
"""Attributes of `FactoryErrors` by the keys of session.toml."""


def factory_errors(about: Description, grade: Grade | None = None) -> FactoryErrors:
    """What the factory left in the device; that of a grade where it is not stated.

    The grade is the device's own if none is given.
    """
    usual = limits.read(grade or about.grade).factory
    said = {name: getattr(about, name) for name in FACTORY}
    stated = {FIELDS[name]: size for name, size in said.items() if size is not None}
    return replace(usual, **stated)
