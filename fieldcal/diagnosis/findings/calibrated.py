"""Bias and scale factor fitted with the effects, and how each effect moves them."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.result import CalibrationGroup, Quantity
from fieldcal.model import thresholds
from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior.model_average import of_columns
from fieldcal.model.posterior.reported import reported

GROUPS = {"acc_bias": "m/s^2", "acc_scale": "1", "gyr_bias": "rad/s", "gyr_scale": "1"}


def with_effects(explanation: Explanation) -> dict[str, CalibrationGroup]:
    """Groups that the recording determines, in the unit of the outputs."""
    about = explanation.prepared.source.about
    nominal, gauge = about.nominal, about.gauge
    found = averaged(explanation)
    out = {}
    for group, unit in GROUPS.items():
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


def calibrated(
    explanation: Explanation, one: Set
) -> dict[str, tuple[float, float, float]]:
    """Bias and scale factor of a set: value, sigma, scale factor, by full name."""
    found = one  # of what was found the numbers are taken already
    if one is not explanation.best.set:
        found = reported(explanation.posterior.search, one)
    at = _columns(explanation)
    left = explanation.dictionary.unfitted
    return _named(explanation, at, *of_columns([(found, 1.0)], at, left))


def averaged(explanation: Explanation) -> dict[str, tuple[float, float, float]]:
    """The same over all sets that count."""
    at = _columns(explanation)
    return _named(explanation, at, *explanation.average.of_columns(at))


def _columns(explanation: Explanation) -> Index:
    """Columns of biases and scale factors that every set has."""
    d = explanation.dictionary
    every = np.concatenate([d.bias + np.arange(6), d.scale + np.arange(6)])
    return every[np.isin(every, explanation.best.set.state.columns)]


def _named(
    explanation: Explanation, at: Index, mean: Array, covariance: Array
) -> dict[str, tuple[float, float, float]]:
    """Value, sigma and scale factor of columns of the calibration, by full name."""
    d, nominal = explanation.dictionary, explanation.inferred.inference.nominal
    sigma, out = np.sqrt(np.diag(covariance)), {}
    for column, change, error in zip(at, mean, sigma, strict=True):
        first, base, kind = (
            (d.bias, nominal.bias, "bias")
            if column < d.bias + 6
            else (d.scale, nominal.scale, "scale")
        )
        c = int(column - first)
        name = f"{'acc' if c < 3 else 'gyr'}_{kind}.{'xyz'[c % 3]}"
        size = float(abs(explanation.state.scale[c])) or 1.0
        out[name] = float(base[c] + change), float(error), size
    return out


def moved(explanation: Explanation, less: Set) -> dict[str, Quantity]:
    """By how much a calibration changes when a cause is taken into account.

    Parameters
    ----------
    explanation : with the cause
    less : the best set without it

    Returns
    -------
    by full name: value with the cause less value without it, and the sigma that is told
    of the calibration, in the unit of the outputs; what either leaves open is absent

    """
    gauge = explanation.prepared.source.about.gauge
    now, before = (calibrated(explanation, s) for s in (explanation.best.set, less))
    told, out = averaged(explanation), {}
    for name, (value, _, size) in now.items():
        sigma = told[name][1]
        group = name.partition(".")[0]
        allowed = thresholds.USEFUL[group] * size
        was, sigma_was, _ = before.get(name, (np.nan, np.inf, 1.0))
        if 0 < sigma < allowed and sigma_was < allowed:
            part, unit = gauge.of(group) or (1.0, GROUPS[group])
            out[name] = Quantity(part * (value - was), part * sigma, unit)
    return out
