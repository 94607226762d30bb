"""Throughput of `Calibration.apply` beside a bare numpy product."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.samples import Block

SAMPLES = 1_000_000
RUNS = 15


def _best(what: Callable[[], object]) -> float:
    times = []
    for _ in range(RUNS):
        began = perf_counter()
        what()
        times.append(perf_counter() - began)
    return min(times)


def main() -> None:
    """Print samples a second; apply is to reach half of the product."""
    rng = np.random.default_rng(0)
    acc, gyr = rng.standard_normal((2, SAMPLES, 3))
    block = Block.of(np.arange(SAMPLES) / 100, acc, gyr)
    names = [f"{s}_{g}.{x}" for s in ("acc", "gyr") for g in ("bias", "scale")
             for x in "xyz"]  # fmt: skip
    values = np.array([0.1, -0.2, 0.3, 1.01, 0.99, 1.0] * 2)
    calibration = Calibration(
        "joint", tuple(names), values, 1e-6 * np.eye(12), ("1",) * 12, 0.0, 1, 0.0
    )
    matrix = rng.standard_normal((3, 3))

    def product() -> None:
        acc @ matrix
        gyr @ matrix

    bare = _best(product)
    ours = _best(lambda: calibration.apply(block))
    spread = _best(lambda: calibration.uncertainty_of(block))
    print(f"bare numpy matmul  {SAMPLES / bare / 1e6:7.1f} million samples/s")
    print(f"Calibration.apply  {SAMPLES / ours / 1e6:7.1f} million samples/s, "
          f"{bare / ours:.2f} x")  # fmt: skip
    print(f"uncertainty_of     {SAMPLES / spread / 1e6:7.1f} million samples/s")
