"""What the factory left in the device of a session."""

from __future__ import annotations

from fieldcal.calibration import limits
from fieldcal.core.factory import FACTORY, FactoryErrors
from fieldcal.session.description import Description


def factory_errors(about: Description) -> FactoryErrors:
    """What the factory left in the device; the grade's where it is not stated."""
    usual = limits.read(about.grade)
    return FactoryErrors(
        *(
            getattr(usual, name) if (said := getattr(about, name)) is None else said
            for name in FACTORY
        )
    )
