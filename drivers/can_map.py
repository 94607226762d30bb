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
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Array
from fieldcal.drivers.can_fields import Bytes, SignalField
from fieldcal.drivers.can_frames import EXTENDED_FLAG
from fieldcal.drivers.options import Options
from fieldcal.session.units import ACC_UNITS, GYR_UNITS

if TYPE_CHECKING:
    from cantools.database.can import Database, Message, Signal

COLUMNS = (*CHANNELS, "temperature", "t", "seq")

VIRTUAL_DBC = Path(__file__).parent / "virtual.dbc"

_ACC = {**ACC_UNITS, "m/s2": 1.0, "m/s/s": 1.0, "m/s**2": 1.0}
_GYR = {
    **GYR_UNITS,
    **dict.fromkeys(("°/s", "dps", "deg/sec", "degree/s", "degrees/s"), np.pi / 180),
    **dict.fromkeys(("mdeg/s", "mdps", "m°/s"), np.pi / 180e3),
    "deg/h": np.pi / 648e3,
}
_TIME = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_DEGREES = {"°c": 1.0, "degc": 1.0, "c": 1.0, "deg c": 1.0, "celsius": 1.0, "k": 1.0}

UNITS_BY_QUANTITY: Mapping[str, tuple[Mapping[str, float], str]] = {
    "acc": (_ACC, "m/s^2, g, mg"),
    "gyr": (_GYR, "rad/s, mrad/s, deg/s"),
    "t": (_TIME, "s, ms, us, ns"),
    "temperature": (_DEGREES, "degC, K"),
}
"""SI value of each unit of a quantity, and the usual units for error texts."""

KELVIN = 273.15


@dataclass(frozen=True, slots=True)
class SignalChannel:
    """A field and its conversion to SI: scale * value + offset."""

    field: SignalField
    scale: float = 1.0
    offset: float = 0.0


@dataclass(slots=True)
class FramePart:
    """Fields of one kind of frame.

    Attributes
    ----------
    name : of the frame
    identifier : with `EXTENDED_FLAG` where it has 29 bits
    selectors : multiplexer fields, with the raw numbers for which the channels are sent
    channels : by column

    """

    name: str
    identifier: int
    selectors: tuple[tuple[SignalField, tuple[int, ...]], ...]
    channels: dict[str, SignalChannel] = field(default_factory=dict)

    @property
    def size(self) -> int:
        """Least size of a frame that holds all fields, bytes."""
        fields = [channel.field for channel in self.channels.values()]
        return max(f.size for f in [*fields, *(s for s, _ in self.selectors)])

    @property
    def temperature_only(self) -> bool:
        """Whether its only channel is a temperature, which may come less often."""
        return set(self.channels) == {"temperature"}

    def carries(self, data: Bytes) -> Array:
        """Whether each of the frames (m, 64) carries these channels, (m,)."""
        chosen = np.ones(len(data), dtype=bool)
        for selector, numbers in self.selectors:
            chosen &= np.isin(selector.bits(data), numbers)
        return chosen


def read_map(options: Options) -> list[FramePart]:
    """Find the frames that make samples, and where their channels are.

    Raises
    ------
    InputError
        If there is no such file or signal, or a unit is unknown.

    """
    name, wanted = options.text("dbc"), options.text("map")
    units = {kind: options.text(f"{kind}_unit") for kind in UNITS_BY_QUANTITY}
    if not name:
        raise InputError(
            "can: name the DBC file of the device with dbc=FILE (dbc=virtual is that of"
            " the virtual device)"
        )
    path = VIRTUAL_DBC if name == "virtual" else Path(name)
    database = load_database(path)
    found: dict[tuple[int, tuple[object, ...]], FramePart] = {}
    for column, signals in _signals_by_column(path, database, wanted).items():
        for message, signal in signals:
            selectors = _selectors(message, signal)
            identifier = message.frame_id | EXTENDED_FLAG * message.is_extended_frame
            part = found.setdefault(
                (identifier, selectors), FramePart(message.name, identifier, selectors)
            )
            place = f"{path}: signal {message.name}.{signal.name}"
            part.channels[column] = _channel(place, column, signal, units)
    return _spread_common_channels(list(found.values()))


def _spread_common_channels(parts: list[FramePart]) -> list[FramePart]:
    """Copy channels that every frame has to each multiplexed part of that frame."""
    selected = [part for part in parts if part.selectors]
    always = {part.identifier: part for part in parts if not part.selectors}
    for part in selected:
        if part.identifier in always:
            part.channels.update(always[part.identifier].channels)
    some = {part.identifier for part in selected}
    return [p for p in parts if p.selectors or p.identifier not in some]


def load_database(path: Path) -> Database:
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
        # the parsers of the formats raise any exception
        raise InputError(
            f"{path}: is no DBC file that can be understood; check that it is the"
            " device's own"
        ) from fault
    if not isinstance(database, Database):
        raise InputError(f"{path}: describes no CAN messages; give a DBC file")
    return database


def _signals_by_column(
    path: Path, database: Database, wanted: str
) -> dict[str, list[tuple[Message, Signal]]]:
    """Signals for each column, with their messages."""
    everything = [(m, s) for m in database.messages for s in m.signals]
    if wanted:
        named = _parse_map(wanted)
    else:
        called = {s.name.lower(): s.name for _, s in everything}
        named = {column: called[column] for column in COLUMNS if column in called}
    if not set(named) & set(CHANNELS):
        raise InputError(
            f"{path}: say which signals are the channels with map=ax=Frame.Signal,…;"
            f" there are {_signal_list(everything)}"
        )
    chosen = {c: _find_signals(path, everything, c, text) for c, text in named.items()}
    used = {m.name for c in chosen if c in CHANNELS for m, _ in chosen[c]}
    for column in ("t", "seq"):
        if column in chosen and "." not in named[column]:
            there = [pair for pair in chosen[column] if pair[0].name in used]
            chosen[column] = there or chosen[column]
        used |= {m.name for m, _ in chosen.get(column, [])}
    return chosen


def _parse_map(wanted: str) -> dict[str, str]:
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


def _find_signals(
    path: Path, everything: list[tuple[Message, Signal]], column: str, text: str
) -> list[tuple[Message, Signal]]:
    found = [(m, s) for m, s in everything if text in (s.name, f"{m.name}.{s.name}")]
    if not found:
        raise InputError(
            f"{path}: there is no signal {text} for {column}; there are"
            f" {_signal_list(everything)}"
        )
    if len(found) > 1 and column not in ("t", "seq"):
        raise InputError(
            f"{path}: the signal {text} for {column} is in several frames; write one of"
            f" {_signal_list(found)}"
        )
    return found


def _signal_list(signals: Iterable[tuple[Message, Signal]], most: int = 12) -> str:
    names = [f"{message.name}.{signal.name}" for message, signal in signals]
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return (", ".join(names[:most]) or "no signals at all") + more


def _selectors(
    message: Message, signal: Signal
) -> tuple[tuple[SignalField, tuple[int, ...]], ...]:
    """Multiplexer fields and their numbers for which a signal is in a frame."""
    selectors: list[tuple[SignalField, tuple[int, ...]]] = []
    below = signal
    while below.multiplexer_signal is not None and below.multiplexer_ids:
        numbers = tuple(below.multiplexer_ids)
        below = message.get_signal_by_name(below.multiplexer_signal)
        selectors.append((SignalField.of(below), numbers))
    return tuple(selectors)


def _channel(
    place: str, column: str, signal: Signal, units: Mapping[str, str]
) -> SignalChannel:
    layout = SignalField.of(signal)
    kind = column
    if column in CHANNELS:
        kind = "acc" if column in CHANNELS[:3] else "gyr"
    if kind == "seq":
        return SignalChannel(layout)
    known, usual = UNITS_BY_QUANTITY[kind]
    written = units[kind] or signal.unit or ""
    factor, _, unit = written.rpartition("*")
    unit = unit.strip().replace("²", "^2").replace("µ", "u")
    at = unit if unit in known else unit.lower()
    try:
        scale = float(factor or 1.0) * known[at]
        if not (scale and isfinite(scale)):
            raise ValueError
    except (ValueError, KeyError):
        says = f"has the unit {written!r}" if written else "has no unit"
        raise InputError(
            f"{place} {says}: state it with {kind}_unit={usual.split(',')[0]}"
            f" ({usual}, also with a factor as in 0.5*{usual.split(',')[0]})"
        ) from None
    if not layout.scale * scale:
        raise InputError(
            f"{place} has the factor 0, so that it never changes: mend it in the DBC"
        )
    return SignalChannel(layout, scale, -KELVIN if at == "k" else 0.0)
