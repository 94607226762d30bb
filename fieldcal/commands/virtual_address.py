"""Address to open a virtual device, from the options it was started with."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from urllib.parse import parse_qsl, urlencode

DEFAULT_HZ = 100.0
"""Rate of a virtual device without --rate."""

WRITER_OPTIONS = ("digits", "time", "numbers")
"""Options of a wire format that only the sender has."""


def driver_address(options: Sequence[str], place: str) -> str:
    """Return the driver's address of a virtual device.

    `options` are those of `fieldcal sim`, `place` is the port or endpoint it printed.

    >>> driver_address(["--can", "slcan"], "/dev/pts/7")
    'can:/dev/pts/7?interface=slcan&dbc=virtual'
    >>> driver_address(["--serial", "vnimu", "--rate", "40"], "/dev/pts/7")
    'serial:/dev/pts/7?format=vnimu&rate=40'
    """
    from fieldcal.commands import sim

    parser = argparse.ArgumentParser()
    sim.add_arguments(parser)
    given = parser.parse_args(options)
    rate = given.rate or DEFAULT_HZ
    if given.mavlink:
        return f"mavlink:{place}?rate={rate:g}"
    if given.can:
        interface = given.can.partition(":")[0]
        return f"can:{place}?interface={interface}&dbc=virtual"
    name, _, query = given.serial.partition("?")
    told = dict(parse_qsl(query))
    timed = name != "vnimu" and told.get("time") != "0"
    if name == "text" and "columns" in told:
        timed = "t" in told["columns"].split(",")
    told = {key: value for key, value in told.items() if key not in WRITER_OPTIONS}
    if not timed:
        told["rate"] = f"{rate:g}"
    return f"serial:{place}?{urlencode({'format': name, **told}, safe=',/^')}"
