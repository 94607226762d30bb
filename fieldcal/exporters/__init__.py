"""Writes results for other programs, with one module for each format.

To add one, write exporters/<name>.py with ``WHAT`` (a line for the help), ``ENDING``
and ``write(source, path)``, which returns notices for the user, one sentence each. The
docstring of the module states sign and order of the format's convention.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, cast

from fieldcal.calibration.gauge import SI
from fieldcal.core.errors import InputError
from fieldcal.core.plugins import module_names

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration, Nominal
    from fieldcal.core.samples import Array
    from fieldcal.drivers.mavlink_installed import InstalledCalibration
    from fieldcal.session.folder import Session


@dataclass(frozen=True, slots=True)
class ExportSource:
    """Calibration to export, with the session it comes from.

    Attributes
    ----------
    calibration : of the device, U = bias + M f in device axes
    nominal : values of parameters that were not determined
    session : of the calibration
    installed : calibration that the device applied to its samples, None if none
    instance : number of the device's sensor, from 0

    """

    calibration: Calibration
    nominal: Nominal
    session: Session
    installed: InstalledCalibration | None = field(default=None)
    instance: int = 0

    def linear(self, sensor: str) -> tuple[Array, Array]:
        """Bias (3,) and matrix (3, 3) of U = bias + matrix f of ``acc`` or ``gyr``."""
        if sensor == "acc":
            return self.calibration.accelerometers(self.nominal)
        return self.calibration.gyroscopes(self.nominal)

    @property
    def undetermined(self) -> list[str]:
        """Biases and scale factors for which the nominal value is taken."""
        return list(self.calibration.undetermined)

    @property
    def notices(self) -> list[str]:
        """Notices for the user that hold for any format, one sentence each."""
        says, gauge = [], self.session.about.gauge
        for size, unit, si in zip(gauge.size, gauge.units, SI, strict=True):
            if unit != si:
                says.append(f"raw is in {si}: the samples' {unit} divided by {size:g}")
        if self.undetermined:
            names = ", ".join(self.undetermined)
            says.append(f"not determined, the nominal value is taken: {names}")
        if self.installed is not None and not self.installed.taken_out:
            says.append(
                "the device had a calibration of its own in use: the numbers are for "
                "what it sends with that in use"
            )
        return says

    @property
    def zero_couplings(self) -> list[str]:
        """Kinds of cross-coupling that were not determined: 0 in the matrices."""
        kinds = ("cross_coupling", "gyro_cross_coupling")
        return [kind for kind in kinds if not self.calibration.components(kind)]

    @property
    def matrix_notices(self) -> list[str]:
        """Notices for the user that hold for any format with matrices."""
        triads = {"cross_coupling": "accelerometers"}
        return self.notices + [
            f"the cross-coupling of the {triads.get(kind, 'gyroscopes')} was not"
            " determined: the matrix has 0 there, which is no measured value; fieldcal"
            " solve --cross or fieldcal diagnose tells whether the positions show it"
            for kind in self.zero_couplings
        ]


class Exporter(Protocol):
    """Interface of a format module in `exporters`."""

    WHAT: str
    ENDING: str
    write: Callable[[ExportSource, Path], list[str]]


def format_names() -> tuple[str, ...]:
    """Names of all formats."""
    return module_names(__path__)


def load_exporter(name: str) -> Exporter:
    """Return the module of a format.

    Raises
    ------
    InputError
        If there is no such format.

    """
    if name not in format_names():
        raise InputError(f"no format {name!r}: there are {', '.join(format_names())}")
    return cast(Exporter, import_module(f"{__name__}.{name}"))
