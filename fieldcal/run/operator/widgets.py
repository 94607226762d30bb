"""Parts of the operator's screen: inclinometer, meters, list, link.

All of it reads without colour, and fits into 76 columns.
"""

from __future__ import annotations

from collections.abc import Mapping, Set

import numpy as np
from rich.table import Table
from rich.text import Text

from fieldcal.run.operator.protocol import OperatorView
from fieldcal.run.position_check import round_to_tenth

METER_WIDTH = 20
"""Width of the stillness meter, characters."""

BAR_WIDTH = 30
"""Width of the bar that fills while averaging, characters."""

TICKS = (0.0, 2.0, 5.0, 15.0, 45.0, 180.0)
"""Angle of each second character of half the inclinometer, deg; a fixed scale."""

HALF_WIDTH = 2 * (len(TICKS) - 1)
"""Characters to either side of the middle, which is the wanted angle."""

RULER = "  -45  -5  0   5  45  "
"""Scale above the inclinometers, deg."""

UNSEEN = "by its mark, gravity does not show it"
"""Notice for a third angle: accelerometers at rest show two only."""

CRYSTAL = 1000.0
"""Uncertainty above which a clock error is not shown, ppm, since any crystal is better.
It is that large for a while after the computer slept, since samples arrived late."""

MIN_TURN_DEG = 1.0
"""Least error of an angle, deg, for which a turn is requested."""


def alert(view: OperatorView) -> str:
    """Reason for waiting if the operator has to act; else empty."""
    return view.reason.text if view.reason.needs_operator else ""


def angles(view: OperatorView) -> list[tuple[str, Text]]:
    """Name and inclinometer of the joints, where the angles are known."""
    wanted, now = view.hold.position.all_degrees, view.arrival
    if now is None or wanted is None:
        return []
    seen = (now.alpha_deg, now.beta_deg)
    rows = [
        (name, inclinometer(there, asked, now.limit_deg, now.ok))
        for name, there, asked in zip("αβ", seen, wanted[:2], strict=True)
    ]
    if wanted[2]:
        set_to = f"{round_to_tenth(wanted[2]):+.1f}°"
        rows.append(("γ", Text(f"set to {set_to} {UNSEEN}")))
    return rows


def inclinometer(seen: float, wanted: float, limit: float, ok: bool) -> Text:
    """Scale with the angle (o), the wanted angle (middle) and the direction to turn.

    Parameters
    ----------
    seen, wanted : deg
    limit : how far it may be off, deg; nan where that is not known
    ok : whether both angles together are close enough

    """
    off = round_to_tenth(wanted - seen)
    away = 2 * float(np.interp(abs(off), TICKS, range(len(TICKS))))
    place = (
        HALF_WIDTH - int(np.copysign(np.ceil(away - 1e-9), off)) if off else HALF_WIDTH
    )
    cells = ["·"] * (2 * HALF_WIDTH + 1)
    cells[HALF_WIDTH], cells[place] = "|", "o"
    within = f" ± {limit:.1f}°" if np.isfinite(limit) else ""
    there = ok or abs(off) < MIN_TURN_DEG
    way = "→" if off > 0 else "←"
    order = "close enough" if there else f"turn {off:+.1f}° {way}"
    there_now, asked = round_to_tenth(seen), round_to_tenth(wanted)
    where = f"[{''.join(cells)}] {there_now:+6.1f}° to {asked:+.1f}°{within}"
    return Text.assemble(where, "  ", (order, "green" if there else "bold yellow"))


def stillness(level: float) -> Text:
    """Meter of the motion, relative to the allowed motion."""
    if not np.isfinite(level):
        return Text("listening to the device's noise")
    filled = int(np.clip(round(level * METER_WIDTH / 2), 0, METER_WIDTH))
    bar = f"{'#' * filled:·<{METER_WIDTH}}"
    limit = METER_WIDTH // 2
    word, style = ("still", "green") if level < 1 else ("MOVING", "bold yellow")
    return Text.assemble(f"[{bar[:limit]}|{bar[limit:]}] ", (word, style))


def sigma(view: OperatorView) -> str:
    """Standard errors reached; of each sensor the worst axis."""
    acc, gyr = view.sigma[:3], view.sigma[3:]
    parts = []
    if np.isfinite(acc).any():
        parts.append(f"{1e3 * np.nanmax(acc):.2f} mm/s²")
    if np.isfinite(gyr).any():
        parts.append(f"{1e3 * np.nanmax(gyr):.3f} mrad/s")
    return ", ".join(parts) or ""


def sigma_at_end(view: OperatorView) -> str:
    """Expected standard error of the full window, for white noise."""
    acc = view.sigma[:3][np.isfinite(view.sigma[:3])]
    if view.hold.sigma:
        return f", wanted ± {1e3 * view.hold.sigma:.2f} mm/s²"
    if not len(acc) or view.elapsed >= view.hold.seconds:
        return ""
    then = float(acc.max()) * np.sqrt(view.elapsed / view.hold.seconds)
    return f", by the end about ± {1e3 * then:.2f} mm/s²"


def gauges(view: OperatorView) -> Table:
    """All present measurements."""
    grid = Table.grid(padding=(0, 2))
    grid.add_column(width=9)
    grid.add_column()
    if view.phase in ("turning", "silent"):
        scales = angles(view)
        if scales:
            grid.add_row("off, °", RULER)
        for name, scale in scales:
            grid.add_row(name, scale)
        grid.add_row("status", "see below" if alert(view) else view.reason.text)
    else:
        seconds = view.hold.seconds
        share = min(1.0, view.elapsed / seconds)
        bar = Text(f"[{'#' * round(share * BAR_WIDTH):·<{BAR_WIDTH}}] {share:4.0%}")
        left = max(0.0, seconds - view.elapsed)
        grid.add_row("averaging", bar)
        grid.add_row("time left", f"{left:.0f} s of {seconds:.0f} s")
        known = sigma(view)
        reached = f"± {known}{sigma_at_end(view)}" if known else "not known yet"
        grid.add_row("reached", reached)
    if view.phase != "silent":
        grid.add_row("stillness", stillness(view.stillness))
    return grid


def progress(
    taken: Mapping[int, float],
    now: int,
    number: int,
    left_out: Set[int] = frozenset(),
) -> str:
    """Line with the positions that are taken, left out, and still to come.

    >>> progress({0: 1e-3}, 2, 5, {1})
    'taken 1 · left out 2 · now 3 · to come 4 5'
    """
    waiting = [i for i in range(number) if i not in taken and i != now]
    groups = {
        "taken": sorted(taken),
        "left out": [i for i in waiting if i in left_out],
        "now": [now] if now >= 0 else [],
        "to come": [i for i in waiting if i not in left_out],
    }
    numbers = {
        name: " ".join(str(i + 1) for i in each) for name, each in groups.items()
    }
    return " · ".join(f"{name} {listed}" for name, listed in numbers.items() if listed)


def short_gauges(view: OperatorView) -> list[str]:
    """All present measurements in a few short lines, for a small screen."""
    if view.phase in ("averaging", "taken"):
        left = max(0.0, view.hold.seconds - view.elapsed)
        reached = f", ± {known}" if (known := sigma(view)) else ""
        return [f"{left:.0f} s of {view.hold.seconds:.0f} s left{reached}"]
    wanted, now = view.hold.position.all_degrees, view.arrival
    lines = []
    if now is not None and wanted is not None:
        seen = (now.alpha_deg, now.beta_deg)
        for name, there, asked in zip("αβ", seen, wanted[:2], strict=True):
            off = round_to_tenth(asked - there)
            near = now.ok or abs(off) < MIN_TURN_DEG
            order = "ok" if near else f"turn {off:+.1f}°"
            lines.append(
                f"{name} {round_to_tenth(there):+.1f}° to {asked:+.1f}°  {order}"
            )
        if wanted[2]:
            lines.append(f"γ to {round_to_tenth(wanted[2]):+.1f}°, not seen by gravity")
    return lines if alert(view) else [*lines, view.reason.text]


def link_state(view: OperatorView) -> Text:
    """State of the link: rate and losses."""
    health = view.health
    rate = f"{view.rate_hz:.0f} Hz" if np.isfinite(view.rate_hz) else "no rate yet"
    parts = [rate, f"{health.samples} samples"]
    gaps = "1 gap" if health.gaps == 1 else f"{health.gaps} gaps"
    parts.append(f"{gaps}, {health.missing} missing, {health.bad} bad frames")
    if np.isfinite(view.temperature):
        parts.append(f"{view.temperature:.1f} °C")
    if health.restarts:
        parts.append(f"restarts: {health.restarts}")
    clock = health.clock
    if clock and clock.real_time and clock.sigma_ppm < CRYSTAL:
        fast, sigma = clock.fast_ppm, np.ceil(clock.sigma_ppm)
        parts.append(f"clock {fast:+.0f} ± {sigma:.0f} ppm")
    lost = health.missing or health.bad or health.restarts
    return Text("link: " + " · ".join(parts), style="yellow" if lost else "")
