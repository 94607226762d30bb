"""Several files of one IMU, and those of them that were recorded one after another."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.errors import InputError
from fieldcal.core.samples import ACC, GYR, Array, Block, concat
from fieldcal.importing.recording import ImuStream, Recording
from fieldcal.importing.session.overlap import Overlap
from fieldcal.importing.times.clock_text import DAY
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.importing.units.time_units import UNIX

BETWEEN = 10.0
"""Time taken to have passed between two files of which no clock tells, s."""

COMPARED, MIN_DISTINCT = 200, 20
"""Rows at the beginning of files that are compared, and how many of them must differ:
a device at rest whose output has no noise begins every file alike."""

AS_NAMED = (
    f"that of the files as they are named, {BETWEEN:g} s apart, since their times start"
    " anew: a drift from file to file cannot be estimated"
)


def count_from_one_day(files: Sequence[Recording]) -> None:
    """Let the clocks of files that say their dates count from the first one's day.

    Each counts from the midnight before its own first row.
    """
    dated = [one for one in files if one.first_days]
    for one in dated[1:]:
        away = [b - a for a in dated[0].first_days for b in one.first_days]
        one.later = DAY * min(away, key=abs)


class SeveralFiles(Recording):
    """Files that hold one IMU together.

    Parameters
    ----------
    parts : the files, each with one IMU

    """

    def __init__(self, parts: Sequence[Recording]) -> None:
        self._parts = list(parts)
        first = parts[0]
        super().__init__(first.path, first.wanted, first.repair)

    @property
    def parts(self) -> list[Recording]:
        """The files, also those that are joined within others."""
        return [file for part in self._parts for file in part.parts]

    def streams(self) -> list[ImuStream]:
        """Return the one IMU."""
        found = []
        for part in self.parts:
            streams = part.streams()
            if len(streams) > 1:
                raise InputError(f"{part.path}: holds several IMUs; import it alone")
            found += streams
        says = dict.fromkeys(s.says for s in found)
        return [ImuStream(found[0].name, "; ".join(says))]

    def alone(self, stream: str) -> Self:
        """The files, each with what is said of its one IMU alone."""
        return type(self)([p.alone(stream_name(p)) for p in self._parts])

    def notes(self, stream: str) -> dict[str, Any]:
        """Return what each file says, by its name."""
        return {"files": {p.path.name: p.notes(stream) for p in self.parts}}

    def files(self) -> list[Path]:
        """The files that it is read from."""
        return [path for part in self.parts for path in part.files()]

    def place(self, row: int) -> str:
        """Name a sample as the first file does."""
        return self._parts[0].place(row)

    def _tell_judged(
        self, judges: Sequence[RowValidator], parts: Sequence[Recording]
    ) -> None:
        """Say also what was found of the times of each file, by its name."""
        for judge, part in zip(judges, parts, strict=True):
            part.mended += [f"{part.path.name}: {said}" for said in judge.mended]
            part.says += [f"{part.path.name}: {said}" for said in judge.says]
        self._tell(parts)

    def _tell(self, parts: Iterable[Recording]) -> None:
        """Say what the files said while they were read, each sentence once."""
        for part in parts:
            self.says += [s for s in part.says if s not in self.says]
            self.mended += [s for s in part.mended if s not in self.mended]


class FilesInOrder(SeveralFiles):
    """Files that were recorded one after another: a file for each position, say."""

    def __init__(self, parts: Sequence[Recording]) -> None:
        super().__init__(parts)
        self._rows: list[int] = []
        self._shared: list[int] = []
        self._overlaps: list[Overlap] = []
        self._begun: list[Array] = []
        count_from_one_day(parts)
        for part in parts:
            # only their own zeros tell whether one clock ran through them all
            part.from_first = False

    def place(self, row: int) -> str:
        """Name a sample as its own file does, with the file."""
        for part, rows, shared in zip(
            self.parts, self._rows, self._shared, strict=False
        ):
            if row < rows:
                return f"{part.path.name}, {part.place(row + shared)}"
            row -= rows
        last = self.parts[min(len(self._rows), len(self.parts) - 1)]
        shared = self._shared[-1] if len(self._shared) > len(self._rows) else 0
        return f"{last.path.name}, {last.place(row + shared)}"

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of one file after the other.

        Samples that the file before holds as well are used once. Times of a file that
        do not go on behind those of the file before begin anew, and are taken to follow
        after a pause.

        Raises
        ------
        InputError
            If two files begin with the same samples, if a file begins before the end of
            the one before it with other samples, or if one holds accelerometers alone
            and another gyroscopes alone.

        """
        measured = np.zeros((len(self._parts), 6), dtype=bool)
        for block in self._in_order(p.blocks(stream_name(p)) for p in self._parts):
            at = len(self._rows)
            measured[at] |= np.isfinite(block.six).any(axis=0)
            yield block
        self._refuse_one_sensor_each(measured)
        self.says += [overlap.sentence() for overlap in self._overlaps]
        self._tell(self.parts)

    def first_rows(self, stream: str, most: int) -> Block:
        """Rows at the beginning of each file, so many in all."""
        each = most // len(self.parts)
        flows = ([p.first_rows(stream_name(p), each)] for p in self.parts)
        return concat(list(self._in_order(flows)))

    def _in_order(self, flows: Iterable[Iterable[Block]]) -> Iterator[Block]:
        self._rows, self._shared, self._begun, self._overlaps = [], [], [], []
        last, shift = np.nan, 0.0
        for flow in flows:
            rows, begun, overlap = 0, False, None
            self._shared.append(0)
            for block in flow:
                known = block.t[np.isfinite(block.t)]
                if len(known) and not begun:
                    self._refuse_again(block.six[:COMPARED])
                    begun, overlap = True, self._overlap(block, known[0], last - shift)
                    if overlap is None:
                        shift = self._shift(float(known[0]), last, shift)
                if overlap is not None:
                    block = overlap.without_shared(block)
                    self._shared[-1] = overlap.shared
                last = float(np.fmax(last, np.max(known + shift, initial=-np.inf)))
                rows += len(block)
                yield replace(block, t=block.t + shift)
            if overlap is not None and overlap.shared:
                self._overlaps.append(overlap)
            self._rows.append(rows)

    def _overlap(self, block: Block, begins: float, ended: float) -> Overlap | None:
        """What a file that begins so has in common with the one before it.

        None if it begins behind the end of that one, or by a clock that began anew.
        One that counts from 1970 does not.

        Parameters
        ----------
        block : its first samples
        begins, ended : its first time, and the last one of the file before, s

        """
        if np.isnan(ended) or begins > ended:
            return None
        before, part = self._parts[len(self._shared) - 2 : len(self._shared)]
        names = before.path.name, str(part.path)
        overlap = Overlap(names, _blocks_again(before), begins)
        if begins < overlap.first:
            away = Overlap(names[::-1], _blocks_again(part), overlap.first)
            dated = UNIX[0] <= begins < UNIX[1]
            if not away.begins_anew and (dated or away.contains(overlap.head)):
                raise away.order_refusal()
            return None
        if overlap.holds(block):
            return overlap
        if overlap.begins_anew:
            return None
        raise overlap.refusal()

    def _refuse_again(self, six: Array) -> None:
        """Refuse a file that begins as one before it, whatever its times are."""
        for part, before in zip(self._parts, self._begun, strict=False):
            n = min(len(six), len(before))
            same = np.array_equal(six[:n], before[:n], equal_nan=True)
            if same and len(np.unique(six[:n], axis=0)) >= MIN_DISTINCT:
                again = self._parts[len(self._begun)].path
                raise InputError(
                    f"{again}: holds the samples of {part.path.name}: name each"
                    " recording once, as samples that count twice make a result look"
                    " surer than it is"
                )
        self._begun.append(six)

    def _refuse_one_sensor_each(self, measured: NDArray[np.bool_]) -> None:
        """Refuse files of one motion, of which each has one of the sensors."""
        acc, gyr = measured[:, ACC].any(axis=1), measured[:, GYR].any(axis=1)
        if (acc & gyr).any() or not (acc.any() and gyr.any()):
            return
        one, other = (self._parts[int(np.argmax(has))].path for has in (acc, gyr))
        raise InputError(
            f"{one}: holds accelerometers alone, and {other.name} gyroscopes alone:"
            " --in-order is for files recorded one after another; join those that hold"
            " the sensors of one IMU with --join"
        )

    def _shift(self, begins: float, last: float, before: float) -> float:
        """What is added to the times of a file that begins so, s.

        Behind a file that ended at `last`, to whose times `before` was added.
        """
        if np.isnan(last):
            self.began = begins
            return -begins
        if begins + before > last:
            return before
        self.guessed["order"] = AS_NAMED
        return last + BETWEEN - begins


def _blocks_again(part: Recording) -> Iterator[Block]:
    """Samples of a file, read once more, without saying anything twice."""
    name = stream_name(part)
    return part.alone(name).blocks(name)


def stream_name(part: Recording) -> str:
    """Name of the only IMU of a file."""
    return part.streams()[0].name


def with_clock_times(part: Recording) -> Recording:
    """A file with times from the zero of its clock instead of its first row."""
    one = part.alone(stream_name(part))
    one.from_first = False
    return one
