"""What the way says of some columns, against all rows laid together."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.known_rows import KnownRows
from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior.turn_force_information import turn_force_information
from fieldcal.model.system.turn_rows import TurnRows

COLUMNS = np.array([3, 5, 8, 9])
WANTED = np.array([5, 9])
SIZES = np.array([0.5, 2.0, 1.0, 3.0])


def turn(way: Array, design: Array, columns: Index) -> TurnRows:
    nothing = np.zeros((0, len(columns)))
    return TurnRows(
        (0, 1), np.zeros(0), columns, nothing, np.zeros(0), nothing, way, design
    )


def two_turns(noise: float, seed: int = 1) -> list[TurnRows]:
    """Of which the second meets a column less, and one that no set has."""
    rng = np.random.default_rng(seed)
    out = []
    for columns in (COLUMNS, np.array([3, 5, 9, 12])):
        design = rng.normal(size=(40, 4))
        way = design @ np.where(columns == 12, 0.0, columns / 4) + noise * rng.normal(
            size=40
        )
        out.append(turn(way, design, columns))
    return out


def found() -> Set:
    state = SimpleNamespace(columns=COLUMNS, prior_sigma=SIZES)
    return cast(Set, SimpleNamespace(state=state))


def stacked(turns: list[TurnRows]) -> tuple[Array, Array]:
    """All rows by the columns of the set, written out."""
    design = []
    for one in turns:
        part = np.zeros((len(one.way), len(COLUMNS)))
        for i, column in enumerate(COLUMNS):
            for j in np.flatnonzero(one.columns == column):
                part[:, i] = one.way_design[:, j]
        design.append(part)
    return np.vstack(design), np.concatenate([one.way for one in turns])


def test_rows_that_remain_lead_to_the_same_as_all_of_them() -> None:
    """Laid together with rows of another system, which has but the columns wanted."""
    turns = two_turns(0.9)
    design, off = turn_force_information(found(), turns, WANTED)
    assert design.shape == (2, 2)
    rng = np.random.default_rng(2)
    other, seen = rng.normal(size=(5, 2)), rng.normal(size=5)
    info = design.T @ design + other.T @ other
    estimate = np.linalg.solve(info, design.T @ off + other.T @ seen)
    rows, white = stacked(turns)
    prior = np.diag([1 / 0.5**2, 0.0, 1.0, 0.0])
    every = np.zeros((5, 4))
    every[:, [1, 3]] = other
    whole = np.linalg.inv(rows.T @ rows + prior + every.T @ every)
    both = whole @ (rows.T @ white + every.T @ seen)
    np.testing.assert_allclose(estimate, both[[1, 3]], rtol=1e-9)
    np.testing.assert_allclose(np.linalg.inv(info), whole[np.ix_([1, 3], [1, 3])])


def test_rows_that_scatter_say_as_much_less() -> None:
    quiet, loud = (
        turn_force_information(found(), two_turns(n), WANTED) for n in (0.9, 9.0)
    )
    ratio = np.linalg.svd(quiet[0])[1] / np.linalg.svd(loud[0])[1]
    np.testing.assert_allclose(ratio, 9.0, rtol=0.15)
    for design, off in (quiet, loud):
        estimate = np.linalg.solve(design, off)
        sigma = np.sqrt(np.diag(np.linalg.inv(design.T @ design)))
        assert np.all(np.abs(estimate - WANTED / 4) < 3 * sigma)


def test_a_column_that_no_turn_meets_has_no_row() -> None:
    some = turn(np.ones(6), np.ones((6, 1)), np.array([5]))
    design, off = turn_force_information(found(), [some], WANTED)
    assert design.shape == (1, 2) and design[0, 1] == pytest.approx(0.0)
    assert abs(off[0] / design[0, 0]) == pytest.approx(1.0)


def test_without_a_way_nothing_remains() -> None:
    design, off = turn_force_information(found(), [], WANTED)
    assert design.shape == (0, 2) and off.shape == (0,)


def test_known_rows_are_joined_column_by_column() -> None:
    one = KnownRows(np.array([2, 7]), np.array([[1.0, 2.0]]), np.array([3.0]))
    other = KnownRows(np.array([1, 7]), np.array([[4.0, 5.0]]), np.array([6.0]))
    both = KnownRows.concatenated([one, other])
    assert both.columns.tolist() == [1, 2, 7]
    assert both.design.tolist() == [[0.0, 1.0, 2.0], [4.0, 0.0, 5.0]]
    assert both.residual.tolist() == [3.0, 6.0]
