"""Gravity that nobody said, and rounding that nobody knows, against what they do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fieldcal.calibration import Calibration
from fieldcal.core.gravity import gravity
from fieldcal.core.samples import Array, Block, Grain
from fieldcal.evaluation.unsaid import with_unsaid
from fieldcal.session.description import parse
from fieldcal.session.folder import Session

NAMES = tuple(f"{g}.{a}" for g in ("acc_bias", "acc_scale") for a in "xyz")
SMALL = 1e-6


def calibration() -> Calibration:
    return Calibration(
        "joint", NAMES, np.repeat([0.1, 1.01], 3), SMALL**2 * np.eye(6),
        ("m/s^2",) * 3 + ("1",) * 3, 7.0, 7, 1e-3,
    )  # fmt: skip


def session(acc: Array, **site: float) -> Session:
    made = Session(Path("unsaid"), parse({"site": site}))
    t = np.arange(len(acc)) / 100.0
    made.__dict__["block"] = Block.of(t, acc, np.zeros_like(acc))
    return made


def samples() -> Array:
    out: Array = np.random.default_rng(1).normal(0.0, 0.5, (3000, 3))
    return out


def test_nothing_is_added_where_all_is_known() -> None:
    known = session(samples(), latitude_deg=50.0)
    coarse = session(np.round(samples(), 1), latitude_deg=50.0)
    for recorded, grain in ((known, Grain()), (coarse, Grain(0.1, 0.01))):
        assert (with_unsaid(calibration(), recorded, grain).sigma == SMALL).all()


@pytest.mark.parametrize("latitude", [-90.0, -60.0, 0.0, 30.0, 75.0])
def test_the_scale_of_any_place_is_within_what_is_said(latitude: float) -> None:
    found = with_unsaid(calibration(), session(samples()), Grain())
    # of gravity taken as that of 45 degrees
    off = found.value("acc_scale.x") * (gravity(latitude) / gravity(45.0) - 1)
    sigma = found.uncertainty("acc_scale.x")
    assert abs(off) < 2 * sigma and sigma < 2e-3
    rows = [NAMES.index(f"acc_scale.{a}") for a in "xy"]
    both = found.covariance[np.ix_(rows, rows)]
    assert both[0, 1] / both[0, 0] == pytest.approx(1.0, abs=1e-3)
    assert found.uncertainty("acc_bias.x") == SMALL


def test_values_cut_toward_zero_are_within_what_is_said() -> None:
    step, g = 0.1, gravity(50.0)
    up, down = (sign * g + 0.02 * samples() for sign in (1.0, -1.0))
    cut = [np.trunc(some / step) * step for some in (up, down)]
    off = (cut[0].mean() - cut[1].mean()) / (2 * g) - 1
    acc = np.trunc(samples() / step) * step
    found = with_unsaid(calibration(), session(acc, latitude_deg=50.0), Grain())
    sigma = found.uncertainty("acc_scale.z")
    assert off < -2e-3 and abs(off) < 3 * sigma < 0.02
    bias = found.uncertainty("acc_bias.z")
    assert bias == pytest.approx(np.sqrt(0.3) * step / 2, rel=0.01)
