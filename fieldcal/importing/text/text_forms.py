r"""Texts that are not plain columns, written as such: quotes, labels, times of a clock.

    "0,12","0,34"                      quoted, also with decimal commas
    "1,714,746"  1 714 746  1'714'746  thousands that are set apart
    12:34:56.789 -> ax: 0.1 ay: 0.2    values with labels, also over several lines
    Acc = V { Data = <0.1, 0.2, 9.8> }  values within brackets, of named records or none
    Data,4,accelerometer_data,…,"0|10" messages of a FIT file
    RAW_IMU {time_usec : 5, xacc : 3}  messages of MAVLink as mavlogdump shows them
    <UBX(ESF-MEAS, timeTag=5, …)>      messages of u-blox as pyubx2 prints them
    {0.01f, 0.1f, 0.2f, 9.8f},         rows of a matrix in a program, or of SQL
    IMU:0.1,0.2,9.8,0,0,0              a word before the columns
    AcX,12,AcY,-45,AcZ,16384           values behind cells with their names
    IMU,0.01,0.1,0.2,9.8               lines of several kinds, by a word in each
    $IMU,0.01,0.1*5A                   lines with a checksum
    %RAWIMUSA,2209,4916.2;...*1fb76c28  messages of a receiver
    $VNYMR,-131.1,+31.8,...*62         messages of a device by VectorNav
    channel idx=3 accel_xyz x = 0.1    channels of Zephyr's sensor shell
    Reading from #4 (imu|SENSE_ACCEL)  devices of RIOT's
    0.01,0.1,0.2,9.8;                  lines with a mark at their end
    angular_velocity:\n  x: 0.1        messages as ROS shows them
    | 0.01 | 0.1 |   0.01,"[0.1, 0.2, 9.8]"   tables between bars, lists in a cell
    0.01\t0.1 0.2 9.8\t0 0 0            spaces between numbers within a cell
    12,345,0.1,0.2                     decimal commas between commas, by the names
    FF3A 0012                          counts in hexadecimal digits
    gscale,0.0005                      counts below lines that say what one of them is
    2024-05-03 23:59:50.123, 0.1, 0.2  times of a clock, in one column or two
    23:59:50:07, 0.1, 0.2              frames behind the seconds, as in film: 50.28
    23:59:50.7, 0.1, 0.2               ms behind the seconds without their zeros: 50.007

    1,0.01,0.1,0.2,9.8                 a number for the sensor, by what stands above
    0.981D+01  9.81 m/s²               numbers as Fortran writes them, or with units
    0.01,ax,0.12                       a line for each value; points of a database

Which of these a text is, its first lines tell. Each form turns lines into lines, so
that everything behind it knows columns of numbers alone.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from fieldcal.importing.text.bare_fractions import BareFractions
from fieldcal.importing.text.cell_forms import (
    BarTable,
    HexCells,
    ListCells,
    SpacedCells,
)
from fieldcal.importing.text.dataflash_text import DataflashText
from fieldcal.importing.text.fit_csv import FitCsv
from fieldcal.importing.text.grouped_digits import GroupedDigits
from fieldcal.importing.text.labelled_lines import LabelledValues
from fieldcal.importing.text.labview_text import LabviewText
from fieldcal.importing.text.line_forms import (
    CheckedLines,
    EchoedMessages,
    EndedLines,
    WordPrefix,
)
from fieldcal.importing.text.long_tables import DatabasePoints, LongTable
from fieldcal.importing.text.matrix_rows import MatrixRows
from fieldcal.importing.text.mavlink_text import MavlinkText
from fieldcal.importing.text.nested_values import NestedValues
from fieldcal.importing.text.paired_cells import PairedCells
from fieldcal.importing.text.rate_on_top import RateOnTop
from fieldcal.importing.text.receiver_lines import ReceiverLines
from fieldcal.importing.text.saul_lines import SaulLines
from fieldcal.importing.text.scaled_counts import ScaledCounts
from fieldcal.importing.text.sensor_codes import SensorCodes
from fieldcal.importing.text.split_decimals import SplitDecimals
from fieldcal.importing.text.tagged_lines import TaggedLines
from fieldcal.importing.text.text_form import (
    MOSTLY,
    Reader,
    TextForm,
    is_true_of_most,
)
from fieldcal.importing.text.text_lines import split_quoted
from fieldcal.importing.text.text_top import find_separator, split_cells
from fieldcal.importing.text.timecodes import Timecodes
from fieldcal.importing.text.ubx_lines import UbxLines
from fieldcal.importing.text.vectornav_lines import VectorNavLines
from fieldcal.importing.text.written_numbers import FortranNumbers, UnitCells
from fieldcal.importing.text.zephyr_lines import ZephyrLines
from fieldcal.importing.times.clock_text import (
    IN_LINE,
    ClockText,
    is_clock,
    is_date,
    possible_days,
)

CLOCK = "utc time [s]"
"""What a column is called whose clock was read; a device's own time goes before it."""

_STAMP = r"(\S*\s?\d+:\d\d:\d\d(?:[.,]\d+)?)"
_ARRIVALS = (
    re.compile(rf"\s*\[?{_STAMP}\]?\s*(?:->|(?:- [A-Z]+ )?#)\s*"),
    re.compile(rf"\s*\[{_STAMP}\][ \t]*(?=[-+.\d])"),
    re.compile(rf"\s*{_STAMP} +(?=[-+.\d][^\s,;]*[,;\t])"),
)
"""Times that monitors write before a line: the Arduino IDE's, and with # RIOT's pyterm;
Tera Term's, in brackets; and CoolTerm's, parted by a space from columns that another
sign parts."""

_ZONED = re.compile(rf"\s*{_STAMP} +[-+](?:0\d|1[0-4]):?(?:00|15|30|45)[,;\t]")
"""A time with its zone, which is no number of the row."""


def forms_of(lines: Sequence[str], separator: str | None) -> list[TextForm]:
    """Forms of a text by its first lines, in the order in which they are undone.

    Parameters
    ----------
    lines : that are not empty
    separator : of columns, where the user says it

    """
    found: list[TextForm] = []
    for form in FORMS:
        one = form.of(lines, separator)
        if one is not None:
            found.append(one)
            lines = one.reader()(lines)
    return found


class QuotedCells(TextForm):
    """Cells in quotes: without them, parted by tabs."""

    def __init__(self, old: str, new: str) -> None:
        self._old, self._new = old, new

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> QuotedCells | None:
        """The form, if most lines have it."""
        if not is_true_of_most(lines, lambda line: line.count('"') > 1):
            return None
        bare = re.sub('"[^"]*"', '""', lines[-1])
        return cls(separator or find_separator(bare) or " ", separator or "\t")

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        return lambda lines: [
            self._new.join(split_quoted(line, self._old)) for line in lines
        ]


class ArrivalPrefix(TextForm):
    """The time at which a monitor received a line, ``12:34:56.789 -> ``: a column.

    Also ``[12:34:56.789] 0.1 0.2``, and ``12:34:56.789 0.1,0.2``.
    """

    def __init__(self, separator: str) -> None:
        self._separator = separator

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> ArrivalPrefix | None:
        """The form, if most lines have it."""
        if not is_true_of_most(lines, lambda line: _arrival(line) is not None):
            return None
        if is_true_of_most(lines, lambda line: _ZONED.match(line) is not None):
            return None
        said = _arrival(lines[-1])
        rest = lines[-1][said.end() :] if said else lines[-1]
        return cls(separator or find_separator(rest) or "\t")

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            arrival = _arrival(line)
            if arrival is None:
                return line
            rest = line[arrival.end() :]
            bare = find_separator(rest) is None
            rest = self._separator.join(rest.split()) if bare else rest
            return f"{arrival[1]}{self._separator}{rest}"

        return lambda lines: [one(line) for line in lines]


def _arrival(line: str) -> re.Match[str] | None:
    """The time before a line; None of a line without one."""
    if ":" not in line:
        return None
    found = (form.match(line) for form in _ARRIVALS)
    return next((said for said in found if said is not None), None)


class ClockColumn(TextForm):
    """A column with times of a clock, as seconds; the date may stand beside it."""

    def __init__(
        self, clock: int, day: int | None, separator: str | None, merged: bool
    ) -> None:
        self.clock, self._day = clock, day
        self._separator, self._merged = separator, merged

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> ClockColumn | None:
        """The form, if most lines have it."""
        if not lines:
            return None
        parted = separator or find_separator(lines[-1])
        if parted is None and (place := _of_two_words(lines)) is not None:
            form = cls(place, None, None, True)
            words = (said[0] for line in lines if (said := IN_LINE.search(line)))
            form.days = possible_days(next(words, ""))
            return form
        rows = [split_cells(line, parted) for line in lines]
        clocks = [i for i, cell in enumerate(rows[-1]) if is_clock(cell)]
        if not clocks:
            return None
        # what a database was asked for, from when to when, is the same in all rows
        clock = next((i for i in clocks if _changes(rows, i)), clocks[0])
        many = sum(len(row) > clock and is_clock(row[clock]) for row in rows)
        if many <= MOSTLY * len(rows):
            return None
        day = next((i for i, cell in enumerate(rows[-1]) if is_date(cell)), None)
        form = cls(clock, day, parted, False)
        wide = [row for row in rows if len(row) > max(clock, day or 0)]
        first = next(row for row in wide if is_clock(row[clock]))
        form.days = possible_days(first[clock], first[day] if day is not None else "")
        return form

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        clock = ClockText()
        return lambda lines: [self._seconds(line, clock) for line in lines]

    def _seconds(self, line: str, clock: ClockText) -> str:
        """The line with seconds in place of a clock."""
        if self._merged:
            said = IN_LINE.search(line)
            since = clock.seconds(said[0]) if said else None
            if said is None or since is None:
                return line
            return f"{line[: said.start()]}{since:.9f}{line[said.end() :]}"
        row = line.split(self._separator)
        if self.clock is None or len(row) <= self.clock:
            return line
        day = row[self._day] if self._day is not None and self._day < len(row) else ""
        since = clock.seconds(row[self.clock], day)
        if since is None:
            return line
        row[self.clock] = f"{since:.9f}"
        return (self._separator or " ").join(row)


def _changes(rows: Sequence[Sequence[str]], i: int) -> bool:
    """Whether a column of clocks is not the same in all rows."""
    return len({row[i] for row in rows if len(row) > i and is_clock(row[i])}) > 1


def _of_two_words(lines: Sequence[str]) -> int | None:
    """Column of a date and time that is one though a space parts them; None if not.

    It is two if a line above the numbers has as many words as they have.
    """
    said = IN_LINE.search(lines[-1])
    if said is None:
        return None
    others = {len(line.split()) for line in lines if not IN_LINE.search(line)}
    if len(lines[-1].split()) in others:
        return None
    return len(lines[-1][: said.start()].split())


FORMS: tuple[type[TextForm], ...] = (
    DataflashText, MavlinkText, UbxLines, FitCsv, LabviewText, ScaledCounts, RateOnTop,
    ReceiverLines, VectorNavLines, ZephyrLines, SaulLines,
    CheckedLines, EchoedMessages, MatrixRows, EndedLines, Timecodes, DatabasePoints,
    GroupedDigits, QuotedCells, SpacedCells, PairedCells, FortranNumbers, UnitCells,
    LongTable, NestedValues, LabelledValues, WordPrefix, BarTable, ListCells,
    SplitDecimals, SensorCodes, TaggedLines, ArrivalPrefix, HexCells, BareFractions,
    ClockColumn,
)  # fmt: skip
"""Forms in the order in which they are looked for."""
