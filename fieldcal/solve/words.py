"""Warnings about an estimate, one sentence each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.probability import chi2_tail
from fieldcal.core.samples import Array
from fieldcal.core.sentences import degrees_of_freedom, join_words
from fieldcal.model import detections, thresholds

NO_DOF = "no degree of freedom is left to check the fit: add a verification position"

RECORD_TURNS = (
    "record the turns between the positions, each within"
    f" {detections.MAX_TURN_S:g} s and without a gap"
)
"""Remedy where no turn could be followed, which may have been recorded."""

NO_SCALE = (
    "gyr_scale is not determined: the Earth's rate is too weak for it in such windows; "
    f"{RECORD_TURNS}, which determine it"
)

SPELLED_DOF = {1: "one degree of freedom", 2: "two degrees of freedom"}


IN_WORDS = {
    "misset": "a position that was set at another angle",
    "repeated_angle": "an angle that is wrong wherever it is set",
    "flicker": "flicker noise of the biases",
    "time": "a course in time that no effect has",
    "temperature": "a dependence on temperature that no effect has",
    "force and time": "a scale factor that changes in time as no effect does",
}
"""Words for causes that are not effects, by id."""


def not_determined(missing: Sequence[str], remedy: Sequence[str], what: str) -> str:
    """Sentence about parameters that are not determined, with the remedy."""
    verb = "are" if len(missing) > 1 else "is"
    cure = f": add {join_words(remedy)}" if remedy else ""
    return f"{join_words(missing)} {verb} not determined by {what}{cure}"


def chi2_chance(chi2: float, dof: int) -> float:
    """Probability of a chi2 at least as large when only the stated noise acts."""
    return chi2_tail(chi2, dof) if dof > 0 else 1.0


def scatter_warning(what: str, chi2: float, dof: int, spread: float, unit: str) -> str:
    """Warning of scatter beyond the noise; empty if there is none."""
    if chi2 <= dof or chi2_chance(chi2, dof) >= thresholds.BEYOND_NOISE:
        return ""
    few = (
        " (itself uncertain, with so few degrees of freedom)"
        if dof < thresholds.FEW_DOF
        else ""
    )
    cause = "run fieldcal diagnose to see where it comes from"
    if what == "positions":
        angle = np.rad2deg(spread / G0)
        cause = (
            f"either the angles are set no better than {angle:.1g}°, or the model"
            " leaves something out, which fieldcal diagnose may name"
        )
    return (
        f"the {what} scatter more than the noise of their windows "
        f"(χ² = {chi2:.0f} with {degrees_of_freedom(dof)}): the uncertainties include "
        f"an additional scatter of {spread:.2g} {unit}{few}; {cause}"
    )


def effects_warning(
    sure: float,
    causes: Mapping[str, float],
    names: Sequence[str],
    moved: Array,
    ended_s: float | None,
    changing: Mapping[str, float],
) -> str:
    """Warning of unrequested effects in a result; empty if they are unlikely.

    Parameters
    ----------
    sure : probability that any effect is there
    causes : probability by id of the effect
    names, moved : parameters, and by how many sigmas the effects move each
    ended_s : time for which biases are stated, s since the start; None if constant
    changing : probability of all that may change biases, noise too, by its id

    """
    if sure < thresholds.NAMED:
        return ""
    likely = {i: p for i, p in causes.items() if p >= thresholds.MENTIONED}
    listed = _listed(likely)
    if not names:
        return f"the recording shows {listed}; fieldcal diagnose says what to do"
    worst = int(np.abs(moved).argmax())
    when = ""
    if ended_s is not None:
        when = (
            " biases and scale factors are stated for the end of the recording,"
            f" {ended_s:.0f} s after its start{_why_at_end(changing, likely)}, and"
        )
    return (
        f"the recording shows {listed}, and the result takes it into account:{when}"
        f" the uncertainties include it; otherwise {names[worst]} would be off by"
        f" {abs(moved[worst]):.1f} σ; fieldcal diagnose says what to do"
    )


def _listed(causes: Mapping[str, float]) -> str:
    """Causes in words with their probabilities."""
    return join_words(
        [f"{IN_WORDS.get(i, i)} (probability {p:.2f})" for i, p in causes.items()]
    )


def _why_at_end(changing: Mapping[str, float], likely: Mapping[str, float]) -> str:
    """What changes biases, as part of a sentence; empty if that is listed already."""
    seen = bool({*changing} & {*likely})
    more = {
        i: p
        for i, p in changing.items()
        if i not in likely and (p >= thresholds.MENTIONED or not seen)
    }
    if not more:
        return ""
    return f", as {_listed(more)} may change them{' too' if seen else ''}"
