"""Procedures: plans for an operator or a script, one in each file, found by name.

To add one, write procedures/<name>.py with ``POSITIONS``, the default positions, and
``plan``, a generator of steps (`fieldcal.planning.steps`) that returns a `Calibration`.
A plan uses no device, no clock and no screen. If it chooses positions during the run
(`Add`), ``MOST`` is their largest number. If its method wants a certain number of
positions, ``COUNT`` is that number.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Protocol, cast

from fieldcal.calibration import Calibration
from fieldcal.core import plugins
from fieldcal.core.positions import Position
from fieldcal.planning.steps import Plan
from fieldcal.session.description import Description


class Procedure(Protocol):
    """Members of a procedure's module."""

    POSITIONS: tuple[Position, ...]
    plan: Callable[..., Plan[Calibration]]


@cache
def procedure_names() -> tuple[str, ...]:
    """Names of all procedures, in alphabetical order."""
    return plugins.module_names(__path__)


def max_positions(about: Description, name: str) -> int | None:
    """Largest number of positions; None for a procedure with fixed positions."""
    if name not in procedure_names() or not hasattr(load_procedure(name), "MOST"):
        return None
    said = about.raw.get("run", {}).get("most")
    return int(said or vars(load_procedure(name))["MOST"])


def position_count(name: str) -> int | None:
    """Number of positions that a procedure is for; None if it takes any number."""
    count: int | None = vars(load_procedure(name)).get("COUNT")
    return count


def load_procedure(name: str) -> Procedure:
    """Module of a procedure; `name` must be one of `procedure_names`."""
    return cast(Procedure, import_module(f"{__name__}.{name}"))
