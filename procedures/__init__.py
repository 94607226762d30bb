"""Procedures: plans for an operator or a script, one a file, found by their names.

To add one, write procedures/<name>.py with ``POSITIONS``, the positions it takes unless
the session says others, and ``plan``, a generator of steps
(`fieldcal.planning.steps`) that returns a `Calibration`. A plan touches no device, no
clock and no screen. One that finds its positions on the way (`Add`) says in ``MOST``
how many there are at most.
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
    """What the module of a procedure has."""

    POSITIONS: tuple[Position, ...]
    plan: Callable[..., Plan[Calibration]]


@cache
def names() -> tuple[str, ...]:
    """Every procedure there is, in alphabetical order."""
    return plugins.module_names(__path__)


def most(about: Description, name: str) -> int | None:
    """Positions that it ends with at most; None where they are known beforehand."""
    if name not in names() or not hasattr(procedure(name), "MOST"):
        return None
    said = about.raw.get("run", {}).get("most")
    return int(said or vars(procedure(name))["MOST"])


def procedure(name: str) -> Procedure:
    """Procedure of that name, which is one of `names`."""
    return cast(Procedure, import_module(f"{__name__}.{name}"))
