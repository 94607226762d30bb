"""What a design determines, and what is proposed where it does not."""

from collections.abc import Sequence

import numpy as np
import pytest
from observed import BIAS, SCALE, G, observe, outputs

from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS, Position
from fieldcal.core.samples import Array
from fieldcal.model import thresholds
from fieldcal.model.causes.planned import design_matrix, parameters
from fieldcal.solve import solve
from fieldcal.solve.rank import (
    PROPOSED_POSITIONS,
    determined_parameters,
    ladder_remedy,
    positions_to_add,
)

TILTED = parameters("angle_offset")


def test_a_parameter_with_a_part_in_a_hidden_direction_is_not_determined() -> None:
    rows = np.array([[1.0, 1, 0], [2, 2, 0], [0, 0, 1]])
    known, rank = determined_parameters(rows)
    assert known.tolist() == [False, False, True] and rank == 2


def test_units_do_not_matter() -> None:
    rng = np.random.default_rng(1)
    rows = rng.standard_normal((6, 4)) * [1e-4, 1.0, 1e4, 1.0]
    known, rank = determined_parameters(rows)
    assert known.all() and rank == 4
    rows[:, 3] = rows[:, 0] / 1e-4 + rows[:, 2] / 1e4
    known, rank = determined_parameters(rows)
    assert known.tolist() == [False, True, False, False] and rank == 3


def test_fewer_rows_than_parameters_leave_all_that_share_them_open() -> None:
    known, rank = determined_parameters(np.array([[1.0, 0, 0], [0, 1, 1]]))
    assert known.tolist() == [True, False, False] and rank == 2


def test_what_is_left_of_a_sine_by_rounding_is_nothing() -> None:
    rows = np.column_stack([[1.0, 1, 1], np.sin(np.pi * np.arange(3)), [1.0, 2, 4]])
    known, rank = determined_parameters(rows)
    assert known.tolist() == [True, False, True] and rank == 2


@pytest.mark.parametrize(
    "taken", [TWO_POSITIONS, TWO_POSITIONS[:1], (*TWO_POSITIONS, TWO_POSITIONS[1])]
)
def test_what_is_proposed_is_enough_and_none_of_it_is_too_much(
    taken: tuple[Position, ...],
) -> None:
    def rows(places: tuple[Position, ...]) -> Array:
        return design_matrix(TILTED, places, G)

    extra = positions_to_add(lambda p: rows(tuple(p)), taken, PROPOSED_POSITIONS)
    assert 0 < len(extra) <= thresholds.MAX_PROPOSED_POSITIONS
    for left in [None, *extra]:
        kept = [p for p in extra if p is not left]
        table = rows((*taken, *kept)).reshape(-1, len(TILTED))
        assert determined_parameters(table)[0].all() == (left is None)


def test_nothing_is_proposed_where_nothing_is_missing_or_nothing_helps() -> None:
    def rows(places: Sequence[Position]) -> Array:
        return np.ones((len(places), 1, 2))

    assert (
        positions_to_add(
            lambda p: design_matrix(TILTED, p, G), FIVE_POSITIONS, PROPOSED_POSITIONS
        )
        == []
    )
    assert positions_to_add(rows, TWO_POSITIONS, PROPOSED_POSITIONS) == []


@pytest.mark.parametrize(
    "missing",
    [thresholds.MAX_PROPOSED_POSITIONS, thresholds.MAX_PROPOSED_POSITIONS + 1],
)
def test_no_more_than_four_positions_are_proposed(missing: int) -> None:
    """Each position determines one parameter, that of its own number."""
    numbered = [Position(str(n)) for n in range(8)]

    def rows(places: Sequence[Position]) -> Array:
        table = np.zeros((len(places), 1, missing))
        for i, place in enumerate(places):
            table[i, 0, int(place.name)] = 1.0
        return table

    found = positions_to_add(rows, (), numbered[:missing])
    assert [p.name for p in found] == (["0", "1", "2", "3"] if missing == 4 else [])


def test_the_proposed_positions_mend_what_solve_leaves_open() -> None:
    places = (Position.deg(0, 0), Position.deg(45, 0), Position.deg(20, 0))
    seen = observe(places, outputs(places))
    assert "acc_scale.z" not in solve(seen, tilt="none").names
    extra = ladder_remedy(seen, parameters())
    more = (*places, *(p for p in PROPOSED_POSITIONS if p.name in extra))
    assert len(more) == len(places) + len(extra)
    found = solve(observe(more, outputs(more)), tilt="none")
    np.testing.assert_allclose(found.values, [*BIAS, *SCALE], atol=1e-5)


def test_positions_without_angles_are_no_part_of_what_a_ladder_determines() -> None:
    names = parameters("angle_offset")
    mean = np.tile([0.1, -9.8, 0.2], (5, 1))
    mixed = observe([*FIVE_POSITIONS[:2], Position("face")], mean[:3])
    alone = observe(FIVE_POSITIONS[:2], mean[:2])
    assert ladder_remedy(mixed, names) == ladder_remedy(alone, names)
