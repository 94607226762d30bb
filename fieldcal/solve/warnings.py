"""Warnings about a calibration: undetermined parameters, missing checks, scatter.

Each is one sentence that also says what to do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.calibration import Method
from fieldcal.calibration.names import AXES, ParameterName, group_of
from fieldcal.core.gravity import normal_gravity
from fieldcal.core.samples import CHANNELS
from fieldcal.core.samples import UNITS as CHANNEL_UNITS
from fieldcal.core.sentences import join_words
from fieldcal.model import thresholds
from fieldcal.solve import words
from fieldcal.solve.doubtful_position import DoubtfulPosition
from fieldcal.solve.estimation import ParameterEstimate, closure_scatter, window_scatter
from fieldcal.solve.observations import Observations
from fieldcal.solve.options import SolveOptions
from fieldcal.solve.rank import ladder_remedy

OF_ACC = frozenset(
    {"acc_bias", "acc_scale", "cross_coupling", "angle_offset", "base_tilt"}
)
"""Groups that the accelerometers at rest determine."""

OF_TURNS = frozenset({"gyr_scale", "gyro_cross_coupling"})
"""Groups that turns determine."""


def undetermined_warnings(
    method: Method, observations: Observations, estimate: ParameterEstimate
) -> list[str]:
    """Parameters that are not determined, and positions that would determine them."""
    sentences = []
    acc = [n for n in estimate.undetermined if group_of(n) in OF_ACC]
    if acc and estimate.parameter_set.options.level_deg is not None:
        acc = [n for n in acc if group_of(n) != "base_tilt"]
    if acc:
        if method == "scalar":
            sentences.append(_norm_warning(acc, estimate, len(observations)))
        else:
            cure = _remedy(observations, estimate)
            sentences.append(words.not_determined(acc, cure, "these positions"))
        if not any(group_of(n) in OF_ACC for n in estimate.names):
            sentences.append(_force_length_warning(observations))
    gyr = [n for n in estimate.undetermined if group_of(n) == "gyr_scale"]
    if estimate.parameter_set.x.clock_sigma >= thresholds.USEFUL_TURNED:
        gyr = []  # no further turns would help: `clock_warnings`
    cross = [n for n in estimate.undetermined if group_of(n) == "gyro_cross_coupling"]
    if not estimate.parameter_set.options.gyr_scale and observations.has_gyr:
        sentences.append(
            "gyr_scale is not determined: the Earth's rate gives it only with two "
            "known positions and the latitude"
            if observations.grade == "navigation"
            else words.NO_SCALE
        )
    elif gyr or cross:
        sentences.append(_gyroscope_warning(gyr, cross, observations, estimate))
    return sentences


def _force_length_warning(observations: Observations) -> str:
    """Warning that the force at rest is not gravity, if no parameter explains it.

    Empty if it is within the range of gravity on the Earth.
    """
    nominal = observations.nominal
    force = (observations.mean[:, :3] - nominal.acc_bias) / nominal.acc_scale
    length = np.linalg.norm(force[np.isfinite(force).all(axis=1)], axis=1)
    size, known = float(length.mean()) if len(length) else 0.0, observations.gravity
    most = max(abs(normal_gravity(at) - known) for at in (0.0, 90.0))
    if not len(length) or abs(size - known) <= most:
        return ""
    return (
        f"|a| at rest is {size:.3f} m/s², {100 * (size / known - 1):+.1f} % from"
        " gravity: biases or scale factors of the accelerometers are off by as much,"
        " and these orientations do not show which; add positions in other"
        " orientations"
    )


def _remedy(observations: Observations, estimate: ParameterEstimate) -> list[str]:
    """Positions that would determine parameters of the accelerometers."""
    names = [n for n in estimate.parameter_set.names if group_of(n) in OF_ACC]
    if (
        any(n in estimate.undetermined for n in names)
        and not observations.rotating.any()
    ):
        return ladder_remedy(observations, names)
    return []


def _gyroscope_warning(
    gyr: Sequence[str],
    cross: Sequence[str],
    observations: Observations,
    estimate: ParameterEstimate,
) -> str:
    """Gyroscope parameters that turns or rates do not determine, with the remedy."""
    coefficients = f"gyro_cross_coupling ({len(cross)} of its 6 coefficients)"
    missing = [*gyr, *([coefficients] if cross else [])]
    if not estimate.parameter_set.options.turned and not observations.rotating.any():
        return (
            f"{join_words(missing)} {'are' if missing[1:] else 'is'} not estimated:"
            f" the Earth's rate shows {'them' if missing[1:] else 'it'} only roughly in"
            f" these windows; average longer, or {words.RECORD_TURNS}"
        )
    turned = {ParameterName.of(n).entry[1] for n in cross}
    turned |= {ParameterName.of(n).axis for n in gyr}
    about = [AXES[axis] for axis in sorted(turned)]
    if observations.rotating.any():
        return words.not_determined(
            missing, [f"a rate of 20°/s about device axis {a}" for a in about],
            "this schedule",
        )  # fmt: skip
    level = f"turns about device axis {join_words(about)} while that axis is level"
    return words.not_determined(missing, [level], "these turns")


def _norm_warning(missing: Sequence[str], estimate: ParameterEstimate, n: int) -> str:
    """Parameters that the norm of the force does not determine, with the remedy."""
    hidden = [m for m in missing if group_of(m) == "cross_coupling"]
    if len(hidden) < len(missing):
        return words.not_determined(
            missing, ["positions with each axis up and down"], "these orientations"
        )
    entries = [ParameterName.of(name).entry for name in hidden]
    pairs = [f"{AXES[row]} and {AXES[column]}" for row, column in entries]
    why = "axes held up and down alone cannot show it"
    if n < 9:
        why = f"{n} norms cannot determine 9 parameters"
    elif estimate.acc.dof in words.SPELLED_DOF:
        why += f" (and all nine would leave {words.SPELLED_DOF[estimate.acc.dof]})"
    return (
        f"{join_words(hidden)} {'are' if hidden[1:] else 'is'} not determined, {why}:"
        f" add positions with gravity half way between {join_words(pairs)}"
    )


def level_warnings(
    method: Method, options: SolveOptions, observations: Observations
) -> list[str]:
    """Warning that the base is assumed level, if nothing else determines its tilt."""
    if method != "two_position" or options.level_deg:
        return []
    moved = observations.gravity * np.deg2rad(0.1)
    return [
        "the base is assumed exactly level: a tilt of 0.1° would change a bias by up"
        f" to {moved:.3f} m/s² unnoticed; take five positions, or state how level it is"
        " (--level)"
    ]


def clock_warnings(estimate: ParameterEstimate) -> list[str]:
    """Warning that times were counted, if turns determine gyroscopes by them."""
    sigma = estimate.parameter_set.x.clock_sigma
    if not sigma or not estimate.parameter_set.options.turned:
        return []
    return [
        f"times were counted from a rate that is known to ± {100 * sigma:.2g} %: the"
        " scale factors of the gyroscopes are known no better, and their ± includes it;"
        " record with times, or measure the rate and state rate_sigma_hz in [sampling]"
    ]


def agreement_warnings(
    method: Method, observations: Observations, estimate: ParameterEstimate
) -> list[str]:
    """Warnings about how well the windows agree."""
    doubt = DoubtfulPosition.of(observations, estimate.bad_probability)
    few = _few_windows_warnings(method, estimate)
    scattered = _scatter_warnings(estimate)
    return [*few, doubt.sentence if doubt else "", *scattered]


def contradiction_warnings(
    observations: Observations, estimate: ParameterEstimate, of_acc: bool
) -> list[str]:
    """Warning if forces or rates contradict each other: noise cannot explain it."""
    fit, first = (estimate.acc, 0) if of_acc else (estimate.gyr, 3)
    if not fit.rejects_model:
        return []
    what = "forces" if of_acc else "rates"
    says = (
        f"the {what} in these positions contradict each other: χ² = {fit.chi2:.0f} with"
        f" {fit.dof} degree{'s' if fit.dof > 1 else ''} of freedom, and chance does not"
        " do that"
    )
    if (far := fit.largest) is None:
        return [says]
    unit = CHANNEL_UNITS[first].replace("^2", "²")
    length = f"the length of the {what[:-1]}"
    along = CHANNELS[first + far.axis] if far.axis >= 0 else length
    return [
        f"{says}; furthest from what the others predict is"
        f" {observations.positions[far.window].name}, {along} by {far.residual:+.2g} ±"
        f" {far.sigma:.1g} {unit}: take that position again, or ask fieldcal diagnose"
        " what is left out"
    ]


def _few_windows_warnings(method: Method, estimate: ParameterEstimate) -> list[str]:
    """Warning that so few windows leave nothing to check the fit."""
    if np.isnan(estimate.acc.rms):
        return []
    if estimate.acc.dof <= 0:
        return [words.NO_DOF]
    if method == "scalar" and estimate.acc.dof in words.SPELLED_DOF:
        return [
            f"only {words.SPELLED_DOF[estimate.acc.dof]}: too few to check the fit; add"
            " positions in other orientations"
        ]
    return []


def _scatter_warnings(estimate: ParameterEstimate) -> list[str]:
    """Warnings of scatter beyond the noise."""
    what = "norms" if estimate.parameter_set.unoriented.all() else "positions"
    sentences = []
    for name, agreed, channels in (
        (what, estimate.acc, (0, 1, 2)), ("gyroscopes' means", estimate.gyr, (3, 4, 5)),
    ):  # fmt: skip
        if not np.isnan(agreed.rms):
            spread = window_scatter(estimate.mixture, channels)
            unit = CHANNEL_UNITS[channels[0]]
            sentences.append(
                words.scatter_warning(name, agreed.chi2, agreed.dof, spread, unit)
            )
    chi2, dof = closure_chi2(estimate)
    if dof >= thresholds.FEW_DOF:
        spread = closure_scatter(estimate.mixture)
        sentences.append(words.scatter_warning("turns", chi2, dof, spread, "rad"))
    return sentences


def closure_chi2(estimate: ParameterEstimate) -> tuple[float, int]:
    """Chi-squared of the turns' closures, and its degrees of freedom."""
    chi2, count = estimate.closure_squares
    spent = sum(group_of(n) in OF_TURNS for n in estimate.names)
    return chi2, max(0, count - spent)
