"""A resolution that changes amid a recording: other digits, or another range."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ladder import TACTICAL, record, ride, windows
from ladder_sessions import tables

from fieldcal.core.samples import Block
from fieldcal.diagnosis.signal.chain import check_chain
from fieldcal.physics.grid_stretches import grids_by_stretch, windows_on_one_grid
from fieldcal.physics.recording import Grids
from fieldcal.session.description_file import parse_description

FINE, COARSE = 6e-4, 0.036
"""Steps of a device in two ranges, m/s^2; its noise is 0.003."""

SOON, LATE = 0.2, 0.8
"""Parts of the fourth rest after which the range changes."""


def rounded(block: Block, at: float, coarse: float = COARSE) -> Block:
    """The forces in fine steps up to an instant, and in coarse ones from there on."""
    step = np.where(block.t < at, FINE, coarse)[:, None]
    return replace(block, acc=np.round(block.acc / step) * step)


def switched(part: float) -> tuple[Block, float]:
    """A ladder of nine positions, and the instant in its fourth rest."""
    start, end = windows()[3]
    at = start + part * (end - start)
    return rounded(record(TACTICAL, ride(TACTICAL, seed=2)), at), at


def test_each_stretch_has_the_step_that_it_was_rounded_to() -> None:
    block, at = switched(SOON)
    grids = grids_by_stretch(block)
    assert grids.changed.tolist() == [True] * 3 + [False] * 3
    for c in range(3):
        (_, _, fine), (first, last, coarse) = grids.stretches(c, len(block))
        assert fine == pytest.approx(FINE, rel=1e-3)
        assert coarse == pytest.approx(COARSE, rel=1e-3)
        assert block.t[first] == pytest.approx(at, abs=0.1) and last == len(block)
    np.testing.assert_allclose(grids.within(0, 100)[:3], FINE, rtol=1e-3)


def test_one_grid_throughout_is_one_stretch() -> None:
    block = rounded(record(TACTICAL, ride(TACTICAL, seed=2)), np.inf)
    for one in (block, rounded(block, -np.inf), replace(block, acc=block.acc + 1e-4)):
        assert not grids_by_stretch(one).changed.any()


@pytest.mark.parametrize(("part", "fine"), [(SOON, True), (LATE, True), (5e-4, False)])
def test_of_a_window_the_part_is_kept_that_is_known_better(
    part: float, fine: bool
) -> None:
    """Half a coarse step is more than the noise of a second's mean of a fine one."""
    block, at = switched(part)
    bounds = np.searchsorted(block.t, np.array(windows()))
    kept = windows_on_one_grid(block, grids_by_stretch(block), bounds)
    whole = np.delete(np.arange(len(bounds)), 3)
    np.testing.assert_array_equal(kept[whole], bounds[whole])
    edge = block.t[kept[3, 1] - 1] if fine else block.t[kept[3, 0]]
    assert edge == pytest.approx(at, abs=0.1)


def test_a_single_sample_on_a_grid_of_its_own_is_no_part_of_a_window() -> None:
    """Of one sample no noise is seen, which does not make it better known."""
    block = record(TACTICAL, ride(TACTICAL, seed=2))
    start, end = np.searchsorted(block.t, np.array(windows()))[3].tolist()
    cut = start + (end - start) // 3
    steps = np.array([[0.0], [FINE], [0.0]]) * np.array([[1.0] * 3 + [0.0] * 3])
    grids = Grids(np.array([0, cut, cut + 1]), steps)
    (kept,) = windows_on_one_grid(block, grids, np.array([[start, end]]))
    assert kept.tolist() == [cut + 1, end]


def test_nothing_stands_still_and_nobody_pushed() -> None:
    """What repeats itself on the coarse grid does so because of that."""
    block, at = switched(SOON)
    checked = check_chain(block, parse_description(tables(TACTICAL)))
    ((name, fault),) = checked.faults
    assert name == "quantisation"
    assert fault.values["acc"] == pytest.approx(COARSE, rel=1e-3)
    assert fault.from_s == pytest.approx(at, abs=0.1)


def test_an_output_between_its_limits_lies_on_no_grid_of_two_values() -> None:
    """Turned to and fro beyond full scale, it shows hardly anything else."""
    rng = np.random.default_rng(4)
    t = np.arange(6000) / 100
    rate = rng.normal(0.0, 2e-3, (6000, 3))
    rate[4000:] += 30.0 * np.sin(40.0 * t[4000:, None])
    gyr = np.clip(np.round(rate / 1e-3) * 1e-3, -0.031, 0.031)
    acc = rng.normal(0.0, 0.02, (6000, 3)) + [0.0, 0.0, 9.8]
    grids = grids_by_stretch(Block.of(t, acc, gyr))
    assert not grids.changed.any()
    np.testing.assert_allclose(grids.steps[0, 3:], 1e-3, rtol=1e-6)
