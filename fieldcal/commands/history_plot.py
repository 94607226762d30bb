"""Plot of parameters from run to run, with the values out of family in red."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.core.errors import InputError, disk_says
from fieldcal.history.store import recording_time

if TYPE_CHECKING:
    from fieldcal.history.trend import TrendPoint


def plot_trends(
    path: Path, serial: str, trends: Mapping[str, Sequence[TrendPoint]]
) -> str:
    """Write the plot, in the format of the file's ending.

    Returns words about calibrations that are left out, since their time is unknown.

    Raises
    ------
    InputError
        If it cannot be written, no calibration has a time, or matplotlib is not
        installed.

    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError(
            "a picture needs matplotlib: pip install 'fieldcal[plot]'"
        ) from error
    runs = {p.run.number: p.run for points in trends.values() for p in points}
    times = {number: recording_time(run.taken_at) for number, run in runs.items()}
    known = {number: at for number, at in times.items() if at is not None}
    if not known:
        raise InputError(
            f"{serial}: no calibration has a time, so nothing can be plotted over it;"
            " leave --png out"
        )
    figure = Figure(figsize=(8, 1.8 * len(trends) + 0.6), layout="constrained")
    axes = figure.subplots(len(trends), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (name, points) in zip(axes, trends.items(), strict=True):
        _plot_trend(axis, name, points, known)
    if axes[0].get_legend_handles_labels()[0]:
        axes[0].legend(loc="best")
    axes[0].set_title(f"{serial}: {len(known)} calibrations")
    figure.autofmt_xdate()
    try:
        figure.savefig(path, dpi=120)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {disk_says(error)}") from error
    except ValueError as error:
        raise InputError(f"{path}: cannot be written: {error}") from error
    lost = len(times) - len(known)
    return f"; {lost} of unknown time left out" if lost else ""


def _plot_trend(
    axis: Any, name: str, points: Sequence[TrendPoint], times: Mapping[int, datetime]
) -> None:
    """Plot one parameter; `times` by the number of the calibration."""
    for odd, colour in ((False, "tab:blue"), (True, "tab:red")):
        some = [p for p in points if p.out_of_family is odd and p.run.number in times]
        if some:
            axis.errorbar(
                [times[p.run.number] for p in some],
                [p.value for p in some],
                yerr=[2 * p.sigma for p in some],
                fmt="o",
                color=colour,
                label="out of family" if odd else "± 2σ",
            )
    axis.set_ylabel(f"{name}\n{points[-1].unit}")
    axis.grid(alpha=0.3)
