"""Numbers in columns that the user has named, as samples."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Array, Block
from fieldcal.core.sentences import join_words
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.times.repeats import NO_VALUES, RepeatFinder
from fieldcal.importing.times.row_times import CLOCK_PARTS, RowTimes
from fieldcal.importing.units.missing_numbers import MissingNumbers
from fieldcal.importing.units.scales import MIN_ROWS
from fieldcal.session.text_files import SAMPLE_COLUMNS

SKIP = "_"
"""Name of a column to skip."""

OTHERS = "_..."
"""Skips all that follow."""

HALF = 2.0**15
"""Numbers of 16 bits from which on the sign is negative."""

SOME = 0.05
"""Share of numbers on either side of zero, where their sign was not read."""

WITHOUT_GRAVITY = ("lx", "ly", "lz")
"""Columns of an acceleration without gravity, where ``ax ay az`` are gravity alone."""

SPANS = {"a": "dv_us", "g": "da_us"}
"""Columns of the time, us, over which velocity and angle were gained in a row."""

LOW_WORDS = tuple(f"low_{channel}" for channel in CHANNELS)
"""Columns of the lower 16 bits of counts of 32."""

KNOWN = (*SAMPLE_COLUMNS, "dt", *CLOCK_PARTS, *WITHOUT_GRAVITY, *SPANS.values(),
         *LOW_WORDS)  # fmt: skip
"""What columns may be called."""


def are_unsigned(values: Array) -> bool:
    """Whether numbers (n, k) are signed 16-bit values that were read as unsigned.

    What is a little below zero reads a little below 65 536, and nothing lies between.
    """
    known = values[np.isfinite(values)]
    if len(known) < MIN_ROWS or known.min() < 0 or known.max() >= 2 * HALF:
        return False
    if known.max() < HALF or (known != np.round(known)).any():
        return False
    low, high = (known < HALF / 2).mean(), (known >= 1.5 * HALF).mean()
    return bool(min(low, high) > SOME and 1 - low - high < SOME / 2)


def to_signed_16_bit(column: Array) -> Array:
    """Convert unsigned 16-bit numbers to signed ones.

    >>> to_signed_16_bit(np.array([1.0, 65535.0])).tolist()
    [1.0, -1.0]
    """
    signed: Array = np.where(column >= HALF, column - 2 * HALF, column)
    return signed


def has_time(names: Iterable[str]) -> bool:
    """Whether columns, also ``t=name``, contain a time or a time step."""
    return any(name.partition("=")[0] in ("t", "dt") for name in names)


THERMOMETER = ("t", "temperature")
"""Columns of a file of a thermometer alone, to be joined with that of an IMU."""


def column_placeholders(many: int) -> str:
    """Example of the columns option for a file with `many` columns.

    >>> column_placeholders(2), column_placeholders(3)
    ('t,temperature', 'ax,ay,az')
    >>> column_placeholders(9), column_placeholders(54)
    ('t,ax,ay,az,gx,gy,gz,_,_', 't,ax,ay,az,gx,gy,gz,_...')
    """
    usual = ["t", *CHANNELS]
    if many == len(THERMOMETER):
        return ",".join(THERMOMETER)
    if many in (len("xyz"), len(CHANNELS)):
        return ",".join(CHANNELS[:many])
    if len("xyz") < many < len(usual):
        return ",".join([*usual[: 1 + len("xyz")], *([SKIP] * (many - 1 - len("xyz")))])
    more = max(0, many - len(usual))
    skipped = [OTHERS] if more > len(usual) else [SKIP] * more
    return ",".join([*usual, *skipped])


def check_columns(wanted: ReadOptions) -> None:
    """Refuse columns that cannot give samples.

    Raises
    ------
    InputError
        Naming the column or unit.

    """
    known = [c.partition("=")[0] for c in wanted.columns]
    for name in known:
        if name not in (*KNOWN, SKIP):
            raise InputError(
                f"column {name!r} is none of: {', '.join(KNOWN)}, _ to skip one"
            )
    named = [c for c in known if c != SKIP]
    if len(set(named)) < len(named):
        raise InputError(f"a column is named twice in {','.join(wanted.columns)}")
    if not {"ax", "gx", "temperature"} & set(named):
        raise InputError("name the columns: neither ax ay az nor gx gy gz is there")
    if 0 < len(forces := [c for c in named if c in ("ax", "ay", "az")]) < len("xyz"):
        raise InputError(
            f"of the accelerometers only {join_words(forces)} is named: the force is"
            " known by three axes alone; name all, or none to use the gyroscopes"
        )
    if not has_time(named) and not wanted.rate_hz:
        raise InputError("no column is t, the time: give the rate, e.g. --rate 100")
    _ = wanted.acc_scale, wanted.gyr_scale, wanted.time_scale, wanted.celsius


class ColumnReader:
    """Converts columns to samples, piece by piece.

    Parameters
    ----------
    wanted : units, and the rate where no column is the time

    """

    def __init__(self, wanted: ReadOptions) -> None:
        self._wanted = wanted
        self._times = RowTimes(wanted)
        self._missing, self._repeats = MissingNumbers(), RepeatFinder()
        self._last = np.nan

    @property
    def says(self) -> list[str]:
        """What the user must know of times and missing values, a sentence each."""
        return [*self._times.says, *self._missing.says]

    def block(self, columns: Mapping[str, Array], n: int) -> Block:
        """Samples of the next n rows; what is not there is unknown."""
        wanted = self._wanted
        columns = self._missing.without(columns)

        def triad(kind: str, scale: float) -> Array:
            there = [(i, columns.get(kind + axis)) for i, axis in enumerate("xyz")]
            whole = all(column is not None for _, column in there)
            # a channel in one piece: all that follows goes through one channel at once
            table = np.empty((3, n)) if whole else np.full((3, n), np.nan)
            for i, column in there:
                if column is not None:
                    signed = (
                        to_signed_16_bit(column) if kind in wanted.unsigned else column
                    )
                    low = columns.get(f"low_{kind}{'xyz'[i]}")
                    signed = signed if low is None else _with_low_word(signed, low)
                    sign = -1.0 if kind + "xyz"[i] in wanted.reversed else 1.0
                    with np.errstate(invalid="ignore"):  # of a nan that signals
                        np.multiply(signed, sign * scale, out=table[i])
            if (span := columns.get(SPANS.get(kind, ""))) is not None:
                table /= np.where(span > 0, 1e-6 * span, np.nan)
            return table.T

        acc = triad("a", wanted.acc_scale)
        if WITHOUT_GRAVITY[0] in columns:
            acc = acc + triad("l", wanted.acc_scale)
        return Block.of(
            self._row_times(columns, n),
            acc,
            triad("g", wanted.gyr_scale),
            _celsius_column(columns.get("temperature"), *wanted.celsius),
            columns.get("seq"),
            columns.get("t_host"),
        )

    def _row_times(self, columns: Mapping[str, Array], n: int) -> Array:
        """Times (n,) of the next rows; one that was written again has the same."""
        if not (self._wanted.written_again and n):
            return self._times.of(columns, n)
        values = [one for name, one in columns.items() if name not in NO_VALUES]
        again = self._repeats.of(values)
        first = np.flatnonzero(~again)
        t = self._times.of({k: one[first] for k, one in columns.items()}, len(first))
        known = np.append(self._last, t)
        self._last = float(known[-1])
        repeated: Array = known[np.cumsum(~again)]
        return repeated


def _with_low_word(high: Array, low: Array) -> Array:
    """Counts with the bits below them, which may have been read with a sign.

    >>> _with_low_word(np.array([-1.0, 5.0]), np.array([32768.0, -16384.0])).tolist()
    [-0.5, 5.75]
    """
    whole: Array = high + np.mod(low, 2 * HALF) / (2 * HALF)
    return whole


def _celsius_column(column: Array | None, size: float, zero: float) -> Array | None:
    """Convert a column to deg C, unless it is in deg C."""
    return column if column is None or (size, zero) == (1, 0) else zero + size * column


def describe_units(wanted: ReadOptions) -> str:
    """Names of the units of the wanted columns, for messages.

    Those that nobody stated are worked out from the samples by an import.
    """
    known = {c.partition("=")[0] for c in wanted.columns}
    says = []
    for channel, unit, lsb in (
        ("ax", wanted.acc_unit, wanted.acc_lsb),
        ("gx", wanted.gyr_unit, wanted.gyr_lsb),
    ):
        if channel in known and not unit:
            says.append("a unit that import works out")
        elif channel in known:
            counts = f"{lsb:g} counts/({unit})" if lsb > 1 else f"{unit} x {lsb:g} s"
            says.append(unit if lsb == 1 else counts)
    return ", ".join(dict.fromkeys(says)) or "deg C"


def unit_notes(wanted: ReadOptions) -> dict[str, object]:
    """Entries about units for the session, and by what steps numbers are rounded."""
    steps = {"acc": wanted.acc_scale, "gyr": wanted.gyr_scale, "cut": True}
    return {
        **({"grain": steps} if wanted.cut else {}),
        "acc_unit": wanted.acc_unit or "m/s^2",
        "acc_lsb": wanted.acc_lsb,
        "acc_zero": list(wanted.acc_zero),
        "gyr_unit": wanted.gyr_unit or "rad/s",
        "gyr_lsb": wanted.gyr_lsb,
        "time_unit": wanted.time_unit or "s",
        "temp_unit": wanted.temp_unit or "degC",
        "temp_lsb": wanted.temp_lsb,
        "temp_zero": wanted.temp_zero,
    }
