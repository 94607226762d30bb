"""A device in a hand, whose force wanders by an angle that is known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_sessions import LADDER, SD, ladder, rows_of

from fieldcal.core.samples import Array, Block
from fieldcal.model.rows.hand_tremor import rows_of as rows_in_a_hand
from fieldcal.model.rows.hand_tremor import wander
from fieldcal.model.rows.reduce import Rows, RowSource
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.session.description import parse

EVERY = tuple(range(len(LADDER)))
G = 9.81


def held(angle: float, free: tuple[int, ...] = EVERY, rows: int = 12) -> Rows:
    """Rows whose force is turned by so many rad about either axis across it."""
    x, rng = ladder(rows, free), np.random.default_rng(2)
    off = angle * np.cross(x.f, rng.standard_normal((len(x), 3)))
    y = np.hstack([x.f + off, x.w]) + SD * rng.standard_normal((len(x), 6))
    return rows_of(x, y)


@pytest.mark.parametrize("angle", [2e-3, 1e-2])
def test_the_angle_is_measured(angle: float) -> None:
    assert wander(held(angle)) == pytest.approx(angle, rel=0.1)


def test_on_a_table_there_is_none() -> None:
    assert wander(held(0.0)) == 0.0
    assert wander(held(5e-6)) == 0.0, "within the noise"


def test_it_is_sought_where_orientations_are_not_known() -> None:
    assert wander(held(1e-2, ())) == 0.0
    assert wander(held(1e-2, (0, 1, 2))) == 0.0, "of so few nobody can tell"
    assert wander(held(1e-2, (0, 1, 2, 3))) > 8e-3
    assert wander(held(1e-2, rows=1)) == 0.0


def test_what_scatters_along_the_force_as_well_is_no_hand() -> None:
    one = held(0.0)
    rng = np.random.default_rng(3)
    y = one.y.copy()
    y[:, :3] += 1e-2 * rng.standard_normal((len(y), 3))
    assert wander(replace(one, y=y)) == 0.0


def test_a_course_that_windows_share_is_none_of_a_hand() -> None:
    one = held(0.0)
    y = one.y.copy()
    y[:, :3] += 0.1 * np.exp(-one.x.since_turn / 5.0)[:, None] * [1.0, -2.0, 0.5]
    assert wander(replace(one, y=y)) == 0.0
    cut = one.x.position != 4
    cut |= one.x.since_turn < 20.0  # windows may be of different lengths
    sd = np.where(cut[:, None], one.sd, np.nan)
    assert wander(replace(one, y=y, sd=sd)) == 0.0


RATE, SECONDS = 50.0, 10.0


def recording(angle: float) -> RowSource:
    """Five windows, the force turning within each by `angle` rad, rms."""
    rng, t = np.random.default_rng(4), np.arange(0.0, 75.0, 1 / RATE)
    places: list[dict[str, Any]] = [
        {"start_s": 15.0 * i + 2.0, "end_s": 15.0 * i + 2.0 + SECONDS} for i in range(5)
    ]
    up = np.eye(3)[np.minimum(t // 15, 4).astype(int) % 3]
    slow = np.repeat(rng.standard_normal((75, 3)), int(RATE), axis=0)
    acc: Array = 2.0 * G * (up + angle * np.cross(up, slow))
    acc += 1e-3 * rng.standard_normal(acc.shape)
    block = Block.of(t, acc, 1e-4 * rng.standard_normal(acc.shape))
    about = parse({
        "format": 1, "position": places, "site": {"gravity": G},
        "nominal": {"acc_scale": [2.0] * 3},
    })  # fmt: skip
    usable = np.ones((len(t), 6), dtype=bool)
    return RowSource(block, about, usable, np.zeros(5), Thermometer.of(block))


def test_in_a_hand_each_window_is_one_row_and_the_mean_rate_unsteady() -> None:
    angle = 5e-3
    source = recording(angle)
    found = rows_in_a_hand(source)
    assert found.x.position.tolist() == [0, 1, 2, 3, 4]
    for i in range(5):
        some = source.block.between(15.0 * i + 2.0, 15.0 * i + 2.0 + SECONDS)
        np.testing.assert_allclose(found.y[i], some.six.mean(axis=0), atol=1e-12)
        np.testing.assert_allclose(found.x.variance[i], some.acc.var(axis=0))
    np.testing.assert_allclose(found.sd[:, :3], np.tile(found.noise[:3], (5, 1))
                               / 500**0.5, rtol=1e-9)  # fmt: skip
    unsteady = np.hypot(2**0.5 * angle / SECONDS, 1e-4 / 500**0.5)
    np.testing.assert_allclose(found.sd[:, 3:], unsteady, rtol=0.25)
    assert found.wander == pytest.approx(2.0 * G * angle, rel=0.25)
    assert found.common.shape == (5, 6) and (found.common[:, 3:] > 4e-5).all()


def test_on_a_table_rows_are_as_ever() -> None:
    found = rows_in_a_hand(recording(0.0))
    assert len(found.x) == 50 and found.wander == 0.0
