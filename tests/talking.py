"""Something that talks on a pty for as long as it is listened to."""

from __future__ import annotations

import os
import pty
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread
from time import monotonic

RATE_HZ = 200.0

Say = Callable[[int], bytes]
"""What is said, by how many times something was."""


@contextmanager
def talking(say: Say) -> Iterator[str]:
    """A pty on which something is said 200 times a second; its path.

    Who comes late says all that was due: a busy machine makes bursts, and not less.
    """
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    os.set_blocking(ours, False)
    done = Event()

    def talk() -> None:
        i, began = 0, monotonic()
        while not done.wait(0.005):
            while i < RATE_HZ * (monotonic() - began):
                with suppress(BlockingIOError):
                    os.write(ours, say(i))
                i += 1

    thread = Thread(target=talk)
    thread.start()
    try:
        yield os.ttyname(theirs)
    finally:
        done.set()
        thread.join()
        os.close(ours)
        os.close(theirs)
