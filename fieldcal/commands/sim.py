"""`fieldcal sim`: run a virtual device on a serial, CAN or MAVLink link."""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import json
import math
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.help import EXIT_INTERRUPTED
from fieldcal.core.errors import InputError, disk_says

if TYPE_CHECKING:
    from fieldcal.sim_device.line_faults import LineFaults
    from fieldcal.sim_device.link import Link
    from fieldcal.sim_device.stream import DeviceStream, OrderSource
from fieldcal.commands.sim_profile import (
    add_device_options,
    parse_numbers,
    profile_from_options,
)

HELP = "be a virtual device on a link"

EXAMPLE = """\
  fieldcal sim --serial witmotion
  fieldcal sim --serial "text?separator=semicolon&checksum=xor" --speed 20
  fieldcal sim --can slcan --rate 1000
  fieldcal sim --mavlink "udpin:127.0.0.1:14550?INS_ACCOFFS_X=0.1"
  fieldcal sim --base-tilt=-1,0.5 --with cross_coupling:k12=0.003,k21=-0.002
"""

RARE = (
    *("baud", "port_link", "control", "duration", "steps", "height", "gravity"),
    *("mounting", "turn_time", "angle_offset", "acc_scale", "gyr_scale"),
    *("acc_noise", "gyr_noise", "grade", "latitude", "truth"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    _add_link_options(parser)
    _add_time_options(parser)
    add_device_options(parser)


def _add_link_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the link."""
    add = parser.add_argument_group("link").add_argument
    add(
        "--serial",
        metavar="FORMAT",
        default="witmotion",
        help=f"wire format of the pty: {_format_names()}; with options as in"
        ' "text?separator=tab&columns=t,ax,ay,az" (default: witmotion)',
    )
    add(
        "--baud",
        type=int,
        metavar="BIT/S",
        help="of the pty; at another rate the host reads garbage (default: any rate)",
    )
    add(
        "--can",
        metavar="INTERFACE",
        help="on a CAN bus instead: slcan (an adapter on a pty), or any bus of"
        " python-can with its channel, as in udp_multicast:239.74.163.2",
    )
    add(
        "--mavlink",
        metavar="URL",
        help="as an autopilot, at udpin:HOST:PORT, udpout:HOST:PORT,"
        " tcpin:HOST:PORT or pty, with options as in"
        ' "tcpin:127.0.0.1:5760?autopilot=px4"',
    )
    add("--port-link", type=Path, metavar="PATH", help="symbolic link to the pty")


def _add_time_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of control, speed and duration."""
    add = parser.add_argument_group("time and orders").add_argument
    add(
        "--control",
        type=Path,
        metavar="PATH",
        help="control socket (default: a new one, printed after the port)",
    )
    add(
        "--speed",
        default="1",
        metavar="X",
        help="speed of device time, or max: as fast as it is read (default: 1;"
        " any other value waits for the reader)",
    )
    add("--once", action="store_true", help="end when the reader disconnects")
    add("--duration", type=float, metavar="S", help="end after this device time")
    add(
        "--steps",
        default="22.5,2.5",
        metavar="A,B",
        help="steps of the arrow keys in alpha and beta, deg (default: 22.5,2.5)",
    )


def _format_names() -> str:
    """Names of the wire formats, without importing any."""
    from fieldcal.sim_device.wire import formats

    return ", ".join(formats())


def run(args: argparse.Namespace) -> int:
    """Carry out the command: run until stopped or interrupted."""
    _check_system()
    from fieldcal.commands.signals import interruptible
    from fieldcal.sim_device.control import Control
    from fieldcal.sim_device.device import VirtualDevice
    from fieldcal.sim_device.line_faults import LineFaults
    from fieldcal.sim_device.orders import carry_out
    from fieldcal.sim_device.stream import DeviceStream

    device = VirtualDevice(profile_from_options(args), args.seed)
    speed, duration = _parse_speed(args.speed), _parse_duration(args.duration)
    steps = parse_numbers("--steps", args.steps, 2)
    if args.truth:
        _write_truth(args.truth, device.concealed())
    try:
        with contextlib.ExitStack() as stack:
            stack.enter_context(interruptible())
            faults = LineFaults(args.seed)
            link = _open_link(args, faults, device.rate)
            stack.callback(link.close)
            stream = DeviceStream(
                device, link, faults, speed, duration, args.once, _print_line
            )
            control = Control(lambda order: carry_out(stream, order), args.control)
            stack.callback(control.close)
            _print_line(link.address)
            _print_line(str(control.path))
            keys = stack.enter_context(_steering_keys(stream, (steps[0], steps[1])))
            stream.run(control, *keys)
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    return 0


def _check_system() -> None:
    """Refuse a system without pseudo-terminals or unix sockets."""
    if importlib.util.find_spec("termios") is None or not hasattr(socket, "AF_UNIX"):
        raise InputError(
            "a virtual device needs a system with pseudo-terminals and unix sockets,"
            " which this one lacks: use a device, or replay: a recording"
        )


def _open_link(args: argparse.Namespace, faults: LineFaults, rate: float) -> Link:
    """Open the link of the device."""
    if args.can:
        from fieldcal.sim_device.link_can import open_link

        return open_link(args.can, faults, args.port_link)
    if args.mavlink:
        from fieldcal.sim_device import link_mavlink

        return link_mavlink.open_link(args.mavlink, faults, rate)
    from fieldcal.sim_device.link_serial import SerialLink
    from fieldcal.sim_device.wire import open_wire

    return SerialLink(open_wire(args.serial), faults, args.port_link, args.baud)


def _parse_speed(text: str) -> float:
    if text == "max":
        return math.inf
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not (math.isfinite(speed) and speed > 0):
        raise InputError(f"--speed {text!r} must be a number above 0, or max")
    return speed


def _parse_duration(seconds: float | None) -> float:
    if seconds is None:
        return math.inf
    if not seconds > 0:
        raise InputError(f"--duration {seconds:g} s must be above 0 s")
    return seconds


def _write_truth(path: Path, concealed: dict[str, Any]) -> None:
    try:
        path.write_text(json.dumps(concealed, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {disk_says(error)}") from error


def _print_line(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


@contextlib.contextmanager
def _steering_keys(
    stream: DeviceStream, steps: tuple[float, float]
) -> Iterator[list[OrderSource]]:
    """Yield the arrow keys as a source of orders, if there is a terminal."""
    if not sys.stdin.isatty():
        yield []
        return
    from fieldcal.sim_device.keys import SteeringKeys

    with SteeringKeys(stream, steps, sys.stdin.fileno()) as keys:
        yield [keys]
