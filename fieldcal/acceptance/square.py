"""Whether a result relies on axes that are square.

Cross-coupling that is not estimated is what the factory left, and hardly anything in
few positions would contradict more of it. Whoever decides has to know what is relied
on.
"""

from __future__ import annotations

from fieldcal.acceptance.check import Check
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import group_of, sensor_of
from fieldcal.session.description import Description


def relies_on_square_axes(
    found: Calibration, about: Description, limits: GradeLimits
) -> list[Check]:
    """How square the axes were taken to be, if cross-coupling was not estimated."""
    square = float(found.info.get("square_sigma") or 0.0)
    if not square or not any(sensor_of(group_of(n)) == "acc" for n in found.names):
        return []
    said = about.squareness is not None or square != limits.squareness
    whose = "as stated" if said else "as usual for the grade"
    says = (
        f"this relies on axes that are square to ± {100 * square:.2g} %, {whose}; each"
        " ± includes it. An uncalibrated device has more: estimate cross-coupling from"
        " nine positions or more (--cross)"
    )
    return [Check("cross-coupling", None, says)]
