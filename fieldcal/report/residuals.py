"""Residuals of the averages, and the measured angles of the device.

    r = <U> - (b + M f' + what else was estimated)                           device axes

f' is the specific force at the angles asked for, with the tilt that was estimated. Of a
position whose angles are not known only the norm says something: r = |M^-1 (<U> - b)| -
g. Gyroscopes of tactical grade: r = <W> - b - A w, w the Earth's rate with its level
part as these windows show it, because north is not known. What a result counts with and
does not contain, such as errors of set angles, a base beside its joints and
cross-coupling, is in r. m/s^2 and rad/s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.frames import (
    angles_of_force_direction,
    axis_projections,
    direction_cosines,
    earth_rate_at_home,
    specific_force_at_home,
    wrap_angle,
)
from fieldcal.core.positions import gamma_angles, table_rates, unknown_axis_speeds
from fieldcal.core.samples import Array, Block
from fieldcal.evaluation.observations import build_observations
from fieldcal.model.causes.planned import state_of
from fieldcal.physics.experience import Experience
from fieldcal.report.gather import ReportMaterial
from fieldcal.solve.base_rate import known_earth_rate
from fieldcal.solve.observations import Observations


@dataclass(frozen=True, slots=True)
class Residuals:
    """Residuals of the windows.

    Attributes
    ----------
    rows : (n,) number of each window's position
    channel : (n, 6) m/s^2 and rad/s, nan where unknown or not measured
    norm : (n,) m/s^2, of the norm of the specific force where angles are not known
    sigma : (n, 6) standard error of the averages
    temperature : (n,) deg C, nan where unknown

    """

    rows: tuple[int, ...]
    channel: Array
    norm: Array
    sigma: Array
    temperature: Array


def window_residuals(material: ReportMaterial) -> Residuals | None:
    """Residuals of the windows; None without windows or a calibration."""
    found, still = material.calibration, material.windows
    if found is None or still is None:
        return None
    seen = build_observations(
        material.session.about, still.averages, still.position_numbers
    )
    channel = seen.mean - predicted_outputs(found, seen)
    true = found.apply(Block.of(seen.time, *_sensors(seen)), seen.nominal)
    norm = np.where(
        seen.oriented, np.nan, np.linalg.norm(true.acc, axis=1) - seen.gravity
    )
    sigma = np.sqrt(np.einsum("nii->ni", seen.covariance))
    return Residuals(still.position_numbers, channel, norm, sigma, seen.temperature)


def predicted_outputs(found: Calibration, seen: Observations) -> Array:
    """Outputs that the calibration predicts, (n, 6); nan if angles are unknown."""
    x = Experience.at_rest(
        *seen.angles,
        seen.gravity,
        base_force=specific_force_at_home(seen.gravity)
        + seen.base_motion.force * [1.0, 0.0, 1.0],
        mounting=seen.mounting,
        rate=table_rates(seen.positions),
        gamma=gamma_angles(seen.positions),
    )
    if seen.grade == "navigation" and seen.latitude is not None:
        rate = earth_rate_at_home(seen.latitude) + seen.base_motion.rate
        x = x.turned(base_rate=rate)
    nominal = seen.nominal
    state = state_of(
        found.names,
        found.values,
        (np.array([*nominal.acc_bias, *nominal.gyr_bias]),
         np.array([*nominal.acc_scale, *nominal.gyr_scale])),
    )  # fmt: skip
    out = state.output(state.experienced(x), np.full((1, len(x)), np.inf))
    out[unknown_axis_speeds(seen.positions)[0] > 0] = np.nan
    if seen.grade != "navigation":
        out[:, 3:] += _estimate_earth_rate(seen, seen.mean[:, 3:] - out[:, 3:])
    return out


def _estimate_earth_rate(seen: Observations, left: Array) -> Array:
    """Estimate the Earth's rate in the windows, (n, 3) rad/s, device axes."""
    known = seen.oriented & np.isfinite(left).all(axis=1)
    if not known.any():
        return np.zeros((len(seen), 3))
    away = np.zeros((len(seen), 3, 3))
    turns = (*seen.angles, gamma_angles(seen.positions))
    away[known] = axis_projections(seen.rates[known]) @ (
        seen.mounting.T @ direction_cosines(*(angle[known] for angle in turns))
    )
    home, sigma = known_earth_rate(seen.latitude, False, None, seen.base_motion)
    size = np.array(sigma)
    free = np.flatnonzero(size)
    noise = np.sqrt(np.einsum("nii->ni", seen.covariance)[known][:, 3:]).ravel()
    unknown = away[known][..., free].reshape(-1, len(free)) / noise[:, None]
    # a prior of the size it can have keeps few windows from explaining anything with it
    rows = np.vstack([unknown, np.diag(1 / size[free])])
    target = (left - away @ home)[known].ravel() / noise
    fitted = np.linalg.lstsq(rows, np.append(target, np.zeros(len(free))), rcond=None)
    earth: Array = away @ home + away[..., free] @ fitted[0]
    return earth


def _sensors(seen: Observations) -> tuple[Array, Array]:
    return seen.mean[:, :3], seen.mean[:, 3:]


@dataclass(frozen=True, slots=True)
class MeasuredAngles:
    """Angles that the calibrated accelerometers measure.

    Attributes
    ----------
    rows : (n,) number of each window's position
    stated : (n, 2) alpha and beta, deg; nan where not known
    measured : (n, 2) deg
    sigma : (n, 2) deg, of noise and calibration

    """

    rows: tuple[int, ...]
    stated: Array
    measured: Array
    sigma: Array


def measured_angles(material: ReportMaterial) -> MeasuredAngles | None:
    """Measured angles of the device in each window; None without windows.

    Without a calibration the nominal one serves.
    """
    still = material.windows
    if still is None:
        return None
    seen = build_observations(
        material.session.about, still.averages, still.position_numbers
    )
    if not seen.has_acc:
        return None
    block = Block.of(seen.time, *_sensors(seen))
    spread = np.sqrt(np.einsum("nii->ni", seen.covariance))[:, :3]
    found = material.calibration
    if found is None:
        acc = (block.acc - seen.nominal.acc_bias) / np.array(seen.nominal.acc_scale)
    else:
        acc = found.apply(block, seen.nominal).acc
        spread = np.hypot(spread, found.uncertainty_of(block, seen.nominal)[:, :3])
    force, spread = acc @ seen.mounting.T, spread @ np.abs(seen.mounting.T)
    shown = np.rad2deg([angles_of_force_direction(f) for f in force])
    asked = np.rad2deg(np.column_stack(seen.angles))
    return MeasuredAngles(
        still.position_numbers, asked, shown, _sigma(force, spread, shown)
    )


def _sigma(force: Array, spread: Array, shown: Array) -> Array:
    """Uncertainty of the angles from that of the force components, (n, 2) deg."""
    variance = np.zeros_like(shown)
    for axis in range(3):
        moved = force.copy()
        moved[:, axis] += spread[:, axis]
        change = np.rad2deg([angles_of_force_direction(f) for f in moved]) - shown
        variance += wrap_angle(change, 360.0) ** 2
    return np.sqrt(variance)
