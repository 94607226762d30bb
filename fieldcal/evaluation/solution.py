"""Solves a recorded session from its windows and the turns between them.

The rows are those of `diagnose`: means over parts of windows with the noise measured in
the recording, after samples were corrected and lines were subtracted. Of a disturbed
window the undisturbed parts are used, if the device stayed in the same position.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.grade_evidence import GradeShown
from fieldcal.calibration.names import TILTS, group_of, sensor_of
from fieldcal.core.errors import InputError, NotObservable
from fieldcal.diagnosis.explain import Explanation, explain, times_since_turn
from fieldcal.diagnosis.prepare import PreparedRecording, prepare_recording
from fieldcal.evaluation.angle_setting import with_shown_angle_setting
from fieldcal.evaluation.jump import with_jump
from fieldcal.evaluation.level_check import with_tilt_shown
from fieldcal.evaluation.observations import (
    UsableWindows,
    angle_setting,
    build_observations,
    reported_grain,
    with_provenance,
)
from fieldcal.evaluation.omitted_effects import (
    omitted_effects,
    with_description_faults,
    with_omitted_effects,
)
from fieldcal.evaluation.rounding_mode import (
    RoundingMode,
    rounding_mode,
    with_rounding_uncertainty,
)
from fieldcal.evaluation.undisturbed_span import undisturbed_span
from fieldcal.model import priors
from fieldcal.session.description import Description
from fieldcal.session.factory import factory_errors
from fieldcal.session.folder import Session
from fieldcal.solve import Observations, solve
from fieldcal.solve.estimation import RecordedRows
from fieldcal.solve.explanations import WeightedExplanation
from fieldcal.solve.observation_rows import mean_variances, with_window_variances
from fieldcal.solve.words import RECORD_TURNS
from fieldcal.windows.dead_band import dead_band_messages

UseTurns = Literal["auto", "yes", "no"]


@dataclass(frozen=True)
class PreparedSession:
    """A session with its windows, prepared for the estimators.

    Attributes
    ----------
    session : the recording
    windows : its usable windows
    previous : explanation of a part of the recording, from which the search may start

    """

    session: Session
    windows: UsableWindows
    previous: Explanation | None = None

    @cached_property
    def order(self) -> list[int]:
        """Indices into `windows`, in the order of time."""
        averages = self.windows.averages
        return sorted(range(len(averages)), key=lambda i: averages[i].start)

    @cached_property
    def about(self) -> Description:
        """Description of the session with these windows and their undisturbed spans."""
        about, windows = self.session.about, self.windows
        rows = [windows.position_numbers[i] for i in self.order]
        averages = [windows.averages[i] for i in self.order]
        ends = [
            undisturbed_span(self.session.block, about.windows[r], average)
            for r, average in zip(rows, averages, strict=True)
        ]
        return replace(
            about,
            positions=tuple(about.positions[r] for r in rows),
            windows=tuple((a, float(np.nextafter(b, np.inf))) for a, b in ends),
            position_numbers=tuple(rows),
        )

    @cached_property
    def observations(self) -> Observations:
        """Means of the windows, in the order of time."""
        averages = [self.windows.averages[i] for i in self.order]
        return build_observations(self.about, averages, range(len(averages)))

    @cached_property
    def rounding(self) -> RoundingMode:
        """Uncertainty of how the device rounds its values."""
        return rounding_mode(self.session, reported_grain(self.session))

    @cached_property
    def examination(self) -> tuple[PreparedRecording | None, str]:
        """The checked and reduced recording, or None and the reason."""
        try:
            return prepare_recording(self.session.block, self.about), ""
        except InputError as error:
            return None, str(error)

    @property
    def reduced_recording(self) -> PreparedRecording | None:
        """The checked and reduced recording; None if it cannot be examined."""
        return self.examination[0]

    @cached_property
    def explanation(self) -> Explanation | None:
        """Explanation of the recording; None if it cannot be examined."""
        if self.reduced_recording is None:
            return None
        return explain(self.reduced_recording, self.previous)

    @property
    def sample_warnings(self) -> list[str]:
        """Warnings of what samples hide, or that only the windows' means are used."""
        why = self.examination[1]
        if not why:
            return list(dead_band_messages(self.session.block, self.observations.mean))
        return [
            f"only the windows' means are used, neither samples nor turns nor [model],"
            f" since the recording cannot be examined: {why}"
        ]

    def recorded_rows(
        self, turns: bool, shown: Explanation | None = None
    ) -> RecordedRows | None:
        """Rows of the windows, and samples of the turns if these are to be used.

        `shown` is the explanation of the recording. None if it cannot be examined.
        """
        if self.reduced_recording is None:
            return None
        source, rows = self.reduced_recording.source, self.reduced_recording.rows
        measured = (self.observations.has_acc, self.observations.has_gyr)
        sd = np.full_like(rows.sd, np.nan)
        for c in np.flatnonzero(measured):
            sd[:, 3 * c : 3 * c + 3] = rows.sd[:, 3 * c : 3 * c + 3]
        rows = replace(rows, sd=sd)
        known = mean_variances(self.observations)
        known[:, :3] += self.rounding.variance_near_zero(self.observations.mean[:, :3])
        rows = with_window_variances(rows, known)
        likely = () if shown is None else shown.posterior.weights
        return RecordedRows(
            rows,
            times_since_turn(source, rows),
            source if turns else None,
            tuple(WeightedExplanation.of(s, p) for s, p in likely),
            None if shown is None else shown.filter_rows,
            tuple(self.rounding.cut_sigma.tolist()),
        )


def solve_session(
    session: Session,
    windows: UsableWindows,
    turns: UseTurns = "auto",
    left: Mapping[str, Any] | None = None,
    **options: Any,
) -> Calibration:
    """Solve a session.

    Parameters
    ----------
    session : the recording
    windows : its usable windows
    turns : whether the turns between windows are used; "yes" requires them
    left : sizes of the factory errors by the keys of session.toml; they replace those
        in session.toml and those of the grade
    options : arguments of `fieldcal.solve.solve`; defaults for the level of the base
        and the setting of angles come from session.toml, or from the grade

    Raises
    ------
    NotObservable
        If nothing is determined, or turns are required and there are none.

    """
    return solve_prepared(PreparedSession(session, windows), turns, left, **options)


def solve_prepared(
    prepared: PreparedSession,
    turns: UseTurns = "auto",
    left: Mapping[str, Any] | None = None,
    **options: Any,
) -> Calibration:
    """Solve a prepared session; parameters and errors as of `solve_session`."""
    options = _with_defaults(prepared, options)
    device = replace(prepared.session.about, **(left or {}))
    options["factory"] = factory_errors(device)
    if options.get("as_printed"):
        return _with_warnings(
            solve(prepared.observations, **options), prepared, turns, []
        )
    shown = prepared.explanation
    recorded = prepared.recorded_rows(turns != "no", shown)

    def fit() -> Calibration:
        return solve(prepared.observations, recorded=recorded, **options)

    stated = options["angle_sigma_deg"]
    calibration, notes = with_shown_angle_setting(fit, options, shown)
    shows = _shown_grade(calibration, prepared.session.about)
    if shows.because:
        options["at_best"] = options["factory"]
        options["factory"] = factory_errors(device, shows.grade)
        calibration = fit()
        calibration = replace(
            calibration, info={**calibration.info, "grade_shown": asdict(shows)}
        )
    calibration = with_tilt_shown(calibration, prepared.observations, recorded, options)
    calibration = _with_warnings(
        calibration, prepared, turns, [*notes, *prepared.sample_warnings]
    )
    calibration = with_rounding_uncertainty(calibration, prepared.rounding)
    if options["angle_sigma_deg"] > stated:
        calibration = replace(
            calibration, info={**calibration.info, "angles_stated_deg": stated}
        )
    if shown is None:
        return replace(
            calibration,
            info={**calibration.info, "unexamined": prepared.examination[1]},
        )
    calibration = with_omitted_effects(
        with_jump(calibration, shown), omitted_effects(shown, calibration)
    )
    return with_description_faults(shown.prepared, calibration)


def _with_defaults(
    prepared: PreparedSession, options: Mapping[str, Any]
) -> dict[str, Any]:
    """Arguments of `solve`, with defaults from session.toml or the grade."""
    about = prepared.session.about
    own = {
        "level_sigma_deg": about.level_deg,
        "angle_sigma_deg": angle_setting(about),
        "beside_tilt_sigma_deg": priors.BESIDE_TILT_DEG,
    }
    return own | {name: value for name, value in options.items() if value is not None}


def _with_warnings(
    calibration: Calibration,
    prepared: PreparedSession,
    turns: UseTurns,
    notes: Sequence[str],
) -> Calibration:
    """Add the warnings of the windows; reasons why the result is bad come first."""
    if turns == "yes":
        _require_turns(calibration, prepared.session, prepared.windows)
    ahead, behind = (
        ((), calibration.warnings) if calibration.good else (calibration.warnings, ())
    )
    warnings = (*ahead, *prepared.windows.warnings, *notes, *behind)
    calibration = with_provenance(
        replace(calibration, warnings=warnings), prepared.session.about
    )
    return _with_numbers_of_session(calibration, prepared)


def _shown_grade(calibration: Calibration, about: Description) -> GradeShown:
    """The grade that a result shows; the stated one if the result is bad.

    Accelerometers are ignored if the tilt of the base is neither estimated nor stated:
    it may have been taken for their bias and scale factor.
    """
    if not calibration.good:
        return GradeShown(about.grade)
    levelled = calibration.method == "scalar" or "level_sigma_deg" in calibration.info
    levelled |= bool({*TILTS} & {*calibration.groups})
    told = [levelled or sensor_of(group_of(n)) != "acc" for n in calibration.names]
    names = [name for name, tells in zip(calibration.names, told, strict=True) if tells]
    values, sigma = calibration.values[told], calibration.sigma[told]
    return GradeShown.of(about.grade, names, values, sigma, about.nominal_as_sent)


def _require_turns(
    calibration: Calibration, session: Session, windows: UsableWindows
) -> None:
    """Refuse a result that does not use turns.

    Raises
    ------
    NotObservable
        If there is no turn.

    """
    if len(windows.at_rest(session).position_numbers) < 1:
        raise NotObservable(
            "no position was held at rest, so there is no turn between two; leave"
            " out --turns"
        )
    if "turns" not in calibration.info:
        raise NotObservable(
            "no turn between two positions could be followed, so the gyroscopes have "
            f"no scale factor: {RECORD_TURNS}"
        )


def _with_numbers_of_session(
    calibration: Calibration, prepared: PreparedSession
) -> Calibration:
    """Put the results for single positions in the order of session.toml.

    The probabilities of bad positions are those of the used windows; wrong positions
    are numbered among all.
    """
    info = dict(calibration.info)
    if (bad := info.get("bad_position")) is not None:
        listed = [0.0] * len(bad)
        for i, p in zip(prepared.order, bad, strict=True):
            listed[i] = p
        info["bad_position"] = listed
    if "wrong_angles" in info:
        numbers = prepared.about.position_numbers
        info["wrong_angles"] = [
            one
            if one["position"] is None
            else {**one, "position": numbers[one["position"]]}
            for one in info["wrong_angles"]
        ]
    return replace(calibration, info=info)
