"""Text files of numbers in columns: what each column is, is said by the user.

Nothing is guessed in silence: columns, rate and units come from the command line; only
the separator and lines of names at the top are found by themselves. Times are made from
the rate where the file has none.
"""

from __future__ import annotations

import gzip
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fieldcal.description import ACC_UNITS, GYR_UNITS
from fieldcal.errors import InputError
from fieldcal.sample_files import COLUMNS
from fieldcal.samples import Array, Block

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}

SKIP = "_"
"""Stands for a column that is not wanted."""


@dataclass(frozen=True, slots=True)
class Layout:
    """What the columns of a file are.

    Attributes
    ----------
    columns : names out of `sample_files.COLUMNS` in the file's order, "_" to skip one
    rate_hz : needed where no column is ``t``
    separator : None finds comma, semicolon, tab or white space
    skip : lines at the top to leave out; None leaves out those that hold no numbers
    acc_unit, gyr_unit, time_unit : of the file
    acc_lsb, gyr_lsb : counts in one unit, for raw counts

    """

    columns: tuple[str, ...]
    rate_hz: float | None = None
    separator: str | None = None
    skip: int | None = None
    acc_unit: str = "m/s^2"
    gyr_unit: str = "rad/s"
    time_unit: str = "s"
    acc_lsb: float = 1.0
    gyr_lsb: float = 1.0

    def check(self) -> None:
        """Refuse a layout that cannot give samples.

        Raises
        ------
        InputError
            Naming the column or unit.

        """
        for name in self.columns:
            if name not in (*COLUMNS, SKIP):
                raise InputError(
                    f"column {name!r} is none of: {', '.join(COLUMNS)}, _ to skip one"
                )
        wanted = [c for c in self.columns if c != SKIP]
        if len(set(wanted)) < len(wanted):
            raise InputError(f"a column is named twice in {','.join(self.columns)}")
        if not {"ax", "gx"} & set(wanted):
            raise InputError("name the columns: neither ax ay az nor gx gy gz is there")
        if "t" not in wanted and not self.rate_hz:
            raise InputError("no column is t, the time: give the rate, e.g. --rate 100")
        for unit, known in (
            (self.acc_unit, ACC_UNITS),
            (self.gyr_unit, GYR_UNITS),
            (self.time_unit, TIME_UNITS),
        ):
            if unit not in known:
                raise InputError(f"unit {unit!r} is none of: {', '.join(known)}")


def read(path: Path, layout: Layout) -> Block:
    """Samples of a file, in SI units (or counts and volts as they are).

    Raises
    ------
    InputError
        If the file or the layout cannot be used; names file, line and column.

    """
    layout.check()
    lines = _lines(path)
    skip = _heading(lines) if layout.skip is None else layout.skip
    if skip >= len(lines):
        raise InputError(f"{path}: holds no row of numbers; is it a text file?")
    separator = layout.separator or _separator(lines[skip])
    table = _numbers(path, lines, skip, separator)
    if table.shape[1] != len(layout.columns):
        raise InputError(
            f"{path}: has {table.shape[1]} columns, {len(layout.columns)} are named;"
            f" its line {skip + 1} is {lines[skip][:60]!r}"
        )
    columns = dict(zip(layout.columns, table.T, strict=True))
    block = _block(columns, layout, len(table))
    back = np.flatnonzero(np.diff(block.t) <= 0)
    if len(back):
        raise InputError(
            f"{path}: line {skip + back[0] + 2}: its time is not later than that of the"
            " line above; put the lines in time order, each time once"
        )
    return block


def _lines(path: Path) -> list[str]:
    try:
        data = path.read_bytes()
        if data[:2] == b"\x1f\x8b":
            data = gzip.decompress(data)
    except (OSError, EOFError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    return [line for line in data.decode(errors="replace").splitlines() if line.strip()]


def _separator(line: str) -> str | None:
    return next((s for s in (",", ";", "\t") if s in line), None)


def _heading(lines: Sequence[str]) -> int:
    """How many lines at the top hold something else than numbers, or fewer columns."""
    full = max((line.count(s) for line in lines[:50] for s in (",", ";")), default=0)
    for i, line in enumerate(lines):
        separator = _separator(line)
        cells = [c.strip() for c in line.split(separator)]
        whole = separator not in (",", ";") or line.count(separator) == full
        if whole and all(_is_number(c) for c in cells if c):
            return i
    return len(lines)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _numbers(
    path: Path, lines: Sequence[str], skip: int, separator: str | None
) -> Array:
    rows = lines[skip:]
    try:
        table: Array = np.loadtxt(rows, delimiter=separator, ndmin=2, comments=None)
    except ValueError:
        try:
            table = np.loadtxt(
                rows,
                delimiter=separator,
                ndmin=2,
                comments=None,
                converters=lambda cell: float(cell.strip() or "nan"),
            )
        except ValueError as error:
            raise InputError(
                f"{path}: {error} (rows counted from line {skip + 1}, the first of"
                " numbers)"
            ) from error
    return table


def _block(columns: dict[str, Array], layout: Layout, n: int) -> Block:
    def triad(kind: str, scale: float) -> Array:
        unknown = np.full(n, np.nan)
        axes = [columns.get(kind + axis, unknown) for axis in "xyz"]
        return scale * np.column_stack(axes)

    if "t" in columns:
        t = columns["t"] * TIME_UNITS[layout.time_unit]
        t = t - t[0]
    else:
        t = np.arange(n) / (layout.rate_hz or 1.0)
    return Block.of(
        t,
        triad("a", ACC_UNITS[layout.acc_unit] / layout.acc_lsb),
        triad("g", GYR_UNITS[layout.gyr_unit] / layout.gyr_lsb),
        columns.get("temperature"),
        columns.get("seq"),
        columns.get("t_host"),
    )
