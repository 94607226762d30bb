"""Terminal view of a calibration: a table of values with their uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import IO, TYPE_CHECKING, Any

from fieldcal.calibration import Calibration
from fieldcal.calibration.gauge import in_sample_units
from fieldcal.calibration.names import group_of
from fieldcal.calibration.wording import (
    UNCHECKED,
    format_with_sigma,
    parameter_title,
)
from fieldcal.commands.install_values import install_lines
from fieldcal.core.sentences import degrees_of_freedom

if TYPE_CHECKING:
    from rich.console import Console


def show_calibration(
    calibration: Calibration,
    truth: Mapping[str, Any] | None = None,
    out: IO[str] | None = None,
) -> None:
    """Print the table, the fit, the verdict and the warnings.

    Parameters
    ----------
    calibration : to show
    truth : true values of a virtual device, shown beside the estimates
    out : standard output by default

    """
    from rich.table import Table

    from fieldcal.commands.console import EscapingConsole

    calibration = in_sample_units(calibration)
    console = EscapingConsole(file=out)
    table = Table(title="Calibration", title_justify="left")
    columns = ["parameter", "value", "± 1σ", "unit"]
    columns += ["concealed", "off by"] if truth else []
    for column in columns:
        right = column in ("value", "± 1σ", "concealed", "off by")
        table.add_column(column, justify="right" if right else "left", no_wrap=True)
    true_by_name = true_values(truth or {})
    before = ""
    rows = zip(calibration.names, calibration.values, calibration.sigma, strict=True)
    for (name, value, sigma), unit in zip(rows, calibration.units, strict=True):
        group = group_of(name)
        if before and group != before:
            table.add_section()
        cells = [parameter_title(name), *format_with_sigma(value, sigma), unit]
        if name in true_by_name:
            true = true_by_name[name]
            cells += [
                format_with_sigma(true, sigma)[0],
                f"{(value - true) / sigma:+.1f} σ" if sigma > 0 else "",
            ]
        table.add_row(*cells)
        before = group
    console.print(table)
    _print_fit_and_verdict(console, calibration)


def _print_fit_and_verdict(console: Console, calibration: Calibration) -> None:
    print_sentence(console, "", _fit_sentence(calibration))
    for told in install_lines(calibration):
        print_sentence(console, "", told)
    for warning in calibration.warnings:
        print_sentence(console, "! ", warning)
    if not calibration.good:
        print_sentence(console, "", "verdict: BAD, do not use these numbers")
    elif "decision" not in calibration.info:  # which says more, below
        verdict = "good" if calibration.is_checked else UNCHECKED
        print_sentence(console, "", f"verdict: {verdict}")


def print_sentence(console: Console, mark: str, text: str) -> None:
    """Print a sentence after a mark, wrapped on a terminal, else on one line."""
    from rich.table import Table
    from rich.text import Text

    if not (mark and console.is_terminal):
        whole = not console.is_terminal
        console.print(f"{mark}{text}", markup=False, soft_wrap=whole)
        return
    grid = Table.grid()
    grid.add_column(width=len(mark))
    grid.add_column()
    grid.add_row(Text(mark), Text(text))
    console.print(grid)


def true_values(truth: Mapping[str, Any]) -> dict[str, float]:
    """True values of a virtual device, by the full names of a calibration."""
    flat = {
        f"{group}.{axis}": float(value)
        for group in ("acc_bias", "acc_scale", "gyr_bias", "gyr_scale")
        for axis, value in zip("xyz", truth.get(group, ()), strict=False)
    }
    for group, parameters in truth.get("effects", {}).items():
        if isinstance(parameters, Mapping):
            numbers = {k: v for k, v in parameters.items() if not isinstance(v, str)}
            flat |= {f"{group}.{k}": float(v) for k, v in numbers.items()}
    return flat


def _fit_sentence(calibration: Calibration) -> str:
    method = f"method: {calibration.method}"
    gyroscopes = calibration.info.get("gyroscopes")
    if not math.isfinite(calibration.chi2):
        return method
    if math.isfinite(calibration.rms):
        rms = f"{calibration.rms:.2g} m/s²"
    elif gyroscopes:
        rms = f"{gyroscopes['rms']:.2g} rad/s"
    else:  # a closed form leaves none
        return method
    return (
        f"{method}; χ² = {calibration.chi2:.1f} with"
        f" {degrees_of_freedom(calibration.dof)}; rms residual {rms}"
    )
