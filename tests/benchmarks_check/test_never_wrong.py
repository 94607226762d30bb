"""Sessions of the campaign: each of these ended in GO once, and was wrong."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.never_wrong import GROUPED, mistakes
from benchmarks.never_wrong.bench import drawn
from benchmarks.never_wrong.bench_mistakes import BEFORE, spoilt
from benchmarks.never_wrong.judging import (
    WRONG,
    Judged,
    beyond_limit,
    judged,
    write,
)
from benchmarks.never_wrong.mistakes import AFTER, session

LIMIT = 600.0


def of(folder: Path, seed: int, *names: str, drawn_first: bool = False) -> Judged:
    """A session of the campaign, in which mistakes are drawn or with `--only` given."""
    rng = np.random.default_rng(seed)
    bench = drawn(rng)
    if drawn_first:
        mistakes(seed, rng, "")  # which other ones there are by now is no matter
    bench = spoilt(bench, names, rng)
    write(folder, session(bench, names, rng))
    return judged(folder, bench.truth, bench.grade, False, LIMIT)


def test_an_error_beyond_a_limit_counts_beside_the_chance_of_one() -> None:
    """0.3173 and 0.0455: outside of one and of two standard uncertainties."""
    limits, truth = {"acc_bias": 0.02}, {"acc_bias.x": 0.0, "acc_bias.y": 0.1}
    one, two = ("acc_bias.x", 0.019, 0.02), ("acc_bias.y", 0.1, 0.01)
    scale = ("acc_scale.x", 1.5, 0.1)  # no limit of its own
    over, chance = beyond_limit([one, two, scale], truth, limits)
    assert not over
    assert chance == pytest.approx(1 - (1 - 0.3173) * (1 - 0.0455), abs=1e-4)
    assert beyond_limit([one, ("acc_bias.y", 0.0797, 0.01)], truth, limits)[0]


def test_every_mistake_has_its_row_in_the_table() -> None:
    grouped = [name for names in GROUPED.values() for name in names]
    assert sorted(grouped) == sorted({"none", *BEFORE, *AFTER})


@pytest.mark.thorough
def test_turns_are_not_followed_with_a_scale_factor_by_the_earth_alone(
    tmp_path: Path,
) -> None:
    found = of(tmp_path / "six", 93_000_015)
    assert found.go and 0 < found.off < WRONG


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("seed", "mistake"),
    [
        # 0.25 % and 0.27 % of gyroscopes: turns show neither, a K2 was taken for both
        (99_400_097, "gauge long"),
        # 0.1 %: a K2 was there for certain, and a kink at zero does as well
        (99_800_236, "gauge long"),
        # angles are set four times less well than stated, which six faces do not show
        (99_800_954, "fixture bends"),
    ],
)
def test_angles_that_are_wrong_are_in_the_uncertainties(
    tmp_path: Path, seed: int, mistake: str
) -> None:
    found = of(tmp_path / "session", seed, mistake, drawn_first=True)
    assert found.off < 3.0


@pytest.mark.thorough
def test_after_a_restart_what_no_position_shows_again_is_uncertain(
    tmp_path: Path,
) -> None:
    """One face is left, whose length alone is known: 0.2 m/s^2 of a bias is unseen."""
    found = of(tmp_path / "two", 97_103_009, "device restarted")
    assert not found.go and found.caught.startswith("acc_bias uncertainty")


@pytest.mark.thorough
def test_a_jump_that_only_the_other_triad_shows_is_uncertain(tmp_path: Path) -> None:
    """31.7 standard uncertainties: a face without angles is all that follows."""
    found = of(tmp_path / "five", 98_170_003, "two days joined")
    assert found.off < WRONG


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("seed", "mistake", "caught"),
    [
        (98_180_007, "device exchanged", "jump"),  # 28.8 of a scale factor
        (98_210_007, "gyr zeroed at each stop", "the run"),  # 739 of a bias
    ],
)
def test_what_a_device_became_or_took_out_is_no_go(
    tmp_path: Path, seed: int, mistake: str, caught: str
) -> None:
    found = of(tmp_path / "s", seed, mistake)
    assert not found.go and found.caught == caught


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("seed", "mistake"),
    [
        (98_220_001, "dead band"),
        pytest.param(98_230_000, "sent on change", marks=pytest.mark.thorough),
    ],
)
def test_faces_of_which_no_output_tells_anything_are_no_fault(
    tmp_path: Path, seed: int, mistake: str
) -> None:
    """`solve` broke on such a session: nothing in it determines how a face lay."""
    assert of(tmp_path / "two", seed, mistake).caught != "exit 70"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("seed", "mistake", "was"),
    [
        (90_000_018, (), 3.5),  # a warm-up that g-sensitivity took in
        (90_000_036, (), 4.3),  # a kink at zero beside a K2 that is determined
        (92_004_008, ("sway",), 3.6),  # attitudes at the ends of turns
        (98_220_007, ("dead band",), 6.0),  # means of values that were set to zero
        (75_100_475, ("dead band",), 27.5),  # the same of gyroscopes at rest
    ],
)
def test_what_is_off_is_in_the_uncertainties(
    tmp_path: Path, seed: int, mistake: tuple[str, ...], was: float
) -> None:
    found = of(tmp_path / "s", seed, *mistake)
    assert found.go and found.off < 0.75 * was


@pytest.mark.thorough
def test_cross_coupling_beside_a_large_bias_does_not_bend_the_turns(
    tmp_path: Path,
) -> None:
    """2 % and 0.5 m/s^2 of an MPU-6050: scale factors of gyroscopes were 5.2 off."""
    found = of(tmp_path / "twelve", 99_600_619, "low-cost device", drawn_first=True)
    assert found.go and found.off < 3.0


@pytest.mark.thorough
def test_gyroscopes_reversed_beside_positions_exchanged_are_no_go(
    tmp_path: Path,
) -> None:
    names = "a triad reversed", "positions swapped"
    found = of(tmp_path / "wide", 99_600_085, *names, drawn_first=True)
    assert not found.go and "the estimate is bad" in found.says


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("mistake", "why"),
    [
        ("outputs exchanged", "gyr_axes = -y-x-z"),
        ("rad/s labelled deg/s", "unit = rad/s read as deg/s"),
    ],
)
def test_gyroscopes_that_follow_other_turns_are_wrong_without_any_angle(
    tmp_path: Path, mistake: str, why: str
) -> None:
    found = of(tmp_path / "twelve", 93_000_003, mistake)
    assert not found.go and why in found.says


@pytest.mark.thorough
def test_a_simulation_without_noise_has_an_answer(tmp_path: Path) -> None:
    """Its estimates went without bounds until nothing could be inverted."""
    rng = np.random.default_rng(7002)
    bench = replace(drawn(rng), acc_noise=0.0, gyr_noise=0.0, grain=0.0)
    written = session(bench, (), rng)
    write(tmp_path / "s", written)
    found = judged(tmp_path / "s", written.truth(bench), bench.grade, False, 200.0)
    assert found.caught != "exit 70" and not (found.late or found.wrong)
