"""Recalibrate an inertial measurement unit in the field, with honest uncertainty.

A recorded session, solved and applied:

    from fieldcal import Session, observe
    from fieldcal.solve import solve

    session = Session.open("bench-7")
    calibration = solve(observe(session)[0])
    true = calibration.apply(session.block)

Names are loaded when they are first used, so that importing the package costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from fieldcal.core.version import __version__ as __version__

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration as Calibration
    from fieldcal.core.positions import Position as Position
    from fieldcal.core.samples import Block as Block
    from fieldcal.drivers.driver import open_driver as open_driver
    from fieldcal.evaluation.observations import observe as observe
    from fieldcal.session.folder import Session as Session
    from fieldcal.windows import average as average

_HOMES = {
    "Block": "core.samples",
    "Calibration": "calibration",
    "Position": "core.positions",
    "Session": "session.folder",
    "average": "windows",
    "observe": "evaluation.observations",
    "open_driver": "drivers.driver",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
