"""What known effects do to the means of parts, written for the oracle alone.

Each column is the change of the six outputs of each part, (m, 6), by one unit of one
parameter. What has a shape (an instant, a time constant) has it as the untouched
diagnosis gave it. Effects that are only scatter, and faults of the signal chain, have
no column: the scatter of the recording holds them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from benchmarks.injected.parts import Parts
from fieldcal.core.frames import in_procedure_axes, specific_force_at_home
from fieldcal.core.positions import alpha_beta_angles, specific_forces
from fieldcal.core.samples import Array
from fieldcal.diagnosis.result import FoundEffect
from fieldcal.session.description import Description

STEP = 1e-4
"""Of an angle by which a derivative is taken, rad."""

Columns = list[Array]


def at_channel(values: Array, channel: int) -> Array:
    """One output that changes by (m,), the others not."""
    out = np.zeros((len(values), 6))
    out[:, channel] = values
    return out


def each(values: Array, channels: range = range(6)) -> Columns:
    """Every output by itself."""
    return [at_channel(values, c) for c in channels]


def plain(force: Array) -> Columns:
    """Bias and scale factor: what is always refitted."""
    ones = np.ones(len(force))
    return each(ones) + [at_channel(force[:, c], c) for c in range(3)]


def named(
    found: FoundEffect, parts: Parts, force: Array, about: Description
) -> Columns:
    """Columns of an effect that a diagnosis named."""
    numbers = {
        n: float(q.value)
        for n, q in found.parameters.items()
        if not isinstance(q.value, str)
    }
    out = _of_time(found.id, numbers, parts)
    out += _of_force(found.id, force)
    out += _of_time_and_force(found.id, numbers, parts, force)
    out += _of_temperature(found.id, parts, force)
    if found.id in ANGLES:
        out += list(_of_angles(found.id, parts, about))
    return [c for c in out if np.isfinite(c).all()]


def _of_time(name: str, numbers: Mapping[str, float], parts: Parts) -> Columns:
    t = parts.t - parts.t[0]
    if name == "bias_drift":
        return each(t)
    if name == "bias_step":
        return each((parts.t > numbers.get("at_s", np.inf)).astype(float))
    if name == "warm_up":
        return each(np.exp(-t / numbers.get("tau_s", np.inf)))
    if name == "thermal_transient":
        return each(_approach(parts, numbers))
    if name == "settling":
        return each(np.exp(-parts.since / numbers.get("tau_s", np.inf)))
    return []


def _approach(parts: Parts, numbers: Mapping[str, float]) -> Array:
    """From zero to one, from an instant on."""
    since = np.maximum(parts.t - numbers.get("at_s", np.inf), 0.0)
    out: Array = 1 - np.exp(-since / numbers.get("tau_s", np.inf))
    return out


def _of_time_and_force(
    name: str, numbers: Mapping[str, float], parts: Parts, force: Array
) -> Columns:
    courses = {
        "scale_drift": parts.t - parts.t[0],
        "scale_step": (parts.t > numbers.get("at_s", np.inf)).astype(float),
        "scale_warm_up": np.exp(-(parts.t - parts.t[0]) / numbers.get("tau_s", np.inf)),
        "scale_transient": _approach(parts, numbers),
    }
    if name not in courses:
        return []
    return [at_channel(courses[name] * force[:, c], c) for c in range(3)]


def _of_force(name: str, force: Array) -> Columns:
    power: dict[str, Callable[[Array], Array]] = {
        "quadratic": np.square,
        "cubic": lambda f: f**3,
        "scale_asymmetry": np.abs,
    }
    if name in power:
        return [at_channel(power[name](force[:, c]), c) for c in range(3)]
    if name == "g2_sensitivity":
        return [at_channel(force[:, c] ** 2, c + 3) for c in range(3)]
    triads = {"cross_coupling": range(3), "g_sensitivity": range(3, 6)}
    if name in triads:
        pairs = [(i, j) for i in triads[name] for j in range(3) if i != j]
        return [at_channel(force[:, j], i) for i, j in pairs]
    if name == "pendulous_products":
        products = [force[:, i] * force[:, j] for i, j in ((0, 1), (1, 2), (0, 2))]
        return [c for p in products for c in each(p, range(3))]
    return []


def _of_temperature(name: str, parts: Parts, force: Array) -> Columns:
    warmer = parts.temperature - parts.temperature[0]
    if name == "temperature_bias":
        return each(warmer)
    if name == "thermal_hysteresis":
        return each(np.gradient(warmer, parts.t))
    if name == "temperature_scale":
        return [at_channel(warmer * force[:, c], c) for c in range(3)]
    return []


ANGLES = ("base_tilt", "angle_offset", "angle_scale", "gravity_error")


def _of_angles(name: str, parts: Parts, about: Description) -> Iterator[Array]:
    """Change of the force by two angles, or by its length."""
    alpha, beta = alpha_beta_angles(about.positions)
    alpha, beta = alpha[parts.window], beta[parts.window]
    home = specific_force_at_home(about.gravity)

    def changed(to: Array) -> Array:
        change = (to - in_procedure_axes(alpha, beta, home)) / STEP
        return np.hstack([change @ about.mounting, np.zeros((len(alpha), 3))])

    if name == "gravity_error":
        yield changed(in_procedure_axes(alpha, beta, home * (1 + STEP)))
    elif name == "base_tilt":
        for axis in ((STEP, 0.0, 0.0), (0.0, 0.0, STEP)):
            yield changed(in_procedure_axes(alpha, beta, home + np.cross(axis, home)))
    else:
        by = (1.0, 1.0) if name == "angle_offset" else (alpha, beta)
        yield changed(in_procedure_axes(alpha + STEP * by[0], beta, home))
        yield changed(in_procedure_axes(alpha, beta + STEP * by[1], home))


def force_said(parts: Parts, about: Description) -> Array:
    """Force on each part by the angles, (m, 3), device axes; nan where unknown."""
    there: Array = specific_forces(about.positions, about.gravity) @ about.mounting
    return there[parts.window]
