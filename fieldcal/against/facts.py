"""Properties of each of two recordings: rate, steps, noise, calibration, effects."""

from __future__ import annotations

import numpy as np

from fieldcal.against.calibrations import DETERMINED, calibration_group, shared_axes
from fieldcal.against.cause_values import cause_quantities
from fieldcal.against.noise_levels import noise_level
from fieldcal.against.result import Facts
from fieldcal.against.side import DiagnosedRecording
from fieldcal.against.widened import WidenedSet
from fieldcal.core.samples import CHANNELS
from fieldcal.diagnosis.findings.calibrated import GROUP_UNITS
from fieldcal.diagnosis.result import Quantity
from fieldcal.model.rows.thermometer import Thermometer


def recording_facts(one: DiagnosedRecording, there: WidenedSet) -> Facts:
    """Properties of a recording, with the causes that it has."""
    steps = [float(np.nan_to_num(one.steps[c : c + 3]).max()) for c in (0, 3)]
    return Facts(
        rate_hz=one.rate_hz,
        step_acc=steps[0] or np.nan,
        step_gyr=steps[1] or np.nan,
        start_s=float(one.block.t[0]),
        start_c=Thermometer.of(one.block).start_c,
        noise={
            name: noise_level(one, c)
            for c, name in enumerate(CHANNELS)
            if np.isfinite(one.noise[c])
        },
        calibration=_calibration(there),
        effects=effects_with_equation(there),
    )


def effects_with_equation(there: WidenedSet) -> dict[str, dict[str, Quantity]]:
    """Parameters of the effects with an equation, by id; its triads are combined."""
    out: dict[str, dict[str, Quantity]] = {}
    for cause, group in there.set.members:
        if cause.kind == "effect":
            found = cause_quantities(there, (cause, group))
            out[cause.name] = {**out.get(cause.name, {}), **found}
    return out


def _calibration(there: WidenedSet) -> dict[str, dict[str, Quantity]]:
    """Determined values of the calibration, by group and axis."""
    out: dict[str, dict[str, Quantity]] = {}
    for name, axes in shared_axes(there, there):
        values, covariance, _ = calibration_group(there, name, axes)
        sigma = np.sqrt(np.diag(covariance))
        out[name] = {
            "xyz"[c % 3]: Quantity(float(v), float(s), GROUP_UNITS[name])
            for c, v, s in zip(axes.tolist(), values, sigma, strict=True)
            if s < DETERMINED[name]
        }
    return out
