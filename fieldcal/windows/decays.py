"""Decays behind turns, of outputs whose steps hide their noise.

An output that keeps a share k of the previous one goes to its value at rest along
A k^n, whatever its steps are. Where rounding is all that a decay leaves, k follows from
it; what is not such a decay leaves more, or leads elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.samples import Array, Mask
from fieldcal.windows.autoregression import SURELY, Share

LARGE_DECAY = 20.0
"""Least decay that is looked at, steps of the output."""

FAR = 5.0
"""Distance from the value at rest up to which a decay is looked at, steps."""

MIN_DECAY_SAMPLES, MIN_DECAYS = 8, 4
"""Fewest samples of a decay, and fewest decays."""


def share_by_decays(rests: Sequence[Array], step: Array) -> Share | None:
    """K by the decays behind turns, if most have the same; None otherwise.

    Parameters
    ----------
    rests : (m, k) outputs of each rest, of which the first may be on their way
    step : (k,) step of the grid that each output lies on

    """
    found = [
        one
        for y in rests
        for c in np.flatnonzero(~rounded_at_random(y[len(y) // 2 :], step))
        if (one := _decay(y[:, c], float(step[c]))) is not None
    ]
    if len(found) < MIN_DECAYS:
        return None
    middle = float(np.median([one.kept for one in found]))
    alike = [o for o in found if abs(o.kept - middle) < SURELY * o.sigma]
    if 2 * len(alike) <= len(found):
        return None
    weight = np.array([o.sigma**-2 for o in alike])
    kept = float(weight @ [o.kept for o in alike] / weight.sum())
    return Share(kept, float(weight.sum() ** -0.5))


def rounded_at_random(y: Array, step: Array) -> Mask:
    """Whether neighbours differ by as much as random rounding makes, each output.

    Where noise does not move an output from step to step, rounding hides it.
    """
    out: Mask = np.diff(y, axis=0).var(axis=0) > step**2 / 8
    return out


def _decay(y: Array, step: float) -> Share | None:
    """K by the decay of one output to its value at rest, (n,); None without one."""
    off = np.abs(y - y[-1])
    begun, far = off[: len(y) // 3] > off.max() / 2, off > FAR * step
    if off.max() < LARGE_DECAY * step or not begun.any():
        return None
    first = int(np.flatnonzero(begun)[-1])
    part = y[first : np.flatnonzero(far)[-1] + 1]
    if len(part) < MIN_DECAY_SAMPLES:
        return None
    old, middle, new = (p - p.mean() for p in (part[:-2], part[1:-1], part[2:]))
    kept = float(old @ new / (old @ middle))
    if not 0 < kept < 1:
        return None
    curve: Array = np.vander([kept], len(y) - first, increasing=True).T
    curve = np.hstack([curve, np.ones_like(curve)])
    fitted = np.linalg.lstsq(curve[: len(part)], part, rcond=None)[0]
    left: Array = y[first:] - curve @ fitted
    if float(left[: len(part)].std()) > step or abs(left[-1]) > 2 * step:
        return None
    rounding = step * np.sqrt((1 + kept**2) / 12)
    return Share(kept, float(rounding / np.sqrt(middle @ middle)))
