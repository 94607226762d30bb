"""The channels that names in the lines of a live device mean, as those of a log do."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence

from fieldcal.drivers.named_guess import NamedChannels
from fieldcal.drivers.protocols.text import KNOWN_COLUMNS, RATE_UNITS, TIME_UNITS
from fieldcal.importing.headings.heading import Column
from fieldcal.importing.headings.headings import match_headings
from fieldcal.session.units import ACC_UNITS

_UNITS: Mapping[str, tuple[str, Container[str]]] = {
    "a": ("acc_unit", ACC_UNITS),
    "g": ("gyr_unit", RATE_UNITS),
    "t": ("t_unit", TIME_UNITS),
    "temperature": ("", {"deg C": 1.0}),
}
"""Option of each kind of channel, "" where it has none, and the units that it takes."""


def channels_by_name(names: Sequence[tuple[str, str]]) -> NamedChannels | None:
    """Channels that names with their units mean; None if they leave a choice.

    Left out is what a live device cannot be read with: a time or temperature in another
    unit. None as well for accelerations or rates in one, or with turned signs.

    >>> channels_by_name([("t_ms", ""), ("aX", "g"), ("aY", "g"), ("aZ", "g")])
    NamedChannels(names={'t': 't_ms', 'ax': 'aX', 'ay': 'aY', 'az': 'aZ'}, \
units={'t_unit': 'ms', 'acc_unit': 'g'})
    """
    found = match_headings([Column(name, name, unit) for name, unit in names])
    if len(found) != 1 or found[0].reversed or found[0].free:
        return None
    pairs = [one.partition("=") for one in found[0].columns]
    names_of = {channel: name for channel, _, name in pairs if channel in KNOWN_COLUMNS}
    units = {}
    for kind, unit in found[0].units.items():
        option, known = _UNITS.get(kind, ("", ()))
        if not unit:
            continue
        if option and unit in known:
            units[option] = unit
        elif unit not in known:
            if kind in "ag":
                return None
            names_of.pop(kind, None)
    return NamedChannels(names_of, units)
