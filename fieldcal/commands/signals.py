"""Makes signals that end a command act like Ctrl-C, once."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator

ENDING_SIGNALS = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP")
    if hasattr(signal, name)  # Windows has no terminal that hangs up
)


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Treat termination, or loss of the terminal, like a keyboard interrupt.

    Further signals are ignored, so that settings of a device are restored before the
    command ends. Outside of the main thread, signals stay as they are.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, frame: object) -> None:
        for kind in ENDING_SIGNALS:
            signal.signal(kind, signal.SIG_IGN)
        raise KeyboardInterrupt

    before = [signal.signal(kind, interrupt) for kind in ENDING_SIGNALS]
    try:
        yield
    finally:
        for kind, handler in zip(ENDING_SIGNALS, before, strict=True):
            signal.signal(kind, handler)
