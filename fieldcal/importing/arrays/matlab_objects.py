"""Tables and timetables of a MATLAB file, which are objects and no arrays.

A timetable's row times become ``t``, s; a variable of several columns stays one array.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError

READER = "matio"
OPAQUE = "MatlabOpaque"
DECODE = "MATLAB_object_decode"
"""What scipy calls an object, and HDF5 marks it with."""

TIME = "t"
"""Name of a timetable's row times."""


def holds_objects(loaded: Mapping[str, Any]) -> bool:
    """Whether a file that scipy has read contains objects."""
    return any(type(value).__name__ == OPAQUE for value in loaded.values())


def object_tables(path: Path) -> dict[str, dict[str, Any]]:
    """Columns (n,) or (n, k) of each table, by the names of both.

    Raises
    ------
    InputError
        If what reads them is not installed.

    """
    if find_spec(READER) is None:
        raise InputError(
            f"{path}: holds tables or timetables of MATLAB, and reading them needs"
            " mat-io: pip install 'fieldcal[matlab]', or write them with writetimetable"
        )
    from matio import load_from_mat

    with warnings.catch_warnings():
        # of objects that are no tables it says what it leaves out
        warnings.simplefilter("ignore")
        loaded = load_from_mat(str(path))
    frames = {n: v for n, v in loaded.items() if type(v).__name__ == "DataFrame"}
    return {name: _columns(frame) for name, frame in frames.items()}


def _columns(frame: Any) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if frame.index.dtype.kind in "mM":
        since = frame.index.to_numpy() - frame.index.to_numpy()[:1]
        found[TIME] = since / np.timedelta64(1, "ns") * 1e-9
    for name in frame.columns:
        values = frame[name].to_numpy()
        if values.dtype.kind in "mM":
            values = (values - values[:1]) / np.timedelta64(1, "ns") * 1e-9
        elif values.dtype.kind == "O" and all(
            isinstance(v, np.ndarray) for v in values
        ):
            values = np.stack([np.ravel(v) for v in values])
        found[str(name)] = values
    return found
