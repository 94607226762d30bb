"""The device of a run that names none: the one that answers introduces itself."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from fieldcal.core.errors import InputError, Stopped

if TYPE_CHECKING:
    from fieldcal.core.samples import Block
    from fieldcal.drivers.driver import Driver
    from fieldcal.drivers.probe import DetectedDevice

LISTEN = 1.0
"""How long each port is listened to at each baud rate, s."""

FIRST = 1.5
"""Device time of the samples that tell which way is up, s."""

TURN = 20.0
"""Device time in which a person turns it by hand, s."""

STANDARD = 9.81
"""Gravity where nobody said where this is, m/s^2: good to half a percent."""

OPEN = "format=text"
"""In the address of lines whose rates may be in either unit, unless it says which."""


def introduce(args: argparse.Namespace) -> None:
    """Find the one device that answers, and write it into the options.

    Raises
    ------
    InputError
        If none answers, or several do.
    Stopped
        If the user does not want it.

    """
    from fieldcal.run.introduction import (
        PLAIN_MOUNTING,
        introduce_device,
        rate_unit_from_turn,
    )

    found = _the_one()
    url = found.url
    gravity = args.gravity or STANDARD
    with _opened(url) as driver:
        known = introduce_device(_samples(driver), gravity)
        asks = not args.headless and sys.stdin.isatty()
        if asks and OPEN in url and "gx" in url and "gyr_unit" not in url:
            _tell("turn the device by hand by 45° or more, and put it back ...")
            unit = rate_unit_from_turn(driver.blocks(), gravity, TURN)
            url += f"&gyr_unit={unit}" if unit else ""
    line = f'--device "{url}"'
    if known.up and not args.mounting and known.mounting != PLAIN_MOUNTING:
        args.mounting = ",".join(known.mounting)
        line += f" --mounting={args.mounting}"
    _tell(f"{found.says.partition(';')[0]}; {known.says}")
    _tell(f"the next time: {line}")
    if asks:
        _tell("Enter takes it, q ends: ", end="")
        if sys.stdin.readline().strip().lower().startswith("q"):
            raise Stopped("stopped by the operator")
    args.device = url


def _the_one() -> DetectedDevice:
    """What answers on the only port where anything does."""
    from fieldcal.commands.ports import plugged_in
    from fieldcal.drivers.probe import probe_port

    ports = [port["port"] for port in plugged_in()]
    if not ports:
        raise InputError(
            "no serial port is plugged in: plug the device in, name it (--device"
            ' "serial:/dev/ttyUSB0?format=witmotion"), or try without one (--virtual)'
        )
    answers = []
    for port in ports:
        _tell(f"listening to {port} ...")
        answers.append(probe_port(port, LISTEN))
    known = [answer for answer in answers if answer.url]
    if len(known) == 1:
        for one in answers:
            if not one.url:  # the device that was meant may be behind this one
                _tell(f"not taken: {one.port}: {one.says}")
        return known[0]
    if known:
        listed = "; ".join(f'--device "{one.url}"' for one in known)
        raise InputError(f"{len(known)} devices answer, say which: {listed}")
    said = "; ".join(f"{one.port}: {one.says}" for one in answers)
    raise InputError(
        f"no device answers ({said}): name one (--device"
        ' "serial:/dev/ttyUSB0?format=witmotion"), or try without one (--virtual)'
    )


def _opened(url: str) -> Driver:
    from fieldcal.drivers.driver import open_driver

    return open_driver(url)


def _samples(driver: Driver) -> Block:
    """The first seconds of a device."""
    from fieldcal.core.samples import concat

    taken = []
    for block in driver.blocks():
        taken.append(block)
        if block.t[-1] - taken[0].t[0] >= FIRST:
            break
    return concat(taken)


def _tell(text: str, end: str = "\n") -> None:
    sys.stderr.write(text + end)
    sys.stderr.flush()
