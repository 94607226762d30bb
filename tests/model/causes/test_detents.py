"""Detents: an angle of the fixture that has the same error in several positions."""

from __future__ import annotations

import numpy as np
import pytest
from small_sessions import LADDER, G, dictionary, ladder, nominal

from fieldcal.core.samples import Array
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.detents import (
    Detent,
    detent_columns,
    detent_rotations,
    detents,
)

ROWS = 2
EVERY = range(len(LADDER))


def force(alpha: Array, beta: Array) -> Array:
    """Specific force at rest, written out, (n, 3)."""
    down = -np.cos(alpha)
    return G * np.stack(
        [-np.sin(alpha), down * np.cos(beta), -down * np.sin(beta)], axis=1
    )


def test_every_angle_of_a_joint_with_the_positions_that_have_it() -> None:
    found = list(detents(ladder(ROWS), EVERY))
    for joint in (0, 1):
        of_joint = [one for one in found if one.joint == joint]
        angles = [degrees[joint] for degrees in LADDER]
        assert [np.rad2deg(one.angle) for one in of_joint] == pytest.approx(
            sorted(set(angles))
        )
        for one in of_joint:
            off = np.abs(np.deg2rad(angles) - one.angle)
            assert list(one.positions) == np.flatnonzero(off < 1e-6).tolist()


def test_angles_a_little_apart_are_two_detents_and_rounded_ones_are_one() -> None:
    x = ladder(ROWS)
    x.alpha[x.position == 1] = x.alpha[x.position == 4] + 3e-10
    x.beta[x.position == 1] += 1e-5
    found = {(d.joint, d.positions) for d in detents(x, EVERY)}
    assert (0, (1, 4)) in found and (1, (1,)) in found
    assert (1, (0, 2, 8)) in found


def test_only_positions_whose_angles_are_stated_have_detents() -> None:
    found = list(detents(ladder(ROWS, free=(0, 2)), [p for p in EVERY if p % 2]))
    assert {p for one in found for p in one.positions} == {1, 3, 5, 7}


def test_rotations_of_the_positions_by_each_detent() -> None:
    table = detent_rotations([Detent(0, 0.1, (0, 2)), Detent(1, 0.1, (2,))], 4)
    expected = np.zeros((4, 2, 2))
    expected[[0, 2], 0, 0] = expected[2, 1, 1] = 1.0
    np.testing.assert_array_equal(table, expected.reshape(8, 2))


def test_a_column_is_the_change_of_the_force_with_the_angle_of_its_positions() -> None:
    x = ladder(ROWS)
    d = dictionary(x)
    before = d.width
    some = [one for one in detents(x, EVERY) if len(one.positions) > 1]
    at = detent_columns(d, some)
    assert at.tolist() == list(range(before, before + len(some))) and len(some) > 5
    assert d.width == before + len(some)
    first, end, basis = list(d.basis_ranges())[-1]
    assert (first, end) == (before, d.width) and isinstance(basis, General)
    state = nominal()
    view = RowView.of(x, np.array([x.since_turn]), state)
    found = basis.evaluate(view)
    assert basis.sides is not None
    for k, (up, down, step) in enumerate(basis.sides(view)):
        one, h = some[k], 1e-5
        turned = h * np.isin(x.position, one.positions)
        a, b = (turned, 0.0) if one.joint == 0 else (0.0, turned)
        ends = [force(x.alpha + s * a, x.beta + s * b) for s in (1, -1)]
        change = (ends[0] - ends[1]) / (2 * h)
        assert np.abs(change).max() > 0.1
        np.testing.assert_allclose(found[:, :3, k], change, atol=1e-4)
        np.testing.assert_allclose((up.f - down.f) / (2 * step), change, atol=1e-4)
        np.testing.assert_allclose(found[:, 3:, k], 0.0, atol=1e-12)
    assert k == len(some) - 1
