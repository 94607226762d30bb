"""A step in time."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.experience import Experience


def step_course(x: Experience, at_s: float) -> Array:
    """0 before an instant, device time, s, and 1 after it, (n,).

    A mean over the instant has the part of it that lies after.
    """
    after = x.t - at_s
    part = after / np.where(x.lasts > 0, x.lasts, 1.0) + 0.5
    out: Array = np.where(x.lasts > 0, np.clip(part, 0.0, 1.0), after >= 0)
    return out
