"""A session that is about to be written: what was put out, and what is said of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.never_wrong.bench import Bench, Samples

Rng = np.random.Generator


@dataclass(frozen=True)
class Written:
    """A session: its tables and its samples; `ending` of the file of samples.

    `mirrored` says that all accelerometers have the other sign. Where no angle is
    stated, nothing that is recorded shows it, and the outputs have minus the bias.
    """

    about: dict[str, Any]
    samples: Samples
    ending: str = "parquet"
    mirrored: bool = False

    def truth(self, bench: Bench) -> dict[str, float]:
        """Parameters of the outputs by full name."""
        own = bench.truth
        if not self.mirrored or bench.stated:
            return own
        return own | {n: -v for n, v in own.items() if n.startswith("acc_bias")}


Before = Callable[[Bench, Rng], Bench]
"""A mistake that is made before anything is recorded."""

After = Callable[[Written, Bench, Rng], Written]
"""A mistake that is made once something was recorded."""


def log_uniform(rng: Rng, least: float, most: float) -> float:
    """Any order of magnitude between two is as likely."""
    return float(np.exp(rng.uniform(np.log(least), np.log(most))))


def acting(bench: Bench, **sizes: Any) -> Bench:
    """A bench on which something else acts."""
    return replace(bench, acting=replace(bench.acting, **sizes))


def interrupted(s: Samples, bench: Bench, rng: Rng) -> tuple[Samples, float]:
    """Samples of which those of 1 s or more on a way are missing, and since when, s."""
    way = int(rng.integers(1, len(bench.windows)))
    start = float(bench.windows[way - 1, 1] + rng.uniform(0.0, bench.way - 1.0))
    off = s.within(start, rng.uniform(start + 1.0, bench.windows[way, 0]))
    return Samples(s.t[~off], s.acc[~off], s.gyr[~off]), start


def tables(bench: Bench) -> dict[str, Any]:
    """What an honest session.toml says of a bench."""
    site: dict[str, Any] = {"latitude_deg": bench.latitude, "height_m": bench.height}
    if bench.level_deg is not None:
        site["level_deg"] = bench.level_deg
    if bench.angles_deg is not None and not bench.imported:
        site["angle_setting_deg"] = bench.angles_deg
    rows: list[dict[str, float]] = []
    for (alpha, beta), (start, end) in zip(bench.angles, bench.windows, strict=True):
        row = {"start_s": float(start), "end_s": float(end)}
        if len(rows) < bench.stated:
            row |= {"alpha_deg": float(alpha), "beta_deg": float(beta)}
        rows.append(row)
    about: dict[str, Any] = {
        "format": 1,
        "device": {"name": "drawn", "serial": "N-1", "grade": bench.grade},
        "site": site,
        "frame": {"mounting": list(bench.mounting)},
        "position": rows,
    }
    if not bench.imported:
        about["run"] = {"procedure": "positions"}
    return about
