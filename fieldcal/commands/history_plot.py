"""Plot of parameters from run to run, with the values out of family in red."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcal.core.errors import InputError

if TYPE_CHECKING:
    from fieldcal.history.trend import TrendPoint


def plot_trends(
    path: Path, serial: str, trends: Mapping[str, Sequence[TrendPoint]]
) -> None:
    """Write the plot, in the format of the file's ending.

    Raises
    ------
    InputError
        If it cannot be written, or matplotlib is not installed.

    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError(
            "a picture needs matplotlib: pip install 'fieldcal[plot]'"
        ) from error
    figure = Figure(figsize=(8, 1.8 * len(trends) + 0.6), layout="constrained")
    axes = figure.subplots(len(trends), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (name, points) in zip(axes, trends.items(), strict=True):
        when = [datetime.fromisoformat(p.run.taken_at) for p in points]
        for odd, colour in ((False, "tab:blue"), (True, "tab:red")):
            some = [
                (w, p)
                for w, p in zip(when, points, strict=True)
                if p.out_of_family is odd
            ]
            if some:
                axis.errorbar(
                    [w for w, _ in some],
                    [p.value for _, p in some],
                    yerr=[2 * p.sigma for _, p in some],
                    fmt="o",
                    color=colour,
                    label="out of family" if odd else "± 2σ",
                )
        axis.set_ylabel(f"{name}\n{points[-1].unit}")
        axis.grid(alpha=0.3)
    axes[0].legend(loc="best")
    axes[0].set_title(f"{serial}: {len(next(iter(trends.values())))} calibrations")
    figure.autofmt_xdate()
    try:
        figure.savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be written: {error}") from error
