"""How long a run waits for a lost device and for a position."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fieldcal.run.plan_file import PlanTask

GIVE_UP, GIVE_UP_UNTURNED = 90.0, 600.0
"""Device time after which a position is given up, s: with and without a mover."""

OPERATOR_PATIENCE_S, HEADLESS_PATIENCE_S = 120.0, 20.0
"""How long to wait for a device whose connection was lost, s."""


def reconnect_seconds(args: argparse.Namespace) -> float:
    """How long to wait for a device whose connection was lost, s."""
    if args.patience is not None:
        return float(args.patience)
    return HEADLESS_PATIENCE_S if args.headless else OPERATOR_PATIENCE_S


def give_up_seconds(args: argparse.Namespace, task: PlanTask) -> float | None:
    """How long to wait for a position, s; None, for a person, without limit."""
    given = task.run.get("give_up_s")
    unturned = task.mover["kind"] == "nothing"
    if given is not None:
        return float(given)
    if unturned:
        return GIVE_UP_UNTURNED if args.headless else None
    return GIVE_UP


def can_ask_operator(args: argparse.Namespace) -> bool:
    """Whether an operator at a keyboard can be asked for further positions."""
    from fieldcal.run.operator.keyboard import Keyboard

    return not args.headless and Keyboard().has_keys
