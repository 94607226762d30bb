"""Residuals by position, axis and temperature, and correlations of the parameters."""

from __future__ import annotations

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.wording import parameter_title
from fieldcal.core.samples import CHANNELS, Array
from fieldcal.report.blocks import (
    CorrelationMatrix,
    Figure,
    Paragraph,
    ReportBlock,
    Section,
)
from fieldcal.report.charts import SENSORS, Axis, Chart, Series
from fieldcal.report.gather import ReportMaterial
from fieldcal.report.residuals import Residuals, window_residuals

LEAST_WARMING = 0.05
"""Smallest range of temperature for which a chart over temperature is drawn, K."""

STRONG = 0.9
"""Smallest correlation that is listed."""


def agreement_section(material: ReportMaterial) -> Section | None:
    """Charts of the residuals; None without a calibration or windows."""
    found = window_residuals(material)
    if found is None:
        return None
    blocks: list[ReportBlock] = []
    warm = found.temperature
    span = np.ptp(warm[np.isfinite(warm)]) if np.isfinite(warm).any() else 0.0
    for first, what, unit in SENSORS:
        values = _rows_by_parameter(found, first)
        if not values:
            continue
        blocks.append(Figure(_by_position(found, values, what, unit), _caption(what)))
        if span > LEAST_WARMING:
            chart = _by_temperature(found, values, what, unit)
            blocks.append(Figure(chart, "The same over the temperature."))
    if not blocks:
        return None
    blocks.insert(0, Paragraph("What the calibration leaves of each window's average."))
    return Section("residuals", "Residuals", tuple(blocks))


def _rows_by_parameter(
    found: Residuals, first: int
) -> list[tuple[str, Array, Array, int]]:
    """Name, residual, error and tone of each known channel of a sensor."""
    sigma = found.sigma
    out = [
        (CHANNELS[i], found.channel[:, i], sigma[:, i], i % 3 + 1)
        for i in range(first, first + 3)
    ]
    if first == 0:
        out.append(("norm", found.norm, sigma[:, :3].mean(axis=1), 5))
    return [row for row in out if np.isfinite(row[1]).any()]


def _caption(what: str) -> str:
    if what == "gyroscopes":
        return "The Earth's rate is taken out as far as these windows show it."
    return "Bars: the standard error of the window. Of hand-held positions, the norm."


def _by_position(
    found: Residuals,
    values: list[tuple[str, Array, Array, int]],
    what: str,
    unit: str,
) -> Chart:
    x = np.arange(len(found.rows), dtype=float)
    middle = (len(values) - 1) / 2
    series = tuple(
        Series(name, x + 0.16 * (i - middle), r, tone, low=r - s, high=r + s)
        for i, (name, r, s, tone) in enumerate(values)
    )
    names = tuple(str(r + 1) for r in found.rows)
    return Chart(
        f"residual-position-{what}",
        f"Residuals of the {what} by position",
        _alt(values, unit),
        Axis("position", names=names),
        Axis("residual", unit),
        series,
    )


def _by_temperature(
    found: Residuals,
    values: list[tuple[str, Array, Array, int]],
    what: str,
    unit: str,
) -> Chart:
    series = tuple(
        Series(name, found.temperature, r, tone, low=r - s, high=r + s)
        for name, r, s, tone in values
    )
    return Chart(
        f"residual-temperature-{what}",
        f"Residuals of the {what} by temperature",
        _alt(values, unit),
        Axis("temperature", "°C"),
        Axis("residual", unit),
        series,
    )


def _alt(values: list[tuple[str, Array, Array, int]], unit: str) -> str:
    said = [
        f"{name} rms {np.sqrt(np.nanmean(r**2)):.2g} {unit},"
        f" largest {np.nanmax(np.abs(r)):.2g} {unit}"
        for name, r, _, _ in values
    ]
    return "; ".join(said) + "."


def correlation_section(material: ReportMaterial) -> Section | None:
    """The correlation matrix, and the strongly correlated pairs."""
    found = material.calibration
    if found is None or len(found.names) < 2:
        return None
    r = correlation_matrix(found)
    names = tuple(parameter_title(n) for n in found.names)
    short = tuple(str(i + 1) for i in range(len(names)))
    matrix = CorrelationMatrix(
        "Correlations in hundredths; row and column numbers are the same",
        names,
        short,
        tuple(tuple(row) for row in r.tolist()),
    )
    return Section(
        "correlation",
        "Correlation",
        (Paragraph(_strong_correlations(names, r)), matrix),
    )


def correlation_matrix(found: Calibration) -> Array:
    """Correlation matrix, (k, k); 0 where a parameter has no uncertainty."""
    size = np.where(found.sigma > 0, found.sigma, np.inf)
    r: Array = found.covariance / np.outer(size, size)
    return r


def _strong_correlations(names: tuple[str, ...], r: Array) -> str:
    pairs = np.argwhere(np.triu(np.abs(r) > STRONG, 1))
    if not len(pairs):
        return f"No two parameters are correlated by more than {STRONG}."
    order = np.argsort([-abs(r[i, j]) for i, j in pairs])[:6]
    listed = [
        f"{names[i]} with {names[j]} ({r[i, j]:+.2f})" for i, j in pairs[order].tolist()
    ]
    more = f", and {len(pairs) - len(listed)} more" if len(pairs) > len(listed) else ""
    return f"Hard to tell apart in these positions: {', '.join(listed)}{more}."
