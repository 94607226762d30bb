"""Resource limits of a process while it carries out a job.

A job that reaches its limit of processor time or memory ends with an error of its own:
if the system killed its process, it would be tried again, and nobody would know why.
"""

from __future__ import annotations

import resource
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fieldcal.service.bounds import ServiceBounds

GRACE_S = 60
"""Processor time in which a job ends after its limit; then it is killed, s."""


LIMITED = (
    resource.RLIMIT_FSIZE,
    resource.RLIMIT_CORE,
    resource.RLIMIT_DATA,
    resource.RLIMIT_CPU,
)


class TimeUsedUp(BaseException):
    """A job has used its processor time; no Exception, so that nothing catches it."""


@contextmanager
def resource_limits(bounds: ServiceBounds) -> Iterator[None]:
    """Limit this process until the end of the block.

    Raises
    ------
    TimeUsedUp
        When the processor time is used up, in the main thread of a process only.

    """
    used = resource.getrusage(resource.RUSAGE_SELF)
    before = {what: resource.getrlimit(what) for what in LIMITED}
    _set_limit(resource.RLIMIT_FSIZE, 2 * bounds.unpacked)
    _set_limit(resource.RLIMIT_CORE, 0)
    if sys.platform == "linux":
        # of what is written to; address space is also reserved for each thread
        _set_limit(resource.RLIMIT_DATA, _data_size() + bounds.memory)
    end = int(used.ru_utime + used.ru_stime) + bounds.seconds

    def end_job(*_: object) -> None:
        signal.signal(signal.SIGXCPU, signal.SIG_DFL)
        _set_limit(resource.RLIMIT_CPU, end + GRACE_S)
        raise TimeUsedUp

    # a worker of Dask works in threads, where no handler can be set
    handled = threading.current_thread() is threading.main_thread()
    handler = signal.signal(signal.SIGXCPU, end_job) if handled else None
    _set_limit(resource.RLIMIT_CPU, end)
    try:
        yield
    finally:
        for what, limit in before.items():
            resource.setrlimit(what, limit)
        if handled:
            signal.signal(signal.SIGXCPU, handler)


def _set_limit(what: int, most: int) -> None:
    _, hard = resource.getrlimit(what)
    least = most if hard == resource.RLIM_INFINITY else min(most, hard)
    resource.setrlimit(what, (least, hard))


def _data_size() -> int:
    """Memory of this process that counts for RLIMIT_DATA, bytes."""
    lines = Path("/proc/self/status").read_text("utf-8").splitlines()
    sizes = [line.split()[1] for line in lines if line.startswith("VmData:")]
    return 1024 * int(sizes[0])
