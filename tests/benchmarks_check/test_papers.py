"""What the figures of the 2023 paper say, checked where they do not speak themselves.

Numbers without another source are those of a symbolic and numerical check of the
papers against their own rotation matrices.
"""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from benchmarks.papers import (
    DIGIT,
    TABLES,
    apart,
    left,
    printed_sigma,
    tilted,
    warming,
)

UNTIL = np.array([15.0, 30.0, 60.0, 120.0])


def test_one_degree_of_the_joints_makes_what_table_2_shows() -> None:
    expected = [-0.171, -0.443, -0.171, -0.0074, 0.0449, -0.105]
    np.testing.assert_allclose(tilted(), expected, atol=6e-4)


def test_the_printed_solution_finds_an_angle_from_z_ten_times_worse() -> None:
    found = list(printed_sigma().values())
    np.testing.assert_allclose(found, [0.066, 0.039, 0.59, 0.40, 0.115], rtol=0.05)


def test_means_from_the_start_are_parted_into_those_between() -> None:
    """Of a bias that is 1, 3, -2 and 5 in the four stretches."""
    each, lasts = np.array([1.0, 3.0, -2.0, 5.0]), np.array([15.0, 15.0, 30.0, 60.0])
    middle, mean, sigma = apart(UNTIL, np.cumsum(each * lasts) / UNTIL)
    np.testing.assert_allclose(mean, each)
    np.testing.assert_allclose(middle, [7.5, 22.5, 45.0, 90.0])
    np.testing.assert_allclose(sigma, DIGIT * np.sqrt([1.0, 5.0, 5.0, 5.0]))


def test_an_exponential_is_told_from_a_ramp_by_what_it_leaves() -> None:
    middle = np.array([7.5, 22.5, 45.0, 90.0])
    sigma = np.full(4, 5e-5)
    mean = -0.05 + 2e-3 * np.exp(-middle / 30)
    fades, tau = warming(middle, mean, sigma)
    assert fades < 0.1
    assert tau == pytest.approx(30, rel=0.1)
    ramp = np.column_stack([middle**0, middle])
    assert left(ramp, mean, sigma) > 20
    assert left(ramp, 2.0 - 0.1 * middle, sigma) == pytest.approx(0, abs=1e-6)


def test_a_gyroscope_warmed_up_in_table_5_and_nobody_said_so() -> None:
    if not TABLES.is_file():
        pytest.skip(f"the paper's tables are not here: {TABLES}")
    tables = tomllib.loads(TABLES.read_text(encoding="utf-8"))
    middle, mean, sigma = apart(UNTIL, np.array(tables["table5"]["By"]))
    assert left(middle[:, None] ** 0, mean, sigma) > 500
    assert left(np.column_stack([middle**0, middle]), mean, sigma) > 30
    fades, tau = warming(middle, mean, sigma)
    assert fades < 10
    assert 20 < tau < 120
    assert mean[-1] - mean[0] == pytest.approx(2e-3, abs=2e-4)
