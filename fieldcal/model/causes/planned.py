"""Predicted outputs in positions that are planned, or were recorded and not fitted.

For a device with given parameters in known positions at rest: the outputs of the
accelerometers, m/s^2 in device axes, and their derivatives by each parameter. The
derivatives are the columns that the fit uses too. A tilt is in degrees.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.calibration.names import ParameterName, group_of
from fieldcal.core.frames import direction_cosines, specific_force_at_home
from fieldcal.core.positions import Position, alpha_beta_angles, gamma_angles
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model.causes import columns
from fieldcal.model.causes.basis import RowView
from fieldcal.model.causes.effect_columns import effect_basis
from fieldcal.model.state import State, Term
from fieldcal.physics.effect import Motion, Sensor
from fieldcal.physics.experience import Experience

ACC_CALIBRATION = tuple(
    f"acc_{group}.{axis}" for group in ("bias", "scale") for axis in "xyz"
)
"""Full names of bias and scale factor of the accelerometers."""


def parameters(*groups: str) -> tuple[str, ...]:
    """Full names of bias and scale factor, and of the parameters of some effects.

    >>> parameters("base_tilt")[-2:]
    ('base_tilt.about_x_deg', 'base_tilt.about_z_deg')
    """
    more = (f"{g}.{p.name}" for g in groups for p in catalogue()[g].params)
    return (*ACC_CALIBRATION, *more)


def predict_outputs(
    names: Sequence[str],
    values: Array,
    positions: Sequence[Position],
    gravity: float,
    mounting: Array | None = None,
) -> tuple[Array, Array]:
    """Predicted means of the accelerometers, and their derivatives.

    Parameters
    ----------
    names, values : (k,) full names of parameters; others have their ideal values
    positions : n, with known angles
    gravity : m/s^2
    mounting : (3, 3), procedure = mounting @ device

    Returns
    -------
    u : (n, 3) m/s^2
    slope : (n, 3, k) derivatives of u by each parameter, in its unit

    """
    state = state_of(names, values)
    x = Experience.at_rest(
        *alpha_beta_angles(positions), gravity,
        base_force=specific_force_at_home(gravity),
        gamma=gamma_angles(positions),
        mounting=np.eye(3) if mounting is None else mounting,
    )  # fmt: skip
    view = RowView.of(x, np.zeros((1, len(x))), state)
    parts = {"acc_bias": columns.bias(view), "acc_scale": columns.scale(view)}
    for term in state.terms:
        parts[term.effect.id] = effect_basis(term.effect, {}, 0).evaluate(view)
    slope = np.stack([_column(parts, n)[:, :3] for n in names], axis=2)
    return state.output(view.x, view.since)[:, :3], slope


def rows_at_session_end(x: Experience, alpha: Array, beta: Array) -> Experience:
    """Rows in further positions at the time and temperature of the last row of `x`.

    `alpha` and `beta` (n,) are the set angles, rad.
    """
    last = np.full(len(alpha), len(x) - 1)
    force: Array = direction_cosines(alpha, beta) @ x.base_force @ x.mounting
    return Experience.at_rest(
        alpha, beta, x.gravity, f=force, t=x.t[last], since_start=x.since_start[last],
        since_turn=x.since_turn[last], warming=x.warming[last],
        heating=x.heating[last], variance=x.variance[last], passed=x.passed[last],
        position=np.full(len(alpha), -1), base_force=x.base_force,
        base_rate=x.base_rate, mounting=x.mounting, latitude=x.latitude,
        gravity_sigma=x.gravity_sigma, transport=x.transport,
        joint_turns=x.joint_turns,
    )  # fmt: skip


def state_of(
    names: Sequence[str], values: Array, nominal: tuple[Array, Array] | None = None
) -> State:
    """The state of a device with given parameters, full names and (k,) values.

    Other parameters have their ideal values; bias and scale factor (6,) those of
    `nominal`, if given. Names of groups that are no effect of the catalogue with an
    equation are ignored.
    """
    known = dict(zip(names, values, strict=True))
    bias, scale = nominal or (np.zeros(6), np.ones(6))
    bias, scale = bias.astype(float), scale.astype(float)
    for c in range(6):
        sensor, axis = ("acc", "gyr")[c // 3], "xyz"[c % 3]
        bias[c] = known.get(f"{sensor}_bias.{axis}", bias[c])
        scale[c] = known.get(f"{sensor}_scale.{axis}", scale[c])
    groups = dict.fromkeys(group_of(n) for n in names)
    terms = [
        Term(e, np.array([known.get(f"{group}.{p.name}", 0.0) for p in e.params]))
        for group in groups
        if isinstance(e := catalogue().get(group), Motion | Sensor)
    ]
    return State(bias, scale, np.zeros((0, 2)), np.zeros(3), tuple(terms))


def design_matrix(
    names: Sequence[str],
    positions: Sequence[Position],
    gravity: float,
    mounting: Array | None = None,
) -> Array:
    """Derivatives (n, 3, k) as of `predict_outputs`, of an ideal device."""
    perfect = np.array([float(group_of(n) == "acc_scale") for n in names])
    return predict_outputs(names, perfect, positions, gravity, mounting)[1]


def _column(parts: dict[str, Array], name: str) -> Array:
    """Column (n, 6) of a parameter by its full name."""
    parameter = ParameterName.of(name)
    group = parameter.group
    if parameter.sensor == "acc":
        return parts[group][:, :, parameter.axis]
    at = catalogue()[group].names.index(parameter.component)
    return np.asarray(parts[group][:, :, at])
