"""What a factory leaves of errors that a calibration does not estimate.

Each is an effect of the catalogue by its id, with one standard deviation that all of
its coefficients share. Few positions cannot show them, so they are part of every
uncertainty. The sizes of a grade are in ``limits.toml``.

A data sheet states how far an output is from a straight line, but not the shape of the
curve. All three shapes of IEEE Std 1293 are therefore counted where K2 is: a kink at
zero that is as large as K2 at 1 g, and a K3 that is as large as K2 at 10 g,

    k+- = K2 g,    K3 = K2 / (10 g)                                                 (1)

A suspension keeps something of how it was bent last: biases of accelerometers have
hysteresis.

A device that warms up has biases that change by their temperature coefficients. A
thermometer shows the course. Otherwise it is that of a package, exp(-t / tau).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0

FACTORY = ("squareness", "quadratic", "g_sensitivity")
"""Keys by which session.toml and ``limits.toml`` state them, in the order below."""

LARGEST = {"cross_coupling": 1.0, "quadratic": 1e-2, "g_sensitivity": 1e-2}
"""From which on a value is in another unit: an output as large as its input."""


WARMING = ("temperature_bias", "warm_up")
"""Effects by which biases change with a thermometer, and without."""

WARM_UP_S = 300.0
"""Time constant of a package that warms up, s: of 100 to 2000."""


@dataclass(frozen=True, slots=True)
class FactoryErrors:
    """One sigma of each coefficient.

    Attributes
    ----------
    cross_coupling : of the accelerometers, 1
    quadratic : K2 of the accelerometers, 1/(m/s^2)
    g_sensitivity : of the gyroscopes, (rad/s)/(m/s^2)
    acc_per_k, gyr_per_k : temperature coefficients of biases, m/s^2/K and rad/s/K
    hysteresis : m/s^2, what the last turn leaves in the bias of an accelerometer
    warming_k : K that the device may still warm up by, where no thermometer shows it

    Raises
    ------
    InputError
        If a value is negative, or in another unit.

    """

    cross_coupling: float = 0.0
    quadratic: float = 0.0
    g_sensitivity: float = 0.0
    acc_per_k: float = 0.0
    gyr_per_k: float = 0.0
    hysteresis: float = 0.0
    warming_k: float = 0.0

    def __post_init__(self) -> None:
        for name, largest in LARGEST.items():
            size = getattr(self, name)
            if not 0 <= size < largest:
                said = "squareness" if name == "cross_coupling" else name
                raise InputError(
                    f"{said} {size:g} is none: give the 1σ of a coefficient in SI"
                    f" units, 0 or more and below {largest:g}"
                )

    @property
    def by_effect(self) -> Mapping[str, float]:
        """Sizes of what depends on the force, by id of the effect."""
        return {
            "cross_coupling": self.cross_coupling,
            "quadratic": self.quadratic,
            "scale_asymmetry": self.quadratic * G0,  # (1)
            "cubic": self.quadratic / (10 * G0),  # (1)
            "g_sensitivity": self.g_sensitivity,
        }

    def warming(self, shown: bool) -> tuple[str, tuple[float, ...]]:
        """By which effect biases change, and the sizes of its six coefficients.

        `shown` says whether a thermometer shows the course.
        """
        per_k = (self.acc_per_k,) * 3 + (self.gyr_per_k,) * 3
        if shown:
            return WARMING[0], per_k
        return WARMING[1], tuple(size * self.warming_k for size in per_k)
