"""Parameters to install in an autopilot after a recalibration from its samples.

An autopilot applies its own calibration to the samples that it sends. A calibration of
these samples is therefore combined with the installed one, see `install.proposal`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.errors import InputError
from fieldcal.session.folder import Session

if TYPE_CHECKING:
    from fieldcal.drivers.mavlink_installed import InstalledCalibration

GROUPS = ("acc_bias", "acc_scale", "gyr_bias")


def add_install_values(calibration: Calibration, session: Session) -> Calibration:
    """Add the installed parameters and those to install, or a warning why not."""
    from fieldcal.install.proposal import installed_in

    there = installed_in(session)
    if there is None:
        return calibration
    info = {**calibration.info, "installed": there.as_table()}
    try:
        info["install"] = _values_to_install(calibration, session, there)
    except InputError as error:
        said = f"nothing to install in the autopilot: {error}"
        warnings = (*calibration.warnings, said)
        return replace(calibration, info=info, warnings=warnings)
    return replace(calibration, info=info)


def install_lines(calibration: Calibration) -> list[str]:
    """Parameters to install, with their ± and the values they had, one line each."""
    from fieldcal.calibration.wording import format_with_sigma

    told = []
    for name, of in calibration.info.get("install", {}).items():
        value, sigma = format_with_sigma(of["value"], of["sigma"])
        unit = "" if of["unit"] == "1" else f" {of['unit']}"
        was = f"(it was {of['was']:.6g}{unit})"
        told.append(f"install {name} = {value} ± {sigma}{unit} {was}")
    return told


def check_same_installed(calibration: Calibration, session: Session) -> None:
    """Refuse a calibration that was found with other installed parameters.

    Raises
    ------
    InputError
        Naming the parameter that differs.

    """
    from fieldcal.drivers.mavlink_installed import InstalledCalibration
    from fieldcal.install.proposal import installed_in

    found, there = calibration.info.get("installed"), installed_in(session)
    if not found or not there:
        return
    before, now = (
        _effective_parameters(InstalledCalibration.from_table(found)),
        _effective_parameters(there),
    )
    for name in sorted(before.keys() & now.keys()):
        if not np.isclose(before[name], now[name], rtol=1e-6, atol=1e-9):
            raise InputError(
                f"{session.folder} was recorded with {name} = {now[name]:.6g} in the"
                f" autopilot, the calibration is on top of {before[name]:.6g}: solve a"
                " session with the same parameters"
            )


def _effective_parameters(known: InstalledCalibration) -> dict[str, float]:
    """Parameters by which the autopilot corrected the samples."""
    from fieldcal.drivers.mavlink_installed import identity_parameters
    from fieldcal.drivers.mavlink_parameter_names import parameter_names

    of_it = sum(parameter_names(known.autopilot, known.instance).values(), start=())
    had = {name: value for name, value in known.values.items() if name in of_it}
    return {**had, **(identity_parameters(known) if known.taken_out else {})}


def _values_to_install(
    calibration: Calibration, session: Session, there: InstalledCalibration
) -> dict[str, dict[str, Any]]:
    from fieldcal.calibration import Nominal
    from fieldcal.install.proposal import changes

    lacking = [group for group in GROUPS if group not in calibration.groups]
    if lacking:
        raise InputError(f"{lacking[0]} is not determined by these positions")
    nominal = Nominal(**{k: tuple(v) for k, v in session.about.nominal.items()})
    return {
        c.name: {"value": c.new, "sigma": c.sigma, "was": c.old, "unit": c.unit}
        for c in changes(calibration, nominal, there)
    }
