"""What real devices have beside bias, scale factor and noise, drawn.

Written apart from everything that estimates, from the equations of IEEE Std 1293 and
1431; f m/s^2 and w rad/s in the device's axes, T its warming in K:

    U += C f + K2 f^2 + P |f| + K3 f^3 + (c + s f) T,   W += D w + G f + e T

with C and D without diagonal. Sizes are drawn from what data sheets state.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SQUARE = (4e-4, 1.2e-3)
"""Smallest and largest 1 sigma of each cross-coupling coefficient: half of 0.05 deg, to
0.1 deg between two axes, as the data sheets of decision 0024 have it."""

QUADRATIC = (2e-6, 3e-5)
"""Of K2, 1/(m/s^2): 0.01 % of 10 g to half of 0.5 % of 16 g."""

ASYMMETRY = 5e-5
"""Of half the difference of the scale factors for the two signs; no sheet states it."""

CUBIC = 2e-7
"""Of K3, 1/(m/s^2)^2: half as much off a straight line at 10 g as K2."""

FELT = (5e-7, 1.3e-5)
"""Of each g-sensitivity of the gyroscopes, (rad/s)/(m/s^2): 1 deg/h per g to half of
0.015 deg/s per g."""

LOW_COST = (1e-2, 2.5e-4, 9e-5)
"""The three of a low-cost device: half of 2 %, of 0.5 % of 2 g, of 0.1 deg/s per g."""

WARM_ACC, WARM_SCALE, WARM_GYR = 1e-3, 3e-5, 1e-5
"""Of temperature coefficients: 0.1 mg/K, 30 ppm/K, 2 deg/h/K."""

WARMING, LAG = 1.0, 300.0
"""K that a device has still to warm up by when it is used, at most, and s it takes."""


@dataclass(frozen=True)
class Device:
    """Errors that a calibration does not estimate, device axes.

    Attributes
    ----------
    coupled : (2, 3, 3) what an axis of either sensor sees of another's input
    quadratic, asymmetry, cubic : (3,) of the accelerometers
    felt : (3, 3) g-sensitivity of the gyroscopes
    warm : (3, 3) acc bias, acc scale, gyr bias, each by axis and K
    warming : K from the start to long after
    heated, heated_s : K that the sun or a heater adds at last, and from when, s

    """

    coupled: Floats = field(repr=False)
    quadratic: Floats
    asymmetry: Floats
    cubic: Floats
    felt: Floats = field(repr=False)
    warm: Floats = field(repr=False)
    warming: float
    heated: float = 0.0
    heated_s: float = 0.0

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Device:
        """A device of tactical grade, by one of the data sheets."""
        square, bent, felt = (
            float(np.exp(rng.uniform(*np.log(each))))
            for each in (SQUARE, QUADRATIC, FELT)
        )
        return cls._sized(rng, square, bent, felt)

    @classmethod
    def low_cost(cls, rng: np.random.Generator) -> Device:
        """Such as an MPU-6050."""
        return cls._sized(rng, *LOW_COST)

    @classmethod
    def _sized(
        cls, rng: np.random.Generator, square: float, bent: float, felt: float
    ) -> Device:
        """One whose coefficients have these standard deviations."""
        sizes = np.array([[WARM_ACC], [WARM_SCALE], [WARM_GYR]])
        return cls(
            coupled=rng.normal(0, square, (2, 3, 3)) * (1 - np.eye(3)),
            quadratic=rng.normal(0, bent, 3),
            asymmetry=rng.normal(0, ASYMMETRY, 3),
            cubic=rng.normal(0, CUBIC, 3),
            felt=rng.normal(0, felt, (3, 3)),
            warm=rng.normal(0, 1, (3, 3)) * sizes,
            warming=float(rng.uniform(0, WARMING)),
        )

    def warmth(self, t: Floats) -> Floats:
        """K by which it is warmer than at the start, (n,)."""
        out: Floats = self.warming * (1 - np.exp(-t / LAG))
        since = np.maximum(t - self.heated_s, 0.0)
        return out + self.heated * (1 - np.exp(-since / LAG))

    def adds(self, t: Floats, f: Floats, w: Floats) -> tuple[Floats, Floats]:
        """What it puts out beside bias and scale factor, (n, 3) each."""
        warmth = self.warmth(t)[:, None]
        bent = self.quadratic * f**2 + self.asymmetry * np.abs(f) + self.cubic * f**3
        warm = (self.warm[0] + self.warm[1] * f) * warmth
        acc = f @ self.coupled[0].T + bent + warm
        return acc, w @ self.coupled[1].T + f @ self.felt.T + self.warm[2] * warmth

    def come_to(self, end: float) -> dict[str, Floats]:
        """What its temperature has made of parameters at an instant, s."""
        groups = ("acc_bias", "acc_scale", "gyr_bias")
        warmth = float(self.warmth(np.array([end]))[0])
        return {g: row * warmth for g, row in zip(groups, self.warm, strict=True)}
