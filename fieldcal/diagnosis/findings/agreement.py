"""Residuals of one model: of its fit, and of its predictions of held-out positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.diagnosis.findings.stretch_means import rms_over_parts, root_mean_square
from fieldcal.diagnosis.result import Quality
from fieldcal.model.rows.averages import Rows

UNITS = ("m/s^2", "rad/s")


@dataclass(frozen=True, slots=True)
class ModelResiduals:
    """Residuals of one model.

    Attributes
    ----------
    rows : rows that the residuals belong to
    residual : (n, 6) of the fit
    predicted_residual : (n, 6) of held-out positions
    lines, lines_predicted : (6,) mean squares at the frequencies of lines, of fit and
        prediction
    chi2_per_dof : of the residual

    """

    rows: Rows
    residual: Array
    predicted_residual: Array
    lines: Array
    lines_predicted: Array
    chi2_per_dof: float

    @property
    def rms(self) -> Array:
        """Root mean squares of the fit's residuals over parts of windows, (6,)."""
        return rms_over_parts(self.rows, self.residual)

    @property
    def held_out_rms(self) -> Array:
        """Root mean squares of the predicted residuals, (6,)."""
        return rms_over_parts(self.rows, self.predicted_residual)

    @property
    def rms_with_lines(self) -> Array:
        """Root mean squares of the fit's residuals and of lines together, (6,)."""
        return np.sqrt(self.rms**2 + self.lines)

    def quality(self, triad: int) -> Quality:
        """Quality in the unit of one triad: 0 accelerometers, 1 gyroscopes."""
        part = slice(3 * triad, 3 * triad + 3)
        held_out = np.sqrt(self.held_out_rms**2 + self.lines_predicted)
        by_channel = {
            n: float(v)
            for n, v in zip(CHANNELS, held_out, strict=True)
            if np.isfinite(v)
        }
        return Quality(
            rms=root_mean_square(self.rms_with_lines[part]),
            chi2_per_dof=self.chi2_per_dof,
            held_out_rms=root_mean_square(held_out[part]),
            by_channel=by_channel,
        )
