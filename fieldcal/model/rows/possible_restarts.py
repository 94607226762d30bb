"""Gaps between positions in which the device may have restarted, with other biases.

Between positions, a restart shows only as a gap. A gap is none where the device's own
clock, or its counter of samples, went on meanwhile: both begin anew at a restart.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.core.sampling import sampling_rate
from fieldcal.model import detections, priors, thresholds
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.session.description import Description


def possible_restarts(block: Block, about: Description) -> list[tuple[float, float]]:
    """End of the position before and start of the one after each such gap, s."""
    bound = window_bounds(block, about)
    held = bound[bound[:, 1] > bound[:, 0]]
    held = held[np.argsort(held[:, 0])]
    least = max(detections.MIN_GAP_S, detections.MIN_GAP_PERIODS / sampling_rate(block))
    out = []
    for (_, end), (start, _) in zip(held[:-1], held[1:], strict=True):
        first = max(int(end) - 1, 0)
        gaps = first + np.flatnonzero(np.diff(block.t[first : start + 1]) > least)
        if any(
            not (_ran_by_its_clock(block.t, i, about) or counted_on(block, i))
            for i in gaps.tolist()
        ):
            out.append((float(block.t[first]), float(block.t[start])))
    return out


def _ran_by_its_clock(t: Array, i: int, about: Description) -> bool:
    """Whether the session says that the device's clock went on after sample i."""
    middle = (t[i] + t[i + 1]) / 2
    return any(start < middle < end for start, end in about.gaps_without_restart)


def counted_on(block: Block, i: int) -> bool:
    """Whether the device's counter shows that it counted from sample i to the next.

    It does if it counted as many samples as came in that time otherwise, and if one
    that began anew would not look the same by chance: one of 8 bits does.
    """
    seq, t = block.seq, block.t
    if not np.isfinite(seq).all():
        return False
    if np.isfinite(block.t_host[[i, i + 1]]).all():  # t may be made of the counter
        t = block.t_host
    steps = np.diff(seq)
    if np.median(steps) != 1.0:
        return False
    expected = (t[i + 1] - t[i]) * sampling_rate(block)
    error = (
        1.0
        + priors.SAMPLE_ARRIVAL_S * sampling_rate(block)
        + priors.RATE_ERROR * expected
    )
    span = next((n for n in detections.COUNTERS if seq.max() < n), np.inf)
    off = steps[i] - expected
    if np.isfinite(span):
        off = (off + span / 2) % span - span / 2
    return bool(abs(off) < error and (2 * error + 1) / span < thresholds.LOOKED_AT)
