"""Warnings about an estimate, one sentence each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fieldcal.core.chances import chi2_tail
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.core.sentences import join
from fieldcal.model import thresholds

NO_DOF = "no degree of freedom: the residual says nothing; add a verification position"

NO_SCALE = (
    "gyr_scale is not determined: the Earth's rate is too weak for it in windows like "
    "these; the turns between the positions give it"
)

FEW = {1: "one degree of freedom", 2: "two degrees of freedom"}


def not_determined(missing: Sequence[str], remedy: Sequence[str], what: str) -> str:
    """Name parameters that the data leave open, and what would fix it."""
    verb = "are" if len(missing) > 1 else "is"
    cure = f": add {join(remedy)}" if remedy else ""
    return f"{join(missing)} {verb} not determined by {what}{cure}"


def chance(chi2: float, dof: int) -> float:
    """Probability of a chi2 at least as large when only the stated noise acts."""
    return chi2_tail(chi2, dof) if dof > 0 else 1.0


def excess(what: str, chi2: float, dof: int, spread: float, unit: str) -> str:
    """Tell of scatter beyond the noise; nothing where there is none."""
    if chi2 <= dof or chance(chi2, dof) >= thresholds.BEYOND_NOISE:
        return ""
    few = "; of so few degrees of freedom it is itself uncertain" if dof < 5 else ""
    cause = "diagnosis can say where it comes from"
    if what == "positions":
        angle = np.rad2deg(spread / G0)
        cause = (
            f"either the angles are set no better than {angle:.1g}°, or diagnosis can"
            " say what the model leaves out"
        )
    return (
        f"the {what} disagree with the model beyond their windows' noise "
        f"(chi2 {chi2:.0f} with dof {dof}): an extra scatter of {spread:.2g} {unit} is "
        f"in the uncertainties{few}, and {cause}"
    )


def carried(
    sure: float,
    causes: Mapping[str, float],
    names: Sequence[str],
    moved: Array,
    ended_s: float | None,
) -> str:
    """Tell what is in a result that was not asked for; nothing where it may not be.

    Parameters
    ----------
    sure : probability that something is there
    causes : probability by id of the effect
    names, moved : parameters, and by how many sigmas each moves with it
    ended_s : when biases are as stated, s since the start; None if they stay

    """
    if sure < thresholds.NAMED:
        return ""
    listed = join(
        [
            f"{i} (probability {p:.2f})"
            for i, p in causes.items()
            if p >= thresholds.MENTIONED
        ]
    )
    worst = int(np.abs(moved).argmax())
    when = ""
    if ended_s is not None:
        when = (
            " biases and scale factors are those at the end of the recording,"
            f" {ended_s:.0f} s after its start, and"
        )
    return (
        f"the recording shows {listed}, which the result carries:{when} the"
        f" uncertainties are with it; without it {names[worst]} would be"
        f" {abs(moved[worst]):.1f} σ off; fieldcal diagnose says what to do"
    )
