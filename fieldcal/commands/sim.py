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
from fieldcal.core.errors import InputError
from fieldcal.core.grade import GRADES

if TYPE_CHECKING:
    from fieldcal.sim_device.line_faults import LineFaults
    from fieldcal.sim_device.link import Link
    from fieldcal.sim_device.profile import Profile
    from fieldcal.sim_device.stream import DeviceStream, OrderSource

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
    _add_device_options(parser)


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


def _add_device_options(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument_group("device").add_argument
    add("--profile", type=Path, metavar="FILE", help="device file to start from")
    add(
        "--with",
        dest="effects",
        action="append",
        default=[],
        metavar="ID:PARAM=VALUE,…",
        help="add an effect; may be given several times",
    )
    add(
        "--seed",
        type=int,
        default=1,
        metavar="N",
        help="seed of all noise (default: 1)",
    )
    add("--rate", type=float, metavar="HZ", help="samples a second")
    add("--grade", choices=GRADES)
    add("--latitude", type=float, metavar="DEG")
    add("--height", type=float, metavar="M", help="above the ellipsoid")
    add("--gravity", type=float, metavar="M/S^2", help="replaces the WGS84 value")
    add("--mounting", metavar="X,Y,Z", help="as in +x,-z,+y")
    add("--turn-time", type=float, metavar="S", help="duration of a turn")
    add("--base-tilt", metavar="X,Z", help="of the base, about x and z, deg")
    add("--angle-offset", metavar="A,B", help="zeros of the joints, deg")
    add("--acc-bias", metavar="X,Y,Z", help="m/s^2")
    add("--acc-scale", metavar="X,Y,Z")
    add("--gyr-bias", metavar="X,Y,Z", help="rad/s")
    add("--gyr-scale", metavar="X,Y,Z")
    add("--acc-noise", metavar="X,Y,Z", help="white, of a sample, m/s^2")
    add("--gyr-noise", metavar="X,Y,Z", help="white, of a sample, rad/s")
    add("--truth", type=Path, metavar="FILE", help="write the true parameters as JSON")


def run(args: argparse.Namespace) -> int:
    """Carry out the command: run until stopped or interrupted."""
    _check_system()
    from fieldcal.commands.signals import interruptible
    from fieldcal.sim_device.control import Control
    from fieldcal.sim_device.device import VirtualDevice
    from fieldcal.sim_device.line_faults import LineFaults
    from fieldcal.sim_device.orders import carry_out
    from fieldcal.sim_device.stream import DeviceStream

    device = VirtualDevice(_profile_from_options(args), args.seed)
    speed, duration = _parse_speed(args.speed), _parse_duration(args.duration)
    steps = _parse_numbers("--steps", args.steps, 2)
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


def _profile_from_options(args: argparse.Namespace) -> Profile:
    """Profile of the file, or the default one, changed by the options."""
    from dataclasses import replace

    from fieldcal.sim_device import profile_file
    from fieldcal.sim_device.effect import SimulatedEffect
    from fieldcal.sim_device.profile import Profile
    from fieldcal.sim_device.vocabulary import checked_effect, parse

    # every real device measures the Earth's rate; a device file lists all its effects
    default = Profile(effects=(checked_effect("earth_rate", {}),))
    profile = profile_file.read_profile(args.profile) if args.profile else default
    tables: dict[str, dict[str, Any]] = {
        "device": {"grade": args.grade},
        "sampling": {"rate_hz": args.rate},
        "site": {
            "latitude_deg": args.latitude,
            "height_m": args.height,
            "gravity": args.gravity,
        },
        "frame": {"mounting": args.mounting and tuple(args.mounting.split(","))},
        "motion": {"turn_s": args.turn_time},
        "truth": _triad_options(
            args, ("acc_bias", "acc_scale", "gyr_bias", "gyr_scale")
        ),
        "noise": {
            name.removesuffix("_noise"): value
            for name, value in _triad_options(args, ("acc_noise", "gyr_noise")).items()
        },
    }
    more: list[SimulatedEffect] = []
    for option, id_, names in (
        ("base_tilt", "base_tilt", ("about_x_deg", "about_z_deg")),
        ("angle_offset", "angle_offset", ("alpha0_deg", "beta0_deg")),
    ):
        if text := getattr(args, option):
            values = _parse_numbers(f"--{option.replace('_', '-')}", text, 2)
            more.append(checked_effect(id_, dict(zip(names, values, strict=True))))
    changes: dict[str, Any] = {}
    for table, values_ in tables.items():
        given = {key: value for key, value in values_.items() if value is not None}
        changes[table] = replace(getattr(profile, table), **given)
    effects = (*profile.effects, *more, *map(parse, args.effects))
    return replace(profile, **changes, effects=effects)


def _triad_options(args: argparse.Namespace, names: tuple[str, ...]) -> dict[str, Any]:
    """Values of options of three numbers, None where not given."""
    return {
        name: text and _parse_numbers(f"--{name.replace('_', '-')}", text, 3)
        for name in names
        for text in [getattr(args, name)]
    }


def _parse_numbers(option: str, text: str, count: int) -> tuple[float, ...]:
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count or not all(map(math.isfinite, values)):
        example = ",".join("1.5 0 -2".split()[:count])
        raise InputError(
            f"{option} {text!r} must be {count} numbers, as in {option}={example}"
        )
    return values


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
        raise InputError(f"{path} cannot be written: {error.strerror}") from error


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
