"""Bias and scale factor fitted with the effects, and how each effect moves them."""

from __future__ import annotations

import numpy as np

from fieldcal.calibration.parameters import Nominal
from fieldcal.calibration.plausible import implausible_values
from fieldcal.core.samples import Array, Index
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.result import CalibrationGroup, Quantity
from fieldcal.model import thresholds
from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior.model_average import (
    average_of_columns,
    average_over_sizes,
)
from fieldcal.model.state import State

GYRO_SCALE = "gyro_scale"
"""Effect of the catalogue: scale factors of gyroscopes that turns show."""

GROUP_UNITS = {
    "acc_bias": "m/s^2",
    "acc_scale": "1",
    "gyr_bias": "rad/s",
    "gyr_scale": "1",
}


def calibration_groups(explanation: Explanation) -> dict[str, CalibrationGroup]:
    """Groups of the calibration that the recording determines, in output units."""
    about = explanation.source.about
    nominal, gauge = about.nominal, about.gauge
    found = averaged_calibration(explanation)
    out = {}
    for group, unit in GROUP_UNITS.items():
        value, sigma = np.full(3, np.nan), np.full(3, np.nan)
        for i, axis in enumerate("xyz"):
            if f"{group}.{axis}" in found:
                v, s, size = found[f"{group}.{axis}"]
                if s < thresholds.USEFUL[group] * size:
                    value[i], sigma[i] = v, s
        if np.isfinite(value).any():
            change = value - nominal[group]
            size, unit = gauge.of(group) or (1.0, unit)
            three = [tuple((size * part).tolist()) for part in (value, sigma, change)]
            out[group] = CalibrationGroup(three[0], three[1], three[2], unit)
    return out


def calibration_of_set(
    explanation: Explanation, fitted: Set
) -> dict[str, tuple[float, float, float]]:
    """Bias and scale factor of a set: value, sigma, scale factor, by full name."""
    reported = fitted  # the best set has its reported sizes already
    if fitted is not explanation.best.set:
        reported = average_over_sizes(explanation.posterior.sets, fitted)
    at = _calibration_columns(explanation)
    left = explanation.dictionary.unfitted
    return _values_by_name(
        explanation, at, *average_of_columns([(reported, 1.0)], at, left)
    )


def impossible_turn_scales(explanation: Explanation) -> dict[str, str]:
    """Scale factors of gyroscopes, by the turns, that no sensor has; in sentences.

    `solve` does not state those of axes about which the device was not turned. The
    best set may need them all the same, to be rid of rates that contradict it; then it
    is not what happened.
    """
    found = turn_scale_factors(explanation.best.set, explanation.inferred.fit.nominal)
    about = explanation.source.about.nominal
    nominal = Nominal(**{k: tuple(v.tolist()) for k, v in about.items()})
    return {
        name: sentence
        for name, (value, sigma) in found.items()
        for sentence in implausible_values(
            [name], np.array([value]), np.array([sigma]), nominal
        )
    }


def exhausted_search(explanation: Explanation) -> str | None:
    """What it means that the rows took so many causes that none counts, if they did."""
    if not explanation.inferred.exhausted:
        return None
    return (
        f"{thresholds.MAX_CAUSES} causes together do not explain it: in its windows the"
        " device was turned, or its columns are not what session.toml says"
    )


def turn_scale_factors(fitted: Set, nominal: State) -> dict[str, tuple[float, float]]:
    """Scale factors of the gyroscopes by the turns in a set, and sigma, by full name.

    Empty if the set has no error of them.
    """
    out = {}
    for group in (g for cause, g in fitted.members if cause.name == GYRO_SCALE):
        at = fitted.state.places_of(group.columns)
        error = np.sqrt(np.diag(fitted.state.inverse)[at])
        for i, change, sigma in zip(
            group.params, fitted.state.estimate[at], error, strict=True
        ):
            name = f"gyr_scale.{'xyz'[i]}"
            out[name] = float(nominal.scale[3 + i] + change), float(sigma)
    return out


def averaged_calibration(
    explanation: Explanation,
) -> dict[str, tuple[float, float, float]]:
    """Bias and scale factor averaged over sets, as `calibration_of_set`."""
    at = _calibration_columns(explanation)
    return _values_by_name(
        explanation, at, *explanation.model_average.average_of_columns(at)
    )


def _calibration_columns(explanation: Explanation) -> Index:
    """Columns of biases and scale factors that every set has."""
    d = explanation.dictionary
    every = np.concatenate([d.bias + np.arange(6), d.scale + np.arange(6)])
    return every[np.isin(every, explanation.best.set.state.columns)]


def _values_by_name(
    explanation: Explanation, at: Index, mean: Array, covariance: Array
) -> dict[str, tuple[float, float, float]]:
    """Value, sigma and scale factor of columns of the calibration, by full name."""
    d, nominal = explanation.dictionary, explanation.inferred.fit.nominal
    sigma, out = np.sqrt(np.diag(covariance)), {}
    for column, change, error in zip(at, mean, sigma, strict=True):
        first, base, kind = d.bias, nominal.bias, "bias"
        if column >= d.bias + 6:
            first, base, kind = d.scale, nominal.scale, "scale"
        c = int(column - first)
        name = f"{'acc' if c < 3 else 'gyr'}_{kind}.{'xyz'[c % 3]}"
        size = float(abs(explanation.state.scale[c])) or 1.0
        out[name] = float(base[c] + change), float(error), size
    return out


def calibration_changes(explanation: Explanation, less: Set) -> dict[str, Quantity]:
    """Change of the calibration when a cause is taken into account, by full name.

    That is the value with the cause less that of `less`, the best set without it, with
    the sigma of the averaged calibration, in the unit of the outputs. Parameters that
    either set does not determine are absent.
    """
    gauge = explanation.source.about.gauge
    now, before = (
        calibration_of_set(explanation, s) for s in (explanation.best.set, less)
    )
    averaged, out = averaged_calibration(explanation), {}
    for name, (value, _, size) in now.items():
        sigma = averaged[name][1]
        group = name.partition(".")[0]
        allowed = thresholds.USEFUL[group] * size
        was, sigma_was, _ = before.get(name, (np.nan, np.inf, 1.0))
        if 0 < sigma < allowed and sigma_was < allowed:
            part, unit = gauge.of(group) or (1.0, GROUP_UNITS[group])
            out[name] = Quantity(part * (value - was), part * sigma, unit)
    return out
