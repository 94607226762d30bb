"""GO or NO-GO as a person reads it, with its reasons and what it means."""

from __future__ import annotations

from typing import IO, Any

from fieldcal.calibration import Calibration

MARKS = {True: "ok  ", False: "NO  ", None: "?   "}


def show_decision(found: Calibration, out: IO[str] | None = None) -> None:
    """Print decision, checks, and what is left for a navigator; nothing without one.

    Parameters
    ----------
    found : calibration that was decided about
    out : standard output, unless given

    """
    from rich.console import Console

    decision = found.info.get("decision")
    if not decision:
        return
    console = Console(file=out, highlight=False)
    word, style = ("GO", "green") if decision["go"] else ("NO-GO", "red")
    console.print(f" {word} ", style=f"bold reverse {style}")
    for check in decision["checks"]:
        text = f"{MARKS[check['ok']]}{check['says']}"
        console.print(text, markup=False, soft_wrap=True)
    for growth in found.info.get("expectation", []):
        console.print(_growth(growth), markup=False, soft_wrap=True)


def _growth(growth: dict[str, Any]) -> str:
    """One sentence about what errors grow to."""
    parts = [
        f"{name} ± {growth[key]:.2g} {unit}"
        for name, key, unit in (
            ("tilt", "tilt_sigma_deg", "°"),
            ("heading", "heading_sigma_deg", "°"),
            ("level velocity", "level_velocity_sigma_m_s", "m/s"),
            ("vertical velocity", "vertical_velocity_sigma_m_s", "m/s"),
        )
        if growth[key] is not None
    ]
    after = f"{growth['seconds']:.0f} s"
    if not parts:
        return f"after {after} without aid: not determined"
    return f"after {after} without aid: {', '.join(parts)} (1σ)"
