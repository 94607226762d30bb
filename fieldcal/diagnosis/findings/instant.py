"""The instant of a change, from the samples around it.

With z the samples less the output of the model before the change, and A_i the change of
each channel in the position of sample i, the instant k is that at which

    S(k) = sum_{i<k} z_i^2 + sum_{i>=k} (z_i - A_i)^2

is smallest, in units of the noise; its uncertainty is the spread of exp(-S / 2). S is
first calculated from the means in the rows, to find the samples between which the
instant can be.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array, Mask
from fieldcal.diagnosis.explain import Explanation
from fieldcal.model import thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.sizing import Member
from fieldcal.physics.effect import Sensor
from fieldcal.physics.experience import Experience


def estimate_instant(explanation: Explanation, member: Member) -> tuple[float, float]:
    """Instant of a change, s of device time, and its standard uncertainty."""
    _, group = member
    (at,) = group.shape.values()
    rows, block = explanation.rows, explanation.source.block
    known = _fitted_changes(explanation, member)
    scale, before = explanation.state.scale, dict.fromkeys(group.shape, -np.inf)
    jump = _change_of_outputs(rows.x, scale, known)
    plain = rows.y - explanation.best.residual() - jump
    change = _change_of_outputs(rows.x, scale, known, before)
    residual = np.where(rows.used, rows.y - plain, np.nan)
    low, high = _possible_instants(explanation, _squares(residual, change, rows.sd), at)
    part = slice(*np.searchsorted(block.t, [low, np.nextafter(high, np.inf)]))
    t, six = block.t[part], block.six[part]
    row = np.clip(np.searchsorted(rows.span[:, 1], t), 0, len(rows.x.t) - 1)
    held = _at_rest(explanation, t)[:, None] & explanation.source.usable[part]
    z = np.where(held, six - plain[row], np.nan)
    noise = np.where(rows.noise > 0, rows.noise, np.inf)
    squares, edges = _squares(z, change[row], noise), np.concatenate([t, [high]])
    weight = np.exp(-0.5 * (squares - squares.min()))
    width = np.gradient(edges)
    weight = weight * width / (weight * width).sum()
    best = float(weight @ edges)
    spread = float(np.sqrt(weight @ (edges - best) ** 2))
    sampled = float(np.median(np.diff(block.t[:1000]))) / 2
    return best, float(np.hypot(spread, sampled))


def _squares(z: Array, change: Array, noise: Array) -> Array:
    """S of changes before each instant and after the last, (n + 1,), less a constant.

    `z` (n, 6) are samples less the model without the change, nan where missing.
    """
    gained = np.nan_to_num(((z - change) ** 2 - z**2) / noise**2).sum(axis=1)
    return np.concatenate([np.cumsum(gained[::-1])[::-1], [0.0]])


def _possible_instants(
    explanation: Explanation, squares: Array, at: float
) -> tuple[float, float]:
    """First and last possible instant of the change, s, by S before each row."""
    span = explanation.rows.span
    near = int(np.searchsorted(explanation.rows.x.t, at))
    instants = np.append(
        np.flatnonzero(squares < squares.min() + thresholds.IN_CHANNEL), near
    )
    first = max(int(instants.min()) - 1, 0)
    last = min(int(instants.max()), len(span) - 1)
    return float(span[first, 0]), float(span[last, 1])


def _at_rest(explanation: Explanation, t: Array) -> Mask:
    """Whether samples at times t (n,) lie within a row, (n,)."""
    span = explanation.rows.span
    row = np.clip(np.searchsorted(span[:, 1], t), 0, len(span) - 1)
    inside: Mask = (t >= span[row, 0]) & (t <= span[row, 1])
    return inside


def _fitted_changes(
    explanation: Explanation, member: Member
) -> list[tuple[Group, Array]]:
    """Groups of the change, one for each triad, with their parameters (k,)."""
    estimate = explanation.best.estimate
    return [
        (group, estimate[group.columns])
        for cause, group in explanation.best.set.members
        if cause.name == member[0].name and isinstance(group.effect, Sensor)
    ]


def _change_of_outputs(
    x: Experience,
    scale: Array,
    known: list[tuple[Group, Array]],
    shape: Mapping[str, float] | None = None,
) -> Array:
    """Outputs (n, 6) that the change adds to rows, at its instant or another one."""
    out = np.zeros((len(x), 6))
    for group, values in known:
        if isinstance(group.effect, Sensor):
            design = group.effect.design(x, shape or group.shape)
            change = design[:, :, list(group.params)] @ values
            out += change * group.effect.gain(scale)
    return out
