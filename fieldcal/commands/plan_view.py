"""What a plan is expected to determine, and how it is shown."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from fieldcal.core.positions import Position
    from fieldcal.planning.aliasing import Aliases
    from fieldcal.planning.planner import GradeNoise

PAPER_COLUMN = "the paper's five"


class PlanPrediction(NamedTuple):
    """What positions are expected to determine.

    Attributes
    ----------
    positions : that the plan has
    seconds : averaging time in each
    sigma : standard uncertainty of each parameter by full name, SI, tilts in deg
    paper_sigma : the same of the five positions of the paper
    aliases : effects that the positions cannot tell apart
    further : position that would be worth most besides; None if there is none
    further_sigma : standard uncertainties with that one; None without one

    """

    positions: Sequence[Position]
    seconds: float
    sigma: Mapping[str, float]
    paper_sigma: Mapping[str, float]
    aliases: Aliases
    further: Position | None
    further_sigma: Mapping[str, float] | None

    def to_json(self) -> dict[str, Any]:
        """Return the prediction as a JSON object."""
        from fieldcal.session.position_tables import position_table

        sigma = dict(self.further_sigma or {})
        further = self.further and {**position_table(self.further), "sigma": sigma}
        return {
            "positions": [position_table(p) for p in self.positions],
            "seconds": self.seconds,
            "sigma": dict(self.sigma),
            "hidden": list(self.aliases.hidden),
            "aliases": {name: list(others) for name, others in self.aliases.pairs},
            "extra_position": further,
        }


def averaging_sentence(grade: GradeNoise) -> str:
    """Sentence about the averaging time from which longer windows gain little."""
    return (
        f"flicker wins over white noise from {grade.acc_seconds:.0f} s"
        f" (accelerometers) and {grade.gyr_seconds:.0f} s (gyroscopes): longer windows"
        " gain little"
    )


def show_prediction(found: PlanPrediction, noise: str, grade: GradeNoise) -> None:
    """Print the positions, the expected ±, and what they cannot tell apart.

    Parameters
    ----------
    found : the prediction
    noise : name of the noise that it is made with
    grade : that noise

    """
    from rich.table import Table

    from fieldcal.commands.console import EscapingConsole

    console = EscapingConsole()
    console.print(f"{len(found.positions)} positions, {found.seconds:g} s each:")
    for i, position in enumerate(found.positions, start=1):
        console.print(f"  {i}  {position.name}")
    mean = f"{1e3 * grade.acc(found.seconds):.2f} mm/s² a mean"
    title = f"Expected ± 1σ by noise alone ({noise}: {mean})"
    table = Table(title=title, title_justify="left")
    plans = {"this plan": found.sigma, PAPER_COLUMN: found.paper_sigma}
    if found.further_sigma is not None:
        plans["one more"] = found.further_sigma
    for column in ("parameter", *plans, "unit"):
        table.add_column(column, justify="right" if column in plans else "left")
    for name in dict.fromkeys([*found.sigma, *found.paper_sigma]):
        cells = [_sigma_cell(sigmas.get(name)) for sigmas in plans.values()]
        table.add_row(name, *cells, _unit_of_parameter(name))
    console.print(table)
    console.print(
        "how well angles are set and how square the axes are comes in addition"
    )
    _print_aliases(found.aliases, found.further)


def _sigma_cell(sigma: float | None) -> str:
    return "not determined" if sigma is None else f"{sigma:.2g}"


def _unit_of_parameter(name: str) -> str:
    from fieldcal.calibration.names import group_of

    units = {"acc_bias": "m/s²", "acc_scale": "1", "gyr_bias": "rad/s"}
    return units.get(group_of(name), "°")


def _print_aliases(confused: Aliases, further: Position | None) -> None:
    say = sys.stdout.write
    worth = further.name if further else "none within the limits"
    say(f"one more position worth most: {worth}\n")
    if confused.hidden:
        say(f"goes into the calibration unseen: {', '.join(confused.hidden)}\n")
    for name, others in confused.pairs:
        say(f"{name} cannot be told from {' or '.join(others)}\n")
