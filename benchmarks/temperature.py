"""Whether parameters over temperature are as uncertain as is said.

    python -m benchmarks temperature [devices] [--seed=1]

Devices with polynomials of their own, of order 0 to 3, are calibrated in seven sessions
within 0 to 50 °C. Part of the errors may be common to all sessions, and parameters may
change from run to run; both are drawn. Differences from truth at five temperatures are
counted in the ± that is stated there.
"""

from __future__ import annotations

import numpy as np

from benchmarks._words import how_many, option
from fieldcal.calibration import Calibration, limits
from fieldcal.core.samples import Array
from fieldcal.thermal import ThermalPoint, thermal_model

SIGMA = 1.5e-3
"""Of a session's biases, m/s^2."""

SIZES = np.array([0.1, 4e-3, 1e-4, 4e-3 / 1200])
"""Of the coefficients, m/s^2 per K^n."""

SESSIONS = 7


def drawn(rng: np.random.Generator) -> tuple[Array, list[ThermalPoint]]:
    """Coefficients about 25 °C, (4, 3), and the sessions."""
    truth = rng.normal(0, 1, (4, 3)) * SIZES[:, None]
    truth[rng.integers(0, 4) + 1 :] = 0
    inner = rng.uniform(5, 45, SESSIONS - 2)
    warm = np.array([rng.uniform(0, 5), *inner, rng.uniform(45, 50)])
    share = rng.choice([0.0, 0.0, 0.3, 0.9])
    run = rng.choice([0.0, 1.0, 10.0]) * SIGMA
    common = np.sqrt(share) * rng.normal(0, SIGMA, 3)
    points = []
    for i, t in enumerate(warm):
        own = np.sqrt(1 - share) * rng.normal(0, SIGMA, 3) + run * rng.normal(0, 1, 3)
        values = (t - 25.0) ** np.arange(4) @ truth + common + own
        names = tuple(f"acc_bias.{axis}" for axis in "xyz")
        covariance = SIGMA**2 * np.eye(3)
        found = Calibration(
            "joint", names, values, covariance, ("m/s^2",) * 3, 5.0, 7, 1e-3
        )
        points.append(ThermalPoint(f"session {i + 1}", float(t), 0.0, found))
    return truth, points


def main() -> None:
    """Print how differences from truth compare with what is stated."""
    devices, off = how_many(200), []
    rng = np.random.default_rng(int(option("seed", "1")))
    bounds = limits.read("tactical")
    for _ in range(devices):
        truth, points = drawn(rng)
        model = thermal_model(points, bounds)
        for t in np.linspace(model.low, model.high, 5):
            true = (t - 25.0) ** np.arange(4) @ truth
            for value, (found, sigma) in zip(true, model.at(t).values(), strict=True):
                off.append((found - value) / sigma)
    size = np.abs(off)
    print(
        f"{devices} devices: rms {np.sqrt(np.mean(size**2)):.2f} of what is stated,"
        f" {100 * np.mean(size < 1):.0f} % within 1 sigma,"
        f" {100 * np.mean(size < 2):.0f} % within 2 sigma"
    )
