"""Adaptive procedure: chooses the most informative next position, until GO.

It begins with home and both joints turned. After each window the calibration is judged,
and the recording is examined for unmodelled effects. The next position is the one of
the ladder with the largest expected gain for both (`fieldcal.planning.expected_gain`).
The procedure ends at GO, if no position has a considerable gain or the operator left
out the one that has; at a cause that is certain and that no position removes; or at the
largest number of positions.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import product
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.names import group_of
from fieldcal.calibration.wording import parameter_title
from fieldcal.core.errors import CalibrationFailed, Skipped
from fieldcal.core.positions import (
    TWO_POSITIONS,
    Position,
    ladder_settings,
    specific_forces,
)
from fieldcal.evaluation.interim_result import InterimResult
from fieldcal.evaluation.observations import angle_setting
from fieldcal.model import thresholds
from fieldcal.planning.expected_gain import COMMON, ExpectedGain, PositionGains
from fieldcal.planning.holding import (
    hold_each,
    hold_until_still,
    with_skipped_positions,
)
from fieldcal.planning.steps import Judge, Plan, add, note
from fieldcal.procedures import max_positions
from fieldcal.session.description import Description
from fieldcal.windows import Average

POSITIONS: tuple[Position, ...] = TWO_POSITIONS
"""The first positions."""

MOST = 9
"""Largest number of positions, unless the plan states another."""

LADDER = ((0.0, -22.5, 22.5, -45.0, 45.0), (0.0, -2.5, 2.5, -5.0, 5.0))
"""Angles alpha and beta to choose from, unless the plan states others, deg."""

REQUIRED_GROUPS = ("acc_bias", "acc_scale", "gyr_bias")
"""Groups of parameters that are judged, whether determined or not."""

LEAST_GAIN = 0.1
"""Gain, ln, below which a position is not taken after GO: a third of the gain for one
parameter at its limit, or for one cause with a probability of one half."""

GAIN_TOLERANCE = 0.02
"""Difference of gains, ln, that count as equal; the nearest position is then chosen."""


def plan(
    about: Description, seconds: float = 30.0, sigma: float | None = None
) -> Plan[Calibration]:
    """Hold the positions of `about`, and further ones as needed."""
    held = yield from hold_each(about.positions, seconds, sigma)
    positions = list(about.positions)
    refused = {p.degrees for i, p in enumerate(positions) if i not in held}
    so_far: InterimResult = yield Judge(quick=True)
    # behind a lost link the plan begins anew, with all the positions asked for before
    content = so_far.sufficient and len(positions) - 1 not in held
    while True:
        worth, places = _position_gains(so_far, about, positions, refused)
        allowed = max_positions(about, "adaptive") or MOST
        end = _reason_to_end(so_far, worth, len(positions), allowed, content)
        if end and so_far.incremental:  # only a full search may end the procedure
            so_far = yield Judge()
            worth, places = _position_gains(so_far, about, positions, refused)
            end = _reason_to_end(so_far, worth, len(positions), allowed, content)
        if end:
            yield from note(end)
            return _final_calibration(so_far, positions, held)
        place = _best_position(worth, places, positions[-1])
        yield from note(_reason_for_position(so_far, worth, place))
        one = places[place]
        number = yield from add(one)
        positions.append(one)
        try:
            held[number] = yield from hold_until_still(number, one, seconds, sigma)
        except Skipped as skipped:
            yield from note(str(skipped))
            refused.add(one.degrees)
            content = so_far.sufficient
        so_far = yield Judge(quick=True)


def _run_table(about: Description) -> dict[str, Any]:
    return dict(about.raw.get("run", {}))


def candidate_positions(about: Description) -> list[Position]:
    """Positions to which the ladder of a session can be set."""
    said = _run_table(about).get("ladder")
    if said is not None:
        joints = (said["alpha_deg"], said["beta_deg"])
    elif {p.degrees for p in POSITIONS} <= {p.degrees for p in about.positions}:
        joints = LADDER
    else:
        return [Position.deg(a, b) for a, b in ladder_settings(about.positions)]
    return [Position.deg(a, b) for a, b in product(*joints)]


def _position_gains(
    so_far: InterimResult,
    about: Description,
    positions: Sequence[Position],
    refused: Collection[tuple[float, float] | None],
) -> tuple[PositionGains | None, list[Position]]:
    """Expected gain of each remaining position; None if it cannot be calculated."""
    taken = {p.degrees for p in positions} - set(refused)
    places = [
        p
        for p in candidate_positions(about)
        if p.degrees not in refused
        and not _out_of_reach(p.degrees, [r for r in refused if r], taken)
    ]
    explanation = so_far.explanation
    if explanation is None or not places:
        return None, places
    angle = float(np.deg2rad(angle_setting(about)))
    likely = explanation.posterior.weights_on_grid
    gain = ExpectedGain(
        explanation.rows, explanation.inferred, likely, _allowed_sigmas(so_far), angle
    )
    return gain.of(places), places


def _out_of_reach(
    place: tuple[float, float] | None,
    refused: Sequence[tuple[float, float]],
    taken: Collection[tuple[float, float] | None],
) -> bool:
    """Whether a joint does not go to where a place is, by those that were left out.

    Two that were left out at the same angle of a joint, at which none was taken, are
    left out for that angle: one beyond it is not asked for either.

    >>> left_out = [(-45.0, -5.0), (-45.0, -2.5)]
    >>> [_out_of_reach((a, 0.0), left_out, {(-22.5, 0.0)}) for a in (-45.0, 45.0)]
    [True, False]
    """
    for joint, angle in enumerate(place or ()):
        for limit in {r[joint] for r in refused}:
            often = sum(r[joint] == limit for r in refused) > 1
            beyond = angle * limit > 0 and abs(angle) >= abs(limit)
            if often and beyond and not any(t and t[joint] == limit for t in taken):
                return True
    return False


def _allowed_sigmas(so_far: InterimResult) -> dict[str, float]:
    """Largest uncertainty of each required parameter."""
    names = [f"{g}.{a}" for g in REQUIRED_GROUPS for a in "xyz"]
    return {n: so_far.limits.sigma(group_of(n)) or np.inf for n in names}


def _reason_to_end(
    so_far: InterimResult,
    worth: PositionGains | None,
    held: int,
    most: int,
    content: bool,
) -> str:
    """Reason to end the procedure, for the operator; empty to continue.

    `content` is whether the operator left out a position that was requested after GO.
    """
    count = f"after {held} positions"
    if worth is None:
        why = (
            so_far.prepared_session.examination[1]
            or "there is none left to choose from"
        )
        return f"{count} nothing can be said of a further one: {why}"
    little = float(worth.gain.max()) < LEAST_GAIN
    if so_far.sufficient and little:
        return f"{count} all is known that was asked for"
    if so_far.sufficient and content:
        return "it is GO, and what would tell more was left out"
    name = _certain_causes(so_far)
    if name and not _fails_by_uncertainty(so_far):
        return f"{count} it is clear what is wrong: {name}"
    if held >= most:
        return f"{count}, the most that were asked for, it ends"
    return ""


def _fails_by_uncertainty(so_far: InterimResult) -> bool:
    """Whether a check of an uncertainty fails, or there is no calibration."""
    return so_far.calibration is None or any(
        n.endswith("uncertainty") or n == "level" for n in so_far.failed_checks
    )


def _certain_causes(so_far: InterimResult) -> str:
    """Names of the probable causes, if all are certain and have no alias; else empty.

    Parameters of the calibration, and the tilt of the base, do not count.
    """
    if so_far.sufficient or so_far.explanation is None:
        return ""
    own = (
        {group_of(name) for name in so_far.calibration.names}
        if so_far.calibration
        else set()
    )
    own |= COMMON.keys()
    wrong = [s for s in so_far.explanation.probable_causes if s.name not in own]
    sure = [s for s in wrong if s.probability > thresholds.CERTAIN and not s.aliases]
    return ", ".join(s.name for s in sure) if len(sure) == len(wrong) else ""


def _best_position(
    worth: PositionGains | None, places: Sequence[Position], last: Position
) -> int:
    """Index of the position of largest gain; of equal ones the nearest to `last`."""
    if worth is None:
        raise CalibrationFailed("there is no position left to choose from")
    best = np.flatnonzero(worth.gain >= worth.gain.max() - GAIN_TOLERANCE).tolist()
    there, here = (
        specific_forces([places[i] for i in best], 1.0),
        specific_forces([last], 1.0),
    )
    nearest: int = best[int(np.argmin(np.linalg.norm(there - here, axis=1)))]
    return nearest


def _reason_for_position(
    so_far: InterimResult, worth: PositionGains | None, place: int
) -> str:
    """Reason for the next position, for the operator."""
    told = worth.most_improved(place) if worth else ""
    what = f"the {parameter_title(told)}" if "." in told else f"whether there is {told}"
    if so_far.sufficient:
        return f"GO so far; the next position tells {what}; s pressed twice ends here"
    lacking = ", ".join(so_far.failed_checks).replace("_", " ") or so_far.failure
    return f"not GO yet ({lacking}); the next position tells {what}"


def _final_calibration(
    so_far: InterimResult, positions: Sequence[Position], held: dict[int, Average]
) -> Calibration:
    if so_far.calibration is None:
        raise CalibrationFailed(so_far.failure)
    return with_skipped_positions(so_far.calibration, positions, held)
