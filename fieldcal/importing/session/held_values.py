"""Values that stay over several rows: a logger that is faster than its sensor."""

from __future__ import annotations

from collections import Counter

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.importing.words.file_names import SENSOR

MIN_RUNS = 50
"""Values that tell how long each stays."""

USUAL = 0.8
"""Share of the values that stay more than half as long as the usual one: coarse counts
of a device at rest stay for any time, and change with each row while it turns."""


class HeldValues:
    """Counts in how many rows each value of a sensor stands.

    The rows are taken in one block after the other.
    """

    def __init__(self) -> None:
        self._runs: dict[str, Counter[int]] = {"acc": Counter(), "gyr": Counter()}
        self._open: dict[str, tuple[Array, int]] = {}

    def add(self, block: Block) -> None:
        """Take in the block that follows."""
        for sensor, runs in self._runs.items():
            rows = getattr(block, sensor)
            rows = rows[np.isfinite(rows).all(axis=1)]
            if not len(rows):
                continue
            last, before = self._open.get(sensor, (rows[0], 0))
            changes = (np.vstack([last, rows[:-1]]) != rows).any(axis=1)
            edges = np.flatnonzero(changes)
            if len(edges):
                runs[before + int(edges[0])] += 1
                lengths, many = np.unique(np.diff(edges), return_counts=True)
                runs.update(dict(zip(lengths.tolist(), many.tolist(), strict=True)))
                before = -int(edges[-1])
            self._open[sensor] = (rows[-1], before + len(rows))

    def says(self, rate: float) -> list[str]:
        """How fast the sensors are where rows come at `rate`, Hz, a sentence each."""
        found = {}
        for sensor, runs in self._runs.items():
            number = sum(runs.values())
            if number < MIN_RUNS:
                continue
            lengths = sorted(runs)
            passed = np.cumsum([runs[n] for n in lengths])
            usual = lengths[int(np.searchsorted(passed, number / 2))]  # the median
            near = sum(many for n, many in runs.items() if n > usual / 2) / number
            if usual > 1 and near >= USUAL:
                mean = sum(n * many for n, many in runs.items()) / number
                found[sensor] = rate / mean
        return [
            f"the values of its {SENSOR[sensor]} stay over about {rate / own:.2g} rows"
            f" each: they measure at {own:.3g} Hz, and the rows between say nothing new"
            for sensor, own in found.items()
        ]
