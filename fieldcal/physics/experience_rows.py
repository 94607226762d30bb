"""Rows of what a device experiences: some of them, and those of several parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fieldcal.core.samples import Index
from fieldcal.physics.experience import Experience

PER_ROW = (
    "alpha", "beta", "gamma", "f", "w", "w_dot", "slope", "bend", "missed", "f_dot",
    "f_bend", "w_bend", "passed", "t", "lasts", "since_start", "since_turn", "warming",
    "heating", "variance", "position", "rate", "speed", "speed_sigma", "attitude_sigma",
    "alpha_axis",
)  # fmt: skip
"""Fields of `Experience` that have one value per row."""


def select_rows(x: Experience, rows: Sequence[int] | Index) -> Experience:
    """The rows of these indices."""
    selected: dict[str, Any] = {
        n: getattr(x, n)[np.asarray(rows, dtype=np.intp)] for n in PER_ROW
    }
    return replace(x, **selected)


def concatenate_rows(parts: Sequence[Experience]) -> Experience:
    """Concatenate rows of one session."""
    joined: dict[str, Any] = {
        n: np.concatenate([getattr(x, n) for x in parts]) for n in PER_ROW
    }
    return replace(parts[0], **joined)
