"""Reads and writes the positions of `fieldcal plan`."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.core.errors import InputError, PlanError

if TYPE_CHECKING:
    from fieldcal.core.positions import Position
    from fieldcal.planning.planner import Ladder

DEFAULT_COUNT = 5
"""Number of positions unless another is given."""


def select_positions(
    args: argparse.Namespace, ladder: Ladder, gravity: float
) -> tuple[Position, ...]:
    """Positions to evaluate: of a file, of a known set, or the best of the ladder.

    Raises
    ------
    PlanError
        If no best positions exist, or a file has positions without angles.

    """
    from fieldcal.core.positions import POSITION_SETS
    from fieldcal.planning.planner import best_positions
    from fieldcal.session import description
    from fieldcal.session.folder import DESCRIPTION

    if args.of is None:
        many = DEFAULT_COUNT if args.positions is None else args.positions
        return (
            POSITION_SETS[args.set]
            if args.set
            else best_positions(many, ladder, gravity)
        )
    if args.set:
        raise PlanError("--of and --set both name positions: leave one of them out")
    path = args.of / DESCRIPTION if args.of.is_dir() else args.of
    found = description.read_description(path).positions
    if not found or not all(p.oriented and not p.on_turning_table for p in found):
        raise PlanError(
            f"{path}: give each [[position]] alpha_deg and beta_deg,"
            " rotation_vector_deg or quaternion, and no rate: --speed plans a table"
        )
    return found


def write_plan(
    path: Path, tables: Mapping[str, Any], positions: Sequence[Position], seconds: float
) -> None:
    """Write a plan for `fieldcal run`.

    Raises
    ------
    InputError
        If the file is there already.

    """
    import tomlkit

    from fieldcal.session.folder import write_atomically

    if path.exists():
        raise InputError(f"{path}: is there already; name another file")
    run_table = {"procedure": "positions", "seconds": seconds}
    whole = {
        **tables,
        "run": run_table,
        "position": [position_table(p) for p in positions],
    }
    write_atomically(path, tomlkit.dumps(whole))


def position_table(position: Position) -> dict[str, Any]:
    """Table of a position in a plan file."""
    alpha, beta, gamma = position.all_degrees or (0.0, 0.0, 0.0)
    third = {"gamma_deg": gamma} if gamma else {}
    return {"name": position.name, "alpha_deg": alpha, "beta_deg": beta, **third}
