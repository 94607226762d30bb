"""GO or NO-GO of a recorded session and its calibration; stores it in the history.

What is not in the calibration is read from the session: temperatures and missing
samples of the windows, the position that was not fitted, the counts of the link, and
what the operator insisted on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.acceptance.centred import biases_taken_out
from fieldcal.acceptance.decision import Circumstances, decide, with_decision
from fieldcal.acceptance.jump import jumps_too_far
from fieldcal.acceptance.site import gravity_contradicted, gravity_unknown
from fieldcal.acceptance.temperature import since_last
from fieldcal.acceptance.tracked import BiasSpread
from fieldcal.acceptance.verification import Verification, planned, verify
from fieldcal.acceptance.warmed import WarmedFamily, warmed
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.errors import FieldcalError
from fieldcal.core.sentences import join
from fieldcal.evaluation.observations import Rests
from fieldcal.history.store import History, HistoryRun, family
from fieldcal.session.folder import Session
from fieldcal.session.installed import tells_an_offset
from fieldcal.windows import Average, average
from fieldcal.windows.dead_axis import broken_axis_messages


def assess(
    found: Calibration,
    session: Session,
    still: Rests,
    limits: GradeLimits,
    history: History | None,
) -> Calibration:
    """The calibration with the decision about it, and where and when it was taken.

    Parameters
    ----------
    found : calibration of the session
    session : the recording
    still : its windows
    limits : of the device's grade
    history : of earlier calibrations, None for none

    """
    marks = list(session.marks())
    warnings = list(found.warnings)
    earlier: WarmedFamily | None = None
    usual: Sequence[HistoryRun] = ()
    serial = str(session.about.device.get("serial", ""))
    if history is not None and serial:
        try:
            here = str(session.folder.resolve())
            runs = [run for run in history.runs(serial) if run.session != here]
            usual = family(runs)
            earlier = warmed(found, usual, limits)
        except FieldcalError as error:
            warnings.append(str(error))
    dead = broken_axis_messages(session.block.six)
    taken_out = _taken_out(found, session, still, limits)
    circumstances = Circumstances(
        temperatures=[a.temperature for a in still.averages],
        link=_link(session, still.averages, marks),
        verification=_verification(found, session, marks, limits),
        family=earlier.calibrations if earlier else None,
        warmth=earlier.sigma if earlier else {},
        doubts=[*_doubts(marks), *dead, *taken_out],
        windows=still.at_rest(session).averages,
        held=[session.about.positions[i] for i in still.rows],
    )
    warnings += [w for w in _restarts(marks) if w not in warnings]
    made = decide(found, session.about, limits, circumstances)
    site = {"latitude_deg": session.about.latitude_deg}
    site |= {"height_m": session.about.height_m, "gravity": session.about.gravity}
    info = {**found.info, "site": site, "taken_at": start_time(marks)}
    if (costs := since_last(found, usual, limits)) is not None:
        info["temperature_change"] = costs
    return with_decision(replace(found, warnings=tuple(warnings), info=info), made)


def unassessed(
    found: Calibration, session: Session, still: Rests, limits: GradeLimits
) -> Calibration:
    """The calibration of a session that nobody is to fly with, with what is wrong.

    There is no GO: a recording from elsewhere need not meet limits. What cannot be
    known of it is said, and facts that are wrong make it bad.
    """
    about, of_acc = session.about, "acc_scale" in found.groups
    unknown = [gravity_unknown(about)] if of_acc else []
    wrong = [gravity_contradicted(about)] if of_acc else []
    wrong += [
        _lacking(found, session, still, limits),
        *broken_axis_messages(session.block.six),
    ]
    wrong += [jumps_too_far(found, limits)]
    wrong += _taken_out(found, session, still, limits)
    wrong = [w for w in wrong if w]
    warnings = (*wrong, *found.warnings, *filter(None, unknown))
    return replace(found, warnings=warnings, good=found.good and not wrong)


def _lacking(
    found: Calibration, session: Session, still: Rests, limits: GradeLimits
) -> str:
    """What is not determined where positions had to be left out; empty for nothing.

    That is what is known no better than of any unit of the grade. A person who recorded
    so few on purpose knows what they do not show.
    """
    out = len(session.positions) - len(still.rows)
    lost = [
        f"{group}.{axis}"
        for group in ("acc_bias", "acc_scale")
        if group in found.groups
        for axis, s in zip("xyz", found.vector(group)[1], strict=True)
        if not s < (limits.tolerance(group) or np.inf)
    ]
    if not out or not lost:
        return ""
    which = "a position was" if out == 1 else f"{out} positions were"
    verb = "is" if len(lost) == 1 else "are"
    them = "it" if out == 1 else "them"
    return (
        f"{which} left out; without {them} {join(lost)} {verb} not determined: record"
        f" {them} again"
    )


def _taken_out(
    found: Calibration, session: Session, still: Rests, limits: GradeLimits
) -> list[str]:
    """Whether biases were subtracted, where they are as large as those found."""
    held = still.at_rest(session).averages
    seen = np.nan_to_num(found.vector("acc_bias")[0])
    gyroscopes = BiasSpread(limits.gyr_bias_repeat, tells_an_offset(session.marks()))
    repeat = limits.acc_bias_repeat, gyroscopes
    return biases_taken_out(held, session.block, repeat, seen, limits.fit_chance)


def store_in_history(history: History, session: Session, found: Calibration) -> str:
    """Store a calibration in the history; returns a sentence for the operator."""
    if not session.about.device.get("serial"):
        return ""
    at = str(found.info.get("taken_at") or start_time([]))
    try:
        history.add(at, session.folder, found)
    except FieldcalError as error:
        return f"the calibration is not stored in the history: {error}"
    return ""


def start_time(marks: Sequence[Mapping[str, Any]]) -> str:
    """When the first position was asked for, ISO 8601 in UTC; now without marks."""
    times = [m["host_s"] for m in marks if isinstance(m.get("host_s"), int | float)]
    at = datetime.fromtimestamp(times[0], UTC) if times else datetime.now(UTC)
    return at.isoformat(timespec="seconds")


def verification_window(
    marks: Sequence[Mapping[str, Any]], number: int
) -> tuple[float, float] | None:
    """Window of the position numbered behind the fitted ones, s of device time."""
    windows = [
        (float(m["start_s"]), float(m["end_s"]))
        for m in marks
        if m.get("event") == "window" and m.get("position") == number
    ]
    return windows[-1] if windows else None


def _verification(
    found: Calibration,
    session: Session,
    marks: Sequence[Mapping[str, Any]],
    limits: GradeLimits,
) -> Verification | None:
    position = planned(session.about)
    window = verification_window(marks, len(session.positions))
    if position is None or window is None:
        return None
    try:
        held = average(session.block.between(*window))
    except FieldcalError:
        return None
    angle = float(np.deg2rad(limits.angle_setting_deg))
    return verify(found, session.about, position, held, angle)


def _link(
    session: Session, windows: Sequence[Average], marks: Sequence[Mapping[str, Any]]
) -> dict[str, int]:
    """Samples in the windows, those missing there, and frames refused in all.

    What is missing between the pieces of a window is no part of it.
    """
    samples = missing = 0
    block, gaps = session.block, session.about.without
    period = float(np.median(np.diff(block.t))) if len(block) > 1 else np.nan
    for window in windows:
        t = block.between(window.start, np.nextafter(window.end, np.inf)).t
        samples += len(t)
        if len(t) > 1 and period > 0:
            lost = np.maximum(np.rint(np.diff(t) / period) - 1, 0)
            for start, end in gaps:
                lost[(t[:-1] >= np.nextafter(start, -np.inf)) & (t[1:] <= end)] = 0
            missing += int(lost.sum())
    bad = sum(int(m.get("bad", 0)) for m in marks if m.get("event") == "link")
    return {"samples": samples, "missing": missing, "bad": bad}


def _doubts(marks: Sequence[Mapping[str, Any]]) -> list[str]:
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


def _restarts(marks: Sequence[Mapping[str, Any]]) -> list[str]:
    """Say that windows come from before and after a restart of the device."""
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
    run = session.about.raw.get("run")
    if given is None and isinstance(run, Mapping) and "limits" in run:
        return Path(str(run["limits"]))
    return given
