"""The noise of a device as a person at a terminal reads it."""

from __future__ import annotations

import math
from typing import IO, TYPE_CHECKING

from fieldcal.calibration.wording import format_unit, format_with_sigma
from fieldcal.noise.document import NoiseResult
from fieldcal.noise.estimate import ChannelEstimate, ProcessSize
from fieldcal.noise.wording import PROCESSES, TRIADS, consequences, value_or_bound

if TYPE_CHECKING:
    from rich.console import Console

PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
COLUMNS = (
    ("N", "white N, {}/√Hz"),
    ("B", "instability B, {}"),
    ("K", "walk K, {}·√Hz"),
)
OTHERS = {name: PROCESSES[name] for name in "QRG"}
PAPERS = (30.0, 60.0)
"""Averaging times of the papers, s."""


def show(
    found: NoiseResult, out: IO[str] | None = None, width: int | None = None
) -> None:
    """Print processes, how long to average, and what follows."""
    from fieldcal.commands.console import ShownConsole

    console = ShownConsole(file=out, width=width)
    model = found.model
    many = "one stretch" if model.stretches == 1 else f"{model.stretches} stretches"
    _line(
        console,
        f"at rest {_span(model.seconds)} in {many}, {model.rate_hz:.4g} Hz,"
        f" {100 * model.bridged:.2g} % disturbed and bridged",
    )
    for triad, what in TRIADS:
        some = [c for n, c in model.channels.items() if n[0] == triad]
        if some:
            scale, prefix = _scale(some)
            _sizes(console, what, some, scale, prefix + format_unit(some[0].unit))
            _windows(console, some, scale, prefix + format_unit(some[0].unit))
    _follows(console, found)


def _scale(channels: list[ChannelEstimate]) -> tuple[float, str]:
    """A prefix in which white noise is more than one."""
    largest = max(c.processes["N"].value for c in channels)
    return next((p for p in PREFIXES if largest >= p[0]), PREFIXES[-1])


def _cell(size: ProcessSize | None, below: ProcessSize | None, scale: float) -> str:
    if size is not None:
        return " ± ".join(format_with_sigma(size.value / scale, size.sigma / scale))
    return "–" if below is None else f"< {below.value / scale:.2g}"


def _sizes(
    console: Console, what: str, some: list[ChannelEstimate], scale: float, unit: str
) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False)
    table.title_justify = "left"
    table.title = f"{what} (± 1σ; < 95 %)"
    table.add_column("")
    for _, title in COLUMNS:
        table.add_column(title.format(unit), justify="right")
    for channel in some:
        cells = [
            _cell(channel.processes.get(p), channel.limits.get(p), scale)
            for p, _ in COLUMNS
        ]
        table.add_row(channel.name, *cells)
    console.print(table)
    for channel in some:
        for text in _more(channel, scale, unit):
            _line(console, f"  {channel.name}: {text}")


def _more(channel: ChannelEstimate, scale: float, unit: str) -> list[str]:
    """What a channel has beside white noise, flicker and walk."""
    out = []
    for name, size in channel.processes.items():
        what = OTHERS.get(name[0])
        if what:
            ending = {"Q": "·s", "R": "/s"}.get(name[0], "")
            value, sigma = format_with_sigma(size.value / scale, size.sigma / scale)
            text = f"{what} {value} ± {sigma} {unit}{ending}"
            if name[0] == "G":
                time = " ± ".join(format_with_sigma(size.time, size.time_sigma))
                text += f", over {time} s"
            out.append(text)
        elif size.time_sigma < size.time < math.inf:
            time, sigma = format_with_sigma(size.time, size.time_sigma)
            out.append(f"flicker {name} up to {time} ± {sigma} s")
    if channel.temperature is not None:
        each = " ± ".join(format_with_sigma(*(v / scale for v in channel.temperature)))
        out.append(f"temperature {each} {unit}/K, taken out")
    if math.isfinite(channel.filtered_hz):
        out.append(f"above {channel.filtered_hz:.3g} Hz it is filtered, or hums")
    if channel.dispersion > 1:
        out.append(
            f"scatters {channel.dispersion**0.5:.2f} times as much as its processes"
            " say: every ± here has it"
        )
    return out


def _windows(
    console: Console, some: list[ChannelEstimate], scale: float, unit: str
) -> None:
    """How long to average."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False)
    table.title_justify = "left"
    table.title = f"error of a mean, {unit}"
    for name in ("", "over 30 s", "over 60 s", "least", "averaged", "white until"):
        table.add_column(name, justify="right" if name else "left")
    for channel in some:
        found = channel.averaging
        cells = [
            " ± ".join(format_with_sigma(v / scale, s / scale))
            if seconds <= found.seconds[-1]
            else "too short"
            for seconds in PAPERS
            for v, s in [found.at(seconds)]
        ]
        least = float(found.sigma.min()) / scale
        table.add_row(
            channel.name,
            *cells,
            f"{least:.2g}",
            _until(found.best, float(found.seconds[-1])),
            _until(found.white_until, float(found.seconds[-1])),
        )
    console.print(table)


def _until(times: tuple[float, float, float], last: float) -> str:
    """A time with what it may be, or that it is longer than can be told."""
    middle, low, high = times
    if not math.isfinite(middle):
        return f"> {last:.0f} s" if not math.isfinite(low) else f"> {low:.0f} s"
    end = f"{high:.0f}" if math.isfinite(high) else "…"
    return f"{middle:.0f} s ({low:.0f}–{end})"


def _follows(console: Console, found: NoiseResult) -> None:
    for program in ("kalibr", "ardupilot", "px4"):
        console.print(f"{program}:", style="bold")
        for name, (value, sigma, unit) in found.programs[program].items():
            text = f"{value_or_bound(value, sigma)} {format_unit(unit)}"
            console.print(f"  {name:30} {text}")
    for text in consequences(found):
        _line(console, f"  {text}")


def _line(console: Console, text: str) -> None:
    """Print a sentence: between words on a terminal, else as one line."""
    console.print(text, soft_wrap=not console.is_terminal)


def _span(seconds: float) -> str:
    if seconds < 600:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
