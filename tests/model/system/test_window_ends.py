"""What the windows say at the ends of turns, against means written out."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_sessions import SD, dictionary, ladder, nominal, rows_of

from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.state import Term
from fieldcal.model.system.window_ends import WindowEnds, output_slopes
from fieldcal.model.system.window_rows import WindowSystem

EFFECTS = catalogue()
X = ladder()
RNG = np.random.default_rng(8)


@pytest.fixture(scope="module")
def read() -> tuple[Dictionary, Array, list[Any], WindowEnds]:
    """Dictionary, standard deviations, linearised rows and what is read from them."""
    d = dictionary(X)
    d.window_error = RNG.uniform(1e-3, 3e-3, (9, 6))
    rows = rows_of(X, RNG.normal(size=(len(X), 6)))
    rows.sd[:] = SD * RNG.uniform(0.5, 2.0, (len(X), 6))
    linear = WindowSystem(rows, d).linearised(nominal())
    return d, rows.sd, linear, WindowEnds.of(linear, d)


Read = tuple[Dictionary, Array, list[Any], WindowEnds]


def test_columns_residuals_and_variances_of_the_means_of_windows(read: Read) -> None:
    d, sd, linear, found = read
    for p in range(9):
        at = X.position == p
        for c in range(3):
            weight = 1 / sd[at, c] ** 2
            expected = np.zeros(d.width)
            table = linear[c].design[at] / linear[c].weight[at, None]
            expected[linear[c].columns] = weight @ table / weight.sum()
            np.testing.assert_allclose(found.means[p, c], expected, atol=1e-12)
            white = linear[c].white[at] / linear[c].weight[at]
            assert found.residuals[p, c] == pytest.approx(weight @ white / weight.sum())
            assert found.variances[p, c] == pytest.approx(
                d.window_error[p, c] ** 2 + 1 / weight.sum()
            )


def test_a_base_that_is_knocked_goes_with_the_turn_from_the_row_at_its_end(
    read: Read,
) -> None:
    """Only what turns the device does; a bias that jumps is taken off with its mean."""
    d, _, linear, found = read
    knocked = [c for c in d.causes if c.name == "base_step"]
    columns = np.unique(
        np.concatenate([g.columns for c in knocked for g in c.variants])
    )
    assert len(columns) and np.array_equal(found.turning, columns)
    values = RNG.normal(size=d.width)
    amid = 0
    for p in range(9):
        rows = np.flatnonzero(X.position == p)
        for last, row in ((False, rows[0]), (True, rows[-1])):
            for c in range(3):
                there = np.zeros(d.width)
                table = linear[c].design[row] / linear[c].weight[row]
                there[linear[c].columns] = table
                there[np.setdiff1d(np.arange(d.width), columns)] = 0.0
                taken = found.columns_at(p, last)[c]
                expected = found.means[p, c] - there
                np.testing.assert_allclose(taken, expected, atol=1e-12)
                amid += bool(np.abs(taken[columns]).max() > 1e-3)
                off = found.residual_at(p, last, values)[c]
                expected_off = found.residuals[p, c] + there @ values
                assert off == pytest.approx(expected_off)
    assert amid, "some instant lies within a window"


def test_outputs_change_with_the_force_by_all_that_reads_it() -> None:
    """By scale factors, what is coupled from other axes, and curvature."""
    k2, coupling = np.array([2e-3, -3e-3, 1e-3]), np.linspace(-0.02, 0.03, 6)
    terms = Term(EFFECTS["quadratic"], k2), Term(EFFECTS["cross_coupling"], coupling)
    scale = np.linspace(0.9, 1.2, 6)
    state = replace(nominal(), bias=np.full(6, 0.5), scale=scale, terms=terms)
    k12, k13, k21, k23, k31, k32 = coupling
    whole = np.array([[0.9, k12, k13], [k21, 0.96, k23], [k31, k32, 1.02]])
    found = output_slopes(state, X, X.since_turn[None])
    for slope, f in zip(found, X.f, strict=True):
        expected = whole + 2 * np.diag(k2 * f)
        np.testing.assert_allclose(slope, expected, atol=1e-8)
