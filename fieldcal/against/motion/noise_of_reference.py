"""Noise that a reference of the motion was found to have, in figures."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.against.motion.explanation import MotionExplanation
from fieldcal.against.motion.fit import column_estimates
from fieldcal.core.samples import UNITS
from fieldcal.diagnosis.result import Quantity
from fieldcal.diagnosis.wording.paragraph import with_uncertainty
from fieldcal.model.causes.cause import TRIADS
from fieldcal.model.causes.motion_dictionary import REFERENCE_NOISE

NAMES = {"acc": "accelerometers", "gyr": "gyroscopes"}

MIN_NOISE_SIGMAS = 3.0
"""Least noise that is told, in its standard uncertainties."""


def noise_densities(found: MotionExplanation) -> Iterator[tuple[str, str]]:
    """Triads of a reference whose noise shows, with its density and unit."""
    noise = found.rows.noise
    causes = {c.part: g for c, g in found.set.members if c.name == REFERENCE_NOISE}
    for i, (part, channels) in enumerate(TRIADS):
        if (group := causes.get(part)) is None:
            continue
        (share,), ((square,),), _ = column_estimates(found.set.state, group.columns)
        sigma = float(np.sqrt(square))
        if share > MIN_NOISE_SIGMAS * sigma:
            density = float(np.sqrt(share * noise.variance[i] * noise.step))
            unit = f"{UNITS[channels[0]]}/sqrt(Hz)"
            off = density * sigma / share / 2
            yield NAMES[part], with_uncertainty(Quantity(density, off, unit))
