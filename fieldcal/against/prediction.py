"""How a simulator predicts a recording, without and with the causes found.

Without them, the simulator's calibration and effects, with their covariance C, replace
those of the recording. Nothing is fitted to the recording but unknown orientations.
With the residual r = y - h - Phi u at the simulator's values and G = Phi^T R^-1 Phi,

    chi^2 = r^T (R + Phi C Phi^T)^-1 r
          = r^T R^-1 r - b^T L (1 + L^T G L)^-1 L^T b,   b = Phi^T R^-1 r, C = L L^T (1)

With the causes found, each position is held out and predicted from the others
(`HeldOut`), as a simulator would that was patched by the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.against.calibrations import bias_wander, shared_axes
from fieldcal.against.causes import DecidedCauses
from fieldcal.against.result import SimulatorPrediction
from fieldcal.against.side import DiagnosedRecording
from fieldcal.against.widened import WidenedSet
from fieldcal.core.samples import Array, Index
from fieldcal.diagnosis.findings.agreement import rms_over_parts, root_mean_square
from fieldcal.model.rows.averages import Rows
from fieldcal.model.system.fitted import FittedSet, estimates_by_column
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.linear_system import gram


def predict_as_simulated(found: DecidedCauses) -> SimulatorPrediction:
    """Prediction by the simulator as it is, for the outputs that it has."""
    real = found.pairing.widened[0]
    rows = found.pairing.real.explanation.rows
    columns, values, covariance = _simulator_values(found)
    linear = [p for p in real.linear if p.channel in found.sim.observed]
    fitted = FittedSet(rows, real.fit.dictionary, linear, real.values, real.set)
    state = replace(real.set.state, columns=columns, estimate=values)
    residual = fitted.residual(estimates_by_column(state, real.fit.dictionary))
    squares = _squares(real, linear, columns, values, covariance)
    return _prediction(rows, residual, squares, sum(len(p.white) for p in linear))


def predict_as_explained(real: DiagnosedRecording) -> SimulatorPrediction:
    """Prediction of each position from the others, with the causes found."""
    explanation = real.explanation
    ahead = explanation.held_out.residual(explanation.rival_sets)
    squares, count = explanation.held_out.squares(explanation.best.set)
    return _prediction(explanation.rows, ahead, squares, count)


def _prediction(
    rows: Rows, residual: Array, squares: float, count: int
) -> SimulatorPrediction:
    sizes = rms_over_parts(rows, residual)
    acc, gyr = (root_mean_square(sizes[part]) for part in (slice(0, 3), slice(3, 6)))
    return SimulatorPrediction(acc, gyr, squares / count if count else np.nan)


def _simulator_values(found: DecidedCauses) -> tuple[Index, Array, Array]:
    """Columns of the recording, with the simulator's values and covariance there."""
    real, sim = found.pairing.widened[0], found.sim
    columns, base, theirs, wide = [], [], [], list[float]()
    for name, axes in shared_axes(real, sim):
        first = "bias" if name.endswith("bias") else "scale"
        here, there = (getattr(w.fit.dictionary, first) for w in (real, sim))
        nominal = [getattr(w.fit.nominal, first) for w in (real, sim)]
        spread = bias_wander(sim, axes) if first == "bias" else np.zeros(len(axes))
        wide += spread.tolist()
        columns += (here + axes).tolist()
        theirs += (there + axes).tolist()
        base += (nominal[1][axes] - nominal[0][axes]).tolist()
    earth = [w.fit.dictionary.earth for w in (real, sim)]
    if min(earth) >= 0:
        columns += list(range(earth[0], earth[0] + 3))
        theirs += list(range(earth[1], earth[1] + 3))
        base += [0.0] * 3
    for cause, group in sim.set.members:
        ours = real.member(cause.key)
        if ours is None or cause.kind != "effect":  # what is random predicts nothing
            continue
        for j, at in zip(group.params, group.columns.tolist(), strict=True):
            if j in ours[1].params:
                columns.append(int(ours[1].columns[ours[1].params.index(j)]))
                theirs.append(at)
                base.append(0.0)
    values, covariance = sim.estimate(np.array(theirs, dtype=np.intp))
    wide += [0.0] * (len(columns) - len(wide))
    covariance = covariance + np.diag(np.square(wide))
    return np.array(columns, dtype=np.intp), values + np.array(base), covariance


def _squares(
    real: WidenedSet,
    linear: Sequence[LinearRows],
    columns: Index,
    values: Array,
    covariance: Array,
) -> float:
    """Chi squared (1) of the predicted windows."""
    d = real.fit.dictionary
    some = np.flatnonzero(
        real.fit.wanted_columns(real.set.members) | (real.values != 0)
    )
    rows = gram(linear, d, real.values, (), some)
    tau = real.sets.instability_sigma(real.set.sizes.instability)
    weighed = rows.with_instability(tau)
    inner, rhs = weighed.normal_equations(columns)
    left = weighed.square - 2 * values @ rhs + values @ inner @ values
    return chi2_of_uncertain_prediction(
        float(left), rhs - inner @ values, inner, covariance
    )


def chi2_of_uncertain_prediction(
    left: float, b: Array, inner: Array, covariance: Array
) -> float:
    """Chi squared (1) of a prediction that has an uncertainty of its own.

    Parameters
    ----------
    left : r^T R^-1 r
    b : (k,) Phi^T R^-1 r
    inner, covariance : (k, k) G and C

    """
    sigma = np.sqrt(np.diag(covariance))
    power, axes = np.linalg.eigh(covariance / sigma / sigma[:, None])
    root = sigma[:, None] * axes * np.sqrt(np.maximum(power, 0.0))  # L of (1)
    rest = root.T @ b
    taken = np.linalg.solve(np.eye(len(rest)) + root.T @ inner @ root, rest)
    return float(left - rest @ taken)
