"""What is said of numbers that cannot be, of bad windows and of scatter."""

import numpy as np
import pytest
from observed import BIAS, COUPLING, G, observe, outputs
from scipy.stats import chi2 as chi_square

from fieldcal.calibration import Nominal
from fieldcal.calibration.plausible import implausible_values
from fieldcal.core.positions import FIVE_POSITIONS, WIDE_POSITIONS, Position
from fieldcal.core.samples import Array
from fieldcal.model import thresholds
from fieldcal.solve import solve, words
from fieldcal.solve.doubtful_position import DoubtfulPosition

NINE = (*WIDE_POSITIONS, *FIVE_POSITIONS[1:])


def noisy(seed: int = 1, size: float = 1e-3, **known: Array) -> Array:
    u = outputs(NINE, **known)  # type: ignore[arg-type]
    return u + size * np.random.default_rng(seed).standard_normal(u.shape)


def test_a_good_device_has_nothing_said_of_it() -> None:
    found = solve(observe(NINE, noisy()), tilt="none")
    assert found.good and not found.warnings


def test_a_recording_in_g_is_said_to_be_in_another_unit() -> None:
    found = solve(observe(NINE, noisy() / 9.80665, sigma=1e-4), tilt="none")
    assert not found.good
    said = [w for w in found.warnings if "unit or full scale" in w]
    assert [w.partition(" ")[0] for w in said] == [f"acc_scale.{x}" for x in "xyz"]
    assert "(0.1024 times it fits)" in said[0]


@pytest.mark.parametrize("axis", range(3))
def test_a_bias_of_most_of_a_gravity_is_said(axis: int) -> None:
    bias = BIAS + 0.9 * G * np.eye(3)[axis]
    found = solve(observe(NINE, noisy(bias=bias)), tilt="none")
    assert not found.good
    (said,) = [w for w in found.warnings if "takes its mean out" in w]
    assert said.startswith(f"acc_bias.{'xyz'[axis]}")
    # and not where [nominal] says so
    known = Nominal(acc_bias=tuple(bias.tolist()))
    said_so = solve(observe(NINE, noisy(bias=bias), nominal=known), tilt="none")
    assert said_so.good and not said_so.warnings


def test_an_axis_that_does_not_follow_is_said() -> None:
    found = solve(observe(NINE, noisy(scale=np.array([1.0, 1.0, 1e-4]))), tilt="none")
    assert not found.good
    assert any(w.startswith("acc_scale.z") and "not follow" in w
               for w in found.warnings)  # fmt: skip


def test_numbers_are_only_called_senseless_when_they_are_sure() -> None:
    names, plain = ["acc_scale.x", "acc_bias.y", "gyr_scale.z"], Nominal()
    values = np.array([1.4, 6.0, 0.05])
    sure = implausible_values(names, values, np.full(3, 1e-3), plain)
    assert [s.partition(" ")[0] for s in sure] == names
    unsure = implausible_values(names[:2], values[:2], np.array([0.08, 1.3]), plain)
    assert unsure == []
    assert (
        implausible_values(["base_tilt.about_x_deg"], values[1:2], values[1:2], plain)
        == []
    )


@pytest.mark.parametrize(("chi2", "dof"), [(3.0, 1), (12.0, 7), (60.0, 20)])
def test_chance_is_that_of_a_larger_chi2(chi2: float, dof: int) -> None:
    assert words.chi2_chance(chi2, dof) == pytest.approx(
        chi_square.sf(chi2, dof), rel=1e-9
    )
    assert words.chi2_chance(chi2, 0) == 1.0


def test_scatter_is_told_from_one_in_a_hundred_on() -> None:
    limit = chi_square.isf(thresholds.BEYOND_NOISE, 10)
    assert words.scatter_warning("positions", 0.99 * limit, 10, 0.01, "m/s^2") == ""
    said = words.scatter_warning("positions", 1.01 * limit, 10, 0.01, "m/s^2")
    assert "10 degrees of freedom" in said and "0.01 m/s^2" in said and "0.06°" in said
    assert "itself uncertain" not in said
    assert "itself uncertain" in words.scatter_warning("norms", 90.0, 4, 0.01, "m/s^2")


@pytest.mark.parametrize(
    ("bad", "says"),
    [(0.05, ""), (0.4, "probability 40 %"), (0.995, "was given no weight")],
)
def test_a_bad_window_is_named(bad: float, says: str) -> None:
    doubt = np.zeros(len(NINE))
    doubt[2] = bad
    found = DoubtfulPosition.of(observe(NINE, outputs(NINE)), doubt)
    said = found.sentence if found else ""
    assert said == "" if not says else says in said and NINE[2].name in said
    document = found.to_json() if found else None
    assert DoubtfulPosition.from_json(document) == found


def test_an_effect_left_out_is_said_to_be_scatter() -> None:
    u = noisy(coupling=COUPLING)
    found = solve(observe(NINE, u), tilt="none")
    assert not found.good
    assert any("than the noise of their windows" in w for w in found.warnings)


def test_lists_read_as_sentences() -> None:
    assert words.not_determined(["p"], [], "these") == "p is not determined by these"
    assert words.not_determined(["p", "q"], ["r"], "these").endswith(
        "p and q are not determined by these: add r"
    )


def test_two_positions_of_the_same_kind_say_what_a_tilt_would_do() -> None:
    places = (Position.deg(0, 0), Position.deg(45, 5))
    found = solve(observe(places, outputs(places)))
    assert any("0.017 m/s² unnoticed" in w for w in found.warnings)
    assert words.NO_DOF in found.warnings
    # whoever asks for two positions has not asked for the tilt
    assert not any("do not show the tilt" in w for w in found.warnings)
    level = solve(observe(places, outputs(places)), level_sigma_deg=0.1)
    assert not any("unseen" in w for w in level.warnings)


def test_what_a_recording_shows_is_said_of_one_that_determines_nothing() -> None:
    walk = {"random_walk": 0.97}
    said = words.effects_warning(1.0, walk, (), np.zeros(0), 60.0, walk)
    assert said.startswith("the recording shows random_walk (probability 0.97);")
    of_one = words.effects_warning(1.0, walk, ("acc_bias.x",), np.ones(1), 60, walk)
    assert "otherwise acc_bias.x would be off by 1.0 σ" in of_one
