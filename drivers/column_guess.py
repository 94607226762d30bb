"""Guess what the columns of lines of numbers are, from a device that lies still.

Three neighbours whose norm is one gravity are the accelerometers, and the norm tells
their unit; the three beside them are the gyroscopes, which at rest read what is no rest
in rad/s, or leave their unit open; a column that only grows is the time or a counter.
"""

from __future__ import annotations

import re
from collections import Counter
from urllib.parse import quote

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.session.units import ACC_UNITS

LARGEST_RATE_AT_REST = 0.1
"""What no gyroscope of a device at rest reads, rad/s: 6 deg/s."""

LEAST_LINES = 5
"""Lines that make a guess worth while."""

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
        if "t" not in names and not np.all(np.diff(values[:, i]) == 1):
            names[i] = "t"
            units.append(f"t_unit={_time_unit(float(np.ptp(values[:, i])), seconds)}")
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
                rates = values[:, beside : beside + 3]
                if float(np.median(np.abs(rates).max(axis=1))) > LARGEST_RATE_AT_REST:
                    units.append("gyr_unit=deg/s")
                break
    mean = values.mean(axis=0)
    for i in [i for i, name in enumerate(names) if name == "-"]:
        if "temperature" not in names and 10 < mean[i] < 60:
            names[i] = "temperature"
    known = [unit for unit in units if unit not in ("t_unit=s", "acc_unit=m/s^2")]
    return ["columns=" + ",".join(names), *known]


def _time_unit(span: float, seconds: float) -> str:
    """Unit in which a span comes nearest to what the host saw, or a fast replay."""
    if not seconds > 0:
        return "s"
    thousands = round(np.log10(max(span, 1e-9) / seconds) / 3)
    return UNITS_OF_TIME[min(max(thousands, 0), 3)]


def _gravity_columns(values: Array, names: list[str]) -> tuple[int, str] | None:
    """First of three neighbours whose norm is one gravity, and their unit.

    Triads stand behind one another: where zeros beside it make several norms alike, it
    is the one a multiple of three from the first column that is free.
    """
    found = []
    free = names.index("-") if "-" in names else 0
    for at in range(len(names) - 2):
        if names[at : at + 3] != ["-"] * 3:
            continue
        norm = float(np.median(np.linalg.norm(values[:, at : at + 3], axis=1)))
        for unit in ("m/s^2", "g", "mg"):
            off = abs(norm * ACC_UNITS[unit] / G0 - 1)
            if off < 0.1:
                found.append(((at - free) % 3 > 0, off, at, unit))
    return min(found)[2:] if found else None
