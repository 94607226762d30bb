"""One thread per link reads all available bytes and records their arrival time.

An operating system buffers about 4 KB of a serial port, 40 ms at 921600 baud, so
recording and drawing must not delay the reading. Bytes wait here, up to a limit. At the
limit the reading waits as well, so that a sender with flow control loses nothing.

A source that fails is opened again until bytes arrive or a time limit is reached. A
source that opens without sending anything, such as a CAN interface that is down, counts
as failed. The first chunk after an interruption is marked as such.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Condition, Thread
from typing import NamedTuple, Protocol

from fieldcal.core.errors import DeviceError, LinkLost
from fieldcal.drivers.driver import host_clock

DELIVERY_INTERVAL = 0.02
"""Shortest time between two deliveries, s: a batch costs the same however long."""

RETRY_INTERVAL = 0.1
"""Time between two attempts to open a broken link again, s."""


class Chunk(NamedTuple):
    """Bytes and when they arrived, s; `broken` if the link was away before them."""

    t_host: float
    data: bytes
    broken: bool = False


class LinkDown(OSError):
    """The link cannot carry anything now; the text says what to do."""


class ByteSource(Protocol):
    """What a reader reads: bytes, or nothing after a short while; OSError if gone."""

    def read(self) -> bytes:
        """Return all that is there, waiting at most about 0.1 s for the first byte."""

    def close(self) -> None:
        """Release the source."""


class Reader:
    """Reads a source in a thread of its own until closed.

    Parameters
    ----------
    name : what errors call the link
    connect : opens the source, and opens it again after a fault
    patience : how long to try again after a fault, s; 0 for not at all
    limit : most bytes to keep

    """

    def __init__(
        self,
        name: str,
        connect: Callable[[], ByteSource],
        patience: float,
        limit: int = 1 << 20,
    ) -> None:
        self._name, self._connect = name, connect
        self._patience, self._limit = patience, limit
        self._source = connect()
        self._changed = Condition()
        self._chunks: list[Chunk] = []
        self._held = 0
        self._awaited = 1
        self._delivered = 0.0
        self._closing = False
        self._fault: Exception | None = None
        self._deadline: float | None = None
        self.reconnecting = False
        self._thread = Thread(target=self._run, name=f"read {name}", daemon=True)
        self._thread.start()

    def take(self, timeout: float) -> list[Chunk]:
        """Return all that came, or nothing after `timeout` seconds.

        Raises
        ------
        DeviceError
            If the link broke and did not come back; what came before is given first.

        """
        deadline = time.monotonic() + timeout
        with self._changed:
            self._await(
                self._limit // 2, min(deadline, self._delivered + DELIVERY_INTERVAL)
            )
            self._await(1, deadline)
            chunks, self._chunks, self._held = self._chunks, [], 0
            self._delivered = time.monotonic()
            self._changed.notify_all()
            if not chunks and self._closing:
                raise DeviceError(f"{self._name} was closed: open it again")
            if not chunks and self._fault:
                raise LinkLost(self._gone()) from self._fault
        return chunks

    def close(self) -> None:
        """End the thread, then release the source; safe to call twice."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()

    def _await(self, size: int, until: float) -> None:
        """Wait for so many bytes; who reads wakes nobody for less."""
        self._awaited = size
        self._changed.wait_for(
            lambda: self._held >= size or self._ended,
            max(0.0, until - time.monotonic()),
        )

    @property
    def _ended(self) -> bool:
        return self._closing or self._fault is not None

    def _gone(self) -> str:
        if isinstance(self._fault, LinkDown):
            return f"{self._name}: {self._fault}"
        back = f" and was not back in {self._patience:g} s" if self._patience else ""
        return f"{self._name} hung up{back}: check cable and power"

    def _run(self) -> None:
        broken = False
        try:
            while not self._closing:
                try:
                    data = self._source.read()
                except Exception as fault:
                    # whatever it is, a thread hands it on: nobody else sees it
                    if not (isinstance(fault, OSError) and self._mend()):
                        with self._changed:
                            self._fault = fault
                            self._changed.notify_all()
                        return
                    broken = True
                    continue
                if data:
                    self._deadline = None
                    self._put(Chunk(host_clock(), data, broken))
                    broken = False
        finally:
            self._source.close()

    def _put(self, chunk: Chunk) -> None:
        with self._changed:
            if self._held >= self._limit:
                self._changed.wait_for(lambda: not self._held or self._closing)
            self._chunks.append(chunk)
            self._held += len(chunk.data)
            if self._held >= self._awaited:
                self._changed.notify_all()

    def _mend(self) -> bool:
        """Open the source again; False when patience or the driver ends."""
        self._source.close()
        if self._deadline is None:
            self._deadline = time.monotonic() + self._patience
        self.reconnecting = self._patience > 0
        try:
            while not self._closing and time.monotonic() < self._deadline:
                with self._changed:
                    self._changed.wait_for(lambda: self._closing, RETRY_INTERVAL)
                try:
                    self._source = self._connect()
                except (OSError, DeviceError):
                    continue
                return True
        finally:
            self.reconnecting = False
        return False
