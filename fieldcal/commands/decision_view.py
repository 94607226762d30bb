"""Terminal view of the decision GO or NO-GO with its reasons."""

from __future__ import annotations

import shlex
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.acceptance.uncertainty import UNCERTAINTY
from fieldcal.calibration import Calibration

if TYPE_CHECKING:
    from fieldcal.session.description import Description

GO = "GO: within all limits that could be checked"
NO_GO = "NO-GO: do not launch on this, for the reasons marked NO"

MARKS = {True: "ok  ", False: "NO  ", None: "?   "}


def show_decision(found: Calibration, folder: Path | None = None) -> None:
    """Print expected navigation errors, checks and decision; nothing without one.

    The decision comes last, with its reasons just above it, so that both are on the
    screen at the end. After a NO-GO follow the cheapest remedy, or the positions that
    were left out, and what was not stated. `folder` is the session of a run, in which
    they can be taken.
    """
    from fieldcal.commands.console import EscapingConsole
    from fieldcal.commands.table import print_sentence

    decision = found.info.get("decision")
    if not decision:
        return
    console = EscapingConsole()
    for growth in found.info.get("expectation", []):
        print_sentence(console, "", _growth_sentence(growth))
    for sentence in found.info.get("temperature_change", {}).get("says", []):
        print_sentence(console, "", sentence)
    order = {True: 0, None: 1, False: 2}
    for check in sorted(decision["checks"], key=lambda each: order[each["ok"]]):
        print_sentence(console, MARKS[check["ok"]], check["says"])
    word, style = (GO, "green") if decision["go"] else (NO_GO, "red")
    console.print(f" {word} ", style=f"bold reverse {style}", markup=False)
    remedy = decision.get("remedy")
    if remedy:
        print_sentence(console, "to GO: ", remedy["says"])
    if folder is not None and not decision["go"]:
        failed = {check["name"] for check in decision["checks"] if check["ok"] is False}
        _print_resume_commands(folder, remedy, failed)


def reasons_against(found: Calibration) -> list[str]:
    """Why a calibration is not to be used: NO-GO, or bad without a decision."""
    decision = found.info.get("decision") or {"go": True}
    if not decision["go"]:
        return list(decision.get("reasons", ())) or ["it was decided so"]
    if not found.good:
        return [f"the calibration is bad: {', '.join(found.warnings[:1]) or 'its fit'}"]
    return []


def _print_resume_commands(
    folder: Path, remedy: dict[str, Any] | None, failed: Collection[str]
) -> None:
    """Print the commands that state what nobody stated, and take what is lacking."""
    from fieldcal.commands.console import EscapingConsole
    from fieldcal.commands.table import print_sentence
    from fieldcal.run.resuming import positions_left_out
    from fieldcal.session.folder import Session

    console, session = EscapingConsole(), Session.open(folder)
    call = f"fieldcal run --resume {shlex.quote(str(folder))}"
    if remedy:
        print_sentence(console, "       ", f"{call} takes it")
    elif left_out := positions_left_out(session):
        which = ", ".join(str(i + 1) for i in left_out)
        what = "positions" if len(left_out) > 1 else "position"
        print_sentence(
            console, "first: ", f"take {what} {which}, left out so far: {call}"
        )
    if unsaid := _options_unsaid(session.about, failed):
        said = f"state what nobody stated, and it is judged anew: {call} "
        said += " ".join(unsaid)
        print_sentence(console, "first: ", said)


def _options_unsaid(about: Description, failed: Collection[str]) -> list[str]:
    """Options of `run --resume` that state what failed checks lack."""
    from fieldcal.acceptance.angles import ANGLES, unstated_angles_warning
    from fieldcal.acceptance.site import (
        gravity_missing_warning,
        latitude_missing_warning,
    )

    options = []
    if gravity_missing_warning(about) or latitude_missing_warning(about):
        options += ["--latitude DEG --height M"] * ("site" in failed)
    if about.level_deg is None:
        options += ["--level DEG"] * ("level" in failed)
    if unstated_angles_warning(about):
        by_angles = {ANGLES, *(f"acc_{of}{UNCERTAINTY}" for of in ("bias", "scale"))}
        options += ["--angles DEG"] * bool(by_angles & {*failed})
    return options


def _growth_sentence(growth: dict[str, Any]) -> str:
    """Sentence about the navigation errors after some time without aid."""
    parts = [
        f"{name} ± {float(f'{growth[key]:.2g}'):g}{unit}"
        for name, key, unit in (
            ("tilt", "tilt_sigma_deg", "°"),
            ("heading", "heading_sigma_deg", "°"),
            ("level velocity", "level_velocity_sigma_m_s", " m/s"),
            ("vertical velocity", "vertical_velocity_sigma_m_s", " m/s"),
        )
        if growth[key] is not None
    ]
    after = f"{growth['seconds']:.0f} s"
    if not parts:
        return f"after {after} without aid: not determined"
    return f"after {after} without aid: {', '.join(parts)} (1σ)"
