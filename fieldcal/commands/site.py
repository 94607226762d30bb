"""Options that describe device and site, for the commands that create a session."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from fieldcal.commands.repeated_option import StoreRepeated
from fieldcal.core.factory import FACTORY_KEYS
from fieldcal.core.grade import GRADES


def add_site_options(parser: argparse.ArgumentParser, several: bool = False) -> None:
    """Declare the options of device, site and frame; `several` for several devices."""
    group = parser.add_argument_group("device and place")
    add = group.add_argument
    add("--name", help="name of the device")
    if several:
        what = "serial number, key of the history; repeat it for each further device"
        add("--serial", action=StoreRepeated, help=what)
    else:
        add("--serial", help="serial number, key of the history")
    add("--lot", metavar="NAME", help="production lot, for fieldcal lot")
    add("--station", metavar="NAME", help="test station, for fieldcal lot")
    add("--operator", metavar="NAME", help="operator, for fieldcal lot")
    add("--grade", choices=GRADES, help="default: tactical")
    add_factory_options(group)
    add(
        "--keeps-gyro-bias",
        action="store_true",
        default=None,
        help="the device subtracts no bias from its gyroscopes at rest",
    )
    add("--latitude", type=float, metavar="DEG", help="of the site, for gravity")
    add("--height", type=float, metavar="M", help="above the ellipsoid, default: 0")
    add("--gravity", type=float, metavar="M/S^2", help="instead of the WGS84 value")
    add(
        "--mounting",
        metavar="X,Y,Z",
        help="procedure axis x, y, z is device axis ... (default: +x,+y,+z; z-up unit:"
        " +x,-z,+y)",
    )


def add_factory_options(parser: argparse._ActionsContainer) -> None:
    """Declare the options of the errors that the factory left in the device."""
    for name, what in (
        ("squareness", "cross-coupling left in the device, 1σ of each coefficient"),
        ("quadratic", "K2 of its accelerometers, 1σ of each, 1/(m/s^2)"),
        ("g_sensitivity", "g-sensitivity of its gyroscopes, 1σ, (rad/s)/(m/s^2)"),
    ):
        option, says = f"--{name.replace('_', '-')}", f"{what} (default: the grade's)"
        parser.add_argument(option, type=float, metavar="X", help=says)


def site_tables(args: argparse.Namespace, name: str) -> dict[str, Any]:
    """Tables of a session.toml from options and defaults; `name` is a default too."""
    tables = {
        "device": {"name": name, "grade": "tactical"},
        "site": {"height_m": 0.0},
        "frame": {"mounting": ["+x", "+y", "+z"]},
    }
    return merge_tables(tables, tables_of_options(args))


def tables_of_options(args: argparse.Namespace) -> dict[str, dict[str, Any]]:
    """Tables of a session.toml with only what the options state."""
    axes = args.mounting and [axis.strip() for axis in args.mounting.split(",")]
    tables = {
        "device": {
            "name": args.name,
            "serial": args.serial,
            "lot": args.lot,
            "grade": args.grade,
            **{name: getattr(args, name) for name in FACTORY_KEYS},
            "keeps_gyro_bias": args.keeps_gyro_bias,
        },
        "site": {
            "station": args.station,
            "operator": args.operator,
            "latitude_deg": args.latitude,
            "height_m": args.height,
            "gravity": args.gravity,
        },
        "frame": {"mounting": axes},
    }
    said = {
        name: {key: value for key, value in table.items() if value is not None}
        for name, table in tables.items()
    }
    return {name: table for name, table in said.items() if table}


def merge_tables(
    tables: Mapping[str, Any], given: Mapping[str, Mapping[str, Any]]
) -> dict[str, Any]:
    """Tables with the keys of `given` replaced; values that are no tables stay."""
    out = dict(tables)
    for name, table in given.items():
        if isinstance(out.get(name, {}), Mapping):
            out[name] = {**out.get(name, {}), **table}
    return out
