"""What a run waits for, and for how long: devices, positions, somebody at the keys."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fieldcal.run.plan_file import PlanTask

GIVE_UP, GIVE_UP_UNTURNED = 90.0, 600.0
"""Device time after which a script gives a position up, s: with and without a mover."""

PATIENCE, PATIENCE_HEADLESS = 120.0, 20.0
"""How long a device that is gone is waited for, s."""


def patience(args: argparse.Namespace) -> float:
    """How long a device that is gone is waited for, s."""
    if args.patience is not None:
        return float(args.patience)
    return PATIENCE_HEADLESS if args.headless else PATIENCE


def give_up(args: argparse.Namespace, task: PlanTask) -> float | None:
    """How long a position is waited for; for a person, for ever."""
    given = task.run.get("give_up_s")
    unturned = task.mover["kind"] == "nothing"
    if given is not None:
        return float(given)
    if unturned:
        return GIVE_UP_UNTURNED if args.headless else None
    return GIVE_UP


def asks(args: argparse.Namespace) -> bool:
    """Whether somebody is there who can be asked for more, and can leave it out."""
    from fieldcal.run.operator.keyboard import Keyboard

    return not args.headless and Keyboard().has_keys
