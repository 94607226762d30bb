"""GO or NO-GO of a recorded session and its calibration; stores it in the history.

Facts that are not in the calibration are read from the session: temperatures and
missing samples of the windows, the verification position, the counts of the link, and
positions that the operator accepted in spite of a warning.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.acceptance.bias_removal import BiasSpread
from fieldcal.acceptance.decision import Circumstances, decide, with_decision
from fieldcal.acceptance.family_at_temperature import (
    FamilyAtTemperature,
    family_at_temperature,
)
from fieldcal.acceptance.jump import bias_jump_warning
from fieldcal.acceptance.mean_removal import removed_bias_sentences
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
from fieldcal.core.sampling import shows_losses
from fieldcal.core.sentences import join_words
from fieldcal.evaluation.observations import UsableWindows, angle_setting
from fieldcal.history.store import History, HistoryRun, earlier_runs, family_runs
from fieldcal.session.folder import Session
from fieldcal.session.installed_calibration import subtracts_gyro_offset
from fieldcal.session.marks import taken_windows
from fieldcal.session.recorded_part import recorded_part
from fieldcal.windows import Average, average
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
    warnings = list(calibration.warnings)
    earlier: FamilyAtTemperature | None = None
    usual: Sequence[HistoryRun] = ()
    serial = str(session.about.device.get("serial", ""))
    if history is not None and serial:
        try:
            runs = history.runs(serial)
            part = recorded_part(session.folder) if runs else None
            usual = family_runs(earlier_runs(runs, session.folder, taken_at, part))
            if runs and taken_at is None:
                warnings.append(TIME_UNKNOWN)
            earlier = family_at_temperature(calibration, usual, limits)
        except FieldcalError as error:
            warnings.append(str(error))
    dead = broken_axis_messages(session.block.six)
    taken_out = _removed_biases(calibration, session, windows, limits)
    circumstances = Circumstances(
        temperatures=[a.temperature for a in windows.averages],
        link=_link(session, windows.averages, marks),
        verification=_verification(calibration, session, marks),
        family=earlier.calibrations if earlier else None,
        temperature_sigma=earlier.sigma if earlier else {},
        doubts=[*_insisted_positions(marks), *dead, *taken_out],
        windows=windows.at_rest(session).averages,
        position_numbers=windows.position_numbers,
    )
    warnings += [w for w in _restart_warnings(marks) if w not in warnings]
    made = decide(calibration, session.about, limits, circumstances)
    site = {"latitude_deg": session.about.latitude_deg}
    site |= {"height_m": session.about.height_m, "gravity": session.about.gravity}
    info = {**calibration.info, "site": site, "taken_at": taken_at}
    if (costs := effect_of_temperature_change(calibration, usual, limits)) is not None:
        info["temperature_change"] = costs
    return with_decision(
        replace(calibration, warnings=tuple(warnings), info=info), made
    )


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
        *broken_axis_messages(session.block.six),
    ]
    wrong += [bias_jump_warning(calibration, limits)]
    wrong += _removed_biases(calibration, session, windows, limits)
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


def _removed_biases(
    calibration: Calibration,
    session: Session,
    windows: UsableWindows,
    limits: GradeLimits,
) -> list[str]:
    """Sentences if biases of the size found were subtracted from the recording."""
    held = windows.at_rest(session).averages
    seen = np.nan_to_num(calibration.vector("acc_bias")[0])
    gyroscopes = BiasSpread(
        limits.gyr_bias_repeat, subtracts_gyro_offset(session.marks())
    )
    repeat = limits.acc_bias_repeat, gyroscopes
    return removed_bias_sentences(held, session.block, repeat, seen, limits.fit_chance)


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
        return f"the calibration is not stored in the history: {error}"
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


def _link(
    session: Session, windows: Sequence[Average], marks: Sequence[Mapping[str, Any]]
) -> dict[str, int]:
    """Samples and missing samples in the windows; frames of the whole run, and refused.

    Gaps between the used pieces of a window do not count as missing. Nothing is said of
    missing samples if the times show none.
    """
    samples = missing = 0
    block, gaps, shown = session.block, session.about.excluded_spans, True
    period = float(np.median(np.diff(block.t))) if len(block) > 1 else np.nan
    for window in windows:
        t = block.between(window.start, np.nextafter(window.end, np.inf)).t
        samples += len(t)
        shown &= shows_losses(t)
        if len(t) > 1 and period > 0:
            lost = np.maximum(np.rint(np.diff(t) / period) - 1, 0)
            for start, end in gaps:
                lost[(t[:-1] >= np.nextafter(start, -np.inf)) & (t[1:] <= end)] = 0
            missing += int(lost.sum())
    bad = sum(int(m.get("bad", 0)) for m in marks if m.get("event") == "link")
    counts = {"samples": samples, "bad": bad, "taken": len(block)}
    return counts | ({"missing": missing} if shown else {})


def _insisted_positions(marks: Sequence[Mapping[str, Any]]) -> list[str]:
    """Positions that the operator confirmed although they looked wrong."""
    insisted: dict[int, str] = {}
    for mark in marks:
        number = mark.get("position")
        if not isinstance(number, int):
            continue
        if mark.get("event") == "asked":
            insisted.pop(number, None)
        elif mark.get("event") == "insisted":
            insisted[number] = str(mark.get("text", ""))
    return [
        f"position {number + 1} was accepted by the operator although {text}"
        for number, text in sorted(insisted.items())
    ]


def _restart_warnings(marks: Sequence[Mapping[str, Any]]) -> list[str]:
    """Warnings that the windows come from before and after a restart of the device."""
    taken: list[int] = []
    said = []
    for mark in marks:
        if mark.get("event") == "window":
            taken.append(int(mark["position"]))
        elif mark.get("event") == "rejoined" and taken:
            said.append(
                f"the recording was interrupted after position {taken[-1] + 1}: if the"
                " device lost power meanwhile, its bias may have changed; record all"
                " positions without a restart"
            )
    counted = sum(int(m.get("restarts", 0)) for m in marks if m.get("event") == "link")
    if counted:
        times = "once" if counted == 1 else f"{counted} times"
        said.append(
            f"the device restarted {times} during the run, and its bias may differ from"
            " start to start: record all positions without a restart"
        )
    return said


def limits_path(session: Session, given: Path | None) -> Path | None:
    """File of limits: the one given, or the one that the session's plan names."""
    return planned_limits(session.about.raw) if given is None else given


def planned_limits(raw: Mapping[str, Any]) -> Path | None:
    """File of limits that the plan in a session.toml names; None without any."""
    run = raw.get("run")
    if isinstance(run, Mapping) and "limits" in run:
        return Path(str(run["limits"]))
    return None
