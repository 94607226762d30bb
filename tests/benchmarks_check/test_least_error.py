"""The least error that positions leave, against many devices that are drawn."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from benchmarks.adaptive import least_error
from benchmarks.adaptive.led import APART

CORNERS = [(0.0, 0.0), (45.0, 5.0), (-45.0, -5.0), (-45.0, 5.0), (45.0, -5.0)]
ANGLES = 0.01


def test_the_error_is_that_of_devices_that_are_drawn_and_fitted() -> None:
    rng = np.random.default_rng(4)
    sigma = np.repeat([0.3, 1e-2, 5e-2, 5e-4], [3, 3, 2, 6])
    rows = np.concatenate([least_error._derivatives(p) for p in CORNERS])
    apart = np.concatenate([least_error._derivatives(p) for p in APART])[:, :6]
    turned = np.zeros((15, 10))
    for i, (alpha, beta) in enumerate(CORNERS):
        a, b = np.deg2rad([alpha, beta])
        at = slice(3 * i, 3 * i + 3)
        # by hand: f = g (-sin a, -cos a cos b, cos a sin b), and its derivatives
        turned[at, 2 * i] = [-np.cos(a), np.sin(a) * np.cos(b), -np.sin(a) * np.sin(b)]
        turned[at, 2 * i + 1] = [0.0, np.cos(a) * np.sin(b), np.cos(a) * np.cos(b)]
    turned *= 9.81 * np.deg2rad(ANGLES)
    blocks = 1e-6 * np.eye(15) + turned @ turned.T
    gain = np.linalg.solve(
        rows.T @ np.linalg.solve(blocks, rows) + np.diag(sigma**-2.0),
        np.linalg.solve(blocks, rows).T,
    )
    off = []
    for _ in range(4000):
        truth = sigma * rng.standard_normal(14)
        seen = rows @ truth + 1e-3 * rng.standard_normal(15)
        seen += turned @ rng.standard_normal(10)
        off.append(apart @ (gain @ seen - truth)[:6])
    drawn = float(np.sqrt(np.mean(np.square(off))))
    assert least_error.error(CORNERS, APART, ANGLES) == pytest.approx(drawn, rel=0.03)


def test_no_set_leaves_less_than_the_best_and_more_positions_leave_less() -> None:
    ladder = list(product((0.0, -22.5, 22.5, -45.0, 45.0), (0.0, -2.5, 2.5, -5.0, 5.0)))
    best = [least_error.least(n, CORNERS[:2], ladder, APART, ANGLES) for n in (3, 4, 5)]
    assert best == sorted(best, reverse=True)
    assert best[2] <= least_error.error(CORNERS, APART, ANGLES) * (1 + 1e-9)
    assert best[2] > least_error.error(ladder, APART, ANGLES)
