"""Several files that hold the channels of one IMU, merged row by row."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block, concat
from fieldcal.importing.recording import ImuStream, Recording


class MergedFiles(Recording):
    """Files with the same times, each with other channels.

    Parameters
    ----------
    parts : the files, each with one IMU

    """

    def __init__(self, parts: Sequence[Recording]) -> None:
        self.parts = parts
        first = parts[0]
        super().__init__(first.path, first.wanted, first.repair)

    def streams(self) -> list[ImuStream]:
        """Return the one IMU."""
        found = []
        for part in self.parts:
            streams = part.streams()
            if len(streams) > 1:
                raise InputError(f"{part.path}: holds several IMUs; import it alone")
            found += streams
        return [ImuStream(found[0].name, "; ".join(s.says for s in found))]

    def alone(self, stream: str) -> Recording:
        """The files, each with what is said of its one IMU alone."""
        return MergedFiles([p.alone(p.streams()[0].name) for p in self.parts])

    def notes(self, stream: str) -> dict[str, Any]:
        """Return what each file says, by its name."""
        return {"files": {p.path.name: p.notes(stream) for p in self.parts}}

    def place(self, row: int) -> str:
        """Name a sample as the first file does."""
        return self.parts[0].place(row)

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples with the channels of every file.

        Raises
        ------
        InputError
            If times or numbers of rows differ; names file, row and column.

        """
        flows = [part.blocks(stream) for part in self.parts]
        waiting = [concat([]) for _ in flows]
        row = 0
        while True:
            for i, flow in enumerate(flows):
                if not len(waiting[i]):
                    waiting[i] = next(flow, waiting[i])
            n = min(len(block) for block in waiting)
            if not n:
                break
            yield self._merged([block[:n] for block in waiting], row)
            waiting = [block[n:] for block in waiting]
            row += n
        for part, block in zip(self.parts, waiting, strict=True):
            if len(block):
                raise InputError(
                    f"{part.path}: {part.place(row)}: the other files have ended; join"
                    " files with the same rows"
                )
        self.says += [sentence for part in self.parts for sentence in part.says]
        self.mended += [sentence for part in self.parts for sentence in part.mended]

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
