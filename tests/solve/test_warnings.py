"""Sentences of what is open, unchecked or too scattered, of estimates made up."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from test_result import estimated, fit, observed

from fieldcal.core.gravity import G0
from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS, Position
from fieldcal.solve import warnings, words
from fieldcal.solve.options import SolveOptions


@pytest.mark.parametrize(
    ("turned", "rates", "gyr", "cross", "says"),
    [
        (False, False, ["gyr_scale.x"], [],
         "gyr_scale.x is not estimated: the Earth's rate shows it only roughly in these"
         " windows; average longer, or record the turns between the positions, each"
         " within 60 s and without a gap"),
        (False, False, ["gyr_scale.x", "gyr_scale.y"], [],
         "gyr_scale.x and gyr_scale.y are not estimated: the Earth's rate shows them"
         " only roughly in these windows; average longer, or record the turns between"
         " the positions, each within 60 s and without a gap"),
        (True, False, ["gyr_scale.y"], ["gyro_cross_coupling.s13"],
         "gyr_scale.y and gyro_cross_coupling (1 of its 6 coefficients) are not"
         " determined by these turns: add turns about device axis y and z while that"
         " axis is level"),
        (False, True, [], ["gyro_cross_coupling.s21", "gyro_cross_coupling.s31"],
         "gyro_cross_coupling (2 of its 6 coefficients) is not determined by this"
         " schedule: add a rate of 20°/s about device axis x"),
    ],
)  # fmt: skip
def test_what_turns_or_rates_leave_open(
    turned: bool, rates: bool, gyr: list[str], cross: list[str], says: str
) -> None:
    found = estimated()
    found.parameter_set.options.turned = turned  # type: ignore[misc]
    seen = observed()
    if rates:
        seen = observed((FIVE_POSITIONS[0], Position("", rate=(0.1, 0.0, 0.0))))
    assert warnings._gyroscope_warning(gyr, cross, seen, found) == says


@pytest.mark.parametrize(
    ("missing", "n", "dof", "says"),
    [
        (["acc_bias.x", "cross_coupling.k12"], 12, 5,
         "acc_bias.x and cross_coupling.k12 are not determined by these orientations:"
         " add positions with each axis up and down"),
        (["cross_coupling.k12"], 12, 5,
         "cross_coupling.k12 is not determined, axes held up and down alone cannot show"
         " it: add positions with gravity half way between x and y"),
        (["cross_coupling.k13", "cross_coupling.k23"], 8, 1,
         "cross_coupling.k13 and cross_coupling.k23 are not determined, 8 norms cannot"
         " determine 9 parameters: add positions with gravity half way between x and z"
         " and y and z"),
        (["cross_coupling.k23"], 9, 2,
         "cross_coupling.k23 is not determined, axes held up and down alone cannot show"
         " it (and all nine would leave two degrees of freedom): add positions with"
         " gravity half way between y and z"),
    ],
)  # fmt: skip
def test_what_lengths_leave_open(
    missing: list[str], n: int, dof: int, says: str
) -> None:
    assert warnings._norm_warning(missing, estimated(acc=fit(dof=dof)), n) == says


@pytest.mark.parametrize(
    ("stretched", "says"),
    [(1.111, "|a| at rest is 10.895 m/s², +11.1 % from gravity"), (1.001, ""),
     (np.nan, "")],
)  # fmt: skip
def test_a_force_that_no_parameter_explains_is_said(
    stretched: float, says: str
) -> None:
    seen = observed((FIVE_POSITIONS[0],) * 3, gravity=G0)
    force = np.array([3.0, 4.0, np.sqrt(G0**2 - 25)])
    seen.mean[:, :3] = stretched * force
    told = warnings._force_length_warning(seen)
    assert told.startswith(says) and bool(told) == bool(says)


def test_of_so_few_windows_the_residual_says_nothing() -> None:
    assert warnings._few_windows_warnings("joint", estimated(acc=fit(dof=0))) == [
        words.NO_DOF
    ]
    assert warnings._few_windows_warnings("joint", estimated(acc=fit(dof=1))) == []
    one = "only one degree of freedom: too few to check the fit; add"
    assert warnings._few_windows_warnings("scalar", estimated(acc=fit(dof=1))) == [
        f"{one} positions in other orientations"
    ]
    assert warnings._few_windows_warnings("scalar", estimated(acc=fit(dof=3))) == []
    assert (
        warnings._few_windows_warnings("joint", estimated(acc=fit(dof=0, rms=np.nan)))
        == []
    )


def test_a_base_that_two_positions_take_for_level_is_said() -> None:
    seen = observed(TWO_POSITIONS, gravity=10.0)
    (text,) = warnings.level_warnings("two_position", SolveOptions(), seen)
    assert text == (
        "the base is assumed exactly level: a tilt of 0.1° would change a bias by up to"
        " 0.017 m/s² unnoticed; take five positions, or state how level it is (--level)"
    )
    assert (
        warnings.level_warnings("two_position", SolveOptions(level_deg=0.1), seen) == []
    )
    assert warnings.level_warnings("joint", SolveOptions(), seen) == []


def test_scatter_of_each_triad_and_of_turns_is_said_with_its_unit() -> None:
    loud = {"chi2": 60.0, "dof": 6, "rms": 1e-3}
    spread = "the uncertainties include an additional scatter of {} {}"
    both = estimated(acc=fit(**loud), gyr=fit(**loud), closure_squares=(90.0, 6))
    acc, gyr, turns = warnings._scatter_warnings(both)
    assert acc.startswith("the positions scatter")
    assert spread.format("2.9", "m/s^2") in acc
    assert gyr.startswith("the gyroscopes' means scatter")
    assert spread.format("1.3", "rad/s") in gyr
    assert turns.startswith("the turns scatter") and "6 degrees" in turns
    assert spread.format("5", "rad") in turns
    both.parameter_set.unoriented[:] = True
    assert warnings._scatter_warnings(both)[0].startswith("the norms scatter")
    few = estimated(closure_squares=(90.0, 5), names=("gyr_scale.x",))
    assert len(warnings._scatter_warnings(few)) == 1, "four of five are left over"
    assert warnings.closure_chi2(few) == (90.0, 4)
    more = estimated(
        closure_squares=(1.0, 1), names=("gyr_scale.x", "gyro_cross_coupling.s12")
    )
    assert warnings.closure_chi2(more) == (1.0, 0)


def test_gyroscopes_of_which_no_scale_factor_is_asked_for() -> None:
    found = estimated()
    found.parameter_set.options.gyr_scale = False  # type: ignore[misc]
    assert warnings.undetermined_warnings("joint", observed(), found) == [
        words.NO_SCALE
    ]
    earth = observed(grade="navigation", latitude=0.8)
    assert warnings.undetermined_warnings("joint", earth, found) == [
        "gyr_scale is not determined: the Earth's rate gives it only with two known"
        " positions and the latitude"
    ]
    assert warnings.undetermined_warnings("joint", observed(gyr=False), found) == []


def open_estimate(*undetermined: str, names: tuple[str, ...] = ("acc_bias.x",)) -> Any:
    """An estimate of which some parameters are not determined."""
    found: Any = estimated(undetermined=undetermined, names=names)
    found.parameter_set.names = (*names, *undetermined)
    return found


def test_what_positions_leave_open_is_told_with_positions_that_mend_it() -> None:
    flat = observed((Position.deg(0, 0), Position.deg(45, 0), Position.deg(20, 0)))
    found = open_estimate(
        "acc_bias.z", "acc_scale.z", names=("acc_bias.x", "acc_bias.y", "acc_scale.x",
                                            "acc_scale.y")
    )  # fmt: skip
    assert warnings.undetermined_warnings("joint", flat, found) == [
        "acc_bias.z and acc_scale.z are not determined by these positions: add"
        " α = 45°, β = 5°"
    ]
    table = Position("", 0.0, 0.0, rate=(0.1, 0.0, 0.0))
    turning = observed((*flat.positions, table))
    assert warnings.undetermined_warnings("joint", turning, found) == [
        "acc_bias.z and acc_scale.z are not determined by these positions"
    ]


def test_a_tilt_that_is_open_is_no_matter_where_the_level_is_stated() -> None:
    found = open_estimate("base_tilt.about_x_deg")
    (text,) = warnings.undetermined_warnings("joint", observed(), found)
    assert text.startswith("base_tilt.about_x_deg is not determined by these positions")
    found.parameter_set.options.level_deg = 0.1
    assert warnings.undetermined_warnings("joint", observed(), found) == []


def test_of_lengths_alone_orientations_are_what_is_missing() -> None:
    found = open_estimate("acc_scale.z", names=("gyr_bias.x",))
    seen = observed()
    seen.mean[:, :3] *= 1.2
    open_, force = warnings.undetermined_warnings("scalar", seen, found)
    assert open_ == (
        "acc_scale.z is not determined by these orientations: add positions with each"
        " axis up and down"
    )
    assert force.startswith("|a| at rest is ") and force.endswith(
        " % from gravity: biases or scale factors of the accelerometers are off by as"
        " much, and these orientations do not show which; add positions in other"
        " orientations"
    )
    known = open_estimate("acc_scale.z")
    assert warnings.undetermined_warnings("scalar", seen, known) == [open_]


def test_each_matrix_of_the_gyroscopes_is_told_by_itself() -> None:
    of_one = {"gyr_scale.y": "gyr_scale.y",
              "gyro_cross_coupling.s12":
              "gyro_cross_coupling (1 of its 6 coefficients)"}  # fmt: skip
    for name, what in of_one.items():
        found = open_estimate(name)
        found.parameter_set.options.turned = True
        (text,) = warnings.undetermined_warnings("joint", observed(), found)
        assert text == (
            f"{what} is not determined by these turns: add turns about device axis y"
            " while that axis is level"
        )


def test_the_position_in_doubt_stands_between_few_windows_and_scatter() -> None:
    bad = np.array([0.0, 0.4, 0.0, 0.0, 0.0])
    found = estimated(acc=fit(dof=0), bad_probability=bad)
    few, doubt, *scatter = warnings.agreement_warnings("joint", observed(), found)
    assert few == words.NO_DOF and FIVE_POSITIONS[1].name in doubt
    assert scatter == warnings._scatter_warnings(found)
    found = estimated(bad_probability=np.zeros(5))
    assert not any(warnings.agreement_warnings("joint", observed(), found))
