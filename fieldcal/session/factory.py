"""What the factory left in the device of a session."""

from __future__ import annotations

from fieldcal.calibration import limits
from fieldcal.core.factory import FACTORY, FactoryErrors
from fieldcal.core.grade import Grade
from fieldcal.session.description import Description


def factory_errors(about: Description, grade: Grade | None = None) -> FactoryErrors:
    """What the factory left in the device; that of a grade where it is not stated.

    The grade is the device's own if none is given.
    """
    usual = limits.read(grade or about.grade)
    return FactoryErrors(
        *(
            getattr(usual, name) if (said := getattr(about, name)) is None else said
            for name in FACTORY
        )
    )
