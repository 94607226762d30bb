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
    names, sigma = estimate.names, np.sqrt(np.diag(estimate.covariance))
    worst = largest_cross_coupling_effect(estimate)
    sentences = [
        words.effects_warning(
            estimate.any_cause_probability,
            estimate.causes,
            names,
            estimate.shift_sigmas,
            estimate.valid_at_s,
        ),
        lot_contribution.sentence if lot_contribution else "",
        *undetermined_warnings(method, observations, estimate),
        worst.sentence if worst else "",
        *notes,
        *level_warnings(method, options, observations),
    ]
    if not names:
        raise NotObservable(
            "these positions determine nothing: " + "; ".join(filter(None, sentences))
        )
    of_acc = any(map(_is_acc, names))
    odd = [
        *implausible_values(names, estimate.values, sigma, observations.nominal),
        *misdirected_turns(_turn_names(estimate.contradicted_turns, observations)),
        *_wrong_latitude(estimate, observations),
        *contradiction_warnings(observations, estimate, of_acc),
    ]
    sentences += agreement_warnings(method, observations, estimate)
    fit = estimate.acc if of_acc else estimate.gyr
    info = _info(method, observations, options, estimate)
    info |= {"borrowed": lot_contribution.to_json()} if lot_contribution else {}
    return Calibration(
        method=method,
        names=names,
        values=estimate.values,
        covariance=estimate.covariance,
        units=tuple(UNITS[group_of(n)] for n in names),
        chi2=fit.chi2,
        dof=fit.dof,
        rms=estimate.acc.rms,
        warnings=tuple(dict.fromkeys(w for w in [*odd, *sentences] if w)),
        good=not odd,
        info=info,
    )


def _is_acc(name: str) -> bool:
    """Whether a parameter is a bias or a scale factor of the accelerometers."""
    return sensor_of(group_of(name)) == "acc"


def _turn_names(
    turns: Sequence[tuple[int, int]], observations: Observations
) -> list[tuple[str, str]]:
    """Turns by the names of the positions at their ends."""
    names = [position.name for position in observations.positions]
    return [(names[before], names[behind]) for before, behind in turns]


def _wrong_latitude(
    estimate: ParameterEstimate, observations: Observations
) -> list[str]:
    """Sentence if the gyroscopes contradict the stated latitude."""
    shown = VerticalEarthRate.of(
        estimate.parameter_set, estimate.sets, observations.latitude
    )
    return [shown.sentence] if shown and shown.latitude_wrong else []


def _is_harmful(wrong: WrongAngles, estimate: ParameterEstimate) -> bool:
    """Whether wrong angles could move a parameter beyond its uncertainty."""
    sigma = np.sqrt(np.diag(estimate.covariance))
    return any(
        abs(wrong.moves[name]) > thresholds.MOVED_WRONG * s
        for name, s in zip(estimate.names, sigma, strict=True)
    )


def _carried_info(
    observations: Observations, estimate: ParameterEstimate
) -> dict[str, Any]:
    """Unrequested causes in the set, and their effects on the parameters."""
    moved = dict(zip(estimate.names, estimate.shift_sigmas.tolist(), strict=True))
    out: dict[str, Any] = {"causes": estimate.causes, "moved_sigmas": moved}
    if estimate.valid_at_s is not None:
        last = (
            float(observations.temperature[-1])
            if len(observations.temperature)
            else np.nan
        )
        warm = last if np.isfinite(last) else None
        out["as_of"] = {"since_start_s": estimate.valid_at_s, "temperature_degc": warm}
    return out


def _info(
    method: Method,
    observations: Observations,
    options: SolveOptions,
    estimate: ParameterEstimate,
) -> dict[str, Any]:
    known = observations.temperature[np.isfinite(observations.temperature)]
    latitude = observations.latitude
    wanted = estimate.parameter_set.options
    out: dict[str, Any] = {
        "conditions": {
            "positions": len(observations),
            "gravity": observations.gravity,
            "latitude_deg": None if latitude is None else float(np.rad2deg(latitude)),
            "temperature_degc": float(known.mean()) if len(known) else None,
            "temperature_sd_k": float(known.std()) if len(known) else None,
            "grade": observations.grade,
        },
        "bad_position": [round(float(p), 4) for p in estimate.bad_probability],
        "extra_scatter": window_scatter(estimate.mixture, (0, 1, 2)),
        "log_evidence": estimate.score,
        "angle_sigma_deg": options.angles_deg,
        "square_sigma": 0.0 if wanted.cross else wanted.factory.cross_coupling,
        "quadratic_sigma": wanted.factory.quadratic,
        "g_sensitivity_sigma": wanted.factory.g_sensitivity,
        "acc_bias_per_k_sigma": wanted.factory.acc_per_k,
        "gyr_bias_per_k_sigma": wanted.factory.gyr_per_k,
        "acc_hysteresis_sigma": wanted.factory.hysteresis,
    }
    if doubt := DoubtfulPosition.of(observations, estimate.bad_probability):
        out["doubtful_position"] = doubt.to_json()
    if np.isfinite(estimate.acc.held_out_rms):
        out["left_out_rms"] = estimate.acc.held_out_rms
    if estimate.parameter_set.options.level_deg:
        out["level_sigma_deg"] = estimate.parameter_set.options.level_deg
    if wanted.tilt != "none" and wanted.beside_tilt_deg:
        out["beside_tilt_sigma_deg"] = wanted.beside_tilt_deg
    if observations.has_gyr:
        gyr = estimate.gyr
        out["gyroscopes"] = {
            "chi2": gyr.chi2, "dof": gyr.dof, "unit": "rad/s",
            "rms": gyr.rms if np.isfinite(gyr.rms) else None,
            "extra_scatter": window_scatter(estimate.mixture, (3, 4, 5)),
        }  # fmt: skip
    if harmful := [w for w in estimate.wrong_angles if _is_harmful(w, estimate)]:
        out["wrong_angles"] = [w.to_json() for w in harmful]
    if estimate.causes or estimate.valid_at_s is not None:
        out["carried"] = _carried_info(observations, estimate)
    if estimate.turn_rows:
        chi2, dof = closure_chi2(estimate)
        scatter = closure_scatter(estimate.mixture)
        out["turns"] = {"chi2": chi2, "dof": dof, "scatter_rad": scatter}
    return out
