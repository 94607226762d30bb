"""Which estimator fits the observations, and one call for all of them.

    two known positions            two_position      (11)-(14)
    more known positions           joint             with the tilt that the data prefer
    rates of a table               least_squares     for the gyroscopes
    positions without angles       scalar            |f| = g

The gyroscopes' bias comes along from the same windows, and with the Earth's rate their
scale factor where the grade is navigation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from typing import Literal

import numpy as np

from fieldcal.calibration import Calibration, Method
from fieldcal.errors import InputError, NotObservable
from fieldcal.solve import closed_form, five_position, gyroscopes, least_squares, scalar
from fieldcal.solve.design import Model, ladder_remedy, loosely_set
from fieldcal.solve.estimate import Estimate, combine, join
from fieldcal.solve.joint import WRONG, joint
from fieldcal.solve.observations import Index, Observations
from fieldcal.solve.tilt import LEVEL, Base, Tilt

METHODS = ("auto", "two_position", "five_position", "least_squares", "joint", "scalar")
TILTS = ("auto", "none", "angle_offset", "base_tilt")

USEFUL_TILT = 3.0
"""A tilt less well known than this, degrees, is worse than what an eye sees."""

CLEAR = 6.0
"""Difference of chi2 from which one model of the tilt counts as the better one."""


def solve(
    observations: Observations,
    method: Method | Literal["auto"] = "auto",
    tilt: Tilt | Literal["auto"] = "auto",
    cross: bool = False,
    as_printed: bool = False,
    level_sigma_deg: float | None = None,
    heading_sigma_deg: float | None = None,
    angle_sigma_deg: float = 0.0,
) -> Calibration:
    """Estimate the calibration from window averages.

    Parameters
    ----------
    observations : n windows, see `Observations`
    method : "auto" takes two_position for two known positions, joint for more, scalar
        where angles are unknown; the method taken is named in the result
    tilt : model of the base's tilt; "auto" estimates it where the positions show it
    cross : estimate cross-coupling (non-orthogonality in the scalar method)
    as_printed : closed forms with the misprints of the paper, to compare
    level_sigma_deg : how level the base was made, about each level axis; the tilt is
        then that of the base, within this
    heading_sigma_deg : how well z points north; not known for tactical grade if None
    angle_sigma_deg : how well the angles of each position are set, about each level
        axis and independently from position to position

    Raises
    ------
    InputError
        If an argument is none of those listed.
    NotObservable
        If the positions determine no parameter.

    >>> from fieldcal.positions import TWO
    >>> mean = np.zeros((2, 6))
    >>> mean[:, :3] = [[0.1, -9.81, 0.2], [-6.83672, -6.91037, 0.80457]]
    >>> cov = np.tile(np.diag([1e-6] * 3 + [1e-10] * 3), (2, 1, 1))
    >>> result = solve(Observations(TWO, mean, cov, gravity=9.81))
    >>> result.method, np.round(result.vector("acc_scale")[0], 4).tolist()
    ('two_position', [1.0, 1.0, 1.0])
    """
    _check(method, tilt, (level_sigma_deg, heading_sigma_deg, angle_sigma_deg))
    if angle_sigma_deg:
        observations = loosely_set(observations, angle_sigma_deg)

    def gyroscopes_by(acc: Estimate | None) -> Estimate | None:
        base = _base(acc, level_sigma_deg)
        return _gyroscopes(observations, heading_sigma_deg, as_printed, base)

    rows, notes = _usable(observations, method)
    acc = None
    chosen: Method = "least_squares"
    if len(rows) and observations.has_acc:
        still = observations[rows]
        wanted = _method(still) if method == "auto" else method
        try:
            fits = _accelerometers(
                still, wanted, tilt, cross, as_printed, level_sigma_deg
            )
            acc = _better(fits, gyroscopes_by).spread(rows, len(observations))
            chosen = wanted
        except NotObservable as error:
            # a rate table has its gyroscopes' result all the same
            if not observations.rotating.any():
                raise
            notes.append(f"the accelerometers are not calibrated: {error}")
    good = acc is None or acc.dof <= 0 or acc.chi2 / acc.dof < WRONG
    return combine(chosen, observations, acc, gyroscopes_by(acc), notes, good)


def _check(method: str, tilt: str, sigmas_deg: Iterable[float | None]) -> None:
    """Refuse arguments that are none."""
    if method not in METHODS or tilt not in TILTS:
        raise InputError(
            f"method {method!r} with tilt {tilt!r} is unknown: methods are "
            f"{join(METHODS)}, tilts are {join(TILTS)}"
        )
    for degrees in sigmas_deg:
        if degrees is not None and not 0 <= degrees < 90:
            raise InputError(f"an uncertainty of {degrees:g}° is none: give 0 to 90°")


def _base(acc: Estimate | None, level_sigma_deg: float | None) -> Base:
    """How the base is tilted: by the accelerometers, or within what is known of it."""
    if acc is not None:
        found = Base.found(acc.names, acc.values, acc.covariance)
        if found.tilt != "none":
            return found
    if level_sigma_deg:
        return Base("base_tilt", np.zeros(2), level_sigma_deg**2 * np.eye(2))
    return LEVEL


def _usable(
    observations: Observations, method: Method | Literal["auto"]
) -> tuple[Index, list[str]]:
    """Positions for the accelerometers: those at rest, and of one kind."""
    rows = np.flatnonzero(~observations.rotating)
    known = rows[observations.oriented[rows]]
    if method != "auto" or not 2 < len(known) < len(rows):
        return rows, []
    return known, [
        f"{len(rows) - len(known)} of {len(rows)} positions have no angles and are not "
        "used; method scalar uses all, and no angles"
    ]


def _method(still: Observations) -> Method:
    """Take the estimator that suits the positions."""
    known = int(still.oriented.sum())
    if known < len(still):
        return "scalar"
    return "two_position" if known == 2 else "joint"


def _accelerometers(
    still: Observations,
    method: Method,
    tilt: Tilt | Literal["auto"],
    cross: bool,
    as_printed: bool,
    level: float | None,
) -> list[Estimate]:
    """Run one method on the positions at rest, with each tilt that could be."""
    if as_printed and method not in ("two_position", "five_position"):
        raise InputError(
            f"the paper prints no {method} method: as printed are two_position and "
            "five_position"
        )
    if method == "scalar":
        return [scalar.scalar(still, cross)]
    if method == "two_position":
        if tilt in ("angle_offset", "base_tilt") or cross:
            raise NotObservable(
                "two positions give bias and scale factor only, not tilt or "
                "cross-coupling: take five positions, each with another α or β"
            )
        return [closed_form.two_position(still, np.deg2rad(level or 0.0), as_printed)]
    if method == "least_squares":
        return [least_squares.accelerometers(still)]
    if method == "joint":
        return _joint(still, tilt, cross, level)
    if tilt == "none":
        raise InputError("the five-position method estimates the tilt: use joint")
    models: list[Tilt] = ["angle_offset"] if tilt == "auto" else [tilt]
    if tilt == "auto" and not as_printed:
        models = ["angle_offset", "base_tilt"]
    return [five_position.five_position(still, t, as_printed) for t in models]


def _joint(
    still: Observations, tilt: Tilt | Literal["auto"], cross: bool, level: float | None
) -> list[Estimate]:
    """Joint estimates; for "auto" with each model of the tilt that shows one."""
    if level and tilt in ("auto", "none"):
        return [joint(still, Model("base_tilt", cross), level)]
    if tilt != "auto":
        return [joint(still, Model(tilt, cross), level)]
    usable = []
    for name in ("angle_offset", "base_tilt"):
        with suppress(NotObservable):
            found = joint(still, Model(name, cross))
            usable += [found] if _shows_tilt(found, cross) else []
    if len(usable) == 1:
        return [_told(usable[0], f"the tilt is taken as {_tilt_of(usable[0])}")]
    if usable:
        return usable
    flat = joint(still, Model("none", cross))
    wanted = np.ones(len(Model("angle_offset", cross).names), dtype=bool)
    extra = ladder_remedy(still, wanted, Model("angle_offset", cross))
    cure = f"; add {join(extra)} to find it" if extra else ""
    note = f"these positions do not show the tilt, so the base is taken as level{cure}"
    return [_told(flat, note)]


def _told(estimate: Estimate, note: str) -> Estimate:
    return replace(estimate, warnings=(*estimate.warnings, note))


def _tilt_of(estimate: Estimate) -> str:
    return estimate.names[-1].partition(".")[0]


def _shows_tilt(estimate: Estimate, cross: bool) -> bool:
    """Whether everything is determined, and the tilt well enough to be of use."""
    if len(estimate.names) < len(Model("base_tilt", cross).names):
        return False
    tilt = [n.endswith("_deg") for n in estimate.names]
    return bool((np.sqrt(np.diag(estimate.covariance))[tilt] < USEFUL_TILT).all())


def _better(
    fits: list[Estimate], gyroscopes_by: Callable[[Estimate], Estimate | None]
) -> Estimate:
    """Take the model of the tilt that fits better, gyroscopes included.

    Where the other one fits nearly as well, what the two differ by is in the
    covariance, weighted by how likely the other is.
    """
    if len(fits) == 1:
        return fits[0]
    beside = [gyroscopes_by(e) for e in fits]
    ahead = _misfit(fits[1], fits[0]) + _misfit(beside[1], beside[0])
    best, other = fits if ahead >= 0 else fits[::-1]
    name, rival, ahead = _tilt_of(best), _tilt_of(other), abs(ahead)
    weight = 1 / (1 + np.exp(min(ahead / 2, 50.0)))
    # alpha0 turns about z and beta0 about x: the same angles in the other order
    twin = np.append(other.values[:-2], other.values[:-3:-1])
    apart = twin - best.values
    if ahead > CLEAR:
        note = (
            f"the tilt is taken as {name}: {rival} fits worse, by {ahead:.0f} in chi2"
        )
    else:
        note = (
            f"the tilt is taken as {name}, but these positions cannot tell it from "
            f"{rival} (chi2 differs by {ahead:.1f}): the uncertainties cover both; "
            f"more positions with both angles turned would tell"
        )
    return replace(
        best,
        covariance=best.covariance + weight * np.outer(apart, apart),
        warnings=(*best.warnings, note),
        extra={**best.extra, "tilt_chi2": {name: best.chi2, rival: other.chi2}},
    )


def _misfit(one: Estimate | None, other: Estimate | None) -> float:
    """By how much chi2 of one exceeds the other's, in units of the better one's."""
    if one is None or other is None:
        return 0.0
    better = min((one, other), key=lambda e: e.chi2)
    noise = max(1.0, better.chi2 / better.dof) if better.dof else 1.0
    return (one.chi2 - other.chi2) / noise


def _gyroscopes(
    observations: Observations,
    heading_sigma_deg: float | None,
    as_printed: bool,
    base: Base,
) -> Estimate | None:
    """Gyroscopes by what their windows hold."""
    if not observations.has_gyr:
        return None
    known = observations.oriented.all() and observations.latitude is not None
    heading = (
        None if heading_sigma_deg is None else float(np.deg2rad(heading_sigma_deg))
    )
    if observations.rotating.any():
        if observations.grade == "navigation" and known:
            heading = heading or 0.0
        return least_squares.gyroscopes(
            observations, heading_sigma=heading, base=base, as_printed=as_printed
        )
    if observations.grade == "navigation" and known and len(observations) > 1:
        return gyroscopes.bias_and_scale(observations, as_printed, base, heading or 0.0)
    found = gyroscopes.bias(observations, heading, as_printed, base)
    note = gyroscopes.NO_SCALE
    if observations.grade == "navigation":
        note = (
            "gyr_scale is not determined: the Earth's rate gives it only with two "
            "known positions and the latitude"
        )
    return replace(found, warnings=(*found.warnings, note))
