"""Text files of numbers in columns.

Columns, rate and units come from the command line, from the lines above the numbers, or
from physics, which is said; the separator and lines at the top that are no numbers are
found by themselves. Times are made from the rate where the file has none; otherwise
they count from the first line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.drivers.codec import recognise_format
from fieldcal.importing import columns
from fieldcal.importing.columns import SKIP
from fieldcal.importing.files.text_encoding import is_mostly_text, utf16_encoding
from fieldcal.importing.headings.heading import Heading
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.recording import Recording
from fieldcal.importing.tables.column_recording import ColumnRecording
from fieldcal.importing.tables.text_heading import TextHeading
from fieldcal.importing.text.instances import (
    ImuInstances,
    find_instances,
    named_columns,
)
from fieldcal.importing.text.number_table import NumberTable
from fieldcal.importing.text.receiver_lines import corrected_messages
from fieldcal.importing.text.text_form import TextForm
from fieldcal.importing.text.text_forms import forms_of
from fieldcal.importing.text.text_lines import (
    TOP,
    cell_count,
    skip_lines,
    split_lines,
    top_lines,
)
from fieldcal.importing.text.text_source import TextSource
from fieldcal.importing.text.text_top import (
    count_top_lines,
    find_separator,
    find_stated_rate,
    parse_numbers,
)
from fieldcal.importing.words.file_names import sensor_of_file_name

WHAT = "text with columns"

NAMED = 50
"""Lines at the top by which their width is judged."""

BEGINNING = 1 << 16
"""Rows at the beginning by which physics tells columns."""

SECONDS = 1.0
"""Time that the first bytes are taken for, where the format asks."""

PLAIN_TEXT = "text"
"""Wire format of lines of numbers, whose units nobody says."""

_CHECKED = re.compile(rb"\$.*\*[0-9A-Fa-f]{2}\s*$")


def recognises(head: bytes, path: Path) -> bool:
    """Whether these are the first bytes of a text."""
    if utf16_encoding(head) is not None:
        return True
    lines = head.split(b"\n")[1:-1]
    if lines and sum(map(_is_checked, lines)) > len(lines) / 2:
        # of a format of its own, a port's bytes; of others physics tells the units
        fits = recognise_format(head, SECONDS)
        return is_mostly_text(head) and (fits is None or fits[0] == PLAIN_TEXT)
    return is_mostly_text(head)


def _is_checked(line: bytes) -> bool:
    """Whether a line ends with a checksum, as those of a port do."""
    return _CHECKED.search(line) is not None


class TextColumns(ColumnRecording):
    """A text file, with one IMU in it or several side by side.

    Attributes
    ----------
    member : the file of a .zip that is the text; "" if it is the file itself
    instance : which of several IMUs that come in turn is read; "" for the first

    """

    member = instance = ""
    _skip = 0

    def place(self, row: int) -> str:
        """Name a line; empty ones are not counted."""
        gathered = any(form.gathers for form in self._forms) or self.in_turn
        return f"{'record' if gathered else 'line'} {self._skip + row + 1}"

    def heading(self) -> list[Heading]:
        """What stands above its numbers."""
        above = TextHeading(self._lines, self._numbers, self.wanted.separator)
        stem = self.path.name.split(".")[0]
        found = above.read(self._forms, self.sensor, sensor_of_file_name(stem))
        self.says += [s for s in found.says if s not in self.says]
        self.told_by = found.told_by or self.told_by
        return found.ways

    def imus(self) -> dict[str, ReadOptions]:
        """Options of each IMU by its name; columns may be chosen by their names."""
        if any("=" in column for column in self.wanted.columns):
            self.wanted = replace(self.wanted, columns=self._by_names())
        if (named := self.wanted.columns)[-1:] == (columns.OTHERS,):
            more = self._numbers.shape[1] - len(named) + 1
            self.wanted = replace(self.wanted, columns=(*named[:-1], *[SKIP] * more))
        found = super().imus()
        if self._in_turn is None or self.instance or len(found) > 1:
            return found
        (one,) = found.values()
        return dict.fromkeys(self._in_turn.names, one)

    def _found(self) -> dict[str, ReadOptions]:
        """Options of each IMU; times that were read of a clock are s, whoever asks."""
        found = super()._found()
        for name, one in found.items():
            if self._is_by_clock(one):
                unit = one.time_unit or "s"
                found[name] = replace(one, time_unit=unit, named=one.named - {"t"})
        return found

    def _is_by_clock(self, wanted: ReadOptions) -> bool:
        """Whether the times are those that were read of a clock."""
        clocks = {form.clock for form in self._forms} - {None}
        return bool({i for i, c in enumerate(wanted.columns) if c == "t"} & clocks)

    @property
    def first_days(self) -> tuple[int, ...]:  # type: ignore[override]
        """Days that the clock of its rows may count from."""
        days = next((form.days for form in self._forms if form.days), ())
        return (
            days if days and all(map(self._is_by_clock, self.imus().values())) else ()
        )

    def alone(self, stream: str) -> Recording:
        """The recording with one of its IMUs."""
        one = super().alone(stream)
        if isinstance(one, TextColumns) and self._in_turn is not None:
            one.instance = stream if stream in self._in_turn.names else ""
        return one

    def _by_names(self) -> tuple[str, ...]:
        """Columns in their order, of those that the user says as ``ax=name``.

        Raises
        ------
        InputError
            If no line above the numbers has these names.

        """
        pairs = (c.partition("=") for c in self.wanted.columns if c != SKIP)
        channels = {name or channel: channel for channel, _, name in pairs}
        ways = [[c.name for c in way.columns] for way in self.heading()]
        for names in ways:
            if set(channels) <= set(names):
                return tuple(channels.get(name, SKIP) for name in names)
        there = ", ".join(max(ways, key=len, default=[])[:30])
        raise InputError(
            f"{self.path}: no line above its numbers has the names"
            f" {', '.join(channels)}; there are {there or 'none'}: say what each column"
            " is in its order, such as --columns t,ax,ay,az,_"
        )

    def beginning(self) -> Array:
        """Numbers of the first lines."""
        return self._numbers

    def ask(self) -> str:
        """Say how its columns are named."""
        lines = self._top or [""]
        if message := corrected_messages(lines):
            return (
                f"{self.path}: what its messages {message} hold is corrected by the"
                " receiver: gravity and the errors of the sensors that it estimated are"
                " taken out, so nothing can be calibrated by them; log RAWIMUSXA"
            )
        if not self._numbers.size:
            return (
                f"{self.path}: no line of it is a row of numbers, and none has values"
                f" with labels that are known; its first line is {lines[0][:60]!r}:"
                " write a row for each sample, such as t,ax,ay,az,gx,gy,gz with commas"
                " between"
            )
        return (
            f"{self.path}: say what its columns are, such as --columns"
            f" {columns.column_placeholders(self._numbers.shape[1])}; its first line is"
            f" {lines[0][:60]!r}"
        )

    @cached_property
    def _lines(self) -> list[str]:
        if self._in_turn is None:
            return self._first_lines
        return next((top_lines(data) for data in self._pieces()), [])

    @cached_property
    def _first_lines(self) -> list[str]:
        """Lines at the top in columns, of all IMUs."""
        return next((top_lines(d) for d in self._text.pieces(self._forms)), [])

    @cached_property
    def _numbers(self) -> Array:
        lines: list[str] = []
        for data in self._pieces():
            lines += split_lines(data)
            if len(lines) > BEGINNING:
                break
        return parse_numbers(lines[:BEGINNING], self.wanted.separator)

    def rate_said(self) -> tuple[float, str] | None:
        """Rate that a line above its numbers says."""
        return find_stated_rate(self._lines, self.wanted.separator)

    def read_samples(self) -> Iterator[Block]:
        """Samples, a piece of the file at a time."""
        columns.check_columns(self.wanted)
        names = [c for c in self.wanted.columns]
        use = [i for i, name in enumerate(names) if name != SKIP]
        samples, t0, first_lines = columns.ColumnReader(self.wanted), None, [""]
        table: NumberTable | None = None
        for data in self._pieces():
            if table is None:
                first_lines = self._begin(data, use)
                if not 0 <= self._skip < len(first_lines):
                    break
                data, first = skip_lines(data, self._skip), first_lines[self._skip]
                separator = self.wanted.separator or find_separator(first)
                self._check_width(first, separator)
                if separator != "," and "," in first:
                    self.says.append("its numbers have decimal commas")
                table = NumberTable(names, separator, self.place, self.damaged)
            found = table.read(data)
            n = len(found[0])
            block = samples.block(
                {names[i]: c for i, c in zip(use, found, strict=True)}, n
            )
            if not n:
                continue
            if t0 is None:
                t0 = float(block.t[0])
                self.began = t0 + self.later
            with np.errstate(invalid="ignore"):  # a time beyond all is no time
                since = block.t - t0 if self.from_first else block.t + self.later
            yield replace(block, t=since)
        self.says += [s for s in samples.says if s not in self.says]
        if table is not None and table.headings:
            self.says.append(f"lines of words between its rows: {table.headings}")
        if table is None or not table.seen:
            number, line = list(enumerate(first_lines[:2] or [""], 1))[-1]
            raise InputError(
                f"{self.path}: no line has numbers in the columns {','.join(names)};"
                f" line {number} is {line[:60]!r}: name each column in its order, _ for"
                " one that is not wanted"
            )

    def _begin(self, data: bytes, use: Sequence[int]) -> list[str]:
        """Lines at the top, as many as it takes to find the first of numbers."""
        lines = [""]
        for many in (NAMED, TOP):
            lines = top_lines(data, many)
            self._skip = count_top_lines(lines, self.wanted, use)
            if 0 <= self._skip < len(lines):
                break
        return lines

    @property
    def _text(self) -> TextSource:
        """The lines of the file."""
        return TextSource(self, self.member)

    def _pieces(self) -> Iterator[bytes]:
        """Whole lines of the file, many at a time, in columns."""
        pieces = self._text.pieces(self._forms)
        if self._in_turn is None:
            return pieces
        name, only = self.instance or self._in_turn.names[0], self._in_turn.only
        return ("\n".join([*only(name, split_lines(data)), ""]).encode()
                for data in pieces)  # fmt: skip

    @cached_property
    def _in_turn(self) -> ImuInstances | None:
        """What tells several IMUs apart whose rows come in turn."""
        parted = self.wanted.separator
        found = find_instances(self._first_lines, parted)
        ways = [found] if found else named_columns(self._first_lines, parted)
        whole = (
            one.over(map(split_lines, self._text.pieces(self._forms))) for one in ways
        )
        fits = (one for one in whole if found or one.are_several)
        found = next(fits, None)
        self.says += found.says if found is not None else []
        return found

    @cached_property
    def _forms(self) -> list[TextForm]:
        """What must be undone before the text is one of columns."""
        with self.named_errors():
            return forms_of(self._top, self.wanted.separator)

    @cached_property
    def _top(self) -> list[str]:
        """First lines, as they stand in the file."""
        return self._text.top()

    def _check_width(self, line: str, separator: str | None) -> None:
        width, named = cell_count(line, separator), len(self.wanted.columns)
        if width != named:
            more = " (_... at the end skips the others)" if named < width else ""
            raise InputError(
                f"{self.path}: has {width} columns, {named} are named{more};"
                f" its line {self._skip + 1} is {line[:60]!r}"
            )
