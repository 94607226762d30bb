"""Residuals of one model: of its fit, and of its predictions of held-out positions.

They are averaged over parts of the windows, to reduce their noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.diagnosis.result import Quality
from fieldcal.model import resolutions
from fieldcal.model.rows.averages import Rows


def part_means(rows: Rows, residual: Array) -> tuple[Array, Array, Index]:
    """Means over parts of the windows.

    Returns
    -------
    mean : (m, 6) weighted mean residuals; nan where there is none
    sd : (m, 6) their standard deviation from white noise
    position : (m,)

    """
    means, sds, position = [], [], []
    for p in np.unique(rows.x.position):
        at = np.flatnonzero(rows.x.position == p)
        cuts = np.unique(
            np.round(np.array(resolutions.PART_ENDS) * len(at)).astype(int)
        )
        for a, b in zip(cuts[:-1], cuts[1:], strict=True):
            part = at[a:b]
            use = np.isfinite(residual[part]) & rows.used[part]
            weight = np.where(use, 1 / np.where(use, rows.sd[part], 1.0) ** 2, 0.0)
            total = weight.sum(axis=0)
            information = np.where(total > 0, total, np.nan)
            means.append(
                (weight * np.nan_to_num(residual[part])).sum(axis=0) / information
            )
            sds.append(np.hypot(1 / np.sqrt(information), rows.window_error[part[0]]))
            position.append(p)
    return np.array(means), np.array(sds), np.array(position, dtype=np.intp)


def root_mean_square(values: Array) -> float:
    """Root mean square of the known of some values (n,); nan if none is known."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan


def rms_over_parts(rows: Rows, residual: Array) -> Array:
    """Root mean square over the parts of windows, (6,); nan where there is none."""
    mean, _, _ = part_means(rows, residual)
    count = np.isfinite(mean).sum(axis=0)
    squares = np.nansum(mean**2, axis=0)
    return np.sqrt(np.where(count > 0, squares / np.maximum(count, 1), np.nan))


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
        pairs = zip(CHANNELS, held_out.tolist(), strict=True)
        return Quality(
            rms=root_mean_square(self.rms_with_lines[part]),
            chi2_per_dof=self.chi2_per_dof,
            held_out_rms=root_mean_square(held_out[part]),
            held_out_by_channel={n: v for n, v in pairs if np.isfinite(v)},
        )
