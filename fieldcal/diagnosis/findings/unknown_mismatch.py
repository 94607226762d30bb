"""Mismatches that no effect of the catalogue makes, for the words about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.found_effects import estimates
from fieldcal.diagnosis.result import Mismatch, Quantity
from fieldcal.model import thresholds
from fieldcal.model.posterior.probabilities import Standing

JOINTS = ("α", "β")


@dataclass(frozen=True, slots=True)
class Unknown:
    """A mismatch without an effect.

    Attributes
    ----------
    cause : of the model: "time", "alpha", "window", "misset" ...
    mismatch : where it is
    turned : joints and angles that would explain it, had the positions been set so

    """

    cause: str
    mismatch: Mismatch
    turned: tuple[tuple[str, Quantity], ...] = ()


def unknown(
    explanation: Explanation, standing: Standing, found: Sequence[Mismatch]
) -> list[Unknown]:
    """What is said of one cause that is no effect."""
    turned = misset(explanation, standing)
    return [Unknown(standing.name, m, turned) for m in found]


def misset(
    explanation: Explanation, standing: Standing
) -> tuple[tuple[str, Quantity], ...]:
    """Angles by which positions were set otherwise, as far as they stand out."""
    (_, group), *_ = standing.members
    if standing.kind != "position":
        return ()
    values, sigmas, _ = estimates(explanation.best.set, group.columns)
    pairs = zip(group.params, np.rad2deg(values), np.rad2deg(sigmas), strict=True)
    return tuple(
        (JOINTS[joint], Quantity(float(v), float(s), "deg"))
        for joint, v, s in pairs
        if abs(v) > thresholds.STANDS_OUT * s
    )


def listed(positions: Sequence[int], most: int | None = None) -> str:
    """Name positions by their numbers, which begin at 1, up to so many.

    >>> listed([3]), listed([0, 1, 2], most=2)
    ('position 4', 'positions 1, 2…')
    """
    word = "position" if len(positions) == 1 else "positions"
    some = ", ".join(str(index + 1) for index in positions[:most])
    return f"{word} {some}" + "…" * (most is not None and len(positions) > most)
