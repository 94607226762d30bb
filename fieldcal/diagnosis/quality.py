"""How well recording and simulation agree, before and after.

Residuals are averaged over parts of the windows before their rms is taken, so that it
is the mismatch that counts and not the white noise of single samples. Lines do not show
in such means: their squares, averaged over windows at their own frequency, are added.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.hand import rows_of
from fieldcal.diagnosis.heldout import LONG, SHORT, held_out, rms
from fieldcal.diagnosis.prepare import Prepared, bench_of
from fieldcal.diagnosis.reduce import Source, reduce
from fieldcal.diagnosis.result import Quality
from fieldcal.samples import CHANNELS, Array, Block

UNITS = ("m/s^2", "rad/s")


@dataclass(frozen=True, slots=True)
class Agreement:
    """Residuals of one model.

    Attributes
    ----------
    bench, fit : the model
    ahead : (n, 6) residuals of what was predicted
    rms, held_out : (6,) over parts of windows
    lines, lines_ahead : (6,) mean squares at the lines' frequencies, and as predicted

    """

    bench: Bench
    fit: Fit
    ahead: Array
    rms: Array
    held_out: Array
    lines: Array
    lines_ahead: Array

    @property
    def whole(self) -> Array:
        """Root mean squares with what there is of lines, (6,)."""
        return np.sqrt(self.rms**2 + self.lines)

    def quality(self, triad: int) -> Quality:
        """In the unit of one triad: 0 accelerometers, 1 gyroscopes."""
        part = slice(3 * triad, 3 * triad + 3)
        held_out = np.sqrt(self.held_out**2 + self.lines_ahead)
        seen = {
            n: float(v)
            for n, v in zip(CHANNELS, held_out, strict=True)
            if np.isfinite(v)
        }
        return Quality(
            rms=_mean(self.whole[part]),
            chi2_per_dof=self.fit.chi2 / max(self.fit.dof, 1),
            held_out_rms=_mean(held_out[part]),
            by_channel=seen,
        )


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan


def agreement(
    bench: Bench, fit: Fit, stretches: int, lines: Array, lines_ahead: Array
) -> Agreement:
    """Residuals of a fit, seen and predicted."""
    ahead = held_out(bench, fit.terms, fit, stretches)
    seen, unseen = (rms(bench.rows, r, stretches) for r in (fit.residual, ahead))
    return Agreement(bench, fit, ahead, seen, unseen, lines, lines_ahead)


def before(block: Block, explanation: Explanation) -> Agreement:
    """The simulation alone, on the samples as they came."""
    prepared = explanation.prepared
    bench = raw_bench(block, prepared)
    fit = explanation.base if bench is prepared.bench else bench.fit(explanation.always)
    lines = sum((r.before for r in prepared.remains), np.zeros(6))
    return agreement(bench, fit, _stretches(explanation), lines, lines)


def after(explanation: Explanation) -> Agreement:
    """The simulation with the effects found in the windows."""
    remains = explanation.prepared.remains
    lines = sum((r.after for r in remains), np.zeros(6))
    ahead = sum((r.held_out for r in remains), np.zeros(6))
    bench, fit = explanation.wide, explanation.fit
    return agreement(bench, fit, _stretches(explanation), lines, ahead)


def _stretches(explanation: Explanation) -> int:
    """Of few windows: long ones, unless nothing but chance could foretell them."""
    only_chance = explanation.model.random and not explanation.terms
    return SHORT if only_chance else LONG


def raw_bench(block: Block, prepared: Prepared) -> Bench:
    """Rows of the samples as they came, if anything was done to them."""
    if block is prepared.source.block and not prepared.checked.ids:
        return prepared.bench
    source: Source = replace(
        prepared.source,
        block=block,
        usable=np.hstack([np.isfinite(block.acc), np.isfinite(block.gyr)]),
    )
    # a device that was touched is not held by hand for that: rows of the same kind
    one_each = len(prepared.bench.rows.x) == prepared.bench.windows
    return bench_of((rows_of if one_each else reduce)(source), source.about)


def parted(one: Agreement, other: Agreement) -> int:
    """The triad in which two models differ most, in what they see or foretell: 0 or 1.

    What is random takes nothing from the residuals, but foretells.
    """
    sizes = []
    for triad in (0, 1):
        part, gains = slice(3 * triad, 3 * triad + 3), [0.0]
        for pair in ((one.whole, other.whole), (one.held_out, other.held_out)):
            first, then = (np.nan_to_num(rms[part]) for rms in pair)
            gain = float((first**2 - then**2).max())
            gains.append(gain / max(float(then.max()) ** 2, 1e-300))
        sizes.append(max(gains))
    known = [bool(np.isfinite(one.rms[3 * i : 3 * i + 3]).any()) for i in (0, 1)]
    if known[0] != known[1]:
        return int(known[1])
    return int(sizes[1] > sizes[0])
