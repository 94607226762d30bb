"""Calibrations drawn at random."""

from __future__ import annotations

import numpy as np

from fieldcal.calibration.parameters import Calibration

PAIRS = [f"{i}{j}" for i in "123" for j in "123" if i != j]


def calibration(
    rng: np.random.Generator, cross: float, gyr_scale: float = 0.0
) -> Calibration:
    values = {
        "acc_bias": rng.normal(0, 0.3, 3),
        "acc_scale": 1 + rng.normal(0, 0.02, 3),
        "gyr_bias": rng.normal(0, 0.02, 3),
    }
    if gyr_scale:
        values["gyr_scale"] = 1 + rng.normal(0, gyr_scale, 3)
    flat = {
        f"{g}.{a}": v
        for g, three in values.items()
        for a, v in zip("xyz", three, strict=True)
    }
    if cross:
        flat |= {f"cross_coupling.k{p}": rng.normal(0, cross) for p in PAIRS}
        if gyr_scale:
            flat |= {f"gyro_cross_coupling.s{p}": rng.normal(0, cross) for p in PAIRS}
    k = len(flat)
    return Calibration(
        "joint", tuple(flat), np.array(list(flat.values())), 1e-8 * np.eye(k),
        ("1",) * k, 1.0, 1, 1e-3,
    )  # fmt: skip
