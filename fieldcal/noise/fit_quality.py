"""How well processes explain a channel: prediction, excess and scatter of bins."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.likelihood import Flags, NoiseFit, Powers


def predicts_better(more: NoiseFit, less: NoiseFit) -> bool:
    """Whether the gain of held-out coefficients exceeds its standard error.

    Twice the gain in likelihood is noncentral chi squared: its standard error is twice
    its root.
    """
    gain = float((more.scores - less.scores).sum())
    likely = max(more.log_likelihood - less.log_likelihood, 0.0)
    return bool(gain > np.sqrt(2 * likely))


def excess_of_bins(powers: Powers, found: NoiseFit) -> Array:
    """Excess of each bin over the model, in standard errors, (b,)."""
    count = powers.count.sum(axis=1)
    ratio = powers.power.sum(axis=1) / np.maximum(count, 1e-300) / found.level
    excess: Array = np.where(count > 0, (ratio - 1) * np.sqrt(count / 2), 0.0)
    return excess


def dispersion_of_bins(powers: Powers, found: NoiseFit) -> float:
    """Mean squared excess of the bins that the model explains, at least 1."""
    some: Flags = ~powers.free & (powers.count.sum(axis=1) > 1)
    freedom = int(some.sum()) - len(found.x)
    if freedom < 1:
        return 1.0
    squares = float(np.sum(excess_of_bins(powers, found)[some] ** 2)) / freedom
    # exceeded by chance in one of forty
    return squares if squares > 1 + 2 * np.sqrt(2 / freedom) else 1.0
