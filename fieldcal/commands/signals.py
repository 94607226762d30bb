"""A command that is told to end, by whatever signal, ends in order: once."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator

ENDING = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP")
    if hasattr(signal, name)  # Windows has no terminal that hangs up
)


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Treat being terminated, or losing the terminal, like an interrupt.

    Once it ends, further signals change nothing: what a device was told is taken back
    first. In a thread other than the main one signals stay as they are.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, frame: object) -> None:
        for kind in ENDING:
            signal.signal(kind, signal.SIG_IGN)
        raise KeyboardInterrupt

    before = [signal.signal(kind, interrupt) for kind in ENDING]
    try:
        yield
    finally:
        for kind, handler in zip(ENDING, before, strict=True):
            signal.signal(kind, handler)
