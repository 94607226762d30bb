"""Makes a calibration with warnings from an estimate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration, Method
from fieldcal.calibration.gauge import GROUPS
from fieldcal.calibration.names import group_of, sensor_of
from fieldcal.calibration.plausible import implausible_values, misdirected_turns
from fieldcal.core.errors import NotObservable
from fieldcal.model import thresholds
from fieldcal.solve import words
from fieldcal.solve.coupling_left_out import largest_coupling_left_out
from fieldcal.solve.cross_coupling_effect import largest_cross_coupling_effect
from fieldcal.solve.doubtful_position import DoubtfulPosition
from fieldcal.solve.estimation import ParameterEstimate, closure_scatter, window_scatter
from fieldcal.solve.latitude import VerticalEarthRate
from fieldcal.solve.lot_contribution import LotContribution
from fieldcal.solve.observations import Observations
from fieldcal.solve.options import SolveOptions
from fieldcal.solve.reliability import WrongAngles
from fieldcal.solve.warnings import (
    agreement_warnings,
    clock_warnings,
    closure_chi2,
    contradiction_warnings,
    level_warnings,
    undetermined_warnings,
)

UNITS = {group: unit for group, (_, _, unit) in GROUPS.items()}
UNITS |= {"angle_offset": "deg", "base_tilt": "deg"}
"""Unit of each group's components."""


def build_calibration(
    method: Method,
    observations: Observations,
    options: SolveOptions,
    estimate: ParameterEstimate,
    notes: Sequence[str],
    lot_contribution: LotContribution | None = None,
) -> Calibration:
    """Make a calibration from an estimate.

    Raises
    ------
    NotObservable
        If it has no parameter.

    """
    names = estimate.names
    sentences = [
        words.effects_warning(
            estimate.any_cause_probability, estimate.causes, names,
            estimate.shift_sigmas, estimate.valid_at_s, estimate.changing_causes,
        ),
        lot_contribution.sentence if lot_contribution else "",
        *_remarks(method, observations, options, estimate, notes),
    ]  # fmt: skip
    if not names:
        raise NotObservable(
            "these positions determine nothing: " + "; ".join(filter(None, sentences))
        )
    of_acc = any(sensor_of(group_of(name)) == "acc" for name in names)
    odd = _reasons_against(observations, estimate, of_acc)
    sentences += agreement_warnings(method, observations, estimate)
    fit = estimate.acc if of_acc else estimate.gyr
    info = _info(method, observations, options, estimate)
    info |= {"borrowed": lot_contribution.to_json()} if lot_contribution else {}
    return Calibration(
        method=method, names=names, values=estimate.values,
        covariance=estimate.covariance, units=tuple(UNITS[group_of(n)] for n in names),
        chi2=fit.chi2, dof=fit.dof, rms=estimate.acc.rms,
        warnings=tuple(dict.fromkeys(w for w in [*odd, *sentences] if w)), good=not odd,
        info=info,
    )  # fmt: skip


def _remarks(
    method: Method,
    observations: Observations,
    options: SolveOptions,
    estimate: ParameterEstimate,
    notes: Sequence[str],
) -> list[str]:
    """Sentences on what the values do not contain, and on assumptions; may be empty."""
    worst = largest_cross_coupling_effect(estimate)
    return [
        *undetermined_warnings(method, observations, estimate),
        worst.sentence if worst else "",
        *notes,
        *level_warnings(method, options, observations),
        *clock_warnings(estimate),
    ]


def _reasons_against(
    observations: Observations, estimate: ParameterEstimate, of_acc: bool
) -> list[str]:
    """Sentences on why the result is bad; empty if it is good.

    `of_acc` states whether parameters of the accelerometers are estimated.
    """
    nominal, names = observations.nominal, [p.name for p in observations.positions]
    turns = [(names[before], names[behind])
             for before, behind in estimate.contradicted_turns]  # fmt: skip
    rate = VerticalEarthRate.of(
        estimate.parameter_set, estimate.sets, observations.latitude
    )
    return [
        *implausible_values(estimate.names, estimate.values, estimate.sigma, nominal),
        *misdirected_turns(turns),
        *([rate.sentence] if rate and rate.latitude_wrong else []),
        *contradiction_warnings(observations, estimate, of_acc),
    ]


def _is_harmful(wrong: WrongAngles, estimate: ParameterEstimate) -> bool:
    """Whether wrong angles could move a parameter beyond its uncertainty."""
    return any(
        abs(wrong.moves[name]) > thresholds.MOVED_WRONG * s
        for name, s in zip(estimate.names, estimate.sigma, strict=True)
    )


def _carried_info(
    observations: Observations, estimate: ParameterEstimate
) -> dict[str, Any]:
    """Unrequested causes in the set, and their effects on the parameters."""
    moved = dict(zip(estimate.names, estimate.shift_sigmas.tolist(), strict=True))
    out: dict[str, Any] = {"causes": estimate.causes, "moved_sigmas": moved}
    if estimate.valid_at_s is not None:
        degrees = observations.temperature
        last = float(degrees[-1]) if len(degrees) else np.nan
        warm = last if np.isfinite(last) else None
        out["as_of"] = {
            "since_start_s": estimate.valid_at_s,
            "temperature_degc": warm,
            "because": estimate.changing_causes,
        }
    return out


def _info(
    method: Method,
    observations: Observations,
    options: SolveOptions,
    estimate: ParameterEstimate,
) -> dict[str, Any]:
    out: dict[str, Any] = {
        "conditions": _conditions(observations),
        "bad_position": [round(float(p), 4) for p in estimate.bad_probability],
        "extra_scatter": window_scatter(estimate.mixture, (0, 1, 2)),
        "log_evidence": estimate.score,
        "angle_sigma_deg": options.angles_deg,
        **_factory_sigmas(estimate),
    }
    if doubt := DoubtfulPosition.of(observations, estimate.bad_probability):
        out["doubtful_position"] = doubt.to_json()
    if np.isfinite(estimate.acc.held_out_rms):
        out["left_out_rms"] = estimate.acc.held_out_rms
    wanted = estimate.parameter_set.options
    if wanted.level_deg:
        out["level_sigma_deg"] = wanted.level_deg
    if wanted.tilt != "none" and wanted.beside_tilt_deg:
        out["beside_tilt_sigma_deg"] = wanted.beside_tilt_deg
    if observations.has_gyr:
        out["gyroscopes"] = _gyroscope_fit(estimate)
    if harmful := [w for w in estimate.wrong_angles if _is_harmful(w, estimate)]:
        out["wrong_angles"] = [w.to_json() for w in harmful]
    if estimate.causes or estimate.valid_at_s is not None:
        out["carried"] = _carried_info(observations, estimate)
    if coupling := largest_coupling_left_out(estimate):
        out["coupling_left_out"] = coupling.to_json()
    if estimate.turn_rows:
        chi2, dof = closure_chi2(estimate)
        scatter = closure_scatter(estimate.mixture)
        out["turns"] = {"chi2": chi2, "dof": dof, "scatter_rad": scatter}
    return out


def _conditions(observations: Observations) -> dict[str, Any]:
    """The conditions of the recording; SI units, temperatures in deg C and K."""
    known = observations.temperature[np.isfinite(observations.temperature)]
    latitude = observations.latitude
    return {
        "positions": len(observations),
        "gravity": observations.gravity,
        "latitude_deg": None if latitude is None else float(np.rad2deg(latitude)),
        "temperature_degc": float(known.mean()) if len(known) else None,
        "temperature_sd_k": float(known.std()) if len(known) else None,
        "grade": observations.grade,
    }


def _factory_sigmas(estimate: ParameterEstimate) -> dict[str, float]:
    """Sizes of the factory errors that the uncertainties contain, SI units."""
    wanted = estimate.parameter_set.options
    return {
        "square_sigma": 0.0 if wanted.cross else wanted.factory.cross_coupling,
        "quadratic_sigma": wanted.factory.quadratic,
        "g_sensitivity_sigma": wanted.factory.g_sensitivity,
        "acc_bias_per_k_sigma": wanted.factory.acc_per_k,
        "gyr_bias_per_k_sigma": wanted.factory.gyr_per_k,
        "acc_hysteresis_sigma": wanted.factory.hysteresis,
    }


def _gyroscope_fit(estimate: ParameterEstimate) -> dict[str, Any]:
    """How the means of the gyroscopes fit, rad/s."""
    gyr = estimate.gyr
    return {
        "chi2": gyr.chi2, "dof": gyr.dof, "unit": "rad/s",
        "rms": gyr.rms if np.isfinite(gyr.rms) else None,
        "extra_scatter": window_scatter(estimate.mixture, (3, 4, 5)),
    }  # fmt: skip
