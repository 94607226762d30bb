"""Turns that close, that close by chance not, and that do not close at all."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fieldcal.acceptance.decision import Circumstances, decide
from fieldcal.acceptance.turn_agreement import turn_disagreement
from fieldcal.calibration import Calibration, limits
from fieldcal.session.description_file import parse_description

BOUNDS = limits.read("tactical")


def calibration(**turns: Any) -> Calibration:
    names = tuple(f"{g}.{a}" for g in ("acc_bias", "acc_scale") for a in "xyz")
    return Calibration(
        "joint", names, np.repeat([0.0, 1.0], 3), 1e-10 * np.eye(6),
        ("m/s^2",) * 3 + ("1",) * 3, 7.0, 7, 1e-3, info={"turns": turns},
    )  # fmt: skip


@pytest.mark.parametrize(
    "turns",
    [
        {},
        {"chi2": 14.0, "dof": 12, "scatter_rad": 0.0},
        {"chi2": 400.0, "dof": 12, "scatter_rad": 5e-4},  # beyond noise, and harmless
        {"chi2": 0.0, "dof": 0, "scatter_rad": 0.03},
    ],
)
def test_what_turns_leave_by_chance_or_harmlessly_is_no_reason(
    turns: dict[str, float],
) -> None:
    assert turn_disagreement(calibration(**turns), BOUNDS) == ""


def test_outputs_that_are_exchanged_are_no_go() -> None:
    found = calibration(chi2=45344.0, dof=12, scatter_rad=0.029)
    about = parse_description({"site": {"latitude_deg": 50.0}})
    made = decide(found, about, BOUNDS, Circumstances())
    (check,) = [c for c in made.checks if c.name == "turns"]
    assert check.ok is False
    assert "miss the positions by 1.7°" in check.says and "allowed 0.29°" in check.says
