"""Biases that jump within a session: as a restart leaves them, or of another device."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fieldcal.acceptance.decision import Circumstances, decide
from fieldcal.acceptance.jump import bias_jump_warning
from fieldcal.calibration import Calibration, limits
from fieldcal.session.description_file import parse_description

BOUNDS = limits.read("tactical")
REPEAT = {"acc_bias": BOUNDS.acc_bias_repeat, "gyr_bias": BOUNDS.gyr_bias_repeat}


def jumping(**bias: tuple[float, float]) -> Calibration:
    names = tuple(f"{g}.{a}" for g in ("acc_bias", "acc_scale") for a in "xyz")
    told = {name.replace("__", "."): list(pair) for name, pair in bias.items()}
    info: dict[str, Any] = {"jump": {"at_s": 86.0, "bias": told}} if told else {}
    return Calibration(
        "joint", names, np.repeat([0.0, 1.0], 3), 1e-10 * np.eye(6),
        ("m/s^2",) * 3 + ("1",) * 3, 7.0, 7, 1e-3, info=info,
    )  # fmt: skip


def test_one_device_is_refused_as_often_as_the_limit_says() -> None:
    """Biases of two runs, each with the spread from run to run; a limit of 1 %."""
    rng, bounds = np.random.default_rng(0), replace(BOUNDS, fit_chance=0.01)
    refused = 0
    for _ in range(4000):
        bias = {}
        for group, repeat in REPEAT.items():
            for axis in "xyz":
                before, after = rng.normal(0, repeat, 2)
                seen = after - before + rng.normal(0, repeat / 2)
                bias[f"{group}__{axis}"] = (float(seen), repeat / 2)
        refused += bool(bias_jump_warning(jumping(**bias), bounds))
    assert refused == pytest.approx(40, abs=4 * 40**0.5)


def test_nothing_is_said_where_nothing_jumps_or_no_limit_is_known() -> None:
    assert bias_jump_warning(jumping(), BOUNDS) == ""
    assert bias_jump_warning(jumping(sensitivity__x=(9.0, 0.1)), BOUNDS) == ""


def test_biases_of_another_device_are_no_go() -> None:
    found = jumping(acc_bias__x=(0.05, 0.002), gyr_bias__x=(0.0112, 1e-4))
    made = decide(found, parse_description({"site": {"latitude_deg": 50.0}}), BOUNDS,
                  Circumstances())  # fmt: skip
    (check,) = [c for c in made.checks if c.name == "jump"]
    assert check.ok is False and not made.go
    assert "at 86 s" in check.says and "gyr_bias.x by +0.011 ± 0.0001" in check.says
    assert "another device" in check.says
