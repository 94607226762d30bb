"""GO or NO-GO of a recorded session and its calibration; stores it in the history.

Facts that are not in the calibration are read from the session: temperatures and
missing samples of the windows, the verification position, the counts of the link, and
positions that the operator accepted in spite of a warning.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.acceptance.bias_cases import BiasSpread
from fieldcal.acceptance.decision import Circumstances, decide, with_decision
from fieldcal.acceptance.exchange import exchange_text
from fieldcal.acceptance.family_at_temperature import (
    FamilyAtTemperature,
    family_at_temperature,
)
from fieldcal.acceptance.jump import bias_jump_warning
from fieldcal.acceptance.mean_removal import removed_bias_sentences
from fieldcal.acceptance.run_facts import (
    insistence_doubts,
    link_counts,
    restart_warnings,
)
from fieldcal.acceptance.site import (
    gravity_contradiction,
    gravity_missing_warning,
    latitude_missing_warning,
)
from fieldcal.acceptance.temperature import effect_of_temperature_change
from fieldcal.acceptance.verification import Verification, planned_verification, verify
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.errors import FieldcalError
from fieldcal.core.sentences import join_words
from fieldcal.evaluation.observations import angle_setting
from fieldcal.evaluation.usable_windows import UsableWindows
from fieldcal.history.store import History, HistoryRun, earlier_runs, family_runs
from fieldcal.session.folder import Session
from fieldcal.session.installed_calibration import subtracts_gyro_offset
from fieldcal.session.marks import taken_windows
from fieldcal.session.recorded_part import recorded_part
from fieldcal.windows import average
from fieldcal.windows.dead_axis import broken_axis_messages

TIME_UNKNOWN = (
    "the time of this recording is unknown, so it is compared with all calibrations of"
    " the device, as if it were the newest"
)


def assess(
    calibration: Calibration,
    session: Session,
    windows: UsableWindows,
    limits: GradeLimits,
    history: History | None,
) -> Calibration:
    """The calibration with its decision, site and time.

    Parameters
    ----------
    calibration : calibration of the session
    session : the recording
    windows : its usable windows
    limits : limits of the device's grade
    history : earlier calibrations; None without a history

    """
    marks = list(session.marks())
    taken_at = start_time(marks)
    earlier = _EarlierCalibrations.of(calibration, session, limits, history, taken_at)
    warnings = [*calibration.warnings, *earlier.warnings]
    warnings += [w for w in restart_warnings(marks) if w not in warnings]
    circumstances = Circumstances(
        temperatures=[a.temperature for a in windows.averages],
        link=link_counts(session, windows.averages, marks),
        verification=_verification(calibration, session, marks),
        family=earlier.family.calibrations if earlier.family else None,
        temperature_sigma=earlier.family.sigma if earlier.family else {},
        doubts=[
            *insistence_doubts(marks),
            *broken_axis_messages(session.block),
            *_bias_faults(calibration, session, windows, limits),
        ],
        windows=windows.at_rest(session).averages,
        position_numbers=windows.position_numbers,
    )
    made = decide(calibration, session.about, limits, circumstances)
    info = {**calibration.info, "site": _site_info(session), "taken_at": taken_at}
    costs = effect_of_temperature_change(calibration, earlier.runs, limits)
    if costs is not None:
        info["temperature_change"] = costs
    return with_decision(
        replace(calibration, warnings=tuple(warnings), info=info), made
    )


@dataclass(frozen=True, slots=True)
class _EarlierCalibrations:
    """What the history holds of the device.

    Attributes
    ----------
    runs : earlier runs of the device, oldest first
    family : their calibrations, taken to the temperature of this one; None without a
        history, or if it cannot be read
    warnings : a sentence each

    """

    runs: Sequence[HistoryRun] = ()
    family: FamilyAtTemperature | None = None
    warnings: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        calibration: Calibration,
        session: Session,
        limits: GradeLimits,
        history: History | None,
        taken_at: str | None,
    ) -> _EarlierCalibrations:
        """Read the history of the session's device; nothing if it has no serial number.

        `taken_at` is the time of the session, ISO 8601.
        """
        serial = str(session.about.device.get("serial", ""))
        if history is None or not serial:
            return cls()
        usual: Sequence[HistoryRun] = ()
        warnings: tuple[str, ...] = ()
        try:
            runs = history.runs(serial)
            part = recorded_part(session.folder) if runs else None
            usual = family_runs(earlier_runs(runs, session.folder, taken_at, part))
            warnings = (TIME_UNKNOWN,) if runs and taken_at is None else ()
            family = family_at_temperature(calibration, usual, limits)
        except FieldcalError as error:
            return cls(usual, None, (*warnings, str(error)))
        return cls(usual, family, warnings)


def _site_info(session: Session) -> dict[str, float | None]:
    """Latitude, deg, height, m, and gravity, m/s^2, for the calibration's `info`."""
    about = session.about
    return {
        "latitude_deg": about.latitude_deg,
        "height_m": about.height_m,
        "gravity": about.gravity,
    }


def with_faults(
    calibration: Calibration,
    session: Session,
    windows: UsableWindows,
    limits: GradeLimits,
) -> Calibration:
    """The calibration without a decision, with warnings about faults of the session.

    A recording from elsewhere need not meet limits, so there is no GO. Missing facts
    are warnings; wrong facts make the calibration bad.
    """
    about, of_acc = session.about, "acc_scale" in calibration.groups
    unknown = [gravity_missing_warning(about)] if of_acc else []
    if "gyr_bias" in calibration.groups:
        unknown.append(latitude_missing_warning(about))
    wrong = [gravity_contradiction(about)] if of_acc else []
    wrong += [
        _undetermined_by_omission(calibration, session, windows, limits),
        *broken_axis_messages(session.block),
    ]
    wrong += [bias_jump_warning(calibration, limits)]
    wrong += _bias_faults(calibration, session, windows, limits)
    wrong = [w for w in wrong if w]
    warnings = (*wrong, *calibration.warnings, *filter(None, unknown))
    return replace(calibration, warnings=warnings, good=calibration.good and not wrong)


def _undetermined_by_omission(
    calibration: Calibration,
    session: Session,
    windows: UsableWindows,
    limits: GradeLimits,
) -> str:
    """Sentence about parameters that are undetermined because positions were left out.

    A parameter counts as undetermined if its uncertainty is no smaller than the
    tolerance of the grade. Empty if no position was left out: a session with few
    positions may be intended.
    """
    out = len(session.positions) - len(windows.position_numbers)
    lost = [
        f"{group}.{axis}"
        for group in ("acc_bias", "acc_scale")
        if group in calibration.groups
        for axis, s in zip("xyz", calibration.vector(group)[1], strict=True)
        if not s < (limits.tolerance(group) or np.inf)
    ]
    if not out or not lost:
        return ""
    which = "a position was" if out == 1 else f"{out} positions were"
    verb = "is" if len(lost) == 1 else "are"
    them = "it" if out == 1 else "them"
    return (
        f"{which} left out; without {them} {join_words(lost)} {verb} not determined:"
        f" record {them} again"
    )


def _bias_faults(
    calibration: Calibration,
    session: Session,
    windows: UsableWindows,
    limits: GradeLimits,
) -> list[str]:
    """Sentences if biases were subtracted, or if those of another device follow."""
    held = windows.at_rest(session).averages
    seen = np.nan_to_num(calibration.vector("acc_bias")[0])
    gyroscopes = BiasSpread(
        limits.gyr_bias_repeat,
        subtracts_gyro_offset(session.marks()),
        session.about.keeps_gyro_bias,
    )
    repeat = limits.acc_bias_repeat, gyroscopes
    removed = removed_bias_sentences(
        held, session.block, repeat, seen, limits.fit_chance,
        calibration.vector("gyr_bias"),
    )  # fmt: skip
    exchanged = exchange_text(calibration, session.block, held, limits)
    return [*removed, *filter(None, [exchanged])]


def store_in_history(
    history: History, session: Session, calibration: Calibration
) -> str:
    """Store a calibration in the history; returns a sentence for the operator."""
    if not session.about.device.get("serial"):
        return ""
    try:
        taken_at, part = calibration.info.get("taken_at"), recorded_part(session.folder)
        history.add(taken_at, session.folder, calibration, part)
    except FieldcalError as error:
        return (
            f"the calibration is not stored in the history: {error}; once that is"
            f" mended, fieldcal batch {shlex.quote(str(session.folder))} puts it there"
        )
    return ""


def start_time(marks: Sequence[Mapping[str, Any]]) -> str | None:
    """Time of the recording, ISO 8601 in UTC; None if unknown.

    Of an imported recording it is by its own stamps, else that of the first mark.
    """
    for mark in marks:
        if mark.get("event") == "imported":
            return mark.get("taken_at")
    times = [m["host_s"] for m in marks if isinstance(m.get("host_s"), int | float)]
    if not times:
        return None
    return datetime.fromtimestamp(times[0], UTC).isoformat(timespec="seconds")


def _verification(
    calibration: Calibration,
    session: Session,
    marks: Sequence[Mapping[str, Any]],
) -> Verification | None:
    position = planned_verification(session.about)
    window = taken_windows(marks).get(len(session.positions))
    if position is None or window is None:
        return None
    try:
        held = average(session.block.between(*window))
    except FieldcalError as error:
        return Verification.unmeasured(position, str(error))
    used = calibration.info.get("angle_sigma_deg")
    stated = calibration.info.get("angles_stated_deg", used)
    angle = float(np.deg2rad(stated or angle_setting(session.about)))
    return verify(calibration, session.about, position, held, angle)


def limits_path(session: Session, given: Path | None) -> Path | None:
    """File of limits: the one given, or the one that the session's plan names."""
    return planned_limits(session.about.raw) if given is None else given


def planned_limits(raw: Mapping[str, Any]) -> Path | None:
    """File of limits that the plan in a session.toml names; None without any."""
    run = raw.get("run")
    if isinstance(run, Mapping) and "limits" in run:
        return Path(str(run["limits"]))
    return None
