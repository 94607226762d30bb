"""Positions of `fieldcal plan`, from a file and into one."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.core.errors import InputError, PlanError

if TYPE_CHECKING:
    from fieldcal.core.positions import Position
    from fieldcal.planning.planner import Ladder

POSITIONS = 5
"""Positions unless another number is asked for."""


def chosen(
    args: argparse.Namespace, ladder: Ladder, gravity: float
) -> tuple[Position, ...]:
    """The positions that are to be evaluated, or the best ones of the ladder.

    Raises
    ------
    PlanError
        If none are best, or those of a file are not known.

    """
    from fieldcal.core.positions import POSITION_SETS
    from fieldcal.planning.planner import best_positions
    from fieldcal.session import description
    from fieldcal.session.folder import DESCRIPTION

    if args.of is None:
        many = POSITIONS if args.positions is None else args.positions
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


def write(
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
    whole = {**tables, "run": run_table, "position": [table(p) for p in positions]}
    write_atomically(path, tomlkit.dumps(whole))


def table(position: Position) -> dict[str, Any]:
    """A position as a plan has it."""
    alpha, beta, gamma = position.all_degrees or (0.0, 0.0, 0.0)
    third = {"gamma_deg": gamma} if gamma else {}
    return {"name": position.name, "alpha_deg": alpha, "beta_deg": beta, **third}
