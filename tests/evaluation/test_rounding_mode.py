"""How a device rounds, told by what it shows as it passes through zero."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fieldcal.calibration import Calibration
from fieldcal.core.samples import Array, Block, Grain
from fieldcal.evaluation.rounding_mode import (
    CUT_CHANCE,
    RoundingMode,
    rounding_mode,
    with_rounding_uncertainty,
    zero_crossings,
)
from fieldcal.session.description_file import parse_description
from fieldcal.session.folder import Session

STEP = 0.05


def session(acc: Array) -> Session:
    made = Session(Path("rounded"), parse_description({"site": {"latitude_deg": 50.0}}))
    t = np.arange(len(acc)) / 100.0
    made.__dict__["block"] = Block.of(t, acc, np.zeros_like(acc))
    return made


def swung(seed: int) -> Array:
    """Three axes that swing through zero at different speeds, with some noise."""
    t, rng = np.arange(0, 60, 0.01), np.random.default_rng(seed)
    swing = [np.sin(2 * np.pi * t / p + rng.uniform(0, 6)) for p in (9.0, 13.0, 17.0)]
    out: Array = 2 * np.column_stack(swing) + rng.normal(0, STEP / 10, (len(t), 3))
    return out


@pytest.mark.parametrize(
    ("rounded", "least", "most"),
    [(np.trunc, 0.99, 1.0), (np.round, 0.0, 0.01), (np.floor, 0.0, 0.01)],
)
def test_zero_is_twice_as_wide_where_values_are_cut(
    rounded: Callable[[Array], Array], least: float, most: float
) -> None:
    for seed in range(3):
        found = rounding_mode(session(rounded(swung(seed) / STEP) * STEP), Grain())
        assert least <= found.cut_probability <= most
        np.testing.assert_allclose(found.step, STEP, rtol=1e-6)


def test_a_device_that_never_passes_zero_tells_nothing() -> None:
    acc = np.trunc((9.8 + 0.1 * swung(1)) / STEP) * STEP
    found = rounding_mode(session(acc), Grain())
    assert found.cut_probability == pytest.approx(CUT_CHANCE)
    assert (found.cut_sigma > 0.2 * STEP).all() and (found.round_down_sigma > 0).all()


def test_whoever_knows_the_rounding_leaves_nothing_open() -> None:
    acc = np.trunc(swung(1) / STEP) * STEP
    found = rounding_mode(session(acc), Grain(acc=STEP))
    assert not found.cut_sigma.any() and not found.round_down_sigma.any()
    assert not found.variance_near_zero(np.zeros((2, 3))).any()
    smooth = rounding_mode(session(swung(1)), Grain())
    assert not smooth.step.any()


def test_a_mean_of_zeros_may_be_anything_up_to_a_step() -> None:
    found = rounding_mode(session(np.trunc(swung(2) / STEP) * STEP), Grain())
    variance = found.variance_near_zero(np.array([[0.0, 3 * STEP, np.nan]]))
    rng = np.random.default_rng(5)
    anywhere = rng.uniform(-STEP, STEP, 100_000)
    assert variance[0, 0] == pytest.approx(anywhere.var(), rel=0.03)
    assert variance[0, 1] == 0.0


def test_a_device_that_comes_to_rest_does_not_pass() -> None:
    through = [-3, -1, -1, 0, 0, 0, 0, 1, 1, 3]
    assert list(zero_crossings(np.array(through))) == [(4, 2.0)]
    for rests in ([-3, -1, -1, *[0] * 40, 1, 1, 3], [-3, *[-1] * 9, 0, 0, 1, 1, 3]):
        assert not list(zero_crossings(np.array(rests)))
    assert not list(zero_crossings(np.array([-3, -1, -1, 0, 0, 0, -1, -3])))


def test_values_rounded_down_are_in_the_bias() -> None:
    names = tuple(f"{g}.{a}" for g in ("acc_bias", "acc_scale") for a in "xyz")
    plain = Calibration(
        "joint", names, np.ones(6), 1e-12 * np.eye(6), ("1",) * 6, 7.0, 7, 1e-3
    )
    down = RoundingMode(np.array([0.0, 0.02, 0.0]), 0.0)
    found = with_rounding_uncertainty(plain, down)
    # a chance of one in seven that it is 0.01 too small, where values were not cut
    assert found.uncertainty("acc_bias.y") == pytest.approx(0.01 / 7**0.5, rel=1e-6)
    for name in set(names) - {"acc_bias.y"}:
        assert found.uncertainty(name) == pytest.approx(1e-6)
