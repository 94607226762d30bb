"""Solves a recorded session from its windows and the turns between them.

The rows, and what explains them, are those of `prepared_session`. To the calibration
come warnings of the session, the grade that it shows, and effects that it does not
contain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, Literal

from fieldcal.calibration import Calibration
from fieldcal.calibration.grade_evidence import GradeShown
from fieldcal.calibration.names import TILTS, group_of, sensor_of
from fieldcal.core.errors import NotObservable
from fieldcal.core.grade import Grade
from fieldcal.evaluation.angle_setting import with_shown_angle_setting
from fieldcal.evaluation.jump import with_jump
from fieldcal.evaluation.level_check import with_tilt_shown
from fieldcal.evaluation.observations import angle_setting, with_provenance
from fieldcal.evaluation.omitted_effects import (
    omitted_effects,
    with_description_faults,
    with_impossible_explanation,
    with_omitted_effects,
)
from fieldcal.evaluation.prepared_session import PreparedSession
from fieldcal.evaluation.rounding_mode import with_rounding_uncertainty
from fieldcal.evaluation.usable_windows import UsableWindows
from fieldcal.model import priors
from fieldcal.session.description import Description
from fieldcal.session.factory import factory_errors
from fieldcal.session.folder import Session
from fieldcal.solve import solve
from fieldcal.solve.estimation import RecordedRows
from fieldcal.solve.words import RECORD_TURNS

UseTurns = Literal["auto", "yes", "no"]


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
    if options.get("as_printed"):
        options["factory"] = factory_errors(device)
        return _with_warnings(
            solve(prepared.observations, **options), prepared, turns, []
        )
    shown, stated = prepared.explanation, options["angle_sigma_deg"]
    recorded = prepared.recorded_rows(turns != "no", shown)

    calibration, notes = _at_shown_grade(prepared, recorded, device, options)
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
    calibration = with_impossible_explanation(shown, calibration)
    return with_description_faults(shown.prepared, calibration)


def _at_shown_grade(
    prepared: PreparedSession,
    recorded: RecordedRows | None,
    device: Description,
    options: dict[str, Any],
) -> tuple[Calibration, list[str]]:
    """The calibration with what the grade that it shows leaves in a device; notes.

    What a grade leaves widens the result by which the grade is judged, so the grade is
    the one that its own result shows. That of the explanation is nearly always right.
    `options` get the uncertainty of angles and the errors that were taken.
    """
    shown, stated = prepared.explanation, options["angle_sigma_deg"]

    def fit() -> Calibration:
        return solve(prepared.observations, recorded=recorded, **options)

    for grade in dict.fromkeys([shown.grade if shown else device.grade, device.grade]):
        options |= {"angle_sigma_deg": stated, **_factory_options(device, grade)}
        calibration, notes = with_shown_angle_setting(fit, options, shown)
        shows = _shown_grade(calibration, prepared.session.about)
        if shows.grade == grade:
            break
    else:
        options |= _factory_options(device, shows.grade)
        calibration = fit()
    if shows.because:
        info = {**calibration.info, "grade_shown": asdict(shows)}
        calibration = replace(calibration, info=info)
    return calibration, notes


def _factory_options(device: Description, grade: Grade) -> dict[str, Any]:
    """Arguments of `solve` for a device that shows a grade."""
    stated, shown = factory_errors(device), factory_errors(device, grade)
    return {"factory": shown, "at_best": None if grade == device.grade else stated}


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
