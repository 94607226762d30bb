"""Variables that Octave saves as text: matrices with their names.

    # Created by Octave 6.4.0, Mon Jan 05 12:00:00 2026 UTC <me@pc>
    # name: acc
    # type: matrix
    # rows: 2
    # columns: 3
     0.1 0.2 9.8
     0.1 0.3 9.7

Those within a structure have their own names. Source: the manual of GNU Octave, `save`
with the option -text, which is its default.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importers.arrays import ArrayFile
from fieldcal.importing.arrays.array_groups import arrays_in_group
from fieldcal.importing.arrays.array_tables import ArrayTable, table_of
from fieldcal.importing.files.text_encoding import as_utf8
from fieldcal.importing.times.said_rate import named_scalars

WHAT = "variables that Octave saves as text"

BEGINS = re.compile(rb"# Created by Octave\b.*\n(?:#.*\n|\s*\n)*?# name: ")
_FIELD = re.compile(r"# (name|type|rows|columns): (.*)")


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like one."""
    return BEGINS.match(head.replace(b"\r\n", b"\n")) is not None


class OctaveText(ArrayFile):
    """Matrices with names, with one IMU in them or several."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes: nothing."""
        return (), ""

    @contextmanager
    def _whole_arrays(self) -> Iterator[dict[str, ArrayTable]]:
        """Every matrix of numbers in the file."""
        if self._loaded is None:
            text = b"".join(as_utf8(self.pieces())).decode(errors="replace")
            with self.named_errors():
                found = read_variables(text.splitlines())
            self._scalars = dict(named_scalars(dict(found.scalars)))
            self._loaded = {name: table_of(one) for name, one in found.arrays.items()}
        yield arrays_in_group(self.group, self._loaded)


class OctaveVariables:
    """Variables of a file.

    Attributes
    ----------
    arrays : matrices by name, of more than one row or column
    scalars : numbers by name

    """

    def __init__(self) -> None:
        self.arrays: dict[str, Array] = {}
        self.scalars: dict[str, float] = {}


def read_variables(lines: Sequence[str]) -> OctaveVariables:
    """Variables of the lines of a file.

    Raises
    ------
    InputError
        If a matrix ends early, or holds what is no number.

    """
    found = OctaveVariables()
    said: dict[str, str] = {}
    at = 0
    while at < len(lines):
        line = lines[at].strip()
        at += 1
        if (field := _FIELD.fullmatch(line)) is not None:
            said = {} if field[1] == "name" else said
            said[field[1]] = field[2].strip()
            continue
        if not line or line.startswith("#") or "name" not in said:
            continue
        if said.get("type") == "scalar":
            found.scalars[said["name"]] = float(_matrix([line], said, 1)[0, 0])
        elif said.get("type") == "matrix" and {"rows", "columns"} <= said.keys():
            many = int(said["rows"]) if said["rows"].isdecimal() else 0
            matrix = _matrix(lines[at - 1 : at - 1 + many], said, many)
            found.arrays[said["name"]] = (
                matrix[:, 0] if matrix.shape[1] == 1 else matrix
            )
            at += max(many - 1, 0)
        said = {}
    return found


def _matrix(lines: Sequence[str], said: Mapping[str, str], many: int) -> Array:
    """Numbers of the rows of a matrix."""
    wide = said.get("columns", "1")
    try:
        rows = [[float(cell) for cell in line.split()] for line in lines]
    except ValueError as error:
        raise InputError(f"variable {said['name']}: {error}; save it again") from None
    if not rows or len(rows) != many or any(str(len(row)) != wide for row in rows):
        raise InputError(
            f"variable {said['name']}: has not {many} rows of {wide} numbers, as it"
            " says: copy the file again from where it came"
        )
    return np.array(rows).reshape(many, -1)
