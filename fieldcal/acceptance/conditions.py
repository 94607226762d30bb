"""Conditions of the recording: temperature and losses of the link."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fieldcal.acceptance.check import Check
from fieldcal.calibration.limits import GradeLimits


def check_temperature(
    temperatures: np.ndarray[Any, Any], limits: GradeLimits
) -> list[Check]:
    """Check the range of temperatures, and the change between windows."""
    known = temperatures[np.isfinite(temperatures)]
    if not len(known):
        return [Check("temperature", None, "the device reports no temperature")]
    low, high = float(known.min()), float(known.max())
    least, most = limits.temperature_min_c, limits.temperature_max_c
    ok = least <= low and high <= most
    says = (
        f"the temperature was {low:.1f} to {high:.1f} °C, allowed {least:g} to"
        f" {most:g} °C"
    )
    span, wide = high - low, limits.temperature_span_k
    steady = span <= wide
    changed = (
        f"the temperature changed by {span:.1f} K from window to window, allowed"
        f" {wide:g} K{'' if steady else ': let the device warm up, then record again'}"
    )
    far = low if low < least else high
    bound = least if low < least else most
    return [
        Check("temperature", ok, says, far, bound, "°C"),
        Check("temperature change", steady, changed, span, wide, "K"),
    ]


def check_link(link: Mapping[str, int] | None, limits: GradeLimits) -> list[Check]:
    """Check the shares of lost samples and of refused frames."""
    if not link or not link.get("samples"):
        return [Check("link", None, "losses of the link were not recorded")]
    taken, checks = link.get("taken", link["samples"]), []
    for name, count, good, limit in (
        ("samples missing", link.get("missing"), link["samples"], limits.lost_share),
        ("frames refused", link.get("bad", 0), taken, limits.bad_share),
    ):
        if count is None:
            says = f"the times are too uneven to show {name}"
            checks.append(Check(f"link: {name}", None, says))
            continue
        share = count / (good + count)
        ok = share <= limit
        says = (
            f"{count} of {good + count} {name} ({share:.2%}), allowed {limit:.2%}"
            f"{'' if ok else ': check the cable and the baud rate'}"
        )
        checks.append(Check(f"link: {name}", ok, says, share, limit, "1"))
    return checks
