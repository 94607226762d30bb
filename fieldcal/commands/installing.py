"""What to install in an autopilot after a recalibration from what it sent.

It sends samples with its own calibration in them, so what is found from them stands on
top of that: see `drivers.mavlink_installed`. Offsets have the error of the bias over
the installed scale, scales that of the scale factor.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.errors import InputError
from fieldcal.session import Session

GROUPS = ("acc_bias", "acc_scale", "gyr_bias")


def installed(session: Session) -> Mapping[str, Any] | None:
    """What the recording says of the calibration its device had; None if nothing."""
    found = None
    for mark in session.marks():
        if mark.get("event") == "device" and mark.get("installed"):
            found = mark["installed"]
    return found


def with_installed(calibration: Calibration, session: Session) -> Calibration:
    """Add what was installed, and what to install now with its ±, or why not."""
    there = installed(session)
    if there is None:
        return calibration
    info = {**calibration.info, "installed": there}
    try:
        info["install"] = _next(calibration, there)
    except InputError as error:
        said = f"nothing to install in the autopilot: {error}"
        warnings = (*calibration.warnings, said)
        return replace(calibration, info=info, warnings=warnings)
    return replace(calibration, info=info)


def lines(calibration: Calibration) -> list[str]:
    """What to install, as an operator types it, with its ± and what it was."""
    from fieldcal.calibration.wording import number

    told = []
    for name, of in calibration.info.get("install", {}).items():
        value, sigma = number(of["value"], of["sigma"])
        was = f"{of['was']:.6g}"
        told.append(f"install {name} = {value} ± {sigma} {of['unit']} (it was {was})")
    return told


def check_same(calibration: Calibration, session: Session) -> None:
    """Refuse to apply a calibration on top of another than it was found on.

    Raises
    ------
    InputError
        Naming the parameter that differs.

    """
    found, there = calibration.info.get("installed"), installed(session)
    if not found or not there:
        return
    before, now = _effective(found), _effective(there)
    for name in sorted(before.keys() & now.keys()):
        if not np.isclose(before[name], now[name], rtol=1e-6, atol=1e-9):
            raise InputError(
                f"{session.folder} was recorded with {name} = {now[name]:.6g} in the"
                f" autopilot, the calibration is on top of {before[name]:.6g}: solve a"
                " session with the same parameters"
            )


def _effective(there: Mapping[str, Any]) -> dict[str, float]:
    """Parameters as they were in the samples."""
    from fieldcal.drivers.mavlink_installed import Installed, identity, names

    known = Installed(there["autopilot"], there["instance"], dict(there["parameters"]))
    of_it = sum(names(known.autopilot, known.instance).values(), start=())
    had = {name: value for name, value in known.values.items() if name in of_it}
    return {**had, **(identity(known) if there["taken_out"] else {})}


def _next(
    calibration: Calibration, there: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    from fieldcal.drivers.mavlink_installed import Installed, names

    lacking = [group for group in GROUPS if group not in calibration.groups]
    if lacking:
        raise InputError(f"{lacking[0]} is not determined by these positions")
    known = Installed(
        there["autopilot"],
        there["instance"],
        dict(there["parameters"]),
        there["taken_out"],
    )
    value, sigma = (_triads(calibration, which) for which in ("values", "sigma"))
    new = known.next(value["acc_bias"], value["acc_scale"], value["gyr_bias"])
    called = names(known.autopilot, known.instance)
    k = np.ones(3) if known.taken_out else known.of("acc_scale")
    errors = {
        "acc_offset": sigma["acc_bias"] / np.abs(k),
        "acc_scale": np.abs(k) * sigma["acc_scale"] / value["acc_scale"] ** 2,
        "gyr_offset": sigma["gyr_bias"],
    }
    units = {"acc_offset": "m/s²", "acc_scale": "1", "gyr_offset": "rad/s"}
    return {
        name: {
            "value": new[name],
            "sigma": float(error),
            "was": known.values[name],
            "unit": units[what],
        }
        for what, some in errors.items()
        for name, error in zip(called[what], some, strict=True)
    }


def _triads(calibration: Calibration, which: str) -> dict[str, Any]:
    """Values or their errors, (3,) by group."""
    flat = dict(zip(calibration.names, getattr(calibration, which), strict=True))
    return {
        group: np.array([flat[f"{group}.{axis}"] for axis in "xyz"]) for group in GROUPS
    }
