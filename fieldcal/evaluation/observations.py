"""Makes the observations of the estimators from the windows of a session."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fieldcal.calibration import Calibration, Nominal, limits
from fieldcal.core.version import __version__
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.description import Description
from fieldcal.session.folder import Session
from fieldcal.solve.observations import Observations
from fieldcal.windows import Average


def build_observations(
    about: Description, averages: Sequence[Average], rows: Sequence[int] | None = None
) -> Observations:
    """Observations: averages with the positions that they were taken in.

    Parameters
    ----------
    about : device, site, frame and positions
    averages : one for each position, or for those numbered in `rows`
    rows : numbers of the positions, all by default

    """
    numbers = range(len(about.positions)) if rows is None else rows
    return Observations.of(
        [about.positions[i] for i in numbers],
        averages,
        about.gravity,
        latitude=None if about.latitude_deg is None else about.latitude,
        base_motion=about.base_motion,
        mounting=about.mounting,
        grade=about.grade,
        nominal=Nominal(**{k: tuple(v.tolist()) for k, v in about.nominal.items()}),
    )


def angle_setting(about: Description) -> float:
    """Uncertainty of set angles, deg; the limit of the grade if it is not stated."""
    if about.angle_setting_deg is not None:
        return about.angle_setting_deg
    return limits.read(about.grade).angle_setting_deg


def with_provenance(calibration: Calibration, about: Description) -> Calibration:
    """The calibration with the device it belongs to and the software that made it."""
    origin = {"device": dict(about.device), "software": f"fieldcal {__version__}"}
    if not about.gauge.is_si:
        origin["gauge"] = about.gauge.table()
    return replace(calibration, info={**calibration.info, **origin})


def observe(session: Session) -> tuple[Observations, tuple[str, ...]]:
    """Average the windows of a recorded session; warnings name what was left out.

    Raises
    ------
    SessionError
        If it has no position, or no window of any position can be used.

    """
    found = usable_windows(session)
    return build_observations(
        session.about, found.averages, found.position_numbers
    ), found.warnings
