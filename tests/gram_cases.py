"""Random rows of windows and turns: their Gram matrix, and the same written out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from dense_model import Dense, shared
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors
from fieldcal.model.causes.cause import CLOSURE
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.known_rows import KnownRows
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.linear_system import gram
from fieldcal.model.system.turn_rows import TurnRows

WINDOWS, ROWS, WIDTH, SMALL_ROTATION = 4, 3, 9, 9
"""Columns that a set may have; those of the positions' turns come after them."""

TAU = np.array([0.3, 0.0, 0.8, 0.1, 0.5, 1.2, 0.4])


@dataclass
class Columns:
    """What of a dictionary a Gram matrix asks for."""

    width: int
    window_positions: Index
    window_error: Array
    unoriented: NDArray[np.bool_]
    small_rotation: int
    known: KnownRows | None = None

    def rotations_of(self, position: int) -> Index:
        """Columns of the small rotations of a position."""
        return self.small_rotation + 2 * position + np.arange(2)


@dataclass
class Case:
    """A Gram matrix, and the same rows written out."""

    gram: Gram
    dense: Dense


def case(
    seed: int,
    free: tuple[int, ...] = (),
    tau: Array = TAU,
    turns: bool = True,
    known: KnownRows | None = None,
) -> Case:
    """Random rows of windows and turns; a window lacks a channel, another one a row."""
    rng = np.random.default_rng(seed)
    width = WIDTH + 2 * WINDOWS
    held = np.arange(WINDOWS)
    common = rng.uniform(0.0, 0.5, (WINDOWS, 6))
    columns = Columns(width, held, common, np.isin(held, free), SMALL_ROTATION,
                      known)  # fmt: skip
    values = np.where(rng.random(width) < 0.3, rng.standard_normal(width), 0.0)
    linear, parts = [], []
    for c in range(6):
        window = np.repeat(held, ROWS)
        kept = ~((window == 2) & (c == 4)) & (np.arange(len(window)) != 5 + (c == 0))
        window = window[kept]
        touching = np.sort(rng.permutation(WIDTH)[:7])
        design = rng.standard_normal((len(window), 7))
        turned = rng.standard_normal((WINDOWS, 2))  # at rest the same in every row
        small_rotation = np.zeros((len(window), 2 * WINDOWS))
        for p in held:
            small_rotation[window == p, 2 * p : 2 * p + 2] = turned[p]
        at = np.concatenate([touching, WIDTH + np.arange(2 * WINDOWS)])
        design = np.hstack([design, small_rotation])
        sd = rng.uniform(0.5, 2.0, len(window))
        off = rng.standard_normal(len(window)) * 2
        linear.append(
            LinearRows(
                c, np.flatnonzero(kept), window, 1 / sd, at,
                design / sd[:, None], off / sd,
            )
        )  # fmt: skip
        whole = np.zeros((len(window), width))
        whole[:, at] = design
        size = np.hypot(common[window, c], tau[c])
        loose = [
            priors.SMALL_ROTATION * whole[:, SMALL_ROTATION + 2 * p :][:, :2]
            for p in free
        ]
        parts.append((off + whole @ values, whole, sd, window, c, size, loose))
    made = [turn(rng, width) for _ in range(2)] if turns else []
    rows = gram(linear, cast(Dictionary, columns), values, made)
    y = np.concatenate([p[0] for p in parts])
    design = np.vstack([p[1] for p in parts])
    white = np.concatenate([p[2] for p in parts])
    window = np.concatenate([p[3] for p in parts])
    channel = np.concatenate([np.full(len(p[0]), p[4]) for p in parts])
    cov = np.diag(white**2)
    cov += shared(window, channel, np.concatenate([p[5] for p in parts]))
    for i in range(len(free)):
        small_rotation = np.vstack([p[6][i] for p in parts])
        cov += small_rotation @ small_rotation.T
    return Case(rows, beside(Dense(y, design, cov, white), made, tau))


def turn(rng: np.random.Generator, width: int) -> TurnRows:
    """A closure of which two parts are known, and three rows on the way."""
    at = np.sort(rng.permutation(width)[:6])
    draw = rng.standard_normal
    return TurnRows(
        (0, 1), draw(2), at, draw((2, 6)), rng.uniform(1, 4, 2),
        rng.uniform(0, 1, (2, 6)), draw(3), draw((3, 6)),
    )  # fmt: skip


def beside(windows: Dense, turns: list[TurnRows], tau: Array) -> Dense:
    """Rows of windows and of turns, which share nothing."""
    y, design, white = [windows.y], [windows.design], [windows.white]
    spread = []
    for one in turns:
        whole = np.zeros((len(one.closure) + len(one.way), windows.design.shape[1]))
        whole[:, one.columns] = np.vstack([one.design, one.way_design])
        y += [one.closure, one.way]
        design.append(whole)
        white += [1 / np.sqrt(one.info), np.ones(len(one.way))]
        ends = np.sqrt(tau[CLOSURE] ** 2 + one.closure_errors**2 @ tau[:6] ** 2)
        spread += [ends, np.zeros(len(one.way))]
    n, sd = len(windows.y), np.concatenate(white)
    cov = np.diag(sd**2)
    cov[:n, :n] = windows.cov
    if spread:
        cov[n:, n:] += np.diag(np.concatenate(spread) ** 2)
    return Dense(np.concatenate(y), np.vstack(design), cov, sd)
