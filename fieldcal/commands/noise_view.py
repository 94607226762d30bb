"""Terminal view of the noise of a device."""

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
PAPER_WINDOWS_S = (30.0, 60.0)
"""Lengths of the windows in the papers, s."""


def show_noise(
    found: NoiseResult, out: IO[str] | None = None, width: int | None = None
) -> None:
    """Print processes, averaging times and consequences."""
    from fieldcal.commands.console import EscapingConsole

    console = EscapingConsole(file=out, width=width)
    model = found.model
    many = "one stretch" if model.stretches == 1 else f"{model.stretches} stretches"
    _print_sentence(
        console,
        f"at rest {_format_duration(model.seconds)} in {many}, {model.rate_hz:.4g} Hz,"
        f" {100 * model.bridged:.2g} % disturbed and bridged",
    )
    for triad, what in TRIADS:
        some = [c for n, c in model.channels.items() if n[0] == triad]
        if some:
            scale, prefix = _unit_prefix(some)
            _print_sizes(console, what, some, scale, prefix + format_unit(some[0].unit))
            _print_averaging(console, some, scale, prefix + format_unit(some[0].unit))
    _print_consequences(console, found)


def _unit_prefix(channels: list[ChannelEstimate]) -> tuple[float, str]:
    """Factor and prefix of the unit in which the largest white noise is 1 or more."""
    largest = max(c.processes["N"].value for c in channels)
    return next((p for p in PREFIXES if largest >= p[0]), PREFIXES[-1])


def _size_cell(
    size: ProcessSize | None, below: ProcessSize | None, scale: float
) -> str:
    if size is not None:
        return " ± ".join(format_with_sigma(size.value / scale, size.sigma / scale))
    return "–" if below is None else f"< {below.value / scale:.2g}"


def _print_sizes(
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
            _size_cell(channel.processes.get(p), channel.limits.get(p), scale)
            for p, _ in COLUMNS
        ]
        table.add_row(channel.name, *cells)
    console.print(table)
    for channel in some:
        for text in _other_processes(channel, scale, unit):
            _print_sentence(console, f"  {channel.name}: {text}")


def _other_processes(channel: ChannelEstimate, scale: float, unit: str) -> list[str]:
    """Sentences about a channel's noise beside white noise, flicker and walk."""
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
        out.append(
            f"above {channel.filtered_hz:.2g} Hz parts are left out: it is filtered"
            " there, or hums"
        )
    if channel.dispersion > 1:
        out.append(
            f"scatters {channel.dispersion**0.5:.2f} times as much as its processes"
            " say: every ± here has it"
        )
    return out


def _print_averaging(
    console: Console, some: list[ChannelEstimate], scale: float, unit: str
) -> None:
    """Print the error of a mean against its length."""
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
            for seconds in PAPER_WINDOWS_S
            for v, s in [found.at(seconds)]
        ]
        least = float(found.sigma.min()) / scale
        table.add_row(
            channel.name,
            *cells,
            f"{least:.2g}",
            _time_with_range(found.best, float(found.seconds[-1])),
            _time_with_range(found.white_until, float(found.seconds[-1])),
        )
    console.print(table)


def _time_with_range(times: tuple[float, float, float], last: float) -> str:
    """A time with its 68 % interval, or a lower bound if it is longer than `last`."""
    middle, low, high = times
    if not math.isfinite(middle):
        return f"> {last:.0f} s" if not math.isfinite(low) else f"> {low:.0f} s"
    end = f"{high:.0f}" if math.isfinite(high) else "…"
    return f"{middle:.0f} s ({low:.0f}–{end})"


def _print_consequences(console: Console, found: NoiseResult) -> None:
    for program in ("kalibr", "ardupilot", "px4"):
        console.print(f"{program}:", style="bold")
        for name, (value, sigma, unit) in found.programs[program].items():
            text = f"{value_or_bound(value, sigma)} {format_unit(unit)}"
            console.print(f"  {name:30} {text}")
    for text in consequences(found):
        _print_sentence(console, f"  {text}")


def _print_sentence(console: Console, text: str) -> None:
    """Print a sentence, wrapped between words on a terminal, else on one line."""
    console.print(text, soft_wrap=not console.is_terminal)


def _format_duration(seconds: float) -> str:
    if seconds < 600:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
