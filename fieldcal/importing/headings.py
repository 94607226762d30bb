"""Headings of columns that state channel and unit.

``ax [m/s^2]``, ``gyro_x (deg/s)``, ``time_us``: a name, and a unit in brackets or
behind a sign that parts words. Taken is only what leaves no choice: each channel is
there once, axes come in threes, and every unit is said, by the name or by the user.
Otherwise the user is offered what to write. Counts are no unit: their scale is missing.
"Linear acceleration" is no channel, for some mean one without gravity by it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from shlex import quote
from typing import NamedTuple

from fieldcal.core.errors import InputError
from fieldcal.importing.recording import ReadOptions

_ACC = r"a|f|acc|accel|accelerometer|acceleration"
_GYR = r"g|w|gyr|gyro|gyroscope|omega|angular[_ ]?(?:velocity|rate)"
_AXIS = r"[_ .]?([xyz])"

NAMES = (
    (re.compile(rf"(?:{_ACC}){_AXIS}"), "a"),
    (re.compile(rf"(?:{_GYR}){_AXIS}"), "g"),
    (re.compile("t|time|timestamp"), "t"),
    (re.compile("temp|temperature"), "temperature"),
    (re.compile("seq|sequence"), "seq"),
    (re.compile("t_host"), "t_host"),
)
"""What a channel may be called."""

SPELLINGS = {
    "m/s^2": ("m/s^2", "m/s2", "m/s²", "m/s/s", "m/s**2", "mps2", "m s-2"),
    "mg": ("mg",),
    "g": ("g",),
    "deg/s": ("deg/s", "°/s", "dps", "degps", "deg s-1"),
    "mrad/s": ("mrad/s", "mradps"),
    "rad/s": ("rad/s", "radps", "rad s-1"),
    "s": ("s", "sec", "seconds"),
    "ms": ("ms",),
    "us": ("us", "µs", "μs"),
    "ns": ("ns",),
    "deg C": ("c", "°c", "degc", "deg c"),
}
"""How each unit is written."""

UNITS = {
    "a": ("m/s^2", "g", "mg"),
    "g": ("rad/s", "deg/s", "mrad/s"),
    "t": ("s", "ms", "us", "ns"),
    "temperature": ("deg C",),
    "seq": (),
    "t_host": (),
}
"""Units that a kind of channel may have."""

_BRACKETS = re.compile(r"(.*?)\s*[\[(](.*)[\])]")
_WRITTEN = {text: unit for unit, texts in SPELLINGS.items() for text in texts}


class Column(NamedTuple):
    """A column of a file.

    Attributes
    ----------
    place : what ``--columns`` calls it: a name, or nothing where columns have none
    name : what stands over it
    unit : what the file says of it elsewhere, or nothing

    """

    place: str
    name: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class HeadingMatch:
    """What the names of some columns say.

    Attributes
    ----------
    columns : as ``--columns`` names them, all
    units : said by the names, by kind of channel; None where they differ

    """

    columns: tuple[str, ...]
    units: Mapping[str, str | None]

    def taken(self, wanted: ReadOptions) -> ReadOptions | None:
        """Return what the user says, with what the names say; None if units lack."""
        given = {"a": wanted.acc_unit, "g": wanted.gyr_unit, "t": wanted.time_unit}
        units = {k: given.get(k) or unit for k, unit in self.units.items()}
        if not all(units.values()):
            return None
        return replace(
            wanted,
            columns=self.columns,
            acc_unit=units.get("a") or "",
            gyr_unit=units.get("g") or "",
            time_unit=units.get("t") or "",
        )

    def offer(self, wanted: ReadOptions) -> str:
        """Write the options that the user may give."""
        text = f"--columns {quote(','.join(self.columns))}"
        if "t" not in self.units and not wanted.rate_hz:
            text += " --rate HZ"
        for kind, (option, given) in {
            "a": ("--acc-unit", wanted.acc_unit),
            "g": ("--gyr-unit", wanted.gyr_unit),
            "t": ("--time-unit", wanted.time_unit),
        }.items():
            if kind in self.units:
                unit = given or self.units[kind] or UNITS[kind][0]
                text += f" {option} {quote(unit)}"
        return text


def read(columns: Sequence[Column], skip: str = "") -> HeadingMatch | None:
    """Channels and units from headings; None if they are not those of one IMU.

    Parameters
    ----------
    columns : in the order of the file
    skip : what stands for one that is not wanted; where nothing does, it is left out

    """
    found: list[str] = []
    units: dict[str, str | None] = {}
    for column in columns:
        kind, axis, unit = _channel(column)
        channel = kind + axis
        if not channel or "," in column.place:
            found += [skip] if skip else []
            continue
        found.append(f"{channel}={column.place}" if column.place else channel)
        if UNITS[kind]:
            units[kind] = unit if units.get(kind, unit) == unit else None
    known = [name.partition("=")[0] for name in found]
    named = [name for name in known if name != skip]
    axes = [{f"{kind}{axis}" for axis in "xyz"} for kind in "ag"]
    whole = [triad for triad in axes if triad <= set(named)]
    some = [triad for triad in axes if triad & set(named)]
    if len(set(named)) < len(named) or not whole or whole != some:
        return None
    return HeadingMatch(tuple(found), units)


def _channel(column: Column) -> tuple[str, str, str | None]:
    """Kind, axis and unit of a column; "" for no kind, None where no unit is said."""
    name = column.name.strip().strip('"').strip().lower()
    bracketed = _BRACKETS.fullmatch(name)
    if bracketed:
        ways = [(bracketed.group(1), bracketed.group(2))]
    else:
        cuts = [cut.span() for cut in re.finditer("[_ ]", name)]
        ways = [(name, column.unit)]
        ways += [(name[:a], name[b:].replace("_", "/")) for a, b in cuts]
    for bare, text in ways:
        unit = _WRITTEN.get(text.strip().lower())
        for pattern, kind in NAMES:
            matched = pattern.fullmatch(bare)
            fits = unit in UNITS[kind] if unit else bracketed or bare == name
            if matched and fits:
                axis = matched.group(1) if matched.groups() else ""
                return kind, axis, unit
    return "", "", None


def resolve_headings(
    path: object, wanted: ReadOptions, found: HeadingMatch | None, else_say: str
) -> tuple[ReadOptions, str]:
    """Options from the headings, and a sentence about them.

    Raises
    ------
    InputError
        If they do not say all; `else_say` is for names that say nothing.

    """
    if found is None:
        raise InputError(else_say)
    if taken := found.taken(wanted):
        return taken, f"taken from the names of its columns: {found.offer(taken)}"
    raise InputError(
        f"{path}: the names of its columns do not say the units: give"
        f" {found.offer(wanted)}, with its units in place of these"
    )
