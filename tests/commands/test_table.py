"""What a virtual device conceals, beside what was found."""

from __future__ import annotations

import io
from dataclasses import replace
from math import nan

import numpy as np
import pytest
from calibrations import calibration

from fieldcal.commands.table import show_calibration, true_values


@pytest.mark.parametrize(
    ("chi2", "dof", "good", "says"),
    [(1.0, 1, True, "verdict: good"), (0.0, 0, True, "nothing is left to check these"),
     (nan, 0, True, "verdict: good"), (9.0, 0, False, "verdict: BAD")],
    ids=["checked", "as many parameters as means", "a closed form", "bad"],
)  # fmt: skip
def test_an_estimate_that_nothing_checks_is_not_called_good(
    chi2: float, dof: int, good: bool, says: str
) -> None:
    found = calibration(np.random.default_rng(1), 0.0)
    out = io.StringIO()
    show_calibration(replace(found, chi2=chi2, dof=dof, good=good), out=out)
    (verdict,) = [line for line in out.getvalue().splitlines() if "verdict" in line]
    assert says in verdict


def test_words_of_an_effect_are_no_values() -> None:
    truth = {
        "acc_bias": [0.1, 0.2, 0.3],
        "effects": {
            "decode_fault": {"channel": "gyr", "kind": "wild", "full_scale": 0},
            "cross_coupling": {"k12": 0.003},
        },
    }
    assert true_values(truth) == {
        "acc_bias.x": 0.1, "acc_bias.y": 0.2, "acc_bias.z": 0.3,
        "decode_fault.full_scale": 0.0, "cross_coupling.k12": 0.003,
    }  # fmt: skip


def test_what_is_exact_is_off_by_no_number_of_its_uncertainties() -> None:
    found = calibration(np.random.default_rng(1), 0.0)
    covariance = found.covariance.copy()
    covariance[0] = covariance[:, 0] = 0.0
    out = io.StringIO()
    truth = {"acc_bias": [9.0, 9.0, 9.0]}
    show_calibration(replace(found, covariance=covariance), truth, out)
    first, second = out.getvalue().split("acc bias x")[1].splitlines()[:2]
    assert "σ" not in first and "inf" not in first and second.rstrip(" │").endswith("σ")
