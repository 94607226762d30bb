"""A recorded session, solved: its windows, the turns between them, and what they show.

The rows are those that `diagnose` sees: block means with the noise that is measured in
the recording, samples put right, lines taken out. Of windows that were disturbed what
is calm counts, before and after it if the device was held on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.grade_shown import GradeShown
from fieldcal.calibration.names import TILTS, group_of, sensor_of
from fieldcal.core.errors import InputError, NotObservable
from fieldcal.diagnosis.explain import Explanation, explain, times_since_turn
from fieldcal.diagnosis.prepare import PreparedRecording, prepare_recording
from fieldcal.evaluation.angles_shown import with_angles_shown
from fieldcal.evaluation.held_on import held_on
from fieldcal.evaluation.jump import with_jump
from fieldcal.evaluation.levelled import with_tilt_shown
from fieldcal.evaluation.not_carried import (
    misread,
    uncarried,
    with_not_carried,
)
from fieldcal.evaluation.observations import (
    Rests,
    angle_setting,
    grain_of,
    observations,
    with_provenance,
)
from fieldcal.evaluation.rounding_mode import (
    RoundingMode,
    rounding_mode,
    with_rounding,
)
from fieldcal.model import priors
from fieldcal.session.description import Description
from fieldcal.session.factory import factory_errors
from fieldcal.session.folder import Session
from fieldcal.solve import Observations, solve
from fieldcal.solve.estimation import Recorded
from fieldcal.solve.rows import variances, widened
from fieldcal.solve.shown import Shown

Turns = Literal["auto", "yes", "no"]


@dataclass(frozen=True)
class Laid:
    """A session's windows as the estimators are given them.

    Attributes
    ----------
    session : the recording
    still : windows that can be used
    before : what explained a part of the recording, which a search may begin with

    """

    session: Session
    still: Rests
    before: Explanation | None = None

    @cached_property
    def order(self) -> list[int]:
        """Numbers in `still` in the order in which the windows were held."""
        averages = self.still.averages
        return sorted(range(len(averages)), key=lambda i: averages[i].start)

    @cached_property
    def about(self) -> Description:
        """What is known of these windows, and where they were calm."""
        about, still = self.session.about, self.still
        rows = [still.rows[i] for i in self.order]
        averages = [still.averages[i] for i in self.order]
        ends = [
            held_on(self.session.block, about.windows[r], average)
            for r, average in zip(rows, averages, strict=True)
        ]
        return replace(
            about,
            positions=tuple(about.positions[r] for r in rows),
            windows=tuple((a, float(np.nextafter(b, np.inf))) for a, b in ends),
            numbers=tuple(rows),
        )

    @cached_property
    def observations(self) -> Observations:
        """Means of the windows, in the order in which they were held."""
        averages = [self.still.averages[i] for i in self.order]
        return observations(self.about, averages, range(len(averages)))

    @cached_property
    def rounding(self) -> RoundingMode:
        """What is not known of how the device rounds."""
        return rounding_mode(self.session, grain_of(self.session))

    @cached_property
    def examined(self) -> tuple[PreparedRecording | None, str]:
        """The recording, checked and reduced, or why it cannot be."""
        try:
            return prepare_recording(self.session.block, self.about), ""
        except InputError as error:
            return None, str(error)

    @property
    def prepared(self) -> PreparedRecording | None:
        """The recording, checked and reduced; None where it cannot be."""
        return self.examined[0]

    @cached_property
    def explanation(self) -> Explanation | None:
        """What the recording shows to be there; None where it cannot be examined."""
        if self.prepared is None:
            return None
        return explain(self.prepared, self.before)

    @property
    def unexamined(self) -> list[str]:
        """Sentence where nothing but the means of the windows was looked at."""
        why = self.examined[1]
        if not why:
            return []
        return [
            f"only the windows' means are used, neither samples nor turns nor [model],"
            f" since the recording cannot be examined: {why}"
        ]

    def recorded(
        self, turns: bool, shown: Explanation | None = None
    ) -> Recorded | None:
        """Rows of the windows, and the samples between them if they are to be used.

        `shown` is what the recording shows to be there.
        """
        if self.prepared is None:
            return None
        source, rows = self.prepared.source, self.prepared.rows
        measured = (self.observations.has_acc, self.observations.has_gyr)
        sd = np.full_like(rows.sd, np.nan)
        for c in np.flatnonzero(measured):
            sd[:, 3 * c : 3 * c + 3] = rows.sd[:, 3 * c : 3 * c + 3]
        rows = replace(rows, sd=sd)
        known = variances(self.observations)
        known[:, :3] += self.rounding.around_zero(self.observations.mean[:, :3])
        rows = widened(rows, known)
        likely = () if shown is None else shown.posterior.weights
        return Recorded(
            rows,
            times_since_turn(source, rows),
            source if turns else None,
            tuple(Shown.of(s, p) for s, p in likely),
            None if shown is None else shown.filter_rows,
            tuple(self.rounding.toward_zero.tolist()),
        )


def solved(
    session: Session,
    still: Rests,
    turns: Turns = "auto",
    left: Mapping[str, Any] | None = None,
    **asked: Any,
) -> Calibration:
    """Solve a session.

    Parameters
    ----------
    session : the recording
    still : its windows
    turns : whether what the turns between windows say is used; "yes" insists on it
    left : what the factory left in the device, by the keys of session.toml; otherwise
        what that says, or what is usual for the grade
    asked : of `fieldcal.solve.solve`; how level the base is and how well angles are set
        are otherwise what session.toml says, or what the grade asks for

    Raises
    ------
    NotObservable
        If nothing is determined, or turns are insisted on and there are none.

    """
    return solved_as(Laid(session, still), turns, left, **asked)


def solved_as(
    laid: Laid,
    turns: Turns = "auto",
    left: Mapping[str, Any] | None = None,
    **asked: Any,
) -> Calibration:
    """The same of windows that were laid out already; raises as `solved` does."""
    asked = _filled_in(laid, asked)
    device = replace(laid.session.about, **(left or {}))
    asked["factory"] = factory_errors(device)
    if asked.get("as_printed"):
        return _told(solve(laid.observations, **asked), laid, turns, [])
    shown = laid.explanation
    recorded = laid.recorded(turns != "no", shown)

    def fit() -> Calibration:
        return solve(laid.observations, recorded=recorded, **asked)

    stated = asked["angle_sigma_deg"]
    found, notes = with_angles_shown(fit, asked, shown)
    shows = _grade(found, laid.session.about)
    if shows.because:
        asked["at_best"] = asked["factory"]
        asked["factory"] = factory_errors(device, shows.grade)
        found = fit()
        found = replace(found, info={**found.info, "grade_shown": asdict(shows)})
    found = with_tilt_shown(found, laid.observations, recorded, asked)
    found = _told(found, laid, turns, [*notes, *laid.unexamined])
    found = with_rounding(found, laid.rounding)
    if asked["angle_sigma_deg"] > stated:
        found = replace(found, info={**found.info, "angles_stated_deg": stated})
    if shown is None:
        return replace(found, info={**found.info, "unexamined": laid.examined[1]})
    found = with_not_carried(with_jump(found, shown), uncarried(shown, found))
    return misread(shown.prepared, found)


def _filled_in(laid: Laid, asked: Mapping[str, Any]) -> dict[str, Any]:
    """What is asked for, and what session.toml or the grade says where it is not."""
    about = laid.session.about
    own = {
        "level_sigma_deg": about.level_deg,
        "angle_sigma_deg": angle_setting(about),
        "beside_tilt_sigma_deg": priors.BESIDE_TILT_DEG,
    }
    return own | {name: value for name, value in asked.items() if value is not None}


def _told(
    found: Calibration, laid: Laid, turns: Turns, notes: Sequence[str]
) -> Calibration:
    """With what is to be said of the windows; why it is bad comes first."""
    if turns == "yes":
        _insist(found, laid.session, laid.still)
    ahead, behind = ((), found.warnings) if found.good else (found.warnings, ())
    warnings = (*ahead, *laid.still.warnings, *notes, *behind)
    found = with_provenance(replace(found, warnings=warnings), laid.session.about)
    return _listed(found, laid.order)


def _grade(found: Calibration, about: Description) -> GradeShown:
    """The grade that the device has by a result; the stated one of a bad result.

    Where neither the tilt of the base is found nor its level stated, accelerometers
    tell nothing: a tilt may be what is taken for their bias and scale factor.
    """
    if not found.good:
        return GradeShown(about.grade)
    levelled = found.method == "scalar" or "level_sigma_deg" in found.info
    levelled |= bool({*TILTS} & {*found.groups})
    told = [levelled or sensor_of(group_of(n)) != "acc" for n in found.names]
    names = [name for name, tells in zip(found.names, told, strict=True) if tells]
    values, sigma = found.values[told], found.sigma[told]
    return GradeShown.of(about.grade, names, values, sigma, about.sent)


def _insist(found: Calibration, session: Session, still: Rests) -> None:
    """Refuse a result without what the turns give.

    Raises
    ------
    NotObservable
        If there is no turn.

    """
    if len(still.at_rest(session).rows) < 1:
        raise NotObservable(
            "no position was held at rest, so there is no turn between two; leave"
            " out --turns"
        )
    if "turns" not in found.info:
        raise NotObservable(
            "no turn between two positions was recorded whole, so the gyroscopes have "
            "no scale factor: record on while the device is turned"
        )


def _listed(found: Calibration, order: list[int]) -> Calibration:
    """With the probability of each position in the order of session.toml."""
    bad = found.info.get("bad_position")
    if bad is None:
        return found
    listed = [0.0] * len(bad)
    for i, p in zip(order, bad, strict=True):
        listed[i] = p
    return replace(found, info={**found.info, "bad_position": listed})
