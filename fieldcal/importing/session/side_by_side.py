"""Files of the same time, each with other channels of one IMU."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block, concat
from fieldcal.importing.recording import Recording
from fieldcal.importing.session.merge import (
    SeveralFiles,
    stream_name,
    with_clock_times,
)
from fieldcal.importing.times.alignment import AlignedPair
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.importing.times.slower_sensor import SlowerSensor

PEEKED = 64
"""Rows that tell whether two files have the same times."""


class MergedFiles(SeveralFiles):
    """Files of the same time, each with other channels."""

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
        if len(self._parts) != 2:
            return None
        heads = [
            with_clock_times(p).first_rows(stream_name(p), PEEKED) for p in self._parts
        ]
        n = min(map(len, heads))
        if np.array_equal(heads[0].t[:n], heads[1].t[:n], equal_nan=True):
            return None
        acc = [bool(np.isfinite(h.acc).any()) for h in heads]
        gyr = [bool(np.isfinite(h.gyr).any()) for h in heads]
        if acc == gyr[::-1] == [True, False]:
            return self._parts[0], self._parts[1]
        if acc == gyr[::-1] == [False, True]:
            return self._parts[1], self._parts[0]
        return None

    def _aligned(self, acc: Recording, gyr: Recording) -> Iterator[Block]:
        pair, begin = AlignedPair(), float("nan")
        both = [with_clock_times(p) for p in (acc, gyr)]
        judges = [RowValidator(str(p.path), p.place, p.repair) for p in both]
        forces, rates = (
            judge.through(p.blocks(stream_name(p)))
            for judge, p in zip(judges, both, strict=True)
        )
        together, slower = False, SlowerSensor()
        for block in slower.through(pair.through(forces, rates)):
            if np.isnan(begin) and len(block):
                begin = self.began = float(block.t[0])
            together = together or bool(np.isfinite(block.gyr).any())
            yield replace(block, t=block.t - begin)
        self._tell_judged(judges, both)
        if not together:
            raise InputError(
                f"{gyr.path}: no sample is at a time at which {acc.path.name} has one;"
                " join files of one clock"
            )
        self.says.append(
            "its accelerometers and gyroscopes have times of their own: each sample of"
            f" the first goes with the nearest, {1e3 * pair.worst:.2g} ms apart at most"
        )
        self.says += slower.says

    def _row_by_row(self, stream: str) -> Iterator[Block]:
        flows = [part.blocks(stream) for part in self._parts]
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
            self.began = self._parts[0].began
            yield self._merged([block[:n] for block in waiting], row)
            waiting = [block[n:] for block in waiting]
            row += n
        for part, block in zip(self._parts, waiting, strict=True):
            if len(block):
                raise InputError(
                    f"{part.path}: {part.place(row)}: the other files have ended; join"
                    " files with the same rows"
                )

    def _merged(self, blocks: list[Block], row: int) -> Block:
        whole = blocks[0]
        for part, block in zip(self._parts[1:], blocks[1:], strict=True):
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
