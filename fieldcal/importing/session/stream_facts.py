"""What is found in a stream as it is imported: times, gaps, temperatures."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.importing.words.file_names import SENSOR

LONG = 5.0
"""Mean periods without a sample that are a gap."""

MIN_PAUSE_S = 1.0
"""Shortest gap that is a pause of the recording, s: in others samples came late."""


def mean_period(t: Array) -> float:
    """Mean interval between times (n,) without pauses, s; nan for a single time.

    What a pause is depends on the period, so the longest are left out until none is.

    >>> round(mean_period(np.r_[np.arange(20), 9000 + np.arange(20)] / 50), 9)
    0.02
    """
    steps = np.diff(t)
    while len(steps):
        period = float(steps.mean())
        if not (long := steps > max(LONG * period, MIN_PAUSE_S)).any():
            return period
        steps = steps[~long]
    return float("nan")


@dataclass(slots=True)
class StreamFacts:
    """Statistics of a stream.

    Attributes
    ----------
    rows : samples that were taken
    start_s, end_s : first and last time
    gaps, longest_gap_s : times that no sample came for `LONG` mean periods
    pauses, paused_s : those of them that last a second, and the duration of all these
    coldest, warmest : deg C, None where there is no temperature
    left_out : rows that were left out, where that was asked for
    first_arrival_s : of the first sample by the host's clock, s; nan if unknown
    measured : "a" if any accelerometer has a number, and "g" if any gyroscope has
    spans : first and last time at which each sensor, acc or gyr, has a number, s

    """

    rows: int = 0
    start_s: float = float("nan")
    end_s: float = float("nan")
    gaps: int = 0
    longest_gap_s: float = 0.0
    pauses: int = 0
    paused_s: float = 0.0
    coldest: float | None = None
    warmest: float | None = None
    left_out: int = 0
    first_arrival_s: float = float("nan")
    measured: str = ""
    spans: dict[str, tuple[float, float]] = field(default_factory=dict)
    _period: float = float("nan")

    def add(self, block: Block) -> None:
        """Take in the block that follows."""
        if not self.rows:
            self.start_s = float(block.t[0])
            self.first_arrival_s = float(block.t_host[0])
            self._period = mean_period(block.t)
        pause = float(block.t[0]) - self.end_s if self.rows else 0.0
        steps = block.t[1:] - block.t[:-1]
        for gaps in (np.array([pause]), steps):
            long = gaps[gaps > LONG * self._period]
            self.gaps += len(long)
            paused = long[long >= MIN_PAUSE_S]
            self.pauses += len(paused)
            self.paused_s += float(paused.sum())
            if len(long):
                self.longest_gap_s = max(self.longest_gap_s, float(gaps.max()))
        self.rows += len(block)
        for sensor, three in (("acc", block.acc), ("gyr", block.gyr)):
            (rows,) = np.nonzero(np.isfinite(three).any(axis=1))
            if not len(rows):
                continue
            first = float(block.t[rows[0]])
            if sensor not in self.spans:
                self.measured += sensor[0]
            began, _ = self.spans.get(sensor, (first, first))
            self.spans[sensor] = (began, float(block.t[rows[-1]]))
        self.end_s = float(block.t[-1])
        known = block.temperature[np.isfinite(block.temperature)]
        if len(known):
            low, high = float(known.min()), float(known.max())
            self.coldest = low if self.coldest is None else min(low, self.coldest)
            self.warmest = high if self.warmest is None else max(high, self.warmest)

    @property
    def rate_hz(self) -> float:
        """Mean rate between the pauses, Hz; nan where no sample follows another."""
        steps = self.rows - 1 - self.pauses
        span = self.end_s - self.start_s - self.paused_s
        return steps / span if steps > 0 and span > 0 else float("nan")

    def sentence(self) -> str:
        """Say it in a line."""
        many = "1 sample" if self.rows == 1 else f"{self.rows} samples"
        says = [f"{many} over {self.end_s - self.start_s:.1f} s"]
        if np.isfinite(self.rate_hz):
            says.append(f"{self.rate_hz:.4g} Hz")
        if self.coldest is not None:
            says.append(f"{self.coldest:.1f} to {self.warmest:.1f} °C")
        if self.gaps:
            gaps = f"{self.gaps} gaps of up to" if self.gaps > 1 else "a gap of"
            says.append(f"{gaps} {self.longest_gap_s:.3g} s")
        return ", ".join(says)

    def silences(self) -> list[str]:
        """Which sensor begins late or ends early, a sentence each."""
        said = []
        for sensor, (first, last) in self.spans.items():
            whens = []
            if first - self.start_s > MIN_PAUSE_S:
                whens.append(f"before {first:.1f} s")
            if self.end_s - last > MIN_PAUSE_S:
                whens.append(f"after {last:.1f} s")
            if whens:
                said.append(
                    f"its {SENSOR[sensor]} have no values {' and '.join(whens)}: rests"
                    " there are of the other sensor alone"
                )
        return said

    def table(self) -> dict[str, Any]:
        """What a mark keeps of it."""
        kept = {
            k: v
            for k, v in asdict(self).items()
            if k[0] != "_" and k not in ("measured", "spans")
        }
        rate = self.rate_hz
        return kept | {"rate_hz": round(rate, 6) if np.isfinite(rate) else None}
