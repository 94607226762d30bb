"""Devices whose parameters follow the temperature, by a polynomial of their own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.calibration import Calibration

UNITS = {"acc_bias": "m/s^2", "acc_scale": "1", "gyr_bias": "rad/s"}
CENTRE_C = 25.0

SIGMA = {"acc_bias": 1.5e-3, "acc_scale": 1.5e-4, "gyr_bias": 1e-5}
"""Of a session's values."""


@dataclass(frozen=True)
class Warming:
    """Coefficients of (T - 25 °C)^n of each group, (4, 3)."""

    coefficients: dict[str, np.ndarray]

    def values(self, temperature: float) -> dict[str, np.ndarray]:
        powers = (temperature - CENTRE_C) ** np.arange(4)
        return {group: powers @ c for group, c in self.coefficients.items()}


def drawn(rng: np.random.Generator, *groups: str) -> Warming:
    """A device with a polynomial of order 0 to 3 in each group."""
    sizes = {
        "acc_bias": (0.1, 4e-3),
        "acc_scale": (5e-3, 1e-4),
        "gyr_bias": (5e-3, 1e-4),
    }
    made = {}
    for group in groups or tuple(sizes):
        constant, slope = sizes[group]
        scale = [constant, slope, slope / 40, slope / 1200]
        c = rng.normal(0, 1, (4, 3)) * np.array(scale)[:, None]
        c[rng.integers(0, 4) + 1 :] = 0
        c[0] += 1.0 if group.endswith("scale") else 0.0
        made[group] = c
    return Warming(made)


def session(
    device: Warming,
    temperature: float,
    error: np.ndarray,
    covariance: np.ndarray,
    serial: str = "A1",
    wander: float = 0.0,
) -> Calibration:
    """What solve would say of the device, with an error of its own."""
    groups = device.coefficients
    true = np.concatenate(list(device.values(temperature).values()))
    conditions = {"temperature_degc": temperature, "temperature_sd_k": wander}
    return Calibration(
        "joint",
        tuple(f"{g}.{a}" for g in groups for a in "xyz"),
        true + error,
        covariance,
        tuple(UNITS[g] for g in groups for _ in "xyz"),
        5.0,
        7,
        1e-3,
        info={
            "conditions": {**conditions, "grade": "tactical"},
            "device": {"serial": serial},
            "decision": {"go": True, "reasons": []},
        },
    )


def exact(device: Warming) -> np.ndarray:
    """Covariance of a session that is hardly in error."""
    return np.diag(np.repeat([SIGMA[g] ** 2 for g in device.coefficients], 3))
