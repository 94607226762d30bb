"""What `fieldcal temperature` shows of a model over temperature."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from fieldcal.core.escaping import escape_line

if TYPE_CHECKING:
    from fieldcal.thermal import ThermalModel, ThermalPoint


def show_model(found: ThermalModel, at: float | None, last: ThermalPoint) -> None:
    """Print a model at some temperatures.

    Parameters
    ----------
    found : the model
    at : another temperature to show it at, deg C
    last : session whose calibration is compared with the model there

    """
    from fieldcal.calibration.wording import (
        format_unit,
        format_with_sigma,
        parameter_title,
    )
    from fieldcal.commands.text_columns import text_columns
    from fieldcal.thermal.wording import REPORTED_SIGMAS, change_sentences

    say = sys.stdout.write
    say(
        f"{len(found.sessions)} sessions at {found.low:.1f} to {found.high:.1f} °C;"
        " between them, ± 1σ:\n"
    )
    shown = [found.low, found.reference, found.high]
    if at is not None:
        shown = sorted({*shown, at})
    heads = [f"{t:.1f} °C" for t in shown]
    rows = [["parameter", *heads, "from run to run", "order"]]
    values = {t: found.at(t) for t in shown}
    for name, curve in found.curves.items():
        cells = [" ± ".join(format_with_sigma(*values[t][name])) for t in shown]
        order = f"{curve.order} (P = {curve.orders[curve.order]:.2f})"
        unit = format_unit(curve.unit)
        spread = f"± {curve.spread:.2g} {unit}".rstrip()
        rows.append([parameter_title(name), *cells, spread, order])
    for line in text_columns(rows):
        say(line + "\n")
    if at is not None:
        told, rest = change_sentences(found.change(at, last.temperature))
        say(
            f"\nat {at:.1f} °C with the calibration of {escape_line(last.name)}"
            f" ({last.temperature:.1f} °C), off by:\n"
        )
        say("".join(f"  {line}\n" for line in told))
        if rest:
            say(
                f"  less than {REPORTED_SIGMAS:.0f} of its ±:"
                f" {', '.join(map(parameter_title, rest))}\n"
            )
