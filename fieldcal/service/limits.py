"""Resource limits of a process while it carries out a job.

A job that reaches its limit of processor time or memory ends with an error of its own:
if the system killed its process, it would be tried again, and nobody would know why.
"""

from __future__ import annotations

import resource
import signal
import sys
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
    """Limit this process until the end of the block, in its main thread.

    Raises
    ------
    TimeUsedUp
        When the processor time is used up.
    ValueError
        In another thread, where the signal of the limit cannot be handled.

    """
    used = resource.getrusage(resource.RUSAGE_SELF)
    end = int(used.ru_utime + used.ru_stime) + bounds.seconds

    def end_job(*_: object) -> None:
        signal.signal(signal.SIGXCPU, signal.SIG_DFL)
        _set_limit(resource.RLIMIT_CPU, end + GRACE_S)
        raise TimeUsedUp

    handler = signal.signal(signal.SIGXCPU, end_job)
    before = {what: resource.getrlimit(what) for what in LIMITED}
    _set_limit(resource.RLIMIT_FSIZE, 2 * bounds.unpacked)
    _set_limit(resource.RLIMIT_CORE, 0)
    if sys.platform == "linux":
        # of what is written to; address space is also reserved for each thread
        _set_limit(resource.RLIMIT_DATA, _data_size() + bounds.memory)
    _set_limit(resource.RLIMIT_CPU, end)
    try:
        yield
    finally:
        for what, limit in before.items():
            resource.setrlimit(what, limit)
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
