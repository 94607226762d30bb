"""What cross-coupling that is left out does, against equations solved again with it."""

import re

import numpy as np
import pytest
from observed import BIAS, SCALE, G, observe
from scipy.optimize import least_squares

from fieldcal.core.positions import SIX_FACES, Position
from fieldcal.core.positions import specific_forces as held
from fieldcal.core.samples import Array
from fieldcal.solve import solve

NAMES = [f"acc_{g}.{x}" for g in ("bias", "scale") for x in "xyz"]
SIZES = np.array([G, G, G, 1.0, 1.0, 1.0])
TILTED = [(1, 0.1, 0.2), (-1, 0.3, -0.1), (0.2, 1, 0.3), (0.5, -1, 0.4),
          (0.3, 0.4, 1), (0.9, 0.1, 0.4)]  # fmt: skip
"""Six orientations of which none has z up or down."""


def forces(directions: Array) -> Array:
    return np.asarray(G * directions / np.linalg.norm(directions, axis=1)[:, None])


def moved_by(f: Array, entry: tuple[int, int]) -> Array:
    """Bias and scale factor that norms give, less the true ones, for one of 1e-3."""
    mixing = np.diag(SCALE)
    mixing[entry] = 1e-3
    u = BIAS + f @ mixing.T

    def off(p: Array) -> Array:
        return np.asarray(np.linalg.norm((u - p[:3]) / p[3:], axis=1) - G)

    found = least_squares(off, [*BIAS, *SCALE], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return np.asarray(found.x - [*BIAS, *SCALE])


def said(f: Array, cross: bool = False) -> list[tuple[str, str, str]]:
    seen = observe((Position("by hand"),) * len(f), BIAS + f * SCALE, sigma=1e-4)
    text = " ".join(solve(seen, cross=cross).warnings)
    return re.findall(r"(\S+) times: each 0.1 % moves (\S+) by ([-\d.e]+)", text)


def test_the_parameter_that_moves_most_and_by_how_much() -> None:
    f = forces(np.array(TILTED, float))
    each = np.array([moved_by(f, entry) for entry in ((0, 1), (0, 2), (1, 2))])
    moved = np.linalg.norm(each, axis=0)
    worst = int(np.argmax(moved / SIZES))
    [(times, name, by)] = said(f)
    assert name == NAMES[worst]
    assert float(by) == pytest.approx(moved[worst], rel=0.05)
    assert float(times) == pytest.approx(1e3 * moved[worst] / SIZES[worst], rel=0.05)


def test_axes_up_and_down_magnify_nothing() -> None:
    assert said(held(SIX_FACES, G)) == []


def test_what_rows_show_of_it_is_not_left_open() -> None:
    """The same orientations, and more of them, in which k would be seen."""
    f = forces(np.vstack([TILTED, -np.array(TILTED), np.eye(3), -np.eye(3)]))
    assert said(f) == []


def test_nothing_is_left_out_where_it_is_estimated() -> None:
    more = np.random.default_rng(4).normal(size=(12, 3))
    assert said(forces(np.vstack([TILTED, more])), cross=True) == []
