"""Options that describe device and place, for the commands that begin a session."""

from __future__ import annotations

import argparse
from typing import Any


def add_site(parser: argparse.ArgumentParser) -> None:
    """Declare the options of device, site and frame."""
    group = parser.add_argument_group("device and place")
    add = group.add_argument
    add("--name", help="name of the device")
    add("--serial", help="its serial number, the key of its history")
    add("--grade", choices=("tactical", "navigation"), default="tactical")
    add("--latitude", type=float, default=None, metavar="DEG", help="default: 45")
    add("--height", type=float, default=0.0, metavar="M", help="above the ellipsoid")
    add("--gravity", type=float, metavar="M/S^2", help="instead of the WGS84 value")
    add(
        "--mounting",
        default="+x,+y,+z",
        metavar="X,Y,Z",
        help="procedure axis x, y, z is device axis ... (z-up unit: +x,-z,+y)",
    )


def site_tables(args: argparse.Namespace, name: str) -> dict[str, Any]:
    """Tables of a session.toml from the options; `name` where none is given."""
    device = {"name": args.name or name, "grade": args.grade}
    if args.serial:
        device["serial"] = args.serial
    site = {
        "latitude_deg": 45.0 if args.latitude is None else args.latitude,
        "height_m": args.height,
    }
    if args.gravity is not None:
        site["gravity"] = args.gravity
    frame = {"mounting": [axis.strip() for axis in args.mounting.split(",")]}
    return {"device": device, "site": site, "frame": frame}
