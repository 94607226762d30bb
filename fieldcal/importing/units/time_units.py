"""Units that the times of a file may be in.

A logger writes 1 to 8000 samples a second, which tells s, ms, us, ns and the days of a
spreadsheet apart. Where the file says the rate, that tells its ticks.
"""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import IMPOSSIBLE_RATE_HZ, Array
from fieldcal.importing.read_options import TIME_UNITS, seconds_in
from fieldcal.importing.units.scales import MIN_ROWS_ALONE, rounded_text
from fieldcal.importing.units.slow_times import turns_at_once
from fieldcal.importing.units.tick_answers import written_tick

RATES_HZ = (0.9, 8000.0)
"""What a logger of an IMU writes in a second: of 1 Hz, a clock shows a little less."""

STATED_HZ = 0.2
"""Rate of times in a stated unit below which it is asked about, Hz: logs from 0.2 kHz
down read less where ms are called s."""

SLOW_HZ = 0.02
"""Slowest rate of a log that is not asked about where something tells that it is one,
Hz."""

SLOWEST_HZ = 1e-3
"""Slowest rate of what anyone calls a recording, Hz: a reading in a quarter of an
hour."""

BRIEF_HZ = 1000.0
"""Rate beyond which a log of less than `MIN_RECORDING_S` may be one in min."""

MIN_RECORDING_S = 5.0
"""Shortest recording, s, where another unit of time makes it longer."""

TIME_SIZES = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9, "d": 1 / 86400}

TICKED = "100ns"
"""Unit in which Windows and .NET count."""

EPOCHS = (11644473600.0, 62135596800.0)
"""Time from where they count, 1601 and the year 1, to 1970, s."""

UNIX = (1e9, 4e9)
"""Times of day since 1970, s: 2001 to 2096."""


def possible_time_units(t: Array, began: float = 0.0) -> list[str]:
    """Possible units of the times (n,) of a file, which count from `began`."""
    t = t[np.isfinite(t)]
    steps = np.diff(t)
    steps = steps[steps > 0]
    if not len(steps):
        return []
    last = float(t[-1]) + began
    day = [u for u, n in TIME_SIZES.items() if UNIX[0] <= last / n < UNIX[1]]
    if len(steps) < MIN_ROWS_ALONE:
        # too few for a rate; a day that s would put beyond all is one all the same
        return [u for u in day if TIME_SIZES[u] > TIME_SIZES["s"]]
    step = float(np.median(steps))
    low, high = RATES_HZ
    usual = [u for u, n in TIME_SIZES.items() if low <= n / step <= high]
    if both := [u for u in usual if u in day]:
        return both
    if slow := [u for u in day if SLOW_HZ <= TIME_SIZES[u] / step < low]:
        # of a slow log, the time of day tells as much as a usual rate
        return slow + usual
    span = float(steps.sum())
    return [u for u in usual if span / TIME_SIZES[u] >= MIN_RECORDING_S] or usual


def assumed_time_unit(
    name: str, t: Array, acc: Array | None = None, began: float = 0.0
) -> tuple[str, str]:
    """Unit taken for the times (n,) of a recording, and why; "" where it is s.

    Forces (n, 3) tell a slow log in s from a fast one in ms. Where times count from
    their first row, its own, `began`, may be a day.

    Raises
    ------
    InputError
        With a question and its answers, where several would do.

    """
    fits, step = possible_time_units(t, began), _step(t)
    finer = [u for u in fits if u != "s"]
    if len(finer) == 1 and step and SLOW_HZ <= 1 / step < RATES_HZ[0]:
        size = TIME_UNITS[finer[0]]
        if acc is not None and turns_at_once(acc, size * step):
            why = f"in {finer[0]} it would be turned faster than anything is"
            return "s", f"s, which makes {1 / step:.4g} Hz: {why}"
        brief = size * float(np.nanmax(t) - np.nanmin(t)) < MIN_RECORDING_S
        brief = brief and 1 / step >= STATED_HZ
        fits = ["s", *finer] if brief else fits
    if len(fits) > 1:
        rates = (f"{1 / (TIME_UNITS[u] * step):.4g} Hz in {u}" for u in fits)
        raise InputError(
            f"{name}: its times may be {' or '.join(rates)}: add"
            f" {' or '.join(f'--time-unit {u}' for u in fits)}"
        )
    if not fits and step:
        _refuse_impossible_times(name, t, step)
        _ask_about_fast_times(name, step)
    if not fits or fits == ["s"]:
        if step and 1 / step > BRIEF_HZ and _span(t) < MIN_RECORDING_S:
            _ask_about_brief_times(name, step, _span(t))
        return "", ""
    rate = 1 / (TIME_UNITS[fits[0]] * step) if step else np.nan
    return fits[0], f"{fits[0]}, which makes {rate:.4g} Hz"


def check_stated_times(name: str, unit: str, t: Array) -> None:
    """Ask about the unit of times (n,), s, that names of columns state.

    Raises
    ------
    InputError
        If they make far less than any log has, or more, and in another unit what logs
        have.

    """
    step, size = _step(t), seconds_in(unit)
    if not step or STATED_HZ <= 1 / step <= RATES_HZ[1]:
        return
    finer = 1 / step < STATED_HZ
    fits = [u for u in possible_time_units(t / size)
            if u != "d" and (TIME_UNITS[u] < size if finer else TIME_UNITS[u] > size)
            ]  # fmt: skip
    if fits:
        rate = 1 / (step / size * TIME_UNITS[fits[0]])
        raise InputError(
            f"{name}: the names of its columns say that times are in {unit}, which"
            f" makes {1 / step:.2g} Hz, and in {fits[0]} it is {rate:.4g} Hz: add"
            f" --time-unit {fits[0]} or --time-unit {unit}, if it is so"
        )


def _refuse_impossible_times(name: str, t: Array, step: float) -> None:
    """Refuse times (n,) of which no unit makes the rate of a sensor.

    Raises
    ------
    InputError
        Naming file, column and remedy.

    """
    fastest = max(n / step for n in TIME_SIZES.values())
    if fastest >= RATES_HZ[0] and 1 / step <= IMPOSSIBLE_RATE_HZ:
        return
    known = t[np.isfinite(t)]
    raise InputError(
        f"{name}: column t: its numbers, {known[0]:.10g} to {known[-1]:.10g}, make"
        f" {1 / step:.2g} Hz in s, and in no unit a rate that a recording has: name the"
        " column of the times with --columns, or skip this one with _ and give --rate"
    )


def _ask_about_fast_times(name: str, step: float) -> None:
    """Ask about times, a `step` in s apart, that make more than any IMU writes.

    Raises
    ------
    InputError
        With the rates in longer units, of which a logger writes none as a rule.

    """
    if 1 / step <= RATES_HZ[1]:
        return
    rates = {u: 1 / (TIME_UNITS[u] * step) for u in ("min", "h", "d")}
    longer = [
        f"--time-unit {u} ({rounded_text(rate)} Hz)" for u, rate in rates.items()
        if SLOW_HZ <= rate <= RATES_HZ[1]
    ]  # fmt: skip
    raise InputError(
        f"{name}: column t: its times make {rounded_text(1 / step)} Hz in s, more than"
        " an IMU writes: a program that runs faster than its sensor may have written"
        f" them. Add {' or '.join(['--time-unit s', *longer])}, as it is, or skip the"
        " column with _ and give --rate"
    )


def _ask_about_brief_times(name: str, step: float, span: float) -> None:
    """Ask about times, a `step` in s apart, of fast rows that end at once.

    Raises
    ------
    InputError
        With the rates in s and in min.

    """
    rate = rounded_text(1 / (TIME_UNITS["min"] * step))
    raise InputError(
        f"{name}: column t: its times make {rounded_text(1 / step)} Hz for"
        f" {rounded_text(span)} s in s, and {rate} Hz in min: add --time-unit s or"
        " --time-unit min"
    )


def _span(t: Array) -> float:
    """What lies between the first and the last of times (n,)."""
    known = t[np.isfinite(t)]
    return float(known.max() - known.min()) if len(known) else 0.0


def counts_from_long_ago(t: Array) -> bool:
    """Whether times (n,) count 100 ns from 1601 or the year 1, and are today's.

    >>> counts_from_long_ago(np.array([638503500000000000.0]))
    True
    """
    known = t[np.isfinite(t)]
    since = float(np.median(known)) * TIME_UNITS[TICKED] if len(known) else 0.0
    return any(UNIX[0] <= since - epoch < UNIX[1] for epoch in EPOCHS)


def usual_step(t: Array) -> float:
    """Usual distance of times (n,), s, if one unit alone fits them; else 0."""
    fits = possible_time_units(t)
    return _step(t) * TIME_UNITS[fits[0]] if len(fits) == 1 else 0.0


TICKS = ("0.1ms", "us")
"""Units of what is called ``SampleTimeFine``, by the device."""

TICKED_HZ = (4.0, 2000.0)
"""Rates of the devices that count them: of two units, one alone is within."""

ABOUT = float(np.log(3.0))
"""Tolerance of the logarithm of a stated rate, which a device does not keep exactly."""

RATE_TOLERANCE = 0.1
"""Part by which a rate that is said and that of the times differ."""


def time_unit_of_rate(t: Array, rate_hz: float) -> str:
    """Unit in which times (n,) come at a rate; nothing if in none.

    >>> time_unit_of_rate(np.arange(100) * 100.0, 100.0)
    '0.1ms'
    """
    step = _step(t)
    near = [u for u, size in TIME_UNITS.items()
            if step
            and abs(np.log(rate_hz * step * size)) < RATE_TOLERANCE]  # fmt: skip
    return near[0] if near else ""


def time_unit_near_rate(t: Array, rate_hz: float) -> tuple[str, float]:
    """Unit in which times (n,) come about at a rate, and the rate they make.

    "" if in none within a factor of three, or of unusual ones within a tenth.

    >>> time_unit_near_rate(np.arange(100) * 13.0, 100.0)[0]
    'ms'
    """
    step = _step(t)
    units = {*TIME_SIZES, time_unit_of_rate(t, rate_hz)} - {""}
    rates = {u: 1 / (step * TIME_UNITS[u]) for u in units if step}
    away = {u: abs(np.log(rate / rate_hz)) for u, rate in rates.items()}
    unit = min(away, key=away.__getitem__, default="")
    return (unit, rates[unit]) if unit and away[unit] < ABOUT else ("", np.nan)


def tick_at_rate(t: Array, rate_hz: float) -> str:
    """So many of a unit as the times (n,) count, if they come at a rate.

    "" of times that do not grow.

    >>> tick_at_rate(np.arange(100) * 320.0, 100.0)
    '31.25us'
    """
    if not (step := _step(t)):
        return ""
    return written_tick(1 / (rate_hz * step), 6)


def time_unit_of_ticks(t: Array) -> str:
    """Unit of ticks (n,) that make a rate that loggers have; nothing if none does."""
    low, high = TICKED_HZ
    step = _step(t)
    usual = [u for u in TICKS if step and low <= 1 / (step * TIME_UNITS[u]) <= high]
    return usual[0] if len(usual) == 1 else ""


def _step(t: Array) -> float:
    """Usual distance of times that differ; 0 of none."""
    steps = np.diff(t[np.isfinite(t)])
    steps = steps[steps > 0]
    return float(np.median(steps)) if len(steps) else 0.0


def recording_date(stamps: Iterable[float], now: float) -> str | None:
    """Time of a recording by the stamps of its first sample, ISO 8601 in UTC.

    None if no stamp counts from 1970. A later time than the present is that of a clock
    that was never set.

    Parameters
    ----------
    stamps : of the first sample by several clocks, s; nan where there is none
    now : the present time since 1970, s

    >>> recording_date([12.5, 1714564800.5], now=1.8e9), recording_date([12.5], 1.8e9)
    ('2024-05-01T12:00:00+00:00', None)
    """
    for stamp in stamps:
        if UNIX[0] <= stamp <= min(now, UNIX[1]):
            return datetime.fromtimestamp(stamp, UTC).isoformat(timespec="seconds")
    return None
