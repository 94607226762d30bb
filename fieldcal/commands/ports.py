"""`fieldcal ports`: list the devices that are plugged in."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

EXAMPLE = """\
  fieldcal ports
  fieldcal ports --probe
  fieldcal ports --probe /dev/ttyUSB0
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("port", nargs="*", metavar="PORT", help="only these ports; a pty is possible")
    add(
        "--probe",
        action="store_true",
        help="listen on each port and identify the device",
    )
    add(
        "--seconds",
        type=float,
        default=1.0,
        metavar="S",
        help="listening time at each baud rate (default: 1)",
    )
    add("--baud", type=int, action="append", metavar="N", help="try only this rate")
    add("--json", action="store_true", help="print one JSON object instead of a table")


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    ports = _ports_by_name(args.port) if args.port else serial_ports()
    if args.probe:
        from fieldcal.drivers.probe import probe_port
        from fieldcal.importing.headings.line_names import channels_by_name

        for port in ports:
            sys.stderr.write(f"listening to {port['port']} ...\n")
            found = probe_port(port["port"], args.seconds, args.baud, channels_by_name)
            port["answer"] = found._asdict()
    if args.json:
        sys.stdout.write(json.dumps({"ports": ports}) + "\n")
    elif ports:
        _print_ports(ports, args.probe)
    else:
        sys.stdout.write("no serial port is plugged in\n")
    asked = args.probe and args.port
    return 3 if asked and not all(port["answer"]["url"] for port in ports) else 0


def serial_ports() -> list[dict[str, Any]]:
    """Properties of each serial port of the system."""
    from serial.tools.list_ports import comports

    return [_port_properties(port) for port in sorted(comports())]


def _ports_by_name(names: list[str]) -> list[dict[str, Any]]:
    known = {port["port"]: port for port in serial_ports()}
    return [known.get(name, {"port": name, "what": "", "serial": ""}) for name in names]


def _port_properties(port: Any) -> dict[str, Any]:
    """Properties of a port: device path, description, serial number."""
    usb = f"{port.vid:04x}:{port.pid:04x}" if port.vid is not None else ""
    parts = (port.manufacturer, port.product or port.description, usb)
    what = " ".join(part for part in parts if part and part != "n/a")
    return {"port": port.device, "what": what, "serial": port.serial_number or ""}


def _print_ports(ports: list[dict[str, Any]], probed: bool) -> None:
    from rich.table import Table

    from fieldcal.commands.console import EscapingConsole

    console = EscapingConsole(soft_wrap=True)
    table = Table("port", "what it is", "serial number")
    if probed:
        table.add_column("what it says")
    for port in ports:
        row = [port["port"], port["what"] or "?", port["serial"] or "?"]
        table.add_row(*row, *([port["answer"]["says"]] if probed else []))
    console.print(table)
    for port in ports:
        if probed and port["answer"]["url"]:
            # in quotation marks: a shell ends a command at an &
            console.print(
                f'to use it: --device "{port["answer"]["url"]}"', markup=False
            )
