"""Reads and writes the positions of `fieldcal plan`."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.site import merge_tables, site_tables, tables_of_options
from fieldcal.core.errors import InputError, PlanError

if TYPE_CHECKING:
    from fieldcal.core.positions import Position
    from fieldcal.planning.planner import Ladder
    from fieldcal.session.description import Description

DEFAULT_COUNT = 5
"""Number of positions unless another is given."""


def select_positions(
    args: argparse.Namespace, ladder: Ladder, gravity: float
) -> tuple[Position, ...]:
    """Positions to evaluate: of a file, of a known set, or the best of the ladder.

    Raises
    ------
    PlanError
        If no best positions exist, a file has positions without angles, or an option
        would be ignored.

    """
    from fieldcal.core.positions import POSITION_SETS
    from fieldcal.planning.planner import best_positions

    if args.positions is not None and (args.set or args.of):
        named = "--set" if args.set else "--of"
        raise PlanError(
            f"--positions is how many are chosen, and {named} names them: leave one of"
            " the two out"
        )
    if args.of is None:
        many = DEFAULT_COUNT if args.positions is None else args.positions
        return (
            POSITION_SETS[args.set]
            if args.set
            else best_positions(many, ladder, gravity)
        )
    if args.set:
        raise PlanError("--of and --set both name positions: leave one of them out")
    found = _described(args.of).positions
    if not found or not all(p.oriented and not p.on_turning_table for p in found):
        raise PlanError(
            f"{args.of}: give each [[position]] alpha_deg and beta_deg,"
            " rotation_vector_deg or quaternion, and no rate: --speed plans a table"
        )
    return found


def plan_tables(args: argparse.Namespace) -> dict[str, Any]:
    """Tables of device, site and frame: of the file with positions, and of options."""
    from fieldcal.session.description_file import FORMAT_VERSION

    tables = site_tables(args, "device")
    if args.of is not None:
        raw = _described(args.of).raw
        given = {name: raw[name] for name in tables if name in raw}
        tables = merge_tables(merge_tables(tables, given), tables_of_options(args))
    if args.sways is not None:
        tables = merge_tables(tables, {"site": {"sways": True}})
    return {"format": FORMAT_VERSION, **tables}


def _described(path: Path) -> Description:
    """What a session, or a file, says of device, site and positions.

    Raises
    ------
    InputError
        If it is not there, or cannot be used.

    """
    from fieldcal.session.description_file import read_description
    from fieldcal.session.folder import DESCRIPTION

    if not path.exists():
        raise InputError(
            f"{path}: is not there; name a session's folder or a plan file"
        )
    return read_description(path / DESCRIPTION if path.is_dir() else path)


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

    from fieldcal.session.file_writing import write_atomically
    from fieldcal.session.position_tables import position_table

    if path.exists():
        raise InputError(f"{path}: is there already; name another file")
    run_table = {"procedure": "positions", "seconds": seconds}
    whole = {
        **tables,
        "run": run_table,
        "position": [position_table(p) for p in positions],
    }
    write_atomically(path, tomlkit.dumps(whole))
