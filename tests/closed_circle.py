"""Which effects of the catalogue go round the closed circle in every run.

Round the circle an effect is put into the virtual device, and named from the recording.
That takes seconds each, so every run takes one in three, the same ones each time: a
test that turns red has been turned red by the change, and not by the day it is run on.
They are the last of each three in the order of their kinds: each kind is among them.
`--all` takes the whole catalogue. What only a reference shows that follows the motion
goes round a circle of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from fieldcal.effects import catalogue
from fieldcal.physics.effect import Chain, Effect, Line, Motion, Scatter
from fieldcal.sim_device.effects import kind

KINDS: tuple[type[Effect], ...] = (Chain, Line, Motion, Scatter, Effect)
"""The last is what all are, and here those that are none of the others."""

ONE_IN = 3


def _kind(effect: Effect) -> int:
    return next(i for i, kind in enumerate(KINDS) if isinstance(effect, kind))


def ordered() -> list[str]:
    """Ids that positions show, by kind, then by what they are seen in."""
    of = catalogue()
    some = [id_ for id_ in of if not kind(id_).EXAMPLE.in_motion]
    return sorted(some, key=lambda id_: (_kind(of[id_]), of[id_].seen_in, id_))


def one_in(number: int, cases: Sequence[tuple[Any, ...]], first: int = 0) -> list[Any]:
    """Parameters of a test: all cases, of which some are for `--all` alone."""
    return [
        pytest.param(
            *case, marks=[pytest.mark.thorough] if (i - first) % number else []
        )
        for i, case in enumerate(cases)
    ]


def every_effect() -> list[Any]:
    """All ids, of which some are for `--all` alone."""
    return one_in(ONE_IN, [(id_,) for id_ in ordered()], first=ONE_IN - 1)
