"""Which signals of a DBC file are the channels of an IMU, and in which units.

Options: ``dbc`` (a file, or ``virtual`` for that of the virtual device), ``map`` as in
``ax=Frame.Signal,ay=…``; without it, signals are taken that are called like the
channels. A signal that only one frame has needs no frame before it; ``seq`` and ``t``
without one are taken from every frame of a sample that has them. ``acc_unit``,
``gyr_unit``, ``t_unit`` and ``temperature_unit`` overrule the units of the file, also
with a factor, as in ``gyr_unit=0.244*deg/s``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Array
from fieldcal.drivers.can_fields import Bytes, Field
from fieldcal.drivers.can_frames import EXTENDED
from fieldcal.drivers.options import Options
from fieldcal.session.units import ACC_UNITS, GYR_UNITS

if TYPE_CHECKING:
    from cantools.database.can import Database, Message, Signal

COLUMNS = (*CHANNELS, "temperature", "t", "seq")

SHIPPED = Path(__file__).parent / "virtual.dbc"

_ACC = {**ACC_UNITS, "m/s2": 1.0, "m/s/s": 1.0, "m/s**2": 1.0}
_GYR = {
    **GYR_UNITS,
    **dict.fromkeys(("°/s", "dps", "deg/sec", "degree/s", "degrees/s"), np.pi / 180),
    **dict.fromkeys(("mdeg/s", "mdps", "m°/s"), np.pi / 180e3),
    "deg/h": np.pi / 648e3,
}
_TIME = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_DEGREES = {"°c": 1.0, "degc": 1.0, "c": 1.0, "deg c": 1.0, "celsius": 1.0, "k": 1.0}

KINDS: Mapping[str, tuple[Mapping[str, float], str]] = {
    "acc": (_ACC, "m/s^2, g, mg"),
    "gyr": (_GYR, "rad/s, mrad/s, deg/s"),
    "t": (_TIME, "s, ms, us, ns"),
    "temperature": (_DEGREES, "degC, K"),
}
"""SI units in one of each unit a quantity may have, and the usual ones."""

KELVIN = 273.15


@dataclass(frozen=True, slots=True)
class Channel:
    """A field and what makes SI units of it: scale * value + offset."""

    field: Field
    scale: float = 1.0
    offset: float = 0.0


@dataclass(slots=True)
class Part:
    """The fields that one kind of frame has.

    Attributes
    ----------
    name : of the frame
    identifier : with `EXTENDED` where it has 29 bits
    selectors : fields and their raw numbers that say which part of it was sent
    channels : by column

    """

    name: str
    identifier: int
    selectors: tuple[tuple[Field, tuple[int, ...]], ...]
    channels: dict[str, Channel] = field(default_factory=dict)

    @property
    def size(self) -> int:
        """Bytes that a frame needs to hold all of it."""
        fields = [channel.field for channel in self.channels.values()]
        return max(f.size for f in [*fields, *(s for s, _ in self.selectors)])

    @property
    def held(self) -> bool:
        """Whether it is only a temperature, which may come less often."""
        return set(self.channels) == {"temperature"}

    def selected(self, data: Bytes) -> Array:
        """Tell which frames (m, 64) carry these fields, (m,)."""
        chosen = np.ones(len(data), dtype=bool)
        for selector, numbers in self.selectors:
            chosen &= np.isin(selector.bits(data), numbers)
        return chosen


def read_map(options: Options) -> list[Part]:
    """Find the frames that make samples, and where their channels are.

    Raises
    ------
    InputError
        If there is no such file or signal, or a unit is unknown.

    """
    name, wanted = options.text("dbc"), options.text("map")
    units = {kind: options.text(f"{kind}_unit") for kind in KINDS}
    if not name:
        raise InputError(
            "can: name the DBC file of the device with dbc=FILE (dbc=virtual is that of"
            " the virtual device)"
        )
    path = SHIPPED if name == "virtual" else Path(name)
    database = load(path)
    found: dict[tuple[int, tuple[object, ...]], Part] = {}
    for column, signals in _chosen(path, database, wanted).items():
        for message, signal in signals:
            selectors = _selectors(message, signal)
            identifier = message.frame_id | EXTENDED * message.is_extended_frame
            part = found.setdefault(
                (identifier, selectors), Part(message.name, identifier, selectors)
            )
            place = f"{path}: signal {message.name}.{signal.name}"
            part.channels[column] = _channel(place, column, signal, units)
    return _merged(list(found.values()))


def _merged(parts: list[Part]) -> list[Part]:
    """Have what every frame carries in each of the parts that only some carry."""
    selected = [part for part in parts if part.selectors]
    always = {part.identifier: part for part in parts if not part.selectors}
    for part in selected:
        if part.identifier in always:
            part.channels.update(always[part.identifier].channels)
    some = {part.identifier for part in selected}
    return [p for p in parts if p.selectors or p.identifier not in some]


def load(path: Path) -> Database:
    """Read a database of CAN messages.

    Raises
    ------
    InputError
        If it cannot be read, or is none.

    """
    from cantools.database import load_file
    from cantools.database.can import Database

    try:
        database = load_file(path, strict=False)
    except OSError as fault:
        raise InputError(f"{path}: cannot be read: {fault.strerror}") from fault
    except Exception as fault:
        # the parsers of its several formats raise what they like
        raise InputError(
            f"{path}: is no DBC file that can be understood; check that it is the"
            " device's own"
        ) from fault
    if not isinstance(database, Database):
        raise InputError(f"{path}: describes no CAN messages; give a DBC file")
    return database


def _chosen(
    path: Path, database: Database, wanted: str
) -> dict[str, list[tuple[Message, Signal]]]:
    """Signals for each column, with their messages."""
    everything = [(m, s) for m in database.messages for s in m.signals]
    if wanted:
        named = _pairs(wanted)
    else:
        called = {s.name.lower(): s.name for _, s in everything}
        named = {column: called[column] for column in COLUMNS if column in called}
    if not set(named) & set(CHANNELS):
        raise InputError(
            f"{path}: say which signals are the channels with map=ax=Frame.Signal,…;"
            f" there are {_listed(everything)}"
        )
    chosen = {c: _find(path, everything, c, text) for c, text in named.items()}
    used = {m.name for c in chosen if c in CHANNELS for m, _ in chosen[c]}
    for column in ("t", "seq"):
        if column in chosen and "." not in named[column]:
            there = [pair for pair in chosen[column] if pair[0].name in used]
            chosen[column] = there or chosen[column]
        used |= {m.name for m, _ in chosen.get(column, [])}
    return chosen


def _pairs(wanted: str) -> dict[str, str]:
    named = {}
    for pair in wanted.split(","):
        column, _, signal = pair.partition("=")
        if column not in COLUMNS or not signal:
            raise InputError(
                f"can: map={pair!r} must be like ax=Frame.Signal, with one of"
                f" {', '.join(COLUMNS)}"
            )
        named[column] = signal
    return named


def _find(
    path: Path, everything: list[tuple[Message, Signal]], column: str, text: str
) -> list[tuple[Message, Signal]]:
    found = [(m, s) for m, s in everything if text in (s.name, f"{m.name}.{s.name}")]
    if not found:
        raise InputError(
            f"{path}: there is no signal {text} for {column}; there are"
            f" {_listed(everything)}"
        )
    if len(found) > 1 and column not in ("t", "seq"):
        raise InputError(
            f"{path}: the signal {text} for {column} is in several frames; write one of"
            f" {_listed(found)}"
        )
    return found


def _listed(signals: Iterable[tuple[Message, Signal]], most: int = 12) -> str:
    names = [f"{message.name}.{signal.name}" for message, signal in signals]
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return (", ".join(names[:most]) or "no signals at all") + more


def _selectors(
    message: Message, signal: Signal
) -> tuple[tuple[Field, tuple[int, ...]], ...]:
    """What must hold for a multiplexed signal to be in a frame."""
    selectors: list[tuple[Field, tuple[int, ...]]] = []
    below = signal
    while below.multiplexer_signal is not None and below.multiplexer_ids:
        numbers = tuple(below.multiplexer_ids)
        below = message.get_signal_by_name(below.multiplexer_signal)
        selectors.append((Field.of(below), numbers))
    return tuple(selectors)


def _channel(
    place: str, column: str, signal: Signal, units: Mapping[str, str]
) -> Channel:
    layout = Field.of(signal)
    kind = column
    if column in CHANNELS:
        kind = "acc" if column in CHANNELS[:3] else "gyr"
    if kind == "seq":
        return Channel(layout)
    known, usual = KINDS[kind]
    written = units[kind] or signal.unit or ""
    factor, _, unit = written.rpartition("*")
    unit = unit.strip().replace("²", "^2").replace("µ", "u")
    at = unit if unit in known else unit.lower()
    try:
        scale = float(factor or 1.0) * known[at]
    except (ValueError, KeyError):
        says = f"has the unit {written!r}" if written else "has no unit"
        raise InputError(
            f"{place} {says}: state it with {kind}_unit={usual.split(',')[0]}"
            f" ({usual}, also with a factor as in 0.5*{usual.split(',')[0]})"
        ) from None
    return Channel(layout, scale, -KELVIN if at == "k" else 0.0)
