"""Where the device rested in a recording: positions of session.toml, and marks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.importing.files.spool import SpooledRows
from fieldcal.windows.cells import CELL, CellTable, SamplesBetween
from fieldcal.windows.joined_rests import RestPeriod, join_rests
from fieldcal.windows.jumps import JumpFinder
from fieldcal.windows.stretch_ends import stretch_end_reasons
from fieldcal.windows.stretches import (
    calm_parts,
    cell_rows,
    explain_no_stretch,
    still_stretches_of_file,
)
from fieldcal.windows.window import FEWEST_CELLS

ONLY_RESTS = (
    "it has no times and turns within no row, so only its rests were recorded, and each"
    " stretch between two jumps is taken for a position"
)

NAMED = 3
"""Bumps whose instants are said; session.toml has all of them."""


class RestSearch(NamedTuple):
    """Rests that were found in a recording.

    Attributes
    ----------
    rests : in order
    ends : why each piece of each rest began and ended
    forces : (m, 3) means of the accelerometers in them, m/s^2
    how, none : how they were found if not as rests, and why there are none; or nothing

    """

    rests: list[RestPeriod]
    ends: list[list[tuple[str, str]]]
    forces: Array
    how: str
    none: str

    @property
    def positions(self) -> list[dict[str, Any]]:
        """Tables of session.toml."""
        out = []
        for rest in self.rests:
            table: dict[str, Any] = {"start_s": rest.start, "end_s": rest.end}
            if rest.gaps:
                table["without_s"] = [list(gap) for gap in rest.gaps]
            out.append({key: np.round(v, 6).tolist() for key, v in table.items()})
        return out

    @property
    def marks(self) -> list[dict[str, Any]]:
        """What each rest lies between, and what bumps it was left as it was by."""
        out = []
        for rest, ends in zip(self.rests, self.ends, strict=True):
            mark: dict[str, Any] = {
                "event": "still", "start_s": rest.start, "end_s": rest.end,
                "began": ends[0][0], "ended": ends[-1][1],
            }  # fmt: skip
            if rest.gaps:
                mark["without_s"] = [list(gap) for gap in rest.gaps]
                mark["bumped"] = [ended for _, ended in ends[:-1]]
            out.append(mark)
        return out

    @property
    def left_out(self) -> str:
        """What is left out of rests, as a sentence; nothing if nothing is."""
        gaps = [gap for rest in self.rests for gap in rest.gaps]
        if not gaps:
            return ""
        some = ", ".join(f"{start:.1f}" for start, _ in gaps[:NAMED])
        more = ", ..." if len(gaps) > NAMED else ""
        what = "a bump" if len(gaps) == 1 else f"{len(gaps)} bumps"
        return (
            f"{what} at {some}{more} s left the device as it lay: what lies before and"
            " after is one position, without without_s in session.toml"
        )


def find_rests(
    jumps: JumpFinder,
    rows: SpooledRows,
    rest: CellTable,
    between: SamplesBetween,
    still: float,
) -> RestSearch:
    """Where the device rested for so long, s; `rest` are the cells not in rows yet."""
    rows.add(cell_rows(rest))
    if still == np.inf:  # of means
        return RestSearch([], [], np.empty((0, 3)), "", "")
    if held := jumps.positions:
        how = f"{ONLY_RESTS}: it jumps {len(held) - 1} times"
        spans = [part for span in held for part in calm_parts(between, span, still)]
        if more := len(spans) - len(held):
            how += f", and {more} of them {'is' if more == 1 else 'are'} cut where it"
            how += " was moved or knocked"
        found = join_rests(rows, rest.origin, between, spans)
        how += _tell_short(spans)
    else:
        how, spans = "", still_stretches_of_file(rows, rest.origin, between, still)
        found = join_rests(rows, rest.origin, between, spans)
    why = "" if found else explain_no_stretch(rows, rest.origin)
    forces = [_mean_of(chain(*(between(*p) for p in one.pieces))) for one in found]
    return RestSearch(
        found,
        [stretch_end_reasons(rows, rest.origin, one.pieces) for one in found],
        np.array(forces).reshape(-1, 3),
        how,
        f"no still stretch was found: {why}" if why else "",
    )


def _tell_short(spans: Sequence[tuple[float, float]]) -> str:
    """Say that the means of short rests have no error, and what to do."""
    least = FEWEST_CELLS * CELL
    # the last sample of a rest begins no interval
    short = sum(end - start < (1 - CELL) * least for start, end in spans)
    if not short:
        return ""
    return (
        f"; {short} of {len(spans)} last less than {least:g} s, too short for their"
        " means to have an error: hold each for longer, say another --rate if that is"
        " not it, or import a table of their means with --sigma 0.005,0.0005"
    )


def _mean_of(blocks: Iterable[Block]) -> Array:
    """Mean of the accelerometers over some blocks, (3,) m/s^2; nan without values."""
    total, many = np.zeros(3), np.zeros(3)
    for block in blocks:
        total += np.nansum(block.acc, axis=0)
        many += np.isfinite(block.acc).sum(axis=0)
    mean: Array = np.divide(total, many, out=np.full(3, np.nan), where=many > 0)
    return mean
