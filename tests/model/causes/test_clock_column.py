"""What an error of the times makes of a turn, and of rests: drawn rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from small_sessions import G, dictionary, ladder, nominal

from fieldcal.core.samples import Array
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.site_groups import clock_group
from fieldcal.physics.experience import Experience

SIGMA = 0.013
SCALE = np.array([1.0, 1.0, 1.0, 1.1, 0.9, 1.2])


def column_in(x: Experience) -> Array:
    table = dictionary(replace(ladder(), clock_sigma=SIGMA))
    (group,) = clock_group(table)
    np.testing.assert_allclose(group.own_sigma(), [SIGMA])
    start, basis = table.bases[-1]
    assert isinstance(basis, General) and list(group.columns) == [start]
    state = replace(nominal(), scale=SCALE)
    return basis.evaluate(RowView.of(x, np.zeros((1, len(x))), state))[:, :, 0]


def test_a_turn_is_as_much_slower_about_every_axis() -> None:
    n, unknown = 5, np.full(5, np.nan)
    w = np.random.default_rng(2).normal(size=(n, 3))
    x = Experience.at_rest(unknown, unknown, G, position=np.full(n, -1), f=0 * w)
    x = replace(x, w=w)
    step = 1e-3
    # by a clock that counts 1 / (1 + step) s a second, all angles are passed sooner
    outputs = [SCALE[3:] * w * rate for rate in (1.0, 1.0 + step)]
    found = column_in(x)
    np.testing.assert_allclose(found[:, 3:], (outputs[1] - outputs[0]) / step)
    assert not found[:, :3].any()


def test_rates_at_rest_do_not_depend_on_a_clock() -> None:
    x = ladder(rows=2)
    assert not column_in(replace(x, w=np.ones((len(x), 3)))).any()


def test_times_that_were_measured_have_no_such_column() -> None:
    assert not [*clock_group(dictionary(ladder()))]
