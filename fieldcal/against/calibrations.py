"""Bias and scale factor of two recordings of one device.

Biases wander between sessions as much as within one, since flicker has the same power
in every octave. The covariance of a bias includes that scatter.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.against.cause_values import cause_quantities
from fieldcal.against.one_device import GroupBesideEffect, SideOfDevice
from fieldcal.against.widened import WidenedSet
from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.calibrated import GROUP_UNITS
from fieldcal.model.causes.cause import Group
from fieldcal.model.posterior.mixture import covariance_of_means
from fieldcal.model.posterior.model_average import average_of_columns

DETERMINED = {"acc_bias": 1.0, "acc_scale": 0.1, "gyr_bias": 0.1, "gyr_scale": 0.1}
"""Sigma from which a difference counts as not determined, m/s^2, rad/s, 1."""


def shared_axes(one: WidenedSet, two: WidenedSet) -> Iterator[tuple[str, Index]]:
    """Groups of a calibration, with the channels that two sessions both have."""
    for name in GROUP_UNITS:
        groups = [_group(w, name) for w in (one, two)]
        axes = [
            _channels_of_group(w, g)
            for w, g in zip((one, two), groups, strict=True)
            if g
        ]
        if len(axes) == len(groups) and len(both := np.intersect1d(axes[0], axes[1])):
            yield name, both


def sides_of_device(
    one: WidenedSet, two: WidenedSet, key: str
) -> tuple[SideOfDevice, SideOfDevice]:
    """Calibrations of two sessions beside an effect, of the channels that both have."""
    shared = list(shared_axes(one, two))
    ours, theirs = (
        SideOfDevice(
            [_beside_effect(w, name, axes, key) for name, axes in shared],
            w.information_beside_calibration(key),
        )
        for w in (one, two)
    )
    return ours, theirs


def _beside_effect(
    there: WidenedSet, name: str, axes: Index, key: str
) -> GroupBesideEffect:
    """A group of one session's calibration beside an effect."""
    values, covariance, slope = there.beside_effect(key, _first(there, name) + axes)
    covariance_without = covariance + _wander(there.without(key), name, axes)
    return GroupBesideEffect(
        values + _nominal(there, name)[axes],
        covariance_without,
        slope,
        covariance + _wander(there, name, axes) - covariance_without,
        _typical(there, name, axes),
    )


def calibration_group(
    there: WidenedSet, name: str, axes: Index
) -> tuple[Array, Array, Array]:
    """A group of one session's calibration.

    Parameters
    ----------
    there : the session
    name : acc_bias, acc_scale, gyr_bias or gyr_scale
    axes : (k,) channels

    Returns
    -------
    values (k,) and covariance (k, k), m/s^2, rad/s or 1, and typical sizes (k,)

    """
    values, covariance = there.estimate(_first(there, name) + axes)
    return (
        values + _nominal(there, name)[axes],
        covariance + _wander(there, name, axes),
        _typical(there, name, axes),
    )


def _first(there: WidenedSet, name: str) -> int:
    """Column of the first axis of biases or scale factors."""
    d = there.fit.dictionary
    return d.bias if name.endswith("bias") else d.scale


def _nominal(there: WidenedSet, name: str) -> Array:
    """Nominal biases or scale factors, (6,)."""
    nominal = there.fit.nominal
    return nominal.bias if name.endswith("bias") else nominal.scale


def _wander(there: WidenedSet, name: str, axes: Index) -> Array:
    """Covariance of a group by which it differs from session to session, (k, k)."""
    if not name.endswith("bias"):
        return np.zeros((len(axes), len(axes)))
    return np.diag(bias_wander(there, axes) ** 2)


def _typical(there: WidenedSet, name: str, axes: Index) -> Array:
    """Typical sizes of a group, (k,).

    Raises
    ------
    KeyError
        If the session has no such group.

    """
    if (group := _group(there, name)) is None:
        raise KeyError(name)
    typical: Array = group.typical[np.isin(group.columns, _first(there, name) + axes)]
    return typical


def scatter_between_sets(explanation: Explanation, name: str, axes: Index) -> Array:
    """Covariance of a calibration's scatter over the probable sets, (k, k).

    A cause and its alias lead to different biases and scale factors.
    """
    d = explanation.dictionary
    columns = (d.bias if name.endswith("bias") else d.scale) + axes
    sets = explanation.model_average.sets
    weight = np.array([w for _, w in sets])
    weight /= weight.sum()
    means = np.array([average_of_columns([(s, 1.0)], columns)[0] for s, _ in sets])
    return covariance_of_means(means, weight)


def bias_wander(there: WidenedSet, axes: Index) -> Array:
    """Standard deviation of biases within a session, (k,) of some channels.

    It combines the instability from window to window and the rms q sqrt(T / 3) of the
    mean of a random walk.
    """
    tau = there.sets.instability_sigma(there.set.sizes.instability)
    square = tau[axes] ** 2
    length = float(np.ptp(there.fit.dictionary.x.t))
    for member in there.set.members:
        for name, q in cause_quantities(there, member).items():
            if member[0].kind == "random" and name in CHANNELS:
                square[axes == CHANNELS.index(name)] += float(q.value) ** 2 * length / 3
    out: Array = np.sqrt(square)
    return out


def _group(there: WidenedSet, name: str) -> Group | None:
    part, _, cause = name.partition("_")
    always = there.fit.dictionary.always
    return next((g for g in always if g.cause == cause and g.part == part), None)


def _channels_of_group(there: WidenedSet, group: Group) -> Index:
    d = there.fit.dictionary
    return group.columns - (d.bias if group.cause == "bias" else d.scale)
