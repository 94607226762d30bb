"""Plan files: positions, averaging, device and mover of a run.

A plan is a session.toml with positions and a table ``[run]``; ``plan.schema.json`` says
what may stand there, and the description of each key there is the remedy that an error
names. The session that a run records keeps the table, so that it can be gone on with.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any

from fieldcal import procedures
from fieldcal.acceptance.verification import planned_verification
from fieldcal.core.documents import load_toml
from fieldcal.core.errors import InputError, PlanError
from fieldcal.core.positions import Position, specific_forces
from fieldcal.session import description_file
from fieldcal.session.description import Description
from fieldcal.session.position_tables import position_table
from fieldcal.session.schemas import (
    load_schema,
    make_validator,
    misspelt_keys,
    schema_faults,
    told_together,
    validator,
)

SECONDS, WARM_UP, TURN = 30.0, 300.0, 120.0
"""Averaging time, longest wait for a device that warms up, longest turn, s."""

MIN_ANGLE_RAD = math.radians(0.5)
"""Least angle between the positions of a plan."""


@dataclass(frozen=True, slots=True)
class PlanTask:
    """Content of a plan.

    Attributes
    ----------
    tables : of session.toml, with ``[run]``
    about : the same, parsed
    run : the table ``[run]``
    verification : position to hold that is not fitted, if any

    """

    tables: Mapping[str, Any]
    about: Description
    run: Mapping[str, Any]
    verification: Position | None

    @property
    def procedure(self) -> str:
        """Name of the procedure."""
        return str(self.run.get("procedure", "positions"))

    @property
    def seconds(self) -> float:
        """Averaging time, s."""
        return float(self.run.get("seconds", SECONDS))

    @property
    def sigma(self) -> float | None:
        """Standard error at which averaging may stop, m/s^2."""
        return self.run.get("sigma")

    @property
    def mover(self) -> Mapping[str, Any]:
        """The table ``[run.mover]``."""
        mover: Mapping[str, Any] = self.run.get("mover", {"kind": "nothing"})
        return mover

    @property
    def further(self) -> Mapping[str, str]:
        """Serial number of each further device, by its address; empty if not given."""
        urls, serials = self.run.get("further", ()), self.run.get("further_serial", ())
        return dict(zip_longest(urls, serials, fillvalue=""))

    @property
    def positions(self) -> tuple[Position, ...]:
        """All positions to be held, the verification last."""
        last = () if self.verification is None else (self.verification,)
        return (*self.about.positions, *last)


@cache
def plan_schema() -> dict[str, Any]:
    """Return the JSON Schema of a plan, with the procedures that there are."""
    found = load_schema("plan")
    procedure = found["properties"]["run"]["properties"]["procedure"]
    procedure["enum"] = list(procedures.procedure_names())
    procedure["description"] = f"write one of {', '.join(procedures.procedure_names())}"
    return found


def default_positions(procedure: str) -> list[dict[str, Any]]:
    """Default tables ``[[position]]`` of a procedure."""
    taken = procedures.load_procedure(procedure).POSITIONS
    return [position_table(p) for p in taken]


def read_plan(path: Path) -> dict[str, Any]:
    """Tables of a plan file.

    Raises
    ------
    InputError
        If it cannot be read, or is no TOML file.

    """
    try:
        return load_toml(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        known = ", ".join(procedures.procedure_names())
        raise InputError(
            f"{path}: is neither a procedure ({known}) nor a plan file"
        ) from error
    except IsADirectoryError as error:
        raise InputError(
            f"{path}: is a folder, no plan file; an interrupted run goes on with"
            f" fieldcal run --resume {shlex.quote(str(path))}"
        ) from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InputError(f"{path}: is no plan file: {error}") from error


def task_from_tables(tables: Mapping[str, Any], name: str) -> PlanTask:
    """Check a plan before anything moves.

    Parameters
    ----------
    tables : of the plan; a plan without positions takes those of its procedure
    name : what errors call it: its file

    Raises
    ------
    PlanError
        Naming file, key and remedy.

    """
    _check_schema(tables, name)
    run = tables.get("run", {})
    if "position" not in tables and "procedure" in run:
        tables = {**tables, "position": default_positions(run["procedure"])}
    try:
        about = description_file.parse_description(tables)
    except InputError as error:
        raise PlanError(f"{name}: {error}") from error
    _check_positions(about, name)
    _check_count(about, run, name)
    _check_further(about, run, name)
    made = PlanTask(tables, about, run, planned_verification(about))
    _check_mover(made, name)
    return made


def _check_schema(tables: Mapping[str, Any], name: str) -> None:
    """Refuse what the schemas of a plan and of a session do not allow, all at once."""
    whole, plan, session = {"run": {}, **tables}, plan_schema(), load_schema("session")
    faults = schema_faults(whole, make_validator(plan))
    faults += schema_faults(whole, validator("session"))
    faults += misspelt_keys(whole, plan, session)
    if wrong := told_together(list(dict.fromkeys(faults))):
        raise PlanError(f"{name}: {wrong}")


def _check_positions(about: Description, name: str) -> None:
    """Refuse positions that cannot give a calibration."""
    import numpy as np

    positions = about.positions
    turning = [i for i, p in enumerate(positions, 1) if p.rate and any(p.rate)]
    if turning:
        raise PlanError(
            f"{name}: [[position]] number {turning[0]} has rate_deg_s, and a run holds"
            " the device at rest: record the rate table by itself, and solve it with"
            " its windows in session.toml"
        )
    if len(positions) < 2 or not all(p.oriented for p in positions):
        raise PlanError(
            f"{name}: {len(positions)} positions with known angles are not enough: a"
            " plan needs two or more, each with alpha_deg and beta_deg"
        )
    f = specific_forces(positions, 1.0)
    if np.linalg.norm(f - f[0], axis=1).max() < MIN_ANGLE_RAD:
        raise PlanError(
            f"{name}: all {len(positions)} positions are the same"
            f" ({positions[0].name}): no scale factor can be determined; turn the"
            " device between them"
        )


def _check_count(about: Description, run: Mapping[str, Any], name: str) -> None:
    """Refuse positions that are too many for the method of the procedure."""
    procedure, given = str(run.get("procedure", "positions")), len(about.positions)
    count = procedures.position_count(procedure)
    if count is not None and given != count:
        raise PlanError(
            f'{name}: [run] procedure = "{procedure}" is for {count} positions, not'
            f' {given}: write procedure = "positions"'
        )


def _check_further(about: Description, run: Mapping[str, Any], name: str) -> None:
    """Refuse further devices and serial numbers that are invalid or named twice."""
    urls, serials = run.get("further", ()), run.get("further_serial", ())
    if len(serials) > len(urls):
        raise PlanError(
            f"{name}: {serials[len(urls)]!r} is the serial number of no device: give"
            " --serial no more often than --device"
        )
    for what, first, more in (
        ("device", run.get("device"), urls),
        ("serial number", about.device.get("serial"), serials),
    ):
        named = [n for n in (first, *more) if n]
        if twice := [n for i, n in enumerate(named) if n in named[:i]]:
            raise PlanError(f"{name}: {what} {twice[0]!r} is named twice: name it once")


def _check_command(made: PlanTask) -> None:
    """Refuse a command that cannot be called, or that lacks a third angle."""
    from fieldcal.run.command_mover import CommandMover

    third = [p for p in made.positions if p.gamma]
    with CommandMover(made.mover["command"], 1.0) as mover:
        if third and not mover.names("gamma"):
            raise PlanError(
                f"{third[0].name} has a third angle, which [run.mover] command does not"
                " name: write {gamma} where the turntable wants it"
            )


def _check_mover(made: PlanTask, name: str) -> None:
    mover = made.mover
    try:
        if mover["kind"] == "command":
            _check_command(made)
        elif mover["kind"] == "virtual":
            shlex.split(mover.get("options", ""))
    except PlanError as error:
        raise PlanError(f"{name}: {error}") from error
    except ValueError as error:
        raise PlanError(f"{name}: [run.mover] options: {error}; mend it") from error
    if mover["kind"] == "virtual" and "control" in mover and "device" not in made.run:
        raise PlanError(
            f"{name}: [run] device is missing: a virtual device that runs already is"
            ' read where it said, as in "serial:/dev/pts/3?format=witmotion"'
        )
