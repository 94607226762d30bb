"""Which channels lines with names hold, from their names and a device that lies still.

What names mean is for the caller to say. A unit of acceleration that no name says is
told by gravity, one of rates by what no gyroscope reads at rest.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple
from urllib.parse import quote

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.drivers.column_guess import (
    LEAST_LINES,
    gravity_unit,
    rate_unit_at_rest,
    time_unit,
)
from fieldcal.drivers.named_lines import NamedValues, read_named_line

LEAST_SHARE = 0.8
"""Share of the lines that have the same names."""


class NamedChannels(NamedTuple):
    """Meaning of names.

    Attributes
    ----------
    names : of the channels t, seq, ax … gz, temperature that are there
    units : options ``acc_unit``, ``gyr_unit``, ``t_unit`` of which the names tell one

    """

    names: Mapping[str, str]
    units: Mapping[str, str]


NameReader = Callable[[Sequence[tuple[str, str]]], NamedChannels | None]
"""From names and their units ("" where there is none) to what they mean; None of names
that leave a choice."""


def guess_named_options(data: bytes, seconds: float, meaning: NameReader) -> str | None:
    """Options of a text format that fit bytes, which came in so many seconds.

    None where the lines have no accelerometers that the names tell, or nothing tells
    their unit.
    """
    lines = [line.strip() for line in data.decode("latin-1").split("\n")[1:-1]]
    lines = [line for line in lines if line]
    read = [said for line in lines if (said := read_named_line(line)) is not None]
    same = _of_same_names(read)
    if len(same) < max(LEAST_LINES, LEAST_SHARE * len(lines)):
        return None
    units = same[0].units
    found = meaning([(name, units.get(name, "")) for name in same[0].values])
    if found is None or not set(CHANNELS[:3]) <= found.names.keys():
        return None
    columns = {
        channel: np.array([said.values[name] for said in same])
        for channel, name in found.names.items()
    }
    told = {**_units_at_rest(columns, seconds), **found.units}
    if not told.get("acc_unit"):
        return None
    pairs = [f"{channel}={quote(name, '[]')}" for channel, name in found.names.items()]
    known = [
        f"{option}={unit}"
        for option, unit in told.items()
        if unit and (option, unit) not in (("t_unit", "s"), ("acc_unit", "m/s^2"))
    ]
    return "&".join(["map=" + ",".join(pairs), *known])


def _of_same_names(read: Sequence[NamedValues]) -> list[NamedValues]:
    """The lines that have the names that most have, in any order."""
    if not read:
        return []
    counted = Counter(frozenset(said.values) for said in read)
    names = counted.most_common(1)[0][0]
    return [said for said in read if said.values.keys() == names]


def _units_at_rest(columns: Mapping[str, Array], seconds: float) -> dict[str, str]:
    """Units by option, "" where nothing tells one."""
    told = {}
    if "t" in columns:
        told["t_unit"] = time_unit(float(np.ptp(columns["t"])), seconds)
    found = gravity_unit(np.column_stack([columns[name] for name in CHANNELS[:3]]))
    told["acc_unit"] = found[1] if found else ""
    if set(CHANNELS) <= columns.keys():
        rates = np.column_stack([columns[name] for name in CHANNELS[3:]])
        told["gyr_unit"] = rate_unit_at_rest(rates)
    return told
