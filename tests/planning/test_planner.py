"""What the planner promises is what an independent simulation finds."""

import argparse
import json
from pathlib import Path

import numpy as np
import pytest

from fieldcal.cli import main
from fieldcal.core.errors import PlanError
from fieldcal.core.positions import (
    FIVE_POSITIONS,
    SIX_FACES,
    TWO_POSITIONS,
    WIDE_POSITIONS,
    Position,
)
from fieldcal.planning import planner
from fieldcal.planning.aliasing import find_aliases
from fieldcal.planning.planner import (
    GRADES,
    GradeNoise,
    Ladder,
    best_positions,
    expected,
)

G = 9.81
UNIT = GradeNoise(1e-3, 0.0, 1e-5, 0.0)


def test_the_paper_s_five_positions_reach_the_published_bound(shared: Path) -> None:
    """Figures of errata.md, for 1 mm/s^2 of noise on each mean."""
    text = (shared / "paper" / "errata.md").read_text()
    assert "4.8, 10.7, 5.2" in text and "0.26, 1.06, 2.7" in text
    found = expected(FIVE_POSITIONS, UNIT, 1.0, G)
    bias = [1e3 * found[f"acc_bias.{a}"] for a in "xyz"]
    scale = [1e3 * found[f"acc_scale.{a}"] for a in "xyz"]
    np.testing.assert_allclose(bias, [4.8, 10.7, 5.2], rtol=0.06)
    np.testing.assert_allclose(scale, [0.26, 1.06, 2.7], rtol=0.06)
    assert found["angle_offset.alpha0_deg"] == pytest.approx(0.027, rel=0.06)
    assert found["angle_offset.beta0_deg"] == pytest.approx(0.034, rel=0.11)


def test_its_own_five_are_three_times_better_than_the_paper_s() -> None:
    ours = expected(best_positions(5, Ladder(), G), UNIT, 1.0, G)
    paper = expected(FIVE_POSITIONS, UNIT, 1.0, G)

    def worst(found: dict[str, float]) -> float:
        return max(found[f"acc_bias.{a}"] for a in "xyz")

    assert worst(paper) > 3 * worst(ours)
    assert worst(expected(WIDE_POSITIONS, UNIT, 1.0, G)) < worst(paper) / 3


@pytest.mark.parametrize(
    "n", [2, *(pytest.param(n, marks=pytest.mark.thorough) for n in (3, 5, 8))]
)
def test_no_random_set_within_the_limits_beats_the_chosen_one(n: int) -> None:
    ladder = Ladder()
    chosen = best_positions(n, ladder, G)
    assert len({p.degrees for p in chosen}) == n
    rng = np.random.default_rng(n)

    def cost(positions: tuple[Position, ...]) -> float:
        s = expected(positions, UNIT, 1.0, G)
        bias = sum(s.get(f"acc_bias.{a}", np.inf) ** 2 for a in "xyz")
        return bias + G**2 * sum(s.get(f"acc_scale.{a}", np.inf) ** 2 for a in "xyz")

    for _ in range(300):
        a, b = rng.uniform(-45, 45, n), rng.uniform(-5, 5, n)
        other = tuple(Position.deg(*ab) for ab in zip(a, b, strict=True))
        assert cost(chosen) <= 1.02 * cost(other)


def test_two_positions_leave_the_tilt_and_level_ones_the_scale() -> None:
    assert "angle_offset.alpha0_deg" not in expected(TWO_POSITIONS, UNIT, 1.0, G)
    level = expected((Position.deg(0, 0), Position.deg(30, 0)), UNIT, 1.0, G)
    assert "acc_scale.z" not in level and "acc_bias.z" in level
    assert "acc_scale.x" in level


def test_positions_that_cannot_determine_anything_are_refused() -> None:
    with pytest.raises(PlanError, match="ask for two or more"):
        best_positions(1, Ladder(), G)
    with pytest.raises(PlanError, match="allow more positions or wider angles"):
        best_positions(5, Ladder(np.deg2rad(45), 0.0), G)


def test_an_extra_position_is_new_and_helps() -> None:
    extra = planner.extra_position(FIVE_POSITIONS, Ladder(), G)
    assert extra is not None
    assert extra.degrees not in {p.degrees for p in FIVE_POSITIONS}
    before = expected(FIVE_POSITIONS, UNIT, 1.0, G)
    after = expected((*FIVE_POSITIONS, extra), UNIT, 1.0, G)
    assert after["acc_bias.y"] < before["acc_bias.y"] / 2


def test_a_plan_of_all_positions_has_no_extra_one(
    capsys: pytest.CaptureFixture[str],
) -> None:
    every = len(Ladder().candidates())
    words = ["plan", "--minutes", "60", "--positions"]
    assert main([*words, str(every)]) == 0
    out = capsys.readouterr().out
    assert "worth most: none within the limits" in out and "one more │" not in out
    assert main([*words, str(every), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["extra_position"] is None and len(said["positions"]) == every
    assert main([*words, str(every + 1)]) == 2
    assert f"{every} are distinguished within |α| ≤ 45°" in capsys.readouterr().err


def test_no_extra_position_completes_what_the_limits_do_not_allow() -> None:
    level = Ladder(np.deg2rad(45), 0.0)
    assert planner.extra_position((Position.deg(0, 0),), level, G) is None


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("--minutes nan", "--minutes nan: give the time"),
        ("--minutes inf", "--minutes inf: give the time"),
        ("--speed 20 --minutes inf", "--minutes inf: give the time"),
        ("--speed 20 --positions -2", "must turn once at least"),
        ("--speed inf", "give a speed above 0"),
        ("--speed 20 --speed-sd nan", "give its ±"),
        ("--sways inf", "a frequency in Hz"),
    ],
)
def test_numbers_that_are_none_are_refused(
    words: str, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", *words.split()]) == 2
    assert says in capsys.readouterr().err


def test_a_joint_that_turns_all_round_has_each_angle_once() -> None:
    around = planner.Ladder(np.pi, np.deg2rad(5.0)).candidates()
    turned = {round(np.cos(p.alpha or 0), 9) + 1j * round(np.sin(p.alpha or 0), 9)
              for p in around}  # fmt: skip
    levels = {p.beta for p in around}
    assert len(around) == len(turned) * len(levels)
    assert len(planner.Ladder(np.deg2rad(170.0)).candidates()) > len(around)


def test_aliases_that_follow_from_the_geometry() -> None:
    """Six faces load each axis with 0 and +-g alone: K2 looks like K+/K-.

    It looks like a scale factor that has drifted between up and down, too.
    """
    six = find_aliases(SIX_FACES, G)
    assert "gravity_error" in six.hidden and "cubic" in six.hidden
    assert dict(six.pairs)["quadratic"] == ("scale_asymmetry", "scale_drift")
    two = find_aliases(TWO_POSITIONS, G)
    assert {"base_tilt", "angle_offset", "quadratic"} <= set(two.hidden)


def test_longer_averaging_ends_at_the_floor() -> None:
    tactical = GRADES["tactical"]
    assert tactical.acc(100) < tactical.acc(10)
    assert tactical.acc(1e9) == pytest.approx(tactical.acc_floor, rel=1e-3)


def test_the_command_writes_a_plan_that_run_takes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from fieldcal.commands import run
    from fieldcal.commands.run_task import make_task

    path = tmp_path / "plan.toml"
    assert main(["plan", "--positions", "4", "-o", str(path), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert len(said["positions"]) == 4 and said["sigma"]["acc_bias.x"] > 0
    parser = argparse.ArgumentParser()
    run.add_arguments(parser)
    task, _ = make_task(parser.parse_args([str(path)]))
    assert len(task.about.positions) == 4 and task.seconds == said["seconds"]
    assert main(["plan", "-o", str(path)]) == 2
    assert main(["plan", "--minutes", "0.5"]) == 2
    assert "allow 1.7 min" in capsys.readouterr().err


def test_a_plan_says_from_when_flicker_wins(
    capsys: pytest.CaptureFixture[str],
) -> None:
    grade = GradeNoise(2e-3, 4e-4, 1e-4, 2e-5)
    assert grade.acc(grade.acc_seconds) == pytest.approx(2**0.5 * grade.acc_floor)
    assert grade.gyr(grade.gyr_seconds) == pytest.approx(2**0.5 * grade.gyr_floor)
    assert main(["plan", "--set", "five", "--noise", "consumer"]) == 0
    out = capsys.readouterr().out
    assert "from 36 s (accelerometers) and 16 s (gyroscopes)" in out
    assert main(["plan", "--set", "five", "--noise", "consumer", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["averaging"]
    assert told == pytest.approx({"acc_best_s": 36.0, "gyr_best_s": 16.0})
