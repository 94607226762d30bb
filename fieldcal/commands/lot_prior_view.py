"""Terminal view of the contribution of the lot to a result."""

from __future__ import annotations

from fieldcal.calibration import Calibration
from fieldcal.calibration.wording import format_unit, format_with_sigma, parameter_title


def show_lot_prior(found: Calibration) -> None:
    """Print each parameter alone, by the lot and by both; nothing without a lot."""
    from rich.table import Table

    from fieldcal.commands.console import EscapingConsole

    told = found.info.get("borrowed")
    if not told:
        return
    odd = f"odd with P = {told['odd_probability']:.2g}"
    heading = f"Beside {told['lot']}: {odd}"
    table = Table(title=heading, title_justify="left")
    for column in ("parameter", "the lot", "± alone", "± both", "unit"):
        left = column in ("parameter", "unit")
        table.add_column(column, justify="left" if left else "right", no_wrap=True)
    units = dict(zip(found.names, found.units, strict=True))
    for name, one in told["parameters"].items():
        alone = "none" if one["own_sigma"] is None else f"{one['own_sigma']:.2g}"
        lot = " ± ".join(format_with_sigma(one["lot_value"], one["lot_sigma"]))
        both = f"{one['sigma']:.2g}"
        table.add_row(
            parameter_title(name), lot, alone, both, format_unit(units.get(name, ""))
        )
    EscapingConsole().print(table)
