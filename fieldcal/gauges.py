"""What the operator's screen is made of: inclinometer, meters, list, link.

All of it reads without colour, and fits into 76 columns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from fieldcal.positions import Position
from fieldcal.view import View

METER = 20
"""Width of the stillness meter, characters."""

BAR = 30
"""Width of the bar that fills while averaging, characters."""

SCALE = 31
"""Width of the inclinometer, characters; odd, as the middle is where it should be."""

SPANS = (2.0, 5.0, 10.0, 30.0, 90.0, 180.0)
"""What half the inclinometer spans, deg: the narrowest that shows where it is."""

NEAR = 1.0
"""Off by less than this, deg, an angle is not asked to be turned."""


def angles(view: View) -> list[tuple[str, float, float]]:
    """Name, angle seen and angle wanted of both joints, deg, where it can be told."""
    wanted = view.hold.position.degrees
    if view.arrival is None or wanted is None:
        return []
    seen = (view.arrival.alpha_deg, view.arrival.beta_deg)
    return list(zip("αβ", seen, wanted, strict=True))


def inclinometer(seen: float, wanted: float) -> Text:
    """Where it is (o), where it should be (the middle), and which way to turn."""
    off = wanted - seen
    span = next((s for s in SPANS if s >= abs(off)), SPANS[-1])
    middle = SCALE // 2
    place = int(np.clip(round(middle - off / span * middle), 0, SCALE - 1))
    cells = ["·"] * SCALE
    cells[middle], cells[place] = "|", "o"
    order = "close enough" if abs(off) < NEAR else f"turn {off:+.1f}°"
    return Text(f"[{''.join(cells)}] {seen:+6.1f}° to {wanted:+.1f}°  {order}")


def stillness(level: float) -> Text:
    """Motion as part of what is allowed."""
    if not np.isfinite(level):
        return Text("listening to the device's noise")
    filled = int(np.clip(round(level * METER / 2), 0, METER))
    word = "still" if level < 1 else "MOVING"
    style = "" if level < 1 else "yellow"
    return Text(f"[{'#' * filled:<{METER}}] {word}", style=style)


def sigma(view: View) -> str:
    """Standard errors reached; of each sensor the worst axis."""
    acc, gyr = view.sigma[:3], view.sigma[3:]
    parts = []
    if np.isfinite(acc).any():
        parts.append(f"{1e3 * np.nanmax(acc):.2f} mm/s²")
    if np.isfinite(gyr).any():
        parts.append(f"{1e3 * np.nanmax(gyr):.3f} mrad/s")
    return ", ".join(parts) or "not known yet"


def gauges(view: View, told: Sequence[str]) -> Table:
    """Everything that is measured now."""
    grid = Table.grid(padding=(0, 2))
    grid.add_column(width=9)
    grid.add_column()
    if view.phase == "turning":
        for name, seen, wanted in angles(view):
            grid.add_row(name, inclinometer(seen, wanted))
        problem = view.arrival.problem if view.arrival else ""
        below = bool(told and problem and view.reason.endswith(problem))
        grid.add_row("waits for", "the turn: see below" if below else view.reason)
    else:
        seconds = view.hold.seconds
        share = min(1.0, view.elapsed / seconds)
        bar = Text(f"[{'#' * round(share * BAR):·<{BAR}}] {share:4.0%}")
        left = max(0.0, seconds - view.elapsed)
        grid.add_row("averaging", bar)
        grid.add_row("time left", f"{left:.0f} s of {seconds:.0f} s")
        reached = f"± {sigma(view)}"
        if view.hold.sigma:
            reached += f", wanted ± {1e3 * view.hold.sigma:.2f} mm/s²"
        grid.add_row("reached", reached)
    grid.add_row("stillness", stillness(view.stillness))
    return grid


def listing(
    positions: Sequence[Position],
    taken: Mapping[int, float],
    now: int,
    rows: int,
    verification: int | None = None,
) -> RenderableType:
    """The positions around the present one, with what was reached in each.

    Parameters
    ----------
    positions : all of them
    taken : standard error of the accelerometers by number, m/s^2
    now : number of the present one
    rows : most that there is room for
    verification : number of the one that is not fitted

    """
    table = Table.grid(padding=(0, 2))
    first = int(np.clip(now - rows // 2, 0, max(0, len(positions) - rows)))
    for i in range(first, min(len(positions), first + rows)):
        if i in taken:
            state = f"taken   ± {1e3 * taken[i]:.2f} mm/s²"
        else:
            state = "now" if i == now else ""
        style = "bold" if i == now else "dim" if i not in taken else ""
        name = positions[i].name + (" (verification)" if i == verification else "")
        table.add_row(f"{i + 1}", name, state, style=style)
    return table


def link(view: View) -> Text:
    """How the link does."""
    health = view.health
    rate = f"{view.rate_hz:.0f} Hz" if np.isfinite(view.rate_hz) else "no rate yet"
    parts = [rate, f"{health.samples} samples"]
    parts.append(f"{health.gaps} gaps, {health.missing} missing, {health.bad} bad")
    if np.isfinite(view.temperature):
        parts.append(f"{view.temperature:.1f} °C")
    if health.restarts:
        parts.append(f"restarts: {health.restarts}")
    if health.clock and health.clock.real_time:
        clock = health.clock
        parts.append(f"clock {clock.fast_ppm:+.0f} ± {clock.sigma_ppm:.1g} ppm")
    return Text("link: " + " · ".join(parts), style="dim")
