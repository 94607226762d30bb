"""Columns written as loggers, monitors, spreadsheets and programs write them."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.awkward.motion import Floats

TEXTS = ("csv", "csv", "semicolon", "tab", "gz", "clock", "quoted", "utf-16", "monitor",
         "bars", "tagged", "begun again")  # fmt: skip
NAMED = ("npz", "parquet", "labels", "json lines", "json lists", "structure")
"""Forms in which columns have names."""

BEGAN = datetime(2024, 5, 3, 23, 59, 40)
SEPARATORS = {"semicolon": ";", "tab": "\t", "utf-16": "\t"}

Columns = list[tuple[str, str, Floats]]
"""Name, unit and values of each column."""


def heading(head: str, columns: Columns) -> list[list[str]]:
    """Lines of names over the columns."""
    names = [name for name, _, _ in columns]
    units = [unit if "in" not in unit else "LSB" for _, unit, _ in columns]
    bracketed = [f"{n} [{u}]" if u else n for n, u in zip(names, units, strict=True)]
    forms: dict[str, Callable[[], list[list[str]]]] = {
        "none": list,
        "bare": lambda: [names],
        "units": lambda: [bracketed],
        "second line": lambda: [names, units],
        "txwx": lambda: [[n.replace("a", "T").replace("g", "w").lower()
                          if len(n) == 2 else n for n in names]],  # fmt: skip
        "axis (unit)": lambda: [
            [f"{n[-1]} ({u})" for n, u in zip(names, units, strict=True)]
        ],
        "grouped": lambda: [
            [{"t": "Time", "ax": "Accelerometer", "gx": "Gyroscope"}.get(n, "")
             for n in names],
            [n[-1].upper() if n != "t" else "" for n in names],
        ],
    }  # fmt: skip
    return forms[head]()


def write(
    folder: Path,
    columns: Columns,
    head: str,
    rng: np.random.Generator,
    said: dict[str, object],
) -> Path:
    """Write columns in a form that is drawn, and say which."""
    named = head in ("bare", "units", "txwx") and len({n for n, _, _ in columns})
    form = str(rng.choice((*TEXTS, *NAMED) if named else TEXTS))
    timed = columns[0][0] == "t"
    form = "csv" if form in ("clock", "monitor") and not timed else form
    said["form"] = form
    if form in NAMED:
        (names,) = heading("bare" if head == "units" else head, columns)
        if form == "parquet":
            (names,) = heading(head, columns)
        return _with_names(folder, form, names, [v for _, _, v in columns])
    separator = SEPARATORS.get(form, ",")
    rows = [*heading(head, columns), *_cells(columns, form)]
    if form == "quoted":
        rows = [[f'"{cell}"' for cell in row] for row in rows]
    lines = [separator.join(row) for row in rows]
    if form == "monitor":
        # the monitor writes when a line came before each, also before the names
        first = rows[-1][0]
        stamps = [row[0] if row[0][:1].isdigit() else first for row in rows]
        pairs = zip(stamps, rows, strict=True)
        lines = [f"{stamp} -> {separator.join(row[1:])}" for stamp, row in pairs]
    lines = _dressed(form, lines, rows)
    data = ("\n".join(lines) + "\n").encode("utf-16" if form == "utf-16" else "utf-8")
    path = folder / ("log.csv.gz" if form == "gz" else "log.csv")
    path.write_bytes(gzip.compress(data, 1) if form == "gz" else data)
    return path


def _dressed(form: str, lines: list[str], rows: list[list[str]]) -> list[str]:
    """Lines with what a form puts about or between them."""
    names = [line for line in lines if line[:1].isalpha()]
    if form == "bars":
        return [f"| {' | '.join(row)} |" for row in rows]
    if form == "tagged":
        # another sensor speaks as well, less often
        pairs = ([f"IMU,{line}"] + (["GPS,48.1,11.5"] if i % 10 == 9 else [])
                 for i, line in enumerate(lines))  # fmt: skip
        return [line for pair in pairs for line in pair]
    if form == "begun again" and len(names) == 1:
        half = len(lines) // 2
        return [*lines[:half], *names, *lines[half:]]
    return lines


def _cells(columns: Columns, form: str) -> list[list[str]]:
    """Cells of each row."""
    found = []
    for name, unit, values in columns:
        whole = bool((values == np.round(values)).all())
        cells = [f"{x:.0f}" if whole else f"{x:.16g}" for x in values]
        if form in ("semicolon", "quoted"):
            cells = [cell.replace(".", ",") for cell in cells]
        if name == "t" and form in ("clock", "monitor"):
            cells = [str(when) for when in _clock(values, unit)]
        found.append(cells)
    return [list(row) for row in zip(*found, strict=True)]


def _clock(values: Floats, unit: str) -> list[str]:
    """Times of day, with a date."""
    size = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[unit]
    times = (BEGAN + timedelta(seconds=x * size) for x in values.tolist())
    return [when.isoformat(timespec="microseconds") for when in times]


def _with_names(
    folder: Path, form: str, names: list[str], values: list[Floats]
) -> Path:
    """Write columns in a form in which they have names."""
    path = folder / {"npz": "log.npz", "parquet": "log.parquet", "labels": "log.txt",
                     "structure": "log.mat"}.get(form, "log.json")  # fmt: skip
    arrays: dict[str, Any] = dict(zip(names, values, strict=True))
    rows = np.column_stack(values).tolist()
    if form == "npz":
        np.savez(path, **arrays)
    elif form == "structure":
        from scipy.io import savemat

        savemat(path, {"log": arrays})
    elif form == "parquet":
        import pyarrow as pa
        import pyarrow.parquet

        pyarrow.parquet.write_table(pa.table(values, names=names), path)
    elif form == "labels":
        pairs = (zip(names, row, strict=True) for row in rows)
        lines = (" ".join(f"{n}: {x:.16g}" for n, x in one) for one in pairs)
        path.write_text("\n".join(lines) + "\n")
    elif form == "json lines":
        records = (dict(zip(names, row, strict=True)) for row in rows)
        path.write_text("\n".join(json.dumps(one) for one in records) + "\n")
    else:
        lists = {name: column.tolist() for name, column in arrays.items()}
        path.write_text(json.dumps(lists))
    return path
