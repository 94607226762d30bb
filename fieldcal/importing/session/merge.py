"""Several files of one IMU: side by side, row by row, or one after another."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block, concat
from fieldcal.importing.recording import ImuStream, Recording
from fieldcal.importing.times.alignment import AlignedPair
from fieldcal.importing.times.row_validator import RowValidator

BETWEEN = 10.0
"""Time taken to have passed between two files of which no clock tells, s."""

PEEKED = 64
"""Rows that tell whether two files have the same times."""

AS_NAMED = (
    f"that of the files as they are named, {BETWEEN:g} s apart, since their times start"
    " anew: a drift from file to file cannot be estimated"
)


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
        """The files."""
        return self._parts

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
        return type(self)([p.alone(_name(p)) for p in self.parts])

    def notes(self, stream: str) -> dict[str, Any]:
        """Return what each file says, by its name."""
        return {"files": {p.path.name: p.notes(stream) for p in self.parts}}

    def files(self) -> list[Path]:
        """The files that it is read from."""
        return [path for part in self.parts for path in part.files()]

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
        for part in parts:
            # only their own zeros tell whether one clock ran through them all
            part.from_first = False

    def place(self, row: int) -> str:
        """Name a sample as its own file does, with the file."""
        for part, rows in zip(self.parts, self._rows, strict=False):
            if row < rows:
                return f"{part.path.name}, {part.place(row)}"
            row -= rows
        last = self.parts[min(len(self._rows), len(self.parts) - 1)]
        return f"{last.path.name}, {last.place(row)}"

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of one file after the other.

        Times of a file that do not go on behind those of the file before begin anew,
        and are taken to follow after a pause.
        """
        yield from self._in_order(p.blocks(_name(p)) for p in self.parts)
        self._tell(self.parts)

    def first_rows(self, stream: str, most: int) -> Block:
        """Rows at the beginning of each file, so many in all."""
        each = most // len(self.parts)
        flows = ([p.first_rows(_name(p), each)] for p in self.parts)
        return concat(list(self._in_order(flows)))

    def _in_order(self, flows: Iterable[Iterable[Block]]) -> Iterator[Block]:
        self._rows, last, shift = [], np.nan, 0.0
        for flow in flows:
            rows, begun = 0, False
            for block in flow:
                known = block.t[np.isfinite(block.t)]
                if len(known) and not begun:
                    begun, shift = True, self._shift(float(known[0]), last, shift)
                block = replace(block, t=block.t + shift)
                last = float(np.fmax(last, np.max(known + shift, initial=-np.inf)))
                rows += len(block)
                yield block
            self._rows.append(rows)

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


class MergedFiles(SeveralFiles):
    """Files of the same time, each with other channels."""

    def place(self, row: int) -> str:
        """Name a sample as the first file does."""
        return self.parts[0].place(row)

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples with the channels of every file.

        Rows of the same times go together; where accelerometers and gyroscopes have
        times of their own, each sample goes with the nearest (`alignment`).

        Raises
        ------
        InputError
            If times or numbers of rows differ; names file, row and column.

        """
        pair = self._triads()
        yield from self._aligned(*pair) if pair else self._row_by_row(stream)
        self._tell(self.parts)

    def _triads(self) -> tuple[Recording, Recording] | None:
        """Accelerometers and gyroscopes of different times; None of others."""
        if len(self.parts) != 2:
            return None
        heads = [_with_clock_times(p).first_rows(_name(p), PEEKED) for p in self.parts]
        n = min(map(len, heads))
        if np.array_equal(heads[0].t[:n], heads[1].t[:n], equal_nan=True):
            return None
        acc = [bool(np.isfinite(h.acc).any()) for h in heads]
        gyr = [bool(np.isfinite(h.gyr).any()) for h in heads]
        if acc == gyr[::-1] == [True, False]:
            return self.parts[0], self.parts[1]
        if acc == gyr[::-1] == [False, True]:
            return self.parts[1], self.parts[0]
        return None

    def _aligned(self, acc: Recording, gyr: Recording) -> Iterator[Block]:
        pair, begin = AlignedPair(), float("nan")
        both = [_with_clock_times(p) for p in (acc, gyr)]
        judges = [RowValidator(str(p.path), p.place, p.repair) for p in both]
        forces, rates = (
            judge.through(p.blocks(_name(p)))
            for judge, p in zip(judges, both, strict=True)
        )
        together = False
        for block in pair.through(forces, rates):
            if np.isnan(begin) and len(block):
                begin = self.began = float(block.t[0])
            together = together or bool(np.isfinite(block.gyr).any())
            yield replace(block, t=block.t - begin)
        for judge, one in zip(judges, both, strict=True):
            one.mended += [f"{one.path.name}: {said}" for said in judge.mended]
        self._tell(both)
        if not together:
            raise InputError(
                f"{gyr.path}: no sample is at a time at which {acc.path.name} has one;"
                " join files of one clock"
            )
        self.says.append(
            "its accelerometers and gyroscopes have times of their own: each sample of"
            f" the first goes with the nearest, {1e3 * pair.worst:.2g} ms apart at most"
        )

    def _row_by_row(self, stream: str) -> Iterator[Block]:
        flows = [part.blocks(stream) for part in self.parts]
        waiting = [concat([]) for _ in flows]
        row = 0
        while True:
            for i, flow in enumerate(flows):
                # a block without rows is not the end
                while not len(waiting[i]) and (block := next(flow, None)) is not None:
                    waiting[i] = block
            n = min(len(block) for block in waiting)
            if not n:
                break
            yield self._merged([block[:n] for block in waiting], row)
            waiting = [block[n:] for block in waiting]
            row += n
        self.began = self.parts[0].began
        for part, block in zip(self.parts, waiting, strict=True):
            if len(block):
                raise InputError(
                    f"{part.path}: {part.place(row)}: the other files have ended; join"
                    " files with the same rows"
                )

    def _merged(self, blocks: list[Block], row: int) -> Block:
        whole = blocks[0]
        for part, block in zip(self.parts[1:], blocks[1:], strict=True):
            differ = np.flatnonzero((block.t != whole.t) & ~np.isnan(whole.t))
            if len(differ):
                i = int(differ[0])
                raise InputError(
                    f"{part.path}: {part.place(row + i)}, column t: {block.t[i]:g} s,"
                    f" but {self.path.name} has {whole.t[i]:g} s there; join files with"
                    " the same times"
                )
            whole = replace(
                whole,
                acc=_known(whole.acc, block.acc),
                gyr=_known(whole.gyr, block.gyr),
                temperature=_known(whole.temperature, block.temperature),
                seq=_known(whole.seq, block.seq),
                t_host=_known(whole.t_host, block.t_host),
            )
        return whole


def _known(first: Array, second: Array) -> Array:
    return second if np.isnan(first).all() else first


def _name(part: Recording) -> str:
    return part.streams()[0].name


def _with_clock_times(part: Recording) -> Recording:
    """A file with times from the zero of its clock instead of its first row."""
    one = part.alone(_name(part))
    one.from_first = False
    return one
