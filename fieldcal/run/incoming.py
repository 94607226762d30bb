"""Samples of a device as they come: each recorded, and handed on in short pieces."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Block, split_by_time
from fieldcal.drivers.driver import Driver
from fieldcal.run.interruptions import MAX_GAP_S
from fieldcal.run.link_marks import LinkMarks, MarkedRecorder
from fieldcal.run.wait_reason import WaitReason, WaitState

SILENCES_UNTIL_TOLD = 2
"""Half seconds of silence after which the operator is told."""

PIECE_S = 0.1
"""Longest stretch of samples that is processed at once, s."""


class IncomingSamples:
    """The samples of one device, from the first to the last.

    Parameters
    ----------
    driver : the device
    recorder : the session folder being written
    on_block : called with every block after it is recorded
    on_piece : called with every piece before it is handed on

    Attributes
    ----------
    pieces : an iterator over the samples, `PIECE_S` at a time
    breaks : number of gaps that are longer than `MAX_GAP_S`
    silence : half seconds since the last sample

    """

    def __init__(
        self,
        driver: Driver,
        recorder: MarkedRecorder,
        on_block: Callable[[Block], None],
        on_piece: Callable[[Block], None],
    ) -> None:
        self._driver, self._recorder = driver, recorder
        self._on_block, self._on_piece = on_block, on_piece
        self._link = LinkMarks(driver, recorder)
        self._health, self._until_s = replace(driver.health), np.nan
        self.breaks = self.silence = 0
        self.pieces: Iterator[Block] = self._record()

    @property
    def source_state(self) -> tuple[int, int]:
        """A state that changes when the device restarts or changes its settings."""
        return self._driver.health.restarts, self._driver.read_back.changed

    def note_silence(self) -> WaitReason | None:
        """Note half a second without samples; returns the reason if it is reported."""
        self.silence += 1
        if self.silence < SILENCES_UNTIL_TOLD:
            return None
        why = self._driver.why_silent(self._health)
        if self._driver.health.received == self._health.received:
            why += "; it goes on by itself once they do"
        text = f"no samples come from {self._driver.name}: {why}"
        return WaitReason(WaitState.NO_SAMPLES, text)

    def end(self) -> None:
        """Mark the last losses of the link."""
        self._link.end()

    def _record(self) -> Iterator[Block]:
        for raw in self._driver.blocks():
            self.silence, self._health = 0, replace(self._driver.health)
            block = self._recorder.append(raw)
            self.breaks += bool(block.t[0] - self._until_s > MAX_GAP_S)
            self._until_s = float(block.t[-1])
            self._link.take(block)
            self._on_block(block)
            for piece in split_by_time(block, PIECE_S):
                self._on_piece(piece)
                yield piece
