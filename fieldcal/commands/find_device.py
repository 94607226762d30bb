"""Finds the device for a run without --device: the only one that answers."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from fieldcal.core.errors import InputError, Stopped

if TYPE_CHECKING:
    from fieldcal.core.samples import Block
    from fieldcal.drivers.driver import Driver
    from fieldcal.drivers.probe import DetectedDevice

LISTEN_S = 1.0
"""How long each port is listened to at each baud rate, s."""

FIRST_S = 1.5
"""Length of the samples that show which axis is up, s of device time."""

TURN_S = 20.0
"""Time to turn the device by hand, s of device time."""

DEFAULT_GRAVITY = 9.81
"""Gravity if the site is not stated, m/s^2: right to half a percent."""

TEXT_FORMAT = "format=text"
"""Part of the address of a text format, whose rates may be in rad/s or deg/s."""


def find_device(args: argparse.Namespace, mounted: bool = False) -> None:
    """Find the only device that answers, and set it in the options.

    How it is mounted is set as well, unless an option or the plan (`mounted`) says so.

    Raises
    ------
    InputError
        If none answers, or several do, also on one port.
    Stopped
        If the user declines the device.

    """
    from fieldcal.run.introduction import (
        PLAIN_MOUNTING,
        introduce_device,
        rate_unit_from_turn,
    )
    from fieldcal.session.mixed_devices import GIVE_EACH_A_PORT

    found = _only_answering_device()
    if found.mixed:
        raise InputError(f"{found.port}: {found.mixed}: {GIVE_EACH_A_PORT}")
    url = found.url
    gravity = args.gravity or DEFAULT_GRAVITY
    with _open_device(url) as driver:
        first, stated = _first_samples(driver), bool(driver.notes.get("installed"))
        known = introduce_device(first, gravity, stated)
        asks = not args.headless and sys.stdin.isatty()
        if asks and TEXT_FORMAT in url and "gx" in url and "gyr_unit" not in url:
            _print_line("turn the device by hand by 45° or more, and put it back ...")
            unit = rate_unit_from_turn(driver.blocks(), gravity, TURN_S)
            url += f"&gyr_unit={unit}" if unit else ""
    line = f'--device "{url}"'
    mounted = mounted or bool(args.mounting)
    if known.up and not mounted and known.mounting != PLAIN_MOUNTING:
        args.mounting = ",".join(known.mounting)
        line += f" --mounting={args.mounting}"
    _print_line(f"{found.says.partition(';')[0]}; {known.summary}")
    _print_line(f"the next time: {line}")
    if asks:
        _ask_to_take_it()
    args.device = url


def _ask_to_take_it() -> None:
    """Ask whether the device is the right one, until the answer is clear.

    What was typed before the question is no answer to it.

    Raises
    ------
    Stopped
        If it is not, or if nobody can answer any more.

    """
    from fieldcal.run.operator.keyboard import forget_typed_lines

    forget_typed_lines()
    while True:
        _print_line("Enter takes it, q ends: ", end="")
        line = sys.stdin.readline()
        answer = line.strip().lower()
        if not line or answer in ("q", "quit", "n", "no"):
            raise Stopped("stopped by the operator")
        if answer in ("", "y", "yes"):
            return


def _only_answering_device() -> DetectedDevice:
    """The device on the only serial port that answers."""
    from fieldcal.commands.ports import serial_ports
    from fieldcal.drivers.probe import probe_port
    from fieldcal.importing.headings.line_names import channels_by_name

    ports = [port["port"] for port in serial_ports()]
    if not ports:
        raise InputError(
            "no serial port is plugged in: plug the device in, name it (--device"
            ' "serial:/dev/ttyUSB0?format=witmotion"), or try without one (--virtual)'
        )
    answers = []
    for port in ports:
        _print_line(f"listening to {port} ...")
        answers.append(probe_port(port, LISTEN_S, meaning=channels_by_name))
    known = [answer for answer in answers if answer.url]
    if len(known) == 1:
        for one in answers:
            if not one.url:  # the device that was meant may be behind this one
                _print_line(f"not taken: {one.port}: {one.says}")
        return known[0]
    if known:
        listed = "; ".join(f'--device "{one.url}"' for one in known)
        raise InputError(f"{len(known)} devices answer, say which: {listed}")
    said = "; ".join(f"{one.port}: {one.says}" for one in answers)
    raise InputError(
        f"no device answers ({said}): name one (--device"
        ' "serial:/dev/ttyUSB0?format=witmotion"), or try without one (--virtual)'
    )


def _open_device(url: str) -> Driver:
    from fieldcal.drivers.driver import open_driver

    return open_driver(url)


def _first_samples(driver: Driver) -> Block:
    """The first seconds of a device."""
    from fieldcal.core.samples import concat

    taken = []
    for block in driver.blocks():
        taken.append(block)
        if block.t[-1] - taken[0].t[0] >= FIRST_S:
            break
    return concat(taken)


def _print_line(text: str, end: str = "\n") -> None:
    sys.stderr.write(text + end)
    sys.stderr.flush()
