"""The instant at which the device came to rest in each position.

Between two windows the device is turned. It arrives at the last sign of motion in the
gyroscopes or, if there are none, in the accelerometers. An effect that settles after a
turn may start at the arrival, or at a fixed time before the window, when the fixture
was clamped and the hands were taken off.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.core.sampling import sampling_rate
from fieldcal.model import detections
from fieldcal.model.rows.block_means import block_means
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.session.description import Description


def rest_instants(block: Block, about: Description, noise: Array) -> Array:
    """Instant from which the device was at rest in each position, (p,) s."""
    windows = window_bounds(block, about)
    m = max(2, round(detections.MOTION_MEAN_S * sampling_rate(block)))
    out = np.full(len(windows), block.t[0])
    before = 0
    for p, (first, last) in enumerate(windows):
        if last > first >= before:
            held = block_means(block, windows[p : p + 1])[0][0]
            moved = _last_motion(block[before:first].six, held, noise, m)
            out[p] = block.t[before + moved if before else 0]
            before = int(last)
    return out


def _last_motion(gap: Array, held: Array, noise: Array, m: int) -> int:
    """Samples of a gap up to the last motion; `held` is the next window's mean."""
    whole = len(gap) // m
    if not whole:
        return len(gap)
    start = len(gap) - whole * m
    mean = gap[start:].reshape(whole, m, 6).mean(axis=1)
    limit = np.maximum(
        detections.ONSET_SIGMAS * noise / np.sqrt(m),
        [detections.MAX_REST_FORCE] * 3 + [detections.MAX_REST_RATE] * 3,
    )
    moving = np.abs(mean - held) > limit
    rated = bool(np.isfinite(mean[:, 3:]).all())
    at = np.flatnonzero((moving[:, 3:] if rated else moving[:, :3]).any(axis=1))
    return start + (int(at[-1]) + 1) * m if len(at) else 0


def window_starts(source: RowSource) -> Array:
    """Start of each window, (p,) s; of a position without one, the start of rest."""
    windows = source.about.windows
    starts = [np.nan if w is None else w[0] for w in windows] or [source.block.t[0]]
    return np.where(np.isnan(starts), source.rest_began, starts)
