"""A calibration as a person reads it: a table of values with their uncertainty."""

from __future__ import annotations

import math
from typing import IO

from fieldcal.calibration import Calibration

TITLES = {
    "acc_bias": "accelerometer bias",
    "acc_scale": "accelerometer scale factor",
    "gyr_bias": "gyroscope bias",
    "gyr_scale": "gyroscope scale factor",
    "cross_coupling": "accelerometer cross-coupling",
    "gyro_cross_coupling": "gyroscope cross-coupling",
    "angle_offset": "angle offset of the joints",
    "base_tilt": "tilt of the base",
}


def number(value: float, sigma: float) -> tuple[str, str]:
    """Value and sigma with as many digits as sigma has two of.

    >>> number(0.12345, 0.00234)
    ('0.1235', '0.0023')
    >>> number(123.4, 56.0)
    ('123', '56')
    """
    if not math.isfinite(sigma) or sigma <= 0:
        return f"{value:.6g}", "?"
    digits = max(0, 1 - math.floor(math.log10(sigma)))
    return f"{value:.{digits}f}", f"{sigma:.{digits}f}"


def show(calibration: Calibration, out: IO[str] | None = None) -> None:
    """Print the table, the fit, the verdict and the warnings."""
    from rich.console import Console
    from rich.table import Table

    console = Console(file=out, highlight=False)
    table = Table(title="Calibration", title_justify="left")
    for column in ("parameter", "", "value", "± 1σ", "unit"):
        right = column in ("value", "± 1σ")
        table.add_column(column, justify="right" if right else "left", no_wrap=True)
    rows = zip(calibration.names, calibration.values, calibration.sigma, strict=True)
    before = ""
    for (name, value, sigma), unit in zip(rows, calibration.units, strict=True):
        group, _, component = name.partition(".")
        if before and group != before:
            table.add_section()
        title = TITLES.get(group, group) if group != before else ""
        table.add_row(title, component, *number(value, sigma), unit)
        before = group
    console.print(table)
    console.print(_fit(calibration))
    for warning in calibration.warnings:
        console.print(f"! {warning}", markup=False)
    verdict = "good" if calibration.good else "BAD: do not use these numbers"
    console.print(f"verdict: {verdict}", markup=False)


def _fit(calibration: Calibration) -> str:
    method = f"method: {calibration.method}"
    if not math.isfinite(calibration.chi2):
        return method
    return (
        f"{method}; χ² = {calibration.chi2:.1f} with {calibration.dof} degrees of"
        f" freedom; rms residual {calibration.rms:.2g} m/s²"
    )
