"""When something changed, from the samples about it.

With z the samples less what the rows' model makes of them before the change, and A the
change of each channel, the instant k is where

    S(k) = sum_{i<k} z_i^2 + sum_{i>=k} (z_i - A)^2

is least, over the noise; its uncertainty is the spread of exp(-S / 2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.diagnosis.explain import Explanation
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.sizing import Member
from fieldcal.physics.effect import Sensor

ROWS = 2
"""Rows to either side of the one in which it is sought."""


def instant(explanation: Explanation, member: Member) -> tuple[float, float]:
    """Instant of a change, s of device time, and its standard uncertainty."""
    _, group = member
    (at,) = group.shape.values()
    rows, block = explanation.rows, explanation.prepared.source.block
    near = int(np.searchsorted(rows.x.t, at))
    low = float(rows.span[max(near - ROWS, 0), 0])
    high = float(rows.span[min(near + ROWS, len(rows.x.t)) - 1, 1])
    part = slice(*np.searchsorted(block.t, [low, np.nextafter(high, np.inf)]))
    t, six = block.t[part], block.six[part]
    change, before = _change(explanation, member)
    plain = _plain(explanation, change, group, t)
    held = _held(explanation, t)[:, None] & explanation.prepared.source.usable[part]
    z = np.where(held, six - plain, np.nan)
    noise = np.where(rows.noise > 0, rows.noise, np.inf)
    gained = np.nan_to_num(((z - change) ** 2 - z**2) / noise**2).sum(axis=1)
    squares = np.concatenate([np.cumsum(gained[::-1])[::-1], [0.0]])
    edges = np.concatenate([t, [high]])
    weight = np.exp(-0.5 * (squares - squares.min()))
    width = np.gradient(edges)
    weight = weight * width / (weight * width).sum()
    best = float(weight @ edges)
    spread = float(np.sqrt(weight @ (edges - best) ** 2))
    return best, float(np.hypot(spread, before))


def _held(explanation: Explanation, t: Array) -> NDArray[np.bool_]:
    """Samples at rest, in one of the rows, (n,)."""
    span = explanation.rows.span
    row = np.clip(np.searchsorted(span[:, 1], t), 0, len(span) - 1)
    inside: NDArray[np.bool_] = (t >= span[row, 0]) & (t <= span[row, 1])
    return inside


def _change(explanation: Explanation, member: Member) -> tuple[Array, float]:
    """By how much each channel changes, (6,), and half a sample's time, s."""
    change = np.zeros(6)
    name = member[0].name
    estimate = explanation.best.estimate
    for cause, group in explanation.best.set.members:
        if cause.name == name and group.effect is not None:
            for j, column in zip(group.params, group.columns, strict=True):
                c = CHANNELS.index(group.effect.params[j].name)
                change[c] = estimate[column]
    t = explanation.prepared.source.block.t
    return change, float(np.median(np.diff(t[:1000]))) / 2


def _plain(explanation: Explanation, change: Array, group: Group, t: Array) -> Array:
    """What the rows' model makes of samples, without the change, (n, 6)."""
    rows = explanation.rows
    fitted = rows.y - explanation.best.residual()
    if isinstance(group.effect, Sensor):
        fitted = fitted - group.effect.design(rows.x, group.shape) @ change
    row = np.clip(np.searchsorted(rows.span[:, 1], t), 0, len(rows.x.t) - 1)
    out: Array = fitted[row]
    return out
