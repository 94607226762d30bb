"""Whole sentences about positions in doubt, cross-coupling, latitude and scatter."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from test_result import estimated, fit, observed

from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.solve import warnings, words
from fieldcal.solve.agreement import LargestResidual
from fieldcal.solve.cross_coupling_effect import CrossCouplingEffect
from fieldcal.solve.doubtful_position import DoubtfulPosition
from fieldcal.solve.latitude import VerticalEarthRate

EARTH = 7.292115e-5


def test_a_position_in_doubt_is_to_be_taken_again() -> None:
    assert DoubtfulPosition("home", 0.4).sentence == (
        "the position home may be disturbed (probability 40 %) and has less weight,"
        " which the uncertainties include: take it again"
    )
    assert DoubtfulPosition("home", 0.991).sentence == (
        "the position home disagrees with all others and was given no weight: take it"
        " again"
    )
    assert "may be disturbed (probability 99 %)" in DoubtfulPosition("a", 0.99).sentence


def test_the_most_doubtful_position_counts_from_one_in_ten_on() -> None:
    seen, bad = observed(), np.array([0.0, 0.2, 0.7, 0.1, 0.0])
    worst = DoubtfulPosition.of(seen, bad)
    assert worst == DoubtfulPosition(FIVE_POSITIONS[2].name, 0.7)
    assert worst.to_json() == {"name": FIVE_POSITIONS[2].name, "probability": 0.7}
    assert DoubtfulPosition.from_json(worst.to_json()) == worst
    assert DoubtfulPosition.of(seen, np.array([0, 0, 0, 0.1, 0])) is not None
    assert DoubtfulPosition.of(seen, np.array([0, 0, 0, 0.0999, 0])) is None
    assert DoubtfulPosition.from_json(None) is None


def test_what_cross_coupling_moves_and_what_is_to_be_done() -> None:
    bias = CrossCouplingEffect("acc_bias.x", "m/s^2", 25.0, 2.55, 0.0)
    assert bias.sentence == (
        "cross-coupling is taken as zero, and these positions magnify its effect 2.5"
        " times: each 0.1 % moves acc_bias.x by 0.025 m/s^2, which the uncertainties"
        " do not include; hold each axis up and down, or estimate cross-coupling"
        " (--cross) from nine positions or more"
    )
    scale = CrossCouplingEffect("acc_scale.z", "1", 12.0, 12.0, 3e-4).sentence
    assert scale.startswith("cross-coupling beyond ± 0.03 % is taken as zero, and ")
    assert "each 0.1 % moves acc_scale.z by 0.012, which" in scale


def test_another_latitude_is_told_with_what_the_gyroscopes_measure() -> None:
    stated = EARTH * np.sin(np.deg2rad(50.45))
    shown = VerticalEarthRate(stated, -EARTH / 2, 4e-7, 9.0)
    assert shown.sentence == (
        "the gyroscopes show the Earth's rate of latitude -30° (-3.6e-05 ± 4e-07 rad/s"
        " about the vertical), not of 50.45°: south is negative; mend latitude_deg in"
        " [site], or the signs of the gyroscopes' axes, and solve again"
    )
    beyond = VerticalEarthRate(stated, -1.5 * EARTH, 4e-7, 9.0).sentence
    assert "latitude -90° (-0.00011" in beyond


def test_a_latitude_is_wrong_where_another_is_likelier_and_on_the_earth() -> None:
    def wrong(measured: float, gain: float) -> bool:
        return VerticalEarthRate(4e-5, measured, 1e-6, gain).latitude_wrong

    assert wrong(-4e-5, 0.01) and not wrong(-4e-5, 0.0) and not wrong(-4e-5, -0.01)
    for sign in (-1, 1):
        assert wrong(sign * (EARTH + 1.9e-6), 5.0)
        assert not wrong(sign * (EARTH + 2.1e-6), 5.0)
    # the odds already have the probability of one in a thousand in them
    even = np.log(1e-3)
    favoured = [
        VerticalEarthRate(4e-5, 1.0, 1e-6, gain).other_favoured
        for gain in (even - 0.01, even + 0.01)
    ]
    assert favoured == [False, True]


def test_nothing_is_said_of_a_latitude_that_is_not_stated_or_not_measured() -> None:
    without, there = (cast(Any, SimpleNamespace(earth=n)) for n in (-1, 0))
    assert VerticalEarthRate.of(without, cast(Any, None), 0.7) is None
    assert VerticalEarthRate.of(there, cast(Any, None), None) is None


@pytest.mark.parametrize(
    ("what", "dof", "cause"),
    [
        ("norms", 5, "run fieldcal diagnose to see where it comes from"),
        ("positions", 6, "either the angles are set no better than 0.3°, or the model"
         " leaves something out, which fieldcal diagnose may name"),
    ],
)  # fmt: skip
def test_scatter_beyond_the_noise(what: str, dof: int, cause: str) -> None:
    spread = 9.80665 * np.deg2rad(0.3)
    assert words.scatter_warning(what, 88.6, dof, spread, "m/s^2") == (
        f"the {what} scatter more than the noise of their windows (χ² = 89 with {dof}"
        " degrees of freedom): the uncertainties include an additional scatter of 0.051"
        f" m/s^2; {cause}"
    )
    few = words.scatter_warning(what, 88.6, 4, spread, "m/s^2")
    assert "of 0.051 m/s^2 (itself uncertain, with so few degrees of freedom); " in few
    assert words.scatter_warning(what, 88.6, 0, spread, "m/s^2") == ""


def test_effects_that_a_recording_shows() -> None:
    causes = {"misset": 0.9, "warm_up": 0.1, "hum": 0.09}
    names, moved = ("acc_bias.x", "acc_bias.y"), np.array([0.5, -2.25])
    shown = (
        "the recording shows a position that was set at another angle (probability"
        " 0.90) and warm_up (probability 0.10)"
    )
    warm = {"warm_up": 0.1}
    assert words.effects_warning(0.49, causes, names, moved, 90.0, warm) == ""
    assert words.effects_warning(0.5, causes, names, moved, None, {}) == (
        f"{shown}, and the result takes it into account: the uncertainties include it;"
        " otherwise acc_bias.y would be off by 2.2 σ; fieldcal diagnose says what to do"
    )
    assert words.effects_warning(0.5, causes, names, moved, 90.4, warm) == (
        f"{shown}, and the result takes it into account: biases and scale factors are"
        " stated for the end of the recording, 90 s after its start, and the"
        " uncertainties include it; otherwise acc_bias.y would be off by 2.2 σ;"
        " fieldcal diagnose says what to do"
    )
    noise = {"flicker": 0.23, "random_walk": 0.02}
    assert words.effects_warning(0.5, causes, names, moved, 90.4, noise) == (
        f"{shown}, and the result takes it into account: biases and scale factors are"
        " stated for the end of the recording, 90 s after its start, as flicker noise"
        " of the biases (probability 0.23) and random_walk (probability 0.02) may"
        " change them, and the uncertainties include it; otherwise acc_bias.y would be"
        " off by 2.2 σ; fieldcal diagnose says what to do"
    )
    both = words.effects_warning(0.5, causes, names, moved, 90.4, warm | noise)
    assert "start, as flicker noise of the biases (probability 0.23) may change" in both
    assert " may change them too, and the uncertainties include it" in both
    assert words.effects_warning(1.0, causes, (), np.zeros(0), 90.0, warm) == (
        f"{shown}; fieldcal diagnose says what to do"
    )
    assert "an angle that is wrong wherever it is set" in words.effects_warning(
        1.0, {"repeated_angle": 1.0}, (), np.zeros(0), None, {}
    )


@pytest.mark.parametrize(
    ("of_acc", "axis", "says"),
    [
        (True, 2, "az by +0.5 ± 0.01 m/s²"),
        (True, -1, "the length of the force by +0.5 ± 0.01 m/s²"),
        (False, 1, "gy by +0.5 ± 0.01 rad/s"),
        (False, -1, "the length of the rate by +0.5 ± 0.01 rad/s"),
    ],
)
def test_forces_or_rates_that_contradict_each_other(
    of_acc: bool, axis: int, says: str
) -> None:
    far = LargestResidual(3, axis, 0.5, 0.01)
    bad = fit(chi2=123.4, dof=6, rejects_model=True, largest=far)
    good = fit(rejects_model=False)
    both = {"acc": bad, "gyr": good} if of_acc else {"acc": good, "gyr": bad}
    found, what = estimated(**both), "forces" if of_acc else "rates"
    (text,) = warnings.contradiction_warnings(observed(), found, of_acc)
    assert text == (
        f"the {what} in these positions contradict each other: χ² = 123 with 6 degrees"
        " of freedom, and chance does not do that; furthest from what the others"
        f" predict is {FIVE_POSITIONS[3].name}, {says}: take that position again, or"
        " ask fieldcal diagnose what is left out"
    )
    assert warnings.contradiction_warnings(observed(), found, not of_acc) == []


def test_a_contradiction_that_no_window_shows_by_itself() -> None:
    found = estimated(acc=fit(chi2=55.0, dof=1, rejects_model=True, largest=None))
    assert warnings.contradiction_warnings(observed(), found, True) == [
        "the forces in these positions contradict each other: χ² = 55 with 1 degree of"
        " freedom, and chance does not do that"
    ]
