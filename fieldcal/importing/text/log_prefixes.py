"""What logs of programs write before a line: level, time, place.

[INFO] [1700000000.123456789] [imu_node]: ax=0.1         ROS 1 and 2
[00:00:12.345,678] <inf> imu: ax=0.1                     Zephyr
[00012345] <inf> imu: ax=0.1                             Zephyr, ms since the start
05-03 14:20:31.123  1234  1250 D Imu: ax=0.1             Android's logcat
[   123] ax=0.1
[12.345] imu: ax=0.1        1700000000.123 [INFO] ax=0.1        12345 ms | ax=0.1
12345, ax=0.1               12345: ax=0.1                       (12345) ax=0.1
"""

from __future__ import annotations

import re
from typing import NamedTuple

TIME = "utc time [s]"
"""Name of the time of day that a monitor or a program writes before a line."""

TICKS = "time [ms]"
"""Name of the time since a device started."""

STAMP = "time [s]"
"""Name of the seconds that a program writes before a line."""

COUNT = "time"
"""Name of a number in brackets: ticks, or rows."""

_TO_LABELS = r"[\s:|,;>-]+(?=[A-Za-z({\[][^:=]*[:=])"
"""What stands between a bare number and labels behind it."""

_FORMS = {
    STAMP: (
        r"\s*\[\s*(?:DEBUG|INFO|WARN(?:ING)?|ERROR|FATAL)\s*\]\s*\[(\d+\.\d+)\]()"
        r"(?:\s*\[[^\]]*\])?:?\s*",
        r"\s*\[\s*(\d+\.\d+)\]():?\s*(?=[A-Za-z])",
        r"\s*(\d{9,}\.\d+)()(?=[\s:|,-]+\[?[A-Za-z])[\s:|,-]+",
    ),
    TIME: (
        r"\s*\[(\d+:\d\d:\d\d\.\d{3}),(\d{3})\]\s*<\w+>\s*[\w.-]+:\s*",
        r"\s*(?:\d{4}-)?\d\d-\d\d (\d\d:\d\d:\d\d\.\d+)()\s+\d+\s+\d+\s+[VDIWEF]"
        r" [^:]*:\s*",
    ),
    TICKS: (
        r"\s*\[(\d{8,})\]()\s*<\w+>\s*[\w.-]+:\s*",
        r"\s*(\d+)() ?ms\b[\s:|,-]+(?=[A-Za-z])",
    ),
    COUNT: (
        r"\s*\[\s*(\d+)\]():?\s*(?=[A-Za-z])",
        rf"\s*(\d+(?:\.\d+)?)(){_TO_LABELS}",
        rf"\s*\((\d+(?:\.\d+)?)()\){_TO_LABELS}",
    ),
}
"""Forms by the name of the time in them, which is in two parts."""

_READ = [(name, re.compile(form)) for name, forms in _FORMS.items() for form in forms]


class LogPrefix(NamedTuple):
    """What stands before a line.

    Attributes
    ----------
    name, value : of its time
    length : of all of it

    """

    name: str
    value: str
    length: int


def log_prefix(line: str) -> LogPrefix | None:
    """Return what a program's log writes before a line; None of another line.

    >>> log_prefix("[INFO] [17.25] [imu]: ax=1")
    LogPrefix(name='time [s]', value='17.25', length=22)
    """
    for name, form in _READ:
        if (said := form.match(line)) is not None:
            return LogPrefix(name, said[1] + said[2], said.end())
    return None
