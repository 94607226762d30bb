"""What the last turn leaves: columns by hand, in windows and in a position to come."""

from __future__ import annotations

import numpy as np
import pytest
from small_sessions import LADDER, G, dictionary, ladder, nominal

from fieldcal.core.samples import Array
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.factory_groups import hysteresis
from fieldcal.physics.experience import Experience


def of_ladder() -> Array:
    """Forces of the ladder by its angles, (9, 3) m/s^2."""
    a, b = np.deg2rad(LADDER).T
    rest = -np.cos(a)
    return G * np.column_stack([-np.sin(a), rest * np.cos(b), -rest * np.sin(b)])


def columns_in(table: ColumnTable, rows: Experience) -> Array:
    """Columns of what a turn leaves, (n, 6, 3)."""
    group = hysteresis(table, 5e-4)
    np.testing.assert_allclose(group.typical, 5e-4)
    start, basis = table.bases[-1]
    assert isinstance(basis, General) and list(group.columns) == [
        start + i for i in (0, 1, 2)
    ]
    return basis.evaluate(RowView.of(rows, np.zeros((1, len(rows))), nominal()))


def test_each_axis_keeps_the_side_that_its_force_came_from() -> None:
    """A change of less than g leaves its part; home was reached from nowhere."""
    x = ladder(rows=2)
    expected = np.zeros((9, 3))
    expected[1:] = np.clip(np.diff(of_ladder(), axis=0) / 9.80665, -1.0, 1.0)
    found = columns_in(dictionary(x), x)
    for c in range(3):
        np.testing.assert_allclose(found[::2, c, c], expected[:, c], atol=1e-9)
        found[:, c, c] = 0.0
    assert not found.any()


@pytest.mark.parametrize(
    ("alpha", "side"), [(-45.0, 0.0), (-90.0, 0.29298), (0.0, -0.70735), (45.0, -1.0)]
)
def test_a_position_to_come_is_reached_from_the_last(alpha: float, side: float) -> None:
    """The ladder ends at -45 deg, where f_x is g / sqrt(2)."""
    table = dictionary(ladder())
    next_one = Experience.at_rest(
        np.deg2rad([alpha]), np.zeros(1), G, position=np.array([-1])
    )
    found = columns_in(table, next_one)[0]
    assert found[0, 0] == pytest.approx(side, abs=1e-4)
    assert not found[3:].any()


def test_on_the_way_nothing_is_left_yet() -> None:
    table = dictionary(ladder())
    unknown = np.full(2, np.nan)
    way = Experience.at_rest(
        unknown, unknown, G, f=np.full((2, 3), G), position=np.full(2, -1)
    )
    assert not columns_in(table, way).any()
