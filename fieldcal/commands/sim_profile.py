"""The device of `fieldcal sim`: its options, and the profile that they make."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.core.errors import InputError
from fieldcal.core.grade import GRADES

if TYPE_CHECKING:
    from fieldcal.sim_device.profile import Profile


def add_device_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
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


def profile_from_options(args: argparse.Namespace) -> Profile:
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
            values = parse_numbers(f"--{option.replace('_', '-')}", text, 2)
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
        name: text and parse_numbers(f"--{name.replace('_', '-')}", text, 3)
        for name in names
        for text in [getattr(args, name)]
    }


def parse_numbers(option: str, text: str, count: int) -> tuple[float, ...]:
    """Values of an option of several numbers.

    Raises
    ------
    InputError
        If they are not so many, or not finite.

    """
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
