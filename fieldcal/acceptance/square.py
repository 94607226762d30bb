"""Whether a result relies on axes that are square.

Cross-coupling that is not estimated is taken as zero. Unfavourable positions magnify
what the device has of it, beyond every stated uncertainty and unseen: nothing in the
recording contradicts it. Whoever decides has to know what is relied on.
"""

from __future__ import annotations

from fieldcal.acceptance.check import Check, shown_unit
from fieldcal.calibration import COMPONENTS, Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import group_of


def relies_on_square_axes(found: Calibration, limits: GradeLimits) -> list[Check]:
    """What cross-coupling may be at most, where positions magnify it."""
    told = found.info.get("cross_coupling_left_out")
    if not told:
        return []
    name, group = str(told["parameter"]), group_of(str(told["parameter"]))
    limit = limits.sigma(group)
    if limit is None:
        return []
    most = 100 * limit / float(told["moved_by_one"])
    unit = shown_unit(COMPONENTS[group][1])
    says = (
        f"this relies on axes that are square to ± {most:.2g} %: cross-coupling is"
        f" taken as zero, and so much of it moves {name} by {limit:.2g}{unit}, its"
        " limit; estimate it from nine positions or more (--cross)"
    )
    return [Check("cross-coupling", None, says, most / 100, None, "1")]
