"""Residuals of one model: what was fitted, and what was predicted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.diagnosis.findings.stretch_means import rms
from fieldcal.diagnosis.result import Quality
from fieldcal.model.rows.reduce import Rows

UNITS = ("m/s^2", "rad/s")


@dataclass(frozen=True, slots=True)
class Agreement:
    """Residuals of one model.

    Attributes
    ----------
    rows : they belong to
    residual, ahead : (n, 6) of what was fitted, and of what was predicted
    lines, lines_ahead : (6,) mean squares at the lines' frequencies, and as predicted
    chi2_per_dof : of the residual

    """

    rows: Rows
    residual: Array
    ahead: Array
    lines: Array
    lines_ahead: Array
    chi2_per_dof: float

    @property
    def rms(self) -> Array:
        """Root mean squares over parts of windows, (6,)."""
        return rms(self.rows, self.residual)

    @property
    def held_out(self) -> Array:
        """The same of what was predicted."""
        return rms(self.rows, self.ahead)

    @property
    def whole(self) -> Array:
        """Root mean squares with what there is of lines, (6,)."""
        return np.sqrt(self.rms**2 + self.lines)

    def quality(self, triad: int) -> Quality:
        """In the unit of one triad: 0 accelerometers, 1 gyroscopes."""
        part = slice(3 * triad, 3 * triad + 3)
        held_out = np.sqrt(self.held_out**2 + self.lines_ahead)
        by_channel = {
            n: float(v)
            for n, v in zip(CHANNELS, held_out, strict=True)
            if np.isfinite(v)
        }
        return Quality(
            rms=_mean(self.whole[part]),
            chi2_per_dof=self.chi2_per_dof,
            held_out_rms=_mean(held_out[part]),
            by_channel=by_channel,
        )


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan
