"""The reading thread: nothing lost, memory bounded, faults handed on."""

import threading
import time

import pytest

from fieldcal.core.errors import DeviceError
from fieldcal.drivers.reader import Chunk, Reader


class Counting:
    """A source that counts, as fast as it is read, until it fails."""

    def __init__(self, until: int, fault: Exception | None = None) -> None:
        self.next, self.closed = 0, 0
        self._until, self._fault = until, fault

    def read(self) -> bytes:
        if self.next >= self._until:
            if self._fault:
                raise self._fault
            time.sleep(0.001)
            return b""
        self.next += 1
        return self.next.to_bytes(4, "big")

    def close(self) -> None:
        self.closed += 1


def numbers(chunks: list[Chunk]) -> list[int]:
    return [int.from_bytes(chunk.data, "big") for chunk in chunks]


def test_a_reader_that_nobody_empties_stops_at_its_limit_and_loses_nothing() -> None:
    source = Counting(5000)
    reader = Reader("x", lambda: source, 0.0, limit=400)
    deadline = time.monotonic() + 5
    while source.next < 100 and time.monotonic() < deadline:
        time.sleep(0.01)
    time.sleep(0.05)
    assert 100 <= source.next <= 102
    got: list[int] = []
    while len(got) < 5000 and time.monotonic() < deadline:
        got += numbers(reader.take(0.1))
    assert got == list(range(1, 5001))
    reader.close()
    assert source.closed == 1


def test_what_was_read_comes_before_the_fault() -> None:
    reader = Reader("the port", lambda: Counting(10, OSError(5, "gone")), 0.0)
    got: list[int] = []
    with pytest.raises(DeviceError, match="the port hung up: check cable"):
        while True:
            got += numbers(reader.take(1.0))
    assert got == list(range(1, 11))
    reader.close()


def test_a_fault_that_is_none_of_the_links_is_not_retried() -> None:
    opened = []

    def connect() -> Counting:
        opened.append(1)
        return Counting(0, ValueError("a bug"))

    reader = Reader("x", connect, 60.0)
    with pytest.raises(DeviceError) as raised:
        reader.take(5.0)
    assert isinstance(raised.value.__cause__, ValueError)
    assert len(opened) == 1
    reader.close()


def test_a_broken_link_is_opened_again_and_the_break_is_marked() -> None:
    sources = [Counting(3, OSError()), Counting(3)]
    left = iter(sources)
    reader = Reader("x", lambda: next(left), 5.0)
    chunks: list[Chunk] = []
    deadline = time.monotonic() + 5
    while len(chunks) < 6 and time.monotonic() < deadline:
        chunks += reader.take(0.1)
    assert [chunk.broken for chunk in chunks] == [False] * 3 + [True, False, False]
    hosts = [chunk.t_host for chunk in chunks]
    assert hosts == sorted(hosts)
    assert abs(hosts[0] - time.time()) < 10
    reader.close()
    assert [source.closed for source in sources] == [1, 1]


def test_closing_does_not_wait_for_patience() -> None:
    reader = Reader("x", lambda: Counting(0, OSError()), 600.0)
    deadline = time.monotonic() + 5
    while not reader.reconnecting and time.monotonic() < deadline:
        time.sleep(0.001)
    before = threading.active_count()
    began = time.monotonic()
    reader.close()
    assert time.monotonic() - began < 2
    assert threading.active_count() == before - 1
