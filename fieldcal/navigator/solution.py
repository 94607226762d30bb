"""The recorded navigation solution, run by run.

A text table with a heading: ``t`` in s, and of the velocity ``vn``, ``ve``, ``vd`` in
m/s, of the position ``pn``, ``pe``, ``pd`` in m from any origin, north, East, down;
columns may be absent. A run is a [[position]] of session.toml from start_s, at which
the navigator began with its entered attitude and zero velocity, to end_s.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array

COLUMNS = (("ve", "vd", "vn"), ("pe", "pd", "pn"))
"""East, down, north: the order of the base axes of a base that points north."""

INSTANTS = 24
"""Number of instants of a run that are used, at equal intervals; no more than it has
samples, so that no two depend on the same one."""

SHORTEST_S = 10.0


@dataclass(frozen=True, slots=True)
class NavigationSolution:
    """The recorded navigation solution.

    Attributes
    ----------
    t : (n,) s, ascending
    values : (n, 6) velocity and position in East, down, north; nan where not recorded

    """

    t: Array
    values: Array

    @property
    def recorded_columns(self) -> list[int]:
        """Columns that were recorded."""
        return np.flatnonzero(np.isfinite(self.values).any(axis=0)).tolist()

    def rotated(self, base: Array) -> NavigationSolution:
        """Return it in other axes, the rows of `base` (3, 3); nan remains nan."""
        known = np.isfinite(self.values)
        both = np.nan_to_num(self.values).reshape(-1, 2, 3) @ base.T
        return NavigationSolution(self.t, np.where(known, both.reshape(-1, 6), np.nan))


@dataclass(frozen=True, slots=True)
class NavigatorRun:
    """One run, at instants step, 2 step, ... from its start.

    Attributes
    ----------
    step : s
    values : (m, 6) velocity, and position less that at the start of the run
    noise_share : (m,) variance of the noise of each instant, of that of a sample: less
        than 1 between two samples

    """

    step: float
    values: Array
    noise_share: Array


def read_solution(path: Path) -> NavigationSolution:
    """Read a navigation solution from a text table.

    Raises
    ------
    InputError
        Naming the file, and the column or the line that is wrong.

    """
    try:
        # Excel begins "CSV UTF-8" with a byte order mark
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            rows = [(reader.line_num, row) for row in reader if row]
    except FileNotFoundError as error:
        raise InputError(
            f"{path}: is not there: put what the navigator computed into it, or name"
            " its file in session.toml, [navigator] solution"
        ) from error
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    heading = [name.strip() for name in rows[0][1]] if rows else []
    names = [n for triad in COLUMNS for n in triad]
    if "t" not in heading or not set(names) & set(heading):
        raise InputError(
            f"{path}: has no heading with t and one of {', '.join(names)}: name the"
            " columns in its first line"
        )
    table = _numbers(path, rows[1:], len(heading))
    t = table[:, heading.index("t")]
    if len(t) < 2:
        raise InputError(f"{path}: has {len(t)} lines of numbers; two are the least")
    if len(back := np.flatnonzero(np.diff(t) <= 0)):
        line, before = rows[int(back[0]) + 2][0], t[back[0]]
        raise InputError(
            f"{path}: line {line}: t does not ascend, it is {t[back[0] + 1]:g} s behind"
            f" {before:g} s: sort the lines by time, or copy the file again if it ends"
            " there"
        )
    values = np.full((len(t), 6), np.nan)
    for i, name in enumerate(names):
        if name in heading:
            values[:, i] = table[:, heading.index(name)]
    return NavigationSolution(t, values)


def _numbers(path: Path, rows: Sequence[tuple[int, list[str]]], width: int) -> Array:
    """Numbers of rows, each with the number of its line, (n, width)."""
    out = np.empty((len(rows), width))
    for i, (line, row) in enumerate(rows):
        try:
            out[i] = [float(cell) for cell in row]
        except ValueError:
            raise InputError(
                f"{path}: line {line} is not {width} numbers: mend it, or leave it out"
            ) from None
        if not np.isfinite(out[i]).all():
            raise InputError(f"{path}: line {line} has a number that is none")
    return out


def runs_in_windows(
    solution: NavigationSolution, windows: Sequence[tuple[float, float] | None]
) -> list[NavigatorRun]:
    """Cut a solution into runs, one for each window (start, end), s.

    Raises
    ------
    InputError
        If one is not within what was recorded, or too short.

    """
    out = []
    for number, window in enumerate(windows, 1):
        if window is None:
            raise InputError(
                f"session.toml: [[position]] number {number} has no start_s and"
                " end_s: say when its run began and ended"
            )
        start, end = window
        # a time that is no number is in no range
        within = solution.t[0] <= start and end <= solution.t[-1]
        if not (within and end - start >= SHORTEST_S):
            raise InputError(
                f"session.toml: [[position]] number {number}: a run of"
                f" {SHORTEST_S:.0f} s or more must lie within {solution.t[0]:g} to"
                f" {solution.t[-1]:g} s, not {start:g} to {end:g} s"
            )
        out.append(_run_between(solution, start, end))
    return out


def _run_between(
    solution: NavigationSolution, start: float, end: float
) -> NavigatorRun:
    """The run from start to end, interpolated between samples."""
    samples = int(((solution.t > start) & (solution.t <= end)).sum())
    step = (end - start) / max(min(INSTANTS, samples), 1)
    at = np.arange(start, end + step / 2, step)
    values = np.stack([np.interp(at, solution.t, v) for v in solution.values.T])
    begun = values[:, :1] * (np.arange(6) >= 3)[:, None]
    after = np.clip(np.searchsorted(solution.t, at), 1, len(solution.t) - 1)
    before, next_ = solution.t[after - 1], solution.t[after]
    u = np.clip((at - before) / (next_ - before), 0.0, 1.0)
    share = u**2 + (1 - u) ** 2
    return NavigatorRun(step, (values - begun).T[1:], share[1:])
