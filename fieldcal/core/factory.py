"""Sizes of the sensor errors that a factory leaves and a calibration does not estimate.

Each is an effect of the catalogue by its id, with one standard deviation that all of
its coefficients share. Few positions cannot show them, so they are part of every
uncertainty. The sizes of a grade are in ``limits.toml``.

A data sheet states how far an output is from a straight line, but not the shape of the
curve. All three shapes of IEEE Std 1293 are therefore counted where K2 is: a kink at
zero that is as large as K2 at 1 g, and a K3 that is as large as K2 at 10 g,

    k+- = K2 g,    K3 = K2 / (10 g)                                                 (1)

The suspension of a proof mass does not return exactly to zero after a turn: biases of
accelerometers have hysteresis.

While a device warms up, its biases change with their temperature coefficients. A
thermometer records the temperature. Without one, the temperature of a package that
warms up is assumed, exp(-t / tau).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import inf

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0

FACTORY_KEYS = ("squareness", "quadratic", "g_sensitivity")
"""Keys that session.toml and ``limits.toml`` use for these sizes."""

IMPOSSIBLE_SIZES = {"cross_coupling": 1.0, "quadratic": 1e-2, "g_sensitivity": 1e-2}
"""Sizes that no device reaches, by attribute: the value must be in another unit."""


WARMING_EFFECTS = ("temperature_bias", "warm_up")
"""Effects that change the biases: with a thermometer, and without one."""

WARM_UP_TIME_CONSTANT = 300.0
"""Time constant of a package that warms up, s; between 100 and 2000."""


@dataclass(frozen=True, slots=True)
class FactoryErrors:
    """Standard deviation of each coefficient.

    Attributes
    ----------
    cross_coupling : of the accelerometers, 1
    quadratic : K2 of the accelerometers, 1/(m/s^2)
    g_sensitivity : of the gyroscopes, (rad/s)/(m/s^2)
    acc_per_k, gyr_per_k : temperature coefficients of biases, m/s^2/K and rad/s/K
    hysteresis : change of the bias of an accelerometer by the last turn, m/s^2
    warming_k : rise of temperature that is still possible, K; used without a
        thermometer

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
        for name in (each.name for each in fields(self)):
            size, largest = getattr(self, name), IMPOSSIBLE_SIZES.get(name, inf)
            if not 0 <= size < largest:
                stated = "squareness" if name == "cross_coupling" else name
                below = f" and below {largest:g}" if largest < inf else ""
                raise InputError(
                    f"{stated} {size:g} is none: give the 1σ of a coefficient in SI"
                    f" units, 0 or more{below}"
                )

    @property
    def by_effect(self) -> Mapping[str, float]:
        """Sizes of the effects of the specific force, by id of the effect."""
        return {
            "cross_coupling": self.cross_coupling,
            "quadratic": self.quadratic,
            "scale_asymmetry": self.quadratic * G0,  # (1)
            "cubic": self.quadratic / (10 * G0),  # (1)
            "g_sensitivity": self.g_sensitivity,
        }

    def warming_effect(self, has_thermometer: bool) -> tuple[str, tuple[float, ...]]:
        """Effect by which biases change, and the sizes of its six coefficients.

        `has_thermometer` says whether a thermometer records the change.
        """
        per_k = (self.acc_per_k,) * 3 + (self.gyr_per_k,) * 3
        if has_thermometer:
            return WARMING_EFFECTS[0], per_k
        return WARMING_EFFECTS[1], tuple(size * self.warming_k for size in per_k)
