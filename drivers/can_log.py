"""Frames of a log, delivered when they are due: candump (.log), .asc, .blf, .trc.

Read through python-can, piece by piece, so a log may be as long as it likes; also as
.gz. Times are those of the log.
"""

from __future__ import annotations

import gzip
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError, RecordingEnded
from fieldcal.drivers.can_bus_filter import BusFilter
from fieldcal.drivers.can_frames import FRAME_DTYPE, FrameBuffer, Frames
from fieldcal.drivers.playback import PlaybackClock

READER_NAMES = {
    ".log": "CanutilsLogReader",
    ".asc": "ASCReader",
    ".blf": "BLFReader",
    ".trc": "TRCReader",
}
"""What python-can calls the readers of each kind of log."""

FRAMES_AT_ONCE = 4096
"""Frames read at once."""


def is_can_log(place: str) -> bool:
    """Tell whether an address names a log and no channel.

    >>> is_can_log("drive.log.gz"), is_can_log("can0")
    (True, False)
    """
    return place.lower().removesuffix(".gz").endswith(tuple(READER_NAMES))


class PlayedCanLog:
    """A log that is played.

    Parameters
    ----------
    path : the file
    buses : keeps the frames of the bus that is meant
    speed : time of the log against the clock; inf for as fast as it is read

    Raises
    ------
    InputError
        If there is no such file, it is no log, or of several buses.

    """

    def __init__(self, path: Path, buses: BusFilter, speed: float) -> None:
        if not path.is_file():
            raise InputError(f"{path}: there is no such log")
        self._path, self._buses = path, buses
        self._pieces = self._read()
        self._piece: Frames = next(self._pieces, np.empty(0, FRAME_DTYPE))
        if not len(self._piece):
            buses.finish()
            raise InputError(f"{path}: holds no frame; check that it is a CAN log")
        self._first = self.now = float(self._piece["t"][0])
        self._pace = PlaybackClock(self._first, speed)

    def take(self, timeout: float) -> Frames:
        """Return the frames that are due, or none after `timeout` seconds.

        Raises
        ------
        RecordingEnded
            At the end of the log.
        InputError
            If frames of another bus turn up that might as well be meant, or none of
            the one that is.

        """
        if not len(self._piece):
            self._piece = next(self._pieces, self._piece)
        if not len(self._piece):
            self._buses.finish()
            raise RecordingEnded(self._path, self.now - self._first)
        until = self._pace.wait(float(self._piece["t"][0]), timeout)
        late = np.flatnonzero(self._piece["t"] > until)
        piece = self._piece[: late[0] if len(late) else None]
        self._piece = self._piece[len(piece) :]
        if len(piece):
            self.now = float(piece["t"].max())
        return piece

    def _read(self) -> Generator[Frames]:
        try:
            messages, more = _messages(self._path), True
            while more:
                packed = FrameBuffer(FRAMES_AT_ONCE)
                self._buses.fill(packed, messages)
                more = packed.full
                if len(frames := self._buses.frames(packed)):
                    yield frames
        except InputError:
            raise
        except (OSError, EOFError) as fault:
            raise InputError(f"{self._path}: cannot be read: {fault}") from fault
        except Exception as fault:
            # the readers of the several formats raise what they like
            raise InputError(
                f"{self._path}: is no CAN log of this kind: {fault}"
            ) from fault

    def close(self) -> None:
        """Let go of the file."""
        self._pieces.close()


def _messages(path: Path) -> Iterator[Any]:
    import can

    packed = path.suffix.lower() == ".gz"
    ending = Path(path.stem if packed else path.name).suffix.lower()
    mode = "rb" if ending == ".blf" else "rt"
    file = gzip.open(path, mode) if packed else path.open(mode)
    # the reader closes it, but not if it refuses to read it
    with file, getattr(can, READER_NAMES[ending])(file) as reader:
        yield from reader
