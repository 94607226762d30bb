"""Guess what the columns of lines of numbers are, from a device that lies still.

Three neighbours whose norm is one gravity are the accelerometers, and the norm tells
their unit; the three beside them are the gyroscopes, which at rest read what is no rest
in rad/s, or leave their unit open; a column that only grows is the time or a counter.
Columns of an attitude or of a magnetometer look like others at rest: four that are a
unit quaternion are no accelerometers unless nothing else is, and of three that stand
together none is a temperature, unless a pressure is among them.
"""

from __future__ import annotations

import re
from collections import Counter
from urllib.parse import quote

import numpy as np

from fieldcal.core.escaping import escape_line
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array, runs_of_true
from fieldcal.drivers.framing import Mask
from fieldcal.drivers.named_lines import read_named_line
from fieldcal.session.units import ACC_UNITS

LARGEST_RATE_AT_REST = 0.1
"""What no gyroscope of a device at rest reads, rad/s: 6 deg/s."""

LARGEST_DEGREES_AT_REST = 100.0
"""The same in deg/s, of the worst of low-cost devices: more are thousandths of them."""

TEMPERATURES = (10.0, 60.0)
"""Usual temperatures of a device, deg C."""

LARGEST_WARMING = 5.0
"""Temperatures do not change by more while a port is listened to, K: counters do."""

PRESSURES = ((500.0, 1100.0), (5e4, 1.1e5))
"""Pressures of the air, in hPa and Pa."""

EVEN_NOISE = 4.0
"""Largest ratio of the noise of one triad's axes."""

LARGEST_GRAVITY_ERROR = 0.1
"""Largest error of gravity as low-cost accelerometers read it, as a share of it."""

QUATERNION_ERROR = 1e-3
"""Usual error of the norm of a quaternion, by its digits and its noise."""

LEAST_LINES = 5
"""Lines that make a guess worth while."""

SHOWN_CHARACTERS = 60
"""Characters of a line that are shown."""

SEPARATORS = {",": ",", ";": ";", "\t": "tab", " ": "space", "|": "|"}
CHECKSUM_LINE = re.compile(r"\$?(.*)\*[0-9A-Fa-f]{2}")
FIRST_WORD = re.compile(r"\$?([A-Za-z]\w*)\W")
UNITS_OF_TIME = ("s", "ms", "us", "ns")


def guess_text_options(data: bytes, seconds: float) -> str | None:
    r"""Options of a text format that fit bytes, which came in so many seconds.

    >>> lines = b"".join(b"%d;0;0;1000;1;2;3\n" % (1000 * i) for i in range(20))
    >>> guess_text_options(lines, 0.02)
    'columns=t,ax,ay,az,gx,gy,gz&separator=;&t_unit=us&acc_unit=mg&gyr_unit=deg/s'
    """
    lines = [line.strip() for line in data.decode("latin-1").split("\n")[1:-1]]
    checked = sum(CHECKSUM_LINE.fullmatch(line) is not None for line in lines)
    options = []
    if checked > len(lines) / 2:
        options.append("checksum=xor")
        found = [CHECKSUM_LINE.fullmatch(line) for line in lines]
        lines = [match[1] for match in found if match]
    words = Counter(match[1] for line in lines if (match := FIRST_WORD.match(line)))
    if words and words.most_common(1)[0][1] > len(lines) / 2:
        word = words.most_common(1)[0][0]
        options.insert(0, f"prefix={quote(word)}")
        lines = [line[len(word) + 1 :] for line in lines if line.startswith(word)]
    table = _table(lines)
    if table is None:
        return None
    separator, values = table
    named = _names(values, seconds)
    if "ax" not in named[0]:
        return None
    if separator != ",":
        named.insert(1, f"separator={SEPARATORS[separator]}")
    return "&".join(named + options)


def describe_lines(data: bytes) -> str:
    r"""What lines are of which no format is known, and what to do; empty of no lines.

    >>> describe_lines(b"12;-3;16384\r\n" * 9)[:45]
    "lines of numbers come, such as '12;-3;16384':"
    >>> describe_lines(bytes(range(256)))
    ''
    """
    lines = [line.strip() for line in data.decode("latin-1").split("\n")[1:-1]]
    lines = [line for line in lines if line]
    plain = sum(
        line.isascii() and line.replace("\t", " ").isprintable() for line in lines
    )
    if len(lines) < LEAST_LINES or plain < 0.8 * len(lines):
        return ""
    one = escape_line(lines[len(lines) // 2][:SHOWN_CHARACTERS])
    if _table(lines):
        return (
            f"lines of numbers come, such as '{one}': say what their columns are, as"
            " in format=text&columns=t,ax,ay,az,gx,gy,gz&acc_unit=g&gyr_unit=deg/s"
        )
    if all(read_named_line(line) for line in lines[-LEAST_LINES:]):
        return (
            f"lines with names come, such as '{one}': say which names are the"
            " channels, and their units, as in format=text&map=t=ms,ax=aX,ay=aY,az=aZ,"
            "gx=gX,gy=gY,gz=gZ&acc_unit=g&gyr_unit=deg/s (`fieldcal ports --probe`"
            " says them where the names and gravity at rest tell)"
        )
    return (
        f"lines of text come, such as '{one}', and format=text reads numbers between"
        " separators only, or behind names: set the device to send those"
    )


def _table(lines: list[str]) -> tuple[str, Array] | None:
    """Find the separator, and the numbers that it separates, (lines, columns)."""
    best: tuple[str, Array] | None = None
    for separator in SEPARATORS:
        rows = [_numbers(line, separator) for line in lines]
        widths = Counter(len(row) for row in rows if row)
        if not widths:
            continue
        width, count = widths.most_common(1)[0]
        if width >= 3 and count >= max(LEAST_LINES, 0.8 * len(lines)):
            if best is None or width > best[1].shape[1]:
                best = separator, np.array([r for r in rows if r and len(r) == width])
    return best


def _numbers(line: str, separator: str) -> list[float] | None:
    try:
        fields = line.split() if separator == " " else line.split(separator)
        return [float(field) for field in fields]
    except ValueError:
        return None


def _names(values: Array, seconds: float) -> list[str]:
    """Names of the columns and their units, as options."""
    names = ["-"] * values.shape[1]
    units = []
    grows = np.all(np.diff(values, axis=0) > 0, axis=0)
    for i in np.flatnonzero(grows).tolist():
        if "t" not in names and not _counts_samples(values[:, i], seconds):
            names[i] = "t"
            units.append(f"t_unit={time_unit(float(np.ptp(values[:, i])), seconds)}")
        elif "seq" not in names:
            names[i] = "seq"
    acc = _gravity_columns(values, names)
    if acc is not None:
        at, unit = acc
        names[at : at + 3] = ["ax", "ay", "az"]
        units.append(f"acc_unit={unit}")
        for beside in (at + 3, at - 3):
            if beside >= 0 and names[beside : beside + 3] == ["-"] * 3:
                names[beside : beside + 3] = ["gx", "gy", "gz"]
                if unit := rate_unit_at_rest(values[:, beside : beside + 3]):
                    units.append(f"gyr_unit={unit}")
                break
    if (warm := _temperature_column(values, names)) is not None:
        names[warm] = "temperature"
    known = [unit for unit in units if unit not in ("t_unit=s", "acc_unit=m/s^2")]
    return ["columns=" + ",".join(names), *known]


def _counts_samples(column: Array, seconds: float) -> bool:
    """Whether a column that grows counts samples, of which some may be missing.

    Milliseconds grow like a counter at 1 kHz, and by two where a sample was late.
    """
    steps = np.diff(column)
    if np.all(steps == 1):
        return True
    if not (np.all(steps == np.round(steps)) and np.median(steps) == 1):
        return False
    return not 0.8 < float(np.ptp(column)) / max(seconds, 1e-9) / 1e3 < 1.25


def _temperature_column(values: Array, names: list[str]) -> int | None:
    """The quietest free column that may be a temperature, and is none of a triad."""
    likely: list[int] = []
    free = np.array([name == "-" for name in names])
    mean = values.mean(axis=0)
    warms = (mean > TEMPERATURES[0]) & (mean < TEMPERATURES[1])
    warms &= np.ptp(values, axis=0) < LARGEST_WARMING
    pressure = np.any([(mean > a) & (mean < b) for a, b in PRESSURES], axis=0)
    for first, end in runs_of_true(free).tolist():
        some = np.arange(first, end)
        alone = len(some) % 3
        if not pressure[some].any():  # what stands before or behind triads
            some = np.concatenate([some[:alone], some[len(some) - alone :]])
        likely += some[warms[some]].tolist()
    quiet = np.abs(np.diff(values, axis=0)).mean(axis=0)
    return min(likely, key=lambda i: quiet[i], default=None)


def rate_unit_at_rest(rates: Array) -> str:
    """Unit of rates at rest, (m, 3); empty where they may be in rad/s or in deg/s."""
    size = float(np.median(np.abs(rates).max(axis=1)))
    if not size > LARGEST_RATE_AT_REST:
        return ""
    return "mdeg/s" if size > LARGEST_DEGREES_AT_REST else "deg/s"


def time_unit(span: float, seconds: float) -> str:
    """Unit in which a span comes nearest to what the host saw, or a fast replay."""
    if not seconds > 0:
        return "s"
    thousands = round(np.log10(max(span, 1e-9) / seconds) / 3)
    return UNITS_OF_TIME[min(max(thousands, 0), 3)]


def _gravity_columns(values: Array, names: list[str]) -> tuple[int, str] | None:
    """First of three neighbours whose norm is one gravity, and their unit.

    Parts of a quaternion are taken only where nothing else has that norm.
    """
    free = np.array([name == "-" for name in names])
    turned = _quaternion_column(values, free)
    if turned is not None:
        others = free.copy()
        others[turned : turned + 4] = False
        if found := _triad_of_gravity(values, others):
            return found
    return _triad_of_gravity(values, free)


def _triad_of_gravity(values: Array, free: Mask) -> tuple[int, str] | None:
    """The triad of free columns whose norm is nearest to gravity, and its unit.

    Where small numbers beside it make several norms alike, it is the one of even noise:
    the others reach into another triad, of another quantity. Where the digits hide the
    noise: triads stand behind one another, from the first or to the last free column.
    """
    found = []
    noise = np.abs(np.diff(values, axis=0)).mean(axis=0)
    for first, end in runs_of_true(free).tolist():
        for at in range(first, end - 2):
            three = noise[at : at + 3]
            uneven = 0 < three.min() < three.max() / EVEN_NOISE
            apart = ((at - first) % 3 > 0) + ((end - at) % 3 > 0)
            if (near := gravity_unit(values[:, at : at + 3])) is not None:
                off, unit = near
                found.append((uneven, apart, off, at, unit))
    return min(found)[3:] if found else None


def gravity_unit(three: Array) -> tuple[float, str] | None:
    """How far the norm of (m, 3) is from gravity, and in which unit it is near."""
    norm = float(np.median(np.linalg.norm(three, axis=1)))
    found = [
        (abs(norm * ACC_UNITS[unit] / G0 - 1), unit) for unit in ("m/s^2", "g", "mg")
    ]
    near = min(found)
    return near if near[0] < LARGEST_GRAVITY_ERROR else None


def _quaternion_column(values: Array, free: Mask) -> int | None:
    """The first of four free columns that are a unit quaternion, if there are any."""
    for first, end in runs_of_true(free).tolist():
        for at in range(first, end - 3):
            off = np.abs(np.linalg.norm(values[:, at : at + 4], axis=1) - 1)
            if float(np.median(off)) < QUATERNION_ERROR:
                return int(at)
    return None
