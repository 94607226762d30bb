"""What a factory leaves of errors that a calibration does not estimate.

Each is an effect of the catalogue by its id, with one standard deviation that all of
its coefficients share. Few positions cannot show them, so they are part of every
uncertainty. The sizes of a grade are in ``limits.toml``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

from fieldcal.core.errors import InputError

FACTORY = ("squareness", "quadratic", "g_sensitivity")
"""Keys by which session.toml and ``limits.toml`` state them, in the order below."""

LARGEST = {"cross_coupling": 1.0, "quadratic": 1e-2, "g_sensitivity": 1e-2}
"""From which on a value is in another unit: an output as large as its input."""


@dataclass(frozen=True, slots=True)
class FactoryErrors:
    """One sigma of each coefficient.

    Attributes
    ----------
    cross_coupling : of the accelerometers, 1
    quadratic : K2 of the accelerometers, 1/(m/s^2)
    g_sensitivity : of the gyroscopes, (rad/s)/(m/s^2)

    Raises
    ------
    InputError
        If a value is negative, or in another unit.

    """

    cross_coupling: float = 0.0
    quadratic: float = 0.0
    g_sensitivity: float = 0.0

    def __post_init__(self) -> None:
        for name, size in self.by_effect.items():
            if not 0 <= size < LARGEST[name]:
                said = "squareness" if name == "cross_coupling" else name
                raise InputError(
                    f"{said} {size:g} is none: give the 1σ of a coefficient in SI"
                    f" units, 0 or more and below {LARGEST[name]:g}"
                )

    @property
    def by_effect(self) -> Mapping[str, float]:
        """Sizes by id of the effect."""
        return asdict(self)
