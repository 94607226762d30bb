"""The running integral of a course, against polynomials and a sum by hand."""

from __future__ import annotations

import doctest

import numpy as np

from fieldcal.core import running_integral as module
from fieldcal.core.running_integral import running_integral


def test_a_line_is_integrated_exactly_at_uneven_times() -> None:
    t = np.array([1.0, 1.5, 4.0, 4.1])
    lines = np.stack([2 * t, 3 - t], axis=1)
    expected = np.stack([t**2 - 1, 3 * (t - 1) - (t**2 - 1) / 2], axis=1)
    np.testing.assert_allclose(running_integral(t, lines), expected, atol=1e-12)


def test_whole_numbers_are_integrated_as_others() -> None:
    found = running_integral(np.array([0.0, 1.0, 2.0]), np.array([1, 2, 2]))
    assert found.tolist() == [0.0, 1.5, 3.5]


def test_the_example_in_the_text() -> None:
    failed, tried = doctest.testmod(module, extraglobs={"np": np})
    assert not failed and tried
