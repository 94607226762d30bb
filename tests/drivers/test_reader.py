"""The reading thread: nothing lost, memory bounded, faults handed on."""

import threading
import time

import pytest

from fieldcal.core.errors import DeviceError, LinkLost
from fieldcal.drivers.driver import host_clock
from fieldcal.drivers.reader import Chunk, LinkDown, Reader


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
    while source.next <= 100:
        time.sleep(0.001)
    got: list[int] = []
    while len(got) < 5000:
        some = numbers(reader.take(0.1))
        assert len(some) <= 100
        got += some
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
    left, before = iter(sources), host_clock()
    reader = Reader("x", lambda: next(left), 600.0)
    chunks: list[Chunk] = []
    while len(chunks) < 6:
        chunks += reader.take(0.1)
    assert [chunk.broken for chunk in chunks] == [False] * 3 + [True, False, False]
    hosts = [before, *(chunk.t_host for chunk in chunks), host_clock()]
    assert hosts == sorted(hosts)
    reader.close()
    assert [source.closed for source in sources] == [1, 1]


def test_closing_does_not_wait_for_patience() -> None:
    # a patience longer than a test may take
    reader = Reader("x", lambda: Counting(0, OSError()), 1e4)
    while not reader.reconnecting:
        time.sleep(0.001)
    before = threading.active_count()
    reader.close()
    assert threading.active_count() == before - 1


def test_a_link_that_opens_and_cannot_be_read_is_given_up() -> None:
    down = LinkDown("it is down; set it up")
    reader = Reader("can0", lambda: Counting(0, down), 0.35)
    with pytest.raises(LinkLost, match="can0: it is down; set it up"):
        reader.take(60.0)
    reader.close()
