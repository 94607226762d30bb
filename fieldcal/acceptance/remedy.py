"""The cheapest way from NO-GO to GO that the ladder of the session allows.

If an uncertainty is too large: further positions. The covariance from n positions is

    C = (sum J_p^T R_p^-1 J_p)^-1,  R_p = s^2 I + a^2 (t_1 t_1^T + t_2 t_2^T)        (1)

with J_p the derivative of the mean at position p by the parameters, s the error of a
mean, a the error of an angle, and t_1, t_2 the derivatives of the force by the two
angles. Other errors of the calibration (a drift, a walk) stay in it: each sigma falls
in the proportion given by (1). If a position disagrees with the others: the same
position once more.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fieldcal.acceptance.check import MENDABLE_CHECKS
from fieldcal.acceptance.factory import factory_errors_used
from fieldcal.acceptance.uncertainty import UNCERTAINTY
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import group_of, sensor_of
from fieldcal.calibration.wording import parameter_title
from fieldcal.core.factory import FactoryErrors
from fieldcal.core.positions import Position, ladder_settings, specific_forces
from fieldcal.core.samples import Array
from fieldcal.core.sentences import join_words
from fieldcal.model.causes.planned import design_matrix, parameters
from fieldcal.planning.planner import parameter_sigma
from fieldcal.session.description import Description
from fieldcal.solve.doubtful_position import DoubtfulPosition

MAX_POSITIONS = 3
"""Largest number of further positions; if more are needed, repeat the run."""

LIMIT_SHARE = 0.9
"""Part of a limit that is aimed at, since the result differs from the expectation."""

MAX_HOLD_S = 600.0
"""Longest time that is asked for at one position, s."""

UNDETERMINED = 1e3
"""Stands for an uncertainty without bounds, far beyond any other, SI."""

DERIVATIVE_STEP_RAD = 1e-4
"""Step of the numerical derivatives t in (1), rad."""


@dataclass(frozen=True, slots=True)
class Remedy:
    """Positions to record in order to reach GO.

    Attributes
    ----------
    says : one sentence
    again : numbers of positions to repeat, from 0
    positions : alpha and beta of further positions, deg
    seconds : time at each, s

    """

    says: str
    again: tuple[int, ...] = ()
    positions: tuple[tuple[float, float], ...] = ()
    seconds: float = 30.0

    def to_json(self) -> dict[str, Any]:
        """Return the object of result.json."""
        return {
            "says": self.says,
            "again": list(self.again),
            "positions": [{"alpha_deg": a, "beta_deg": b} for a, b in self.positions],
            "seconds": self.seconds,
        }


def cheapest_remedy(
    calibration: Calibration,
    about: Description,
    numbers: Sequence[int],
    limits: GradeLimits,
    failed: Collection[str],
    sigma: float,
    seconds: float,
    others: Sequence[str] = (),
    unchecked: bool = False,
) -> Remedy | None:
    """The cheapest remedy that is possible at the ladder; None if there is none.

    Parameters
    ----------
    calibration : calibration that is NO-GO
    about : description of its session
    numbers : of the positions that have a window, from 0
    limits : limits of its grade
    failed : groups whose uncertainty is above its limit
    sigma : standard error of the mean of a window, m/s^2
    seconds : length of a window, s
    others : failed checks that are not of an uncertainty
    unchecked : whether the positions determine everything, and leave nothing to check

    """
    doubt = DoubtfulPosition.from_json(calibration.info.get("doubtful_position"))
    number = _number_in_doubt(doubt, calibration, about, numbers) if doubt else None
    if doubt and number is not None:
        which = f"position {number + 1} ({doubt.name})"
        says = f"take {which} again: it disagrees with the others"
        return Remedy(says, again=(number,), seconds=seconds)
    had = [about.positions[i] for i in numbers]
    over = _limit_ratios(calibration, limits, failed)
    if not (over or unchecked) or not all(p.oriented for p in about.positions):
        return None
    of_gyr = {name for name in over if sensor_of(group_of(name)) == "gyr"}
    if len(of_gyr) == len(over) and not unchecked:
        return _hold_longer(calibration, about, numbers, over, seconds, others)
    # further positions determine the accelerometers, gyroscopes have to be held longer
    groups = dict.fromkeys(group_of(name) for name in of_gyr)
    left = [*others, *(group + UNCERTAINTY for group in groups)]
    over = {name: part for name, part in over.items() if name not in of_gyr}
    return _further_positions(
        calibration, about, had, limits, over, sigma, seconds, left
    )


def _number_in_doubt(
    doubt: DoubtfulPosition,
    calibration: Calibration,
    about: Description,
    numbers: Sequence[int],
) -> int | None:
    """Number of the position in doubt; a place may be held more than once."""
    bad = calibration.info.get("bad_position", ())
    if len(bad) != len(numbers):
        return None
    there = [
        (chance, number)
        for chance, number in zip(bad, numbers, strict=True)
        if about.positions[number].name == doubt.name
    ]
    return max(there)[1] if there else None


def _expectation(left: Sequence[str]) -> str:
    """What a remedy leads to, if some failed checks are left as they are."""
    stays = [name for name in left if name not in MENDABLE_CHECKS]
    if stays:
        verb, more = ("fails", "has") if len(stays) == 1 else ("fail", "have")
        return f"then {join_words(stays)} still {verb}, and {more} to be mended as well"
    if left:
        verb = "passes" if len(left) == 1 else "pass"
        return f"then GO is expected if {join_words(left)} {verb} as well"
    return "then GO is expected"


def _limit_ratios(
    calibration: Calibration, limits: GradeLimits, failed: Collection[str]
) -> dict[str, float]:
    """Uncertainty over its limit, by full name; infinite if not determined."""
    out = {}
    for group in failed:
        limit = limits.sigma(group)
        for axis in "xyz" if limit is not None else "":
            name = f"{group}.{axis}"
            sigma = (
                calibration.uncertainty(name) if name in calibration.names else np.inf
            )
            if limit and not sigma <= limit:
                out[name] = float(sigma / limit)
    return out


def _hold_longer(
    calibration: Calibration,
    about: Description,
    numbers: Sequence[int],
    over: dict[str, float],
    seconds: float,
    left: Sequence[str],
) -> Remedy | None:
    """Remedy for gyroscopes: a longer mean in the last position that was held.

    The part of the uncertainty from g-sensitivity and the mean force does not change.
    """
    had = [about.positions[i] for i in numbers]
    force = specific_forces(had, about.gravity).mean(axis=0)
    stays = factory_errors_used(calibration).g_sensitivity * float(
        np.linalg.norm(force)
    )
    times = 1.0
    for name, part in over.items():
        sigma = calibration.uncertainty(name) if np.isfinite(part) else np.inf
        kept = stays if group_of(name) == "gyr_bias" else 0.0
        room = (LIMIT_SHARE * sigma / part) ** 2 - kept**2
        times = max(times, (sigma**2 - kept**2) / room if room > 0 else np.inf)
    whole = seconds * len(had)
    last = had[-1].degrees
    if not whole * (times - 1) <= MAX_HOLD_S or last is None:
        return None
    more = float(np.ceil(whole * (times - 1) / 5) * 5)
    says = (
        f"hold position {numbers[-1] + 1} for {more:.0f} s more: {_expectation(left)}"
    )
    return Remedy(says, positions=(last,), seconds=max(more, seconds))


def _further_positions(
    calibration: Calibration,
    about: Description,
    had: Sequence[Position],
    limits: GradeLimits,
    over: dict[str, float],
    sigma: float,
    seconds: float,
    left: Sequence[str],
) -> Remedy | None:
    """Further positions of the ladder, each time the best one."""
    tilts = [g for g in ("angle_offset", "base_tilt") if g in calibration.groups]
    names = parameters(*(tilts or ["angle_offset"]))
    held, known = list(had), _KnownErrors.of(calibration, sigma)
    before = _expected_sigma(names, held, about, known)
    allowed = [limits.sigma(group_of(name)) or np.inf for name in names]
    candidates = [Position.deg(a, b) for a, b in ladder_settings(about.positions)]
    if not over:  # a place that was held is not checked by holding it again
        places = {p.degrees for p in had}
        candidates = [p for p in candidates if p.degrees not in places] or candidates
    if not candidates:  # all have a third angle: it is no ladder
        return None
    chosen: list[Position] = []
    for _ in range(MAX_POSITIONS):
        ratios = []
        for one in candidates:
            then = _expected_sigma(names, [*held, *chosen, one], about, known)
            ratios.append(
                _largest_limit_ratio(names, over, before, then, allowed)
                if over
                else _size_of_all(then)
            )
        best = int(np.argmin(ratios))
        chosen.append(candidates[best])
        if not over or ratios[best] <= LIMIT_SHARE:
            return _as_remedy(chosen, over, seconds, left)
    return None


def _as_remedy(
    chosen: Sequence[Position],
    over: dict[str, float],
    seconds: float,
    left: Sequence[str],
) -> Remedy:
    one = len(chosen) == 1
    word = "one position" if one else f"{len(chosen)} positions"
    time = f"{seconds:.0f} s" if one else f"{seconds:.0f} s each"
    where = " and ".join(p.name for p in chosen)
    why = "nothing checks what the others determine"
    if over:
        worst = max(over, key=lambda name: over[name])
        now = f"{over[worst]:.2g} times its limit now"
        if not np.isfinite(over[worst]):
            now = "not determined yet"
        why = f"{parameter_title(worst)} is {now}"
    says = f"{word} more for {time}, {where}: {_expectation(left)} ({why})"
    angles = tuple(angles for p in chosen if (angles := p.degrees))
    return Remedy(says, positions=angles, seconds=seconds)


def _largest_limit_ratio(
    names: Sequence[str],
    over: dict[str, float],
    before: Array,
    then: Array,
    allowed: Sequence[float],
) -> float:
    """Largest ratio of an expected uncertainty to its limit."""
    parts = [0.0]
    for name, part in over.items():
        if name in names:
            i = names.index(name)
            known = np.isfinite(part) and np.isfinite(before[i])
            expected = part * then[i] / before[i] if known else then[i] / allowed[i]
            parts.append(float(expected))
    return max(parts)


def _size_of_all(sigma: Array) -> float:
    """Mean logarithm of expected uncertainties, which may be infinite.

    The place that makes it least depends on most of them, and so contradicts most.
    """
    return float(np.mean(np.log(np.minimum(sigma, UNDETERMINED))))


class _KnownErrors(NamedTuple):
    """Assumed errors: of a mean, m/s^2, of an angle, rad, and of the factory."""

    sigma: float
    angle: float
    factory: FactoryErrors

    @classmethod
    def of(cls, calibration: Calibration, sigma: float) -> _KnownErrors:
        """Take the errors that a result was made with."""
        angle = np.deg2rad(float(calibration.info.get("angle_sigma_deg") or 0.0))
        return cls(sigma, float(angle), factory_errors_used(calibration))


def _expected_sigma(
    names: Sequence[str],
    positions: Sequence[Position],
    about: Description,
    known: _KnownErrors,
) -> Array:
    """Expected sigma of each parameter by (1), (k,); infinite if not determined."""
    left = {name: size for name, size in known.factory.by_effect.items() if size}
    more = [name for name in parameters(*left) if name not in names]
    every = [*names, *more]
    j = design_matrix(every, positions, about.gravity, about.mounting)
    t = np.stack(
        [
            _force_slopes(positions, about, a, b)
            for a, b in ((DERIVATIVE_STEP_RAD, 0.0), (0.0, DERIVATIVE_STEP_RAD))
        ],
        axis=2,
    )
    r = known.sigma**2 * np.eye(3) + known.angle**2 * t @ t.transpose(0, 2, 1)
    whitened = np.linalg.solve(np.linalg.cholesky(r), j).reshape(-1, len(every))
    sizes = np.array([left[group_of(name)] for name in more])
    before = np.eye(len(every))[len(names) :] / sizes[:, None]
    whitened = np.vstack([whitened, before])
    return parameter_sigma(whitened)[: len(names)]  # (1)


def _force_slopes(
    positions: Sequence[Position], about: Description, alpha: float, beta: float
) -> Array:
    """Derivative of the forces in device axes by an angle, (n, 3) m/s^2/rad."""
    off = [p.turned(alpha, beta) for p in positions]
    change = specific_forces(off, about.gravity) - specific_forces(
        positions, about.gravity
    )
    moved: Array = change @ about.mounting / DERIVATIVE_STEP_RAD
    return moved
