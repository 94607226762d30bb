"""Lines of numbers: ``format=text&columns=t,ax,ay,az,gx,gy,gz,temperature``.

A line is one sample, its fields in the order of ``columns`` (a name that is none of
t, seq, ax … gz, temperature is passed over), between ``separator``: a character or
comma, semicolon, tab, space. Units are ``t_unit`` (s, ms, us, ns), ``acc_unit`` and
``gyr_unit`` as in session.toml, or mdeg/s, also with a factor, which is what a count
is worth: ``acc_unit=0.061*mg``. ``checksum=xor`` asks each line for the two
hexadecimal digits behind ``*`` that NMEA 0183 has: the exclusive or of all between
``$`` and ``*``. ``prefix=IMU`` passes over lines that begin otherwise; a ``$`` is no
part of it.

``map=ax=aX,ay=aY,az=aZ,t=ms`` in place of ``columns`` reads lines whose values have
names (`named_lines`), in any order: a sample needs each name of the map once, and other
names are passed over. ``separator`` is then only what stands behind the prefix, and no
line is a header.

Headers and comments (lines that begin with a letter or one of # % ; / ") and blank
lines are passed over, any other line that is not whole is refused. Without a checksum
the first line counts for nothing: it may be the end of one.

``t_unit=ms`` and ``us`` are taken for counters of ``t_bits=32``; ``t_resolution`` is in
s (1 ms for ms, else seen where samples share a stamp). Without a column t: ``rate=`` in
Hz, else the arrivals.
"""

from __future__ import annotations

import re
from string import ascii_letters, hexdigits

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Array, Block
from fieldcal.drivers.chosen_timebase import ChosenTimebase
from fieldcal.drivers.codec import Codec, FormatMatch
from fieldcal.drivers.column_guess import guess_text_options
from fieldcal.drivers.framing import Bytes, FrameCandidates, FrameScan, Index, Mask
from fieldcal.drivers.layouts import RawSamples
from fieldcal.drivers.named_lines import NUMBER_PATTERN, ChannelMap
from fieldcal.drivers.options import Options
from fieldcal.drivers.sample_counter import SampleCounter
from fieldcal.drivers.stamp_resolution import StampResolution
from fieldcal.session.units import ACC_UNITS, GYR_UNITS

LONGEST = 1024
"""Longest line, bytes; what is longer is no line."""

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
RATE_UNITS = {**GYR_UNITS, "mdeg/s": np.pi / 180e3}
SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
KNOWN_COLUMNS = ("t", "seq", *CHANNELS, "temperature")
DEFAULT = "t,ax,ay,az,gx,gy,gz,temperature"

NUMBER = re.compile(rf"\s*({NUMBER_PATTERN})\s*")

LF, CR, TAB, SPACE, STAR = b"\n\r\t *"

CHECKSUM_LENGTH = len("*hh")


def _table(characters: bytes) -> Mask:
    table = np.zeros(256, dtype=bool)
    table[list(characters)] = True
    return table


LETTERS = _table(ascii_letters.encode())
REMARKS = _table(b'\r\n#%;/"')
DOLLAR = _table(b"$!")
STRANGE = ~_table(bytes(range(ord(" "), 127)) + b"\t")
HEX = np.full(256, -1000)
for _digit in hexdigits:
    HEX[ord(_digit)] = int(_digit, 16)


class TextCodec(Codec):
    """Decoder of lines; the options are those of the module's text."""

    longest = LONGEST

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        self._names, self._map = _columns(options)
        self._separator = _separator(options)
        prefix = options.text("prefix").lstrip("$!")
        prefix += chr(self._separator) if prefix else ""
        self._prefix = np.frombuffer(prefix.encode(), np.uint8)
        self._checked = options.choice("checksum", ("none", "xor"), "none") == "xor"
        acc = options.unit("acc_unit", ACC_UNITS, "m/s^2")
        gyr = options.unit("gyr_unit", RATE_UNITS, "rad/s")
        self._scale = np.array([acc] * 3 + [gyr] * 3)
        unit = options.choice("t_unit", TIME_UNITS, "s")
        self._t_unit = TIME_UNITS[unit]
        counter = 32.0 if unit in {"ms", "us"} else 0.0
        bits = options.number("t_bits", counter, 0, 64)
        coarse = 1e-3 if unit == "ms" else 0.0
        resolution = options.number("t_resolution", coarse, 0, 1)
        stated = resolution > 0 or options.text("t_resolution")
        self._resolution = None if stated else StampResolution()
        span = 2**bits * self._t_unit if bits else float("inf")
        self._clock = ChosenTimebase(
            self.health, options, resolution, span, since_power_on=counter > 0
        )
        self._whole = self._checked
        self._seq = SampleCounter()
        self._check()

    def _check(self) -> None:
        used = [name for name in self._names if name in KNOWN_COLUMNS]
        said = f"{'map' if self._map else 'columns'}={','.join(self._names)}"
        if len(set(used)) < len(used):
            raise InputError(f"{said}: a name occurs twice")
        if not any(set(three) <= set(used) for three in (CHANNELS[:3], CHANNELS[3:])):
            raise InputError(f"{said}: name ax,ay,az or gx,gy,gz or both")

    @classmethod
    def match(cls, data: bytes, seconds: float) -> FormatMatch | None:
        """Judge bytes by how their lines look; the columns are guessed."""
        query = guess_text_options(data, seconds)
        if query is None:
            return None
        like = cls.match_decoded(data, query)
        # lines of numbers may also be a format of their own
        return like and FormatMatch(0.5 * like.score, query, like.samples)

    def scan(self, data: Bytes) -> FrameCandidates:
        """Every line that has ended."""
        newlines = np.flatnonzero(data == LF)
        ends = newlines + 1
        rest = int(ends[-1]) if len(ends) else 0
        starts = np.concatenate([[0], ends[:-1]])[: len(ends)]
        if not self._whole and len(ends):
            starts, ends, newlines = starts[1:], ends[1:], newlines[1:]
            self._whole = True
        if len(data) - rest > LONGEST:
            rest, self._whole = len(data), False
        if self._checked and len(starts):
            starts = _last_dollar(data, starts, newlines)
        good = self._passed(data, starts)
        lines = ~good
        good[lines] = self._well_formed(data, starts[lines], newlines[lines])
        return FrameCandidates(starts, ends, good, rest)

    def reset(self) -> None:
        """Forget half a line, and distrust the next."""
        super().reset()
        self._whole = self._checked
        self._seq.link_broken()
        self._clock.link_broken()

    def decode(self, data: Bytes, found: FrameScan, t_host: Array) -> Block | None:
        """Make samples of well-formed lines."""
        lines = ~self._passed(data, found.starts)
        if not lines.any():
            return None
        starts, ends = found.starts[lines], found.ends[lines]
        if self._map:
            body, stop = self._bodies(data, starts, ends - 1)
            read = map(self._map.values, _texts(data, body, stop))
            values = np.array(list(read), dtype=float)
        else:
            values = self._numbers(data, starts, ends)
        fine = ~np.isinf(values).any(axis=1)
        if "t" in self._names:
            fine &= ~np.isnan(values[:, self._names.index("t")])
        self.health.bad += int(np.count_nonzero(~fine))
        return self._block(values[fine], t_host[lines][fine]) if fine.any() else None

    def _ours(self, data: Bytes, starts: Index) -> Mask:
        """Lines that begin with the prefix, (m,)."""
        n = len(self._prefix)
        if not n:
            return np.ones(len(starts), dtype=bool)
        padded = np.concatenate([data, np.zeros(n + 1, np.uint8)])
        begin = np.lib.stride_tricks.sliding_window_view(padded, n)[
            starts + DOLLAR[data[starts]]
        ]
        ours: Mask = (begin == self._prefix).all(axis=1)
        return ours

    def _passed(self, data: Bytes, starts: Index) -> Mask:
        """Lines that are none of ours and no fault, (m,)."""
        first = data[starts]
        if len(self._prefix):
            return ~self._ours(data, starts) & (LETTERS | REMARKS | DOLLAR)[first]
        if self._names[0] in KNOWN_COLUMNS and not self._map:
            return (LETTERS | REMARKS)[first]
        return REMARKS[first]

    def _well_formed(self, data: Bytes, starts: Index, newlines: Index) -> Mask:
        """Lines with the right beginning, end and number of fields, (m,)."""
        body, stop = self._bodies(data, starts, newlines)
        good: Mask = self._ours(data, starts) & (newlines - starts < LONGEST)
        if self._checked:
            good &= stop > starts
            stop = np.maximum(stop, starts)
            high, low = (data.take(stop + i, mode="clip") for i in (1, 2))
            good &= (data[stop] == STAR) & (
                HEX[high] * 16 + HEX[low] == _xor(data, starts, stop)
            )
        good &= _between(STRANGE[data], body, stop) == 0
        if self._map:
            read = map(self._map.values, _texts(data, body[good], stop[good]))
            good[good] = [values is not None for values in read]
        else:
            good &= self._fields(data, body, stop) == len(self._names)
        return good

    def _bodies(
        self, data: Bytes, starts: Index, newlines: Index
    ) -> tuple[Index, Index]:
        """Where the fields of lines begin and end, (m,) each."""
        stop = newlines - (data[newlines - 1] == CR)
        body = starts + DOLLAR[data[starts]] + len(self._prefix)
        return body, stop - CHECKSUM_LENGTH * self._checked

    def _fields(self, data: Bytes, starts: Index, stops: Index) -> Index:
        """Count the fields between, (m,)."""
        if self._separator != SPACE:
            return _between(data == self._separator, starts, stops) + 1
        blank = (data == SPACE) | (data == TAB)
        return _between(~blank & np.append(True, blank[:-1]), starts, stops)

    def _numbers(self, data: Bytes, starts: Index, ends: Index) -> Array:
        """Fields of well-formed lines, (m, columns); inf in a line that holds none."""
        first = int(starts[0])
        text = data[first : ends[-1]].copy()
        starts, ends = starts - first, ends - first
        text[ends - 1] = self._separator
        tail = ends - 1 - (text[ends - 2] == CR)
        text[tail[tail < ends - 1]] = SPACE
        for i in range(1, 1 + CHECKSUM_LENGTH * self._checked):
            text[tail - i] = SPACE
        head = starts + DOLLAR[text[starts]]
        text[starts[DOLLAR[text[starts]]]] = SPACE
        for i in range(len(self._prefix)):
            text[head + i] = SPACE
        if np.any(starts[1:] != ends[:-1]):
            keep = np.zeros(len(text) + 1, dtype=np.int8)
            np.add.at(keep, starts, 1)
            np.add.at(keep, ends, -1)
            text = text[np.cumsum(keep[:-1], dtype=np.int8) > 0]
        return self._parse(text.tobytes().decode("latin-1"), len(starts))

    def _parse(self, text: str, n: int) -> Array:
        fields = (
            text.split()
            if self._separator == SPACE
            else text.split(chr(self._separator))[:-1]
        )
        columns = len(self._names)
        values = np.full((n, columns), np.nan)
        used = [i for i, name in enumerate(self._names) if name in KNOWN_COLUMNS]
        try:
            if "_" in text:
                raise ValueError
            if len(used) == columns:
                return np.array(list(map(float, fields))).reshape(n, columns)
            for i in used:
                values[:, i] = list(map(float, fields[i::columns]))
        except ValueError:
            for i in used:
                values[:, i] = [_number(field) for field in fields[i::columns]]
        return values

    def _block(self, values: Array, t_host: Array) -> Block | None:
        column = {name: values[:, i] for i, name in enumerate(self._names)}
        unknown = np.full(len(values), np.nan)
        seq = column.get("seq", unknown)
        stamps = column.get("t", unknown) * self._t_unit
        six = np.column_stack([column.get(name, unknown) for name in CHANNELS])
        temperature = column.get("temperature", unknown)
        if self._resolution and "t" in self._names:
            if coarse := self._resolution.found(stamps, six):
                self._clock.coarsen(coarse)
                self._resolution = None
        which = np.arange(len(values))
        raw = RawSamples(which, six * self._scale, temperature, stamps, seq)
        return self._timed(self._clock, raw, t_host, self._seq.steps(seq))


def _columns(options: Options) -> tuple[list[str], ChannelMap | None]:
    """Names of the columns, of lines with names those of the channels of the map."""
    named = options.text("map")
    if not named:
        return options.text("columns", DEFAULT).split(","), None
    if options.text("columns"):
        raise InputError("columns and map: give the one that is right for the lines")
    wanted = ChannelMap(named, KNOWN_COLUMNS)
    return wanted.channels, wanted


def _texts(data: Bytes, starts: Index, stops: Index) -> list[str]:
    """The text of each stretch."""
    pairs = zip(starts, stops, strict=True)
    return [data[a:b].tobytes().decode("latin-1") for a, b in pairs]


def _separator(options: Options) -> int:
    """Character code of option ``separator``."""
    given = options.text("separator", ",")
    mark = SEPARATORS.get(given, given)
    if len(mark) != 1 or mark.isalnum() or mark in "+-.*$\r\n":
        raise InputError(
            f"separator={given} is none: give one character, or comma, semicolon, tab "
            "or space"
        )
    return ord(mark)


def _last_dollar(data: Bytes, starts: Index, newlines: Index) -> Index:
    """Begin each line at its last $: before it may stand the rest of another, (m,)."""
    at = np.append(-1, np.flatnonzero(data == ord("$")))
    begin: Index = np.maximum(starts, at[np.searchsorted(at, newlines) - 1])
    return begin


def _between(marks: Mask, starts: Index, stops: Index) -> Index:
    """Count the marks in each stretch, (m,)."""
    at = np.flatnonzero(marks)
    counts: Index = np.searchsorted(at, stops) - np.searchsorted(at, starts)
    return counts


def _xor(data: Bytes, starts: Index, stops: Index) -> Index:
    """Exclusive or of each stretch, a leading $ or ! left out, (m,)."""
    if not len(starts):
        return np.empty(0, np.int64)
    begin = starts + DOLLAR[data[starts]]
    empty = stops <= begin
    cuts = np.column_stack([begin, np.maximum(stops, begin)]).ravel()
    total = np.bitwise_xor.reduceat(data, np.minimum(cuts, len(data) - 1))[::2]
    return np.where(empty, -1, total)


def _number(field: str) -> float:
    """Read a number; inf if it is none, so that no number is taken for it."""
    return float(field) if NUMBER.fullmatch(field) else float("inf")
