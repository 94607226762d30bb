"""As many positions as it takes: each is the one worth most after those before.

It begins with home and both joints turned. After each window it is judged what the
calibration is good for and what the recording may conceal; the next position is the one
of the ladder that is expected to tell most of both (`fieldcal.planning.expected_gain`).
It ends at GO with no position left that would tell much, or where the operator leaves
out what would; at a cause that is certain and that no position mends; or at the largest
number of positions.
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
from fieldcal.procedures import most
from fieldcal.session.description import Description
from fieldcal.windows import Average

POSITIONS: tuple[Position, ...] = TWO_POSITIONS
"""What it begins with."""

MOST = 9
"""Positions after which it ends, unless the plan says another number."""

LADDER = ((0.0, -22.5, 22.5, -45.0, 45.0), (0.0, -2.5, 2.5, -5.0, 5.0))
"""Angles alpha and beta that it chooses from unless the plan says others, deg."""

REQUIRED = ("acc_bias", "acc_scale", "gyr_bias")
"""Groups that are judged whether they were determined or not."""

LITTLE = 0.1
"""Gain, ln, that is not worth a position once it is GO: of one parameter at its limit,
or of one cause as likely as not, a third."""

ALIKE = 0.02
"""Gains, ln, that differ by less are alike: then the shortest way counts."""


def plan(
    about: Description, seconds: float = 30.0, sigma: float | None = None
) -> Plan[Calibration]:
    """Hold the positions of `about`, and further ones until it is known."""
    held = yield from hold_each(about.positions, seconds, sigma)
    positions = list(about.positions)
    refused = {p.degrees for i, p in enumerate(positions) if i not in held}
    content = False
    while True:
        so_far: InterimResult = yield Judge(quick=True)
        worth, places = _worth(so_far, about, positions, refused)
        allowed = most(about, "adaptive") or MOST
        end = _end(so_far, worth, len(positions), allowed, content)
        if end and so_far.incremental:  # it ends by nothing but a search in full
            so_far = yield Judge()
            worth, places = _worth(so_far, about, positions, refused)
            end = _end(so_far, worth, len(positions), allowed, content)
        if end:
            yield from note(end)
            return _ended(so_far, positions, held)
        place = _choice(worth, places, positions[-1])
        yield from note(_why(so_far, worth, place))
        one = places[place]
        number = yield from add(one)
        positions.append(one)
        try:
            held[number] = yield from hold_until_still(number, one, seconds, sigma)
        except Skipped as skipped:
            yield from note(str(skipped))
            refused.add(one.degrees)
            content = so_far.sufficient


def _run(about: Description) -> dict[str, Any]:
    return dict(about.raw.get("run", {}))


def candidates(about: Description) -> list[Position]:
    """Positions that the ladder of a session can be set to."""
    said = _run(about).get("ladder")
    if said is not None:
        joints = (said["alpha_deg"], said["beta_deg"])
    elif {p.degrees for p in POSITIONS} <= {p.degrees for p in about.positions}:
        joints = LADDER
    else:
        return [Position.deg(a, b) for a, b in ladder_settings(about.positions)]
    return [Position.deg(a, b) for a, b in product(*joints)]


def _worth(
    so_far: InterimResult,
    about: Description,
    positions: Sequence[Position],
    refused: Collection[tuple[float, float] | None],
) -> tuple[PositionGains | None, list[Position]]:
    """What each position that is left to choose would tell; None if nobody knows."""
    places = [p for p in candidates(about) if p.degrees not in refused]
    explanation = so_far.explanation
    if explanation is None or not places:
        return None, places
    angle = float(np.deg2rad(angle_setting(about)))
    likely = explanation.posterior.weights_on_grid
    gain = ExpectedGain(
        explanation.rows, explanation.inferred, likely, _allowed(so_far), angle
    )
    return gain.of(places), places


def _allowed(so_far: InterimResult) -> dict[str, float]:
    """Uncertainty that is allowed of each parameter that has to be known."""
    names = [f"{g}.{a}" for g in REQUIRED for a in "xyz"]
    return {n: so_far.limits.sigma(group_of(n)) or np.inf for n in names}


def _end(
    so_far: InterimResult,
    worth: PositionGains | None,
    held: int,
    most: int,
    content: bool,
) -> str:
    """Why it ends here, for the operator; empty if it goes on.

    `content` is whether the operator left out what was asked for beyond GO.
    """
    count = f"after {held} positions"
    if worth is None:
        why = (
            so_far.prepared_session.examination[1]
            or "there is none left to choose from"
        )
        return f"{count} nothing can be said of a further one: {why}"
    little = float(worth.gain.max()) < LITTLE
    if so_far.sufficient and little:
        return f"{count} all is known that was asked for"
    if so_far.sufficient and content:
        return "it is GO, and what would tell more was left out"
    name = _named(so_far)
    if name and not _uncertain(so_far):
        return f"{count} it is clear what is wrong: {name}"
    if held >= most:
        return f"{count}, the most that were asked for, it ends"
    return ""


def _uncertain(so_far: InterimResult) -> bool:
    """Whether what fails is that something is not known well enough."""
    return so_far.calibration is None or any(
        n.endswith("uncertainty") or n == "level" for n in so_far.failed_checks
    )


def _named(so_far: InterimResult) -> str:
    """The cause that is certain, and nothing else may stand in its place.

    What a calibration finds anyway, the tilt of the base among it, is not wrong.
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


def _choice(
    worth: PositionGains | None, places: Sequence[Position], last: Position
) -> int:
    """The place worth most; of those alike the one nearest to the last position."""
    if worth is None:
        raise CalibrationFailed("there is no position left to choose from")
    best = np.flatnonzero(worth.gain >= worth.gain.max() - ALIKE).tolist()
    there, here = (
        specific_forces([places[i] for i in best], 1.0),
        specific_forces([last], 1.0),
    )
    nearest: int = best[int(np.argmin(np.linalg.norm(there - here, axis=1)))]
    return nearest


def _why(so_far: InterimResult, worth: PositionGains | None, place: int) -> str:
    """Why the next position is asked for."""
    told = worth.most_improved(place) if worth else ""
    what = f"the {parameter_title(told)}" if "." in told else f"whether there is {told}"
    if so_far.sufficient:
        return f"GO so far; the next position tells {what}; s pressed twice ends here"
    lacking = ", ".join(so_far.failed_checks).replace("_", " ") or so_far.failure
    return f"not GO yet ({lacking}); the next position tells {what}"


def _ended(
    so_far: InterimResult, positions: Sequence[Position], held: dict[int, Average]
) -> Calibration:
    if so_far.calibration is None:
        raise CalibrationFailed(so_far.failure)
    return with_skipped_positions(so_far.calibration, positions, held)
