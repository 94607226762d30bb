"""What makes a NO-GO a GO: asked for, held, and then it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomlkit
from session_folders import FACES, recorded, write_session

from fieldcal.acceptance.assessment import assess
from fieldcal.acceptance.remedy import cheapest_remedy
from fieldcal.calibration import Calibration, limits
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS, ladder_settings
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import NoiseFigures, Profile

LIMITS = limits.read("tactical")
QUIET = NoiseFigures(acc_instability=(0, 0, 0), gyr_instability=(0, 0, 0))


def decided(
    folder: Path,
    angles: list[tuple[float, float]],
    bounds: GradeLimits,
    without_gyroscopes: bool = False,
    gyr_read: float = 1.0,
    **said: float,
) -> Calibration:
    """A session of a virtual device in these positions, solved and decided about."""
    positions = [
        {"alpha_deg": a, "beta_deg": b, "start_s": 3 + 20.0 * i, "end_s": 15 + 20.0 * i}
        for i, (a, b) in enumerate(angles)
    ]
    block = recorded(Profile(noise=QUIET), positions)
    if without_gyroscopes:
        block = replace(block, gyr=np.full_like(block.gyr, np.nan))
    block = replace(block, gyr=gyr_read * block.gyr)
    site: dict[str, float] = {"latitude_deg": 50.45, "height_m": 170.0}
    site |= {"angle_setting_deg": 0.05, **said}
    session = Session.open(write_session(folder, block, positions, site=site))
    still = usable_windows(session)
    return assess(solve_session(session, still), session, still, bounds, None)


@pytest.mark.thorough  # as test_adaptive has it of a run that asks for it at once
def test_the_position_that_is_asked_for_makes_it_go(tmp_path: Path) -> None:
    five = [p.degrees or (0.0, 0.0) for p in FIVE_POSITIONS]
    loose = replace(LIMITS, acc_bias_sigma=1.0, acc_scale_sigma=1.0)
    first = decided(tmp_path / "first", five, loose)
    assert first.info["decision"]["go"] and "remedy" not in first.info["decision"]
    worst = float(np.nanmax(first.vector("acc_bias")[1]))
    tight = replace(loose, acc_bias_sigma=0.7 * worst)
    then = decided(tmp_path / "tight", five, tight)
    remedy = then.info["decision"]["remedy"]
    assert not then.info["decision"]["go"] and "then GO is expected" in remedy["says"]
    besides = [(p["alpha_deg"], p["beta_deg"]) for p in remedy["positions"]]
    assert 1 <= len(besides) <= 3 and set(besides) <= set(
        ladder_settings(FIVE_POSITIONS)
    )
    mended = decided(tmp_path / "mended", [*five, *besides], tight)
    assert mended.info["decision"]["go"], mended.info["decision"]["reasons"]


def found_with(names: tuple[str, ...], sigma: list[float]) -> Calibration:
    """A calibration of which only the uncertainties matter."""
    groups = [name.partition(".")[0] for name in names]
    units = tuple(
        {"gyr_bias": "rad/s", "acc_bias": "m/s^2"}.get(g, "1") for g in groups
    )
    return Calibration(
        names=names, values=np.ones(len(names)),
        covariance=np.diag(np.square(sigma)), units=units,
        method="joint", chi2=1.0, dof=1, rms=1.0,
    )  # fmt: skip


def about(tmp_path: Path, angles: list[tuple[float, float]]) -> Session:
    positions = [{"alpha_deg": a, "beta_deg": b} for a, b in angles]
    tmp_path.mkdir(parents=True)
    text = tomlkit.dumps({"format": 1, "position": positions})
    (tmp_path / "session.toml").write_text(text)
    return Session.open(tmp_path)


def test_no_position_is_asked_for_where_a_unit_is_wrong(tmp_path: Path) -> None:
    """Rates in rad/s that are taken for deg/s: one position more cannot help."""
    five = [p.degrees or (0.0, 0.0) for p in FIVE_POSITIONS]
    found = decided(tmp_path / "s", five, LIMITS, gyr_read=float(np.deg2rad(1.0)))
    decision = found.info["decision"]
    assert "record it again with gyr_unit in the device's" in decision["reasons"][0]
    assert found.info["misdescribed"] == ["mounting"] and "remedy" not in decision


def test_gyroscopes_need_time_and_no_turn(tmp_path: Path) -> None:
    five = [p.degrees or (0.0, 0.0) for p in FIVE_POSITIONS]
    names = tuple(f"gyr_bias.{a}" for a in "xyz")
    found = found_with(names, [1e-4, 1e-4, 1.1 * LIMITS.gyr_bias_sigma])
    session = about(tmp_path / "s", five)
    remedy = cheapest_remedy(
        found,
        session.about,
        range(len(session.about.positions)),
        LIMITS,
        ["gyr_bias"],
        1e-3,
        30.0,
    )
    assert remedy is not None and remedy.says.startswith("hold position 5 for ")
    assert remedy.positions == (five[-1],)
    # white noise: 150 s gave 1.1 of the limit, 0.9 of it take 1.49 times as long
    assert remedy.seconds == pytest.approx(150 * ((1.1 / 0.9) ** 2 - 1), abs=5.0)


def test_what_was_left_out_gave_the_gyroscopes_no_time(tmp_path: Path) -> None:
    names = tuple(f"gyr_bias.{a}" for a in "xyz")
    found = found_with(names, [1e-4, 1e-4, 1.1 * LIMITS.gyr_bias_sigma])
    session = about(tmp_path / "s", [p.degrees or (0.0, 0.0) for p in FIVE_POSITIONS])
    args = LIMITS, ["gyr_bias"], 1e-3, 30.0
    remedy = cheapest_remedy(found, session.about, [0, 1, 3], *args)
    assert remedy is not None and remedy.says.startswith("hold position 4 for ")
    assert remedy.positions == (session.about.positions[3].degrees,)
    assert remedy.seconds == pytest.approx(90 * ((1.1 / 0.9) ** 2 - 1), abs=5.0)


def test_what_gyroscopes_feel_of_gravity_no_time_takes_away(tmp_path: Path) -> None:
    """Six faces have none of it in their mean; home alone has all of it."""
    limit = LIMITS.gyr_bias_sigma
    names = tuple(f"gyr_bias.{a}" for a in "xyz")
    felt = 0.8 * limit
    found = found_with(names, [1e-4, 1e-4, 1.1 * limit])
    found = replace(found, info={"g_sensitivity_sigma": felt / 9.81})
    seconds = []
    for angles in ([(0.0, 0.0)] * 6, [(a, 0.0) for a in (0.0, 90.0, 180.0, 270.0)]):
        session = about(tmp_path / str(len(angles)), angles)
        had = range(len(angles))
        remedy = cheapest_remedy(
            found, session.about, had, LIMITS, ["gyr_bias"], 1e-3, 30.0
        )
        assert remedy is not None
        seconds.append(remedy.seconds / 30.0 / len(angles) + 1)
    once = (1.1**2 - 0.8**2) / (0.9**2 - 0.8**2)
    assert seconds[0] == pytest.approx(once, rel=0.02)
    assert seconds[1] == pytest.approx((1.1 / 0.9) ** 2, abs=5 / 120)
    more = replace(found, info={"g_sensitivity_sigma": 0.95 * limit / 9.81})
    session = about(tmp_path / "home", [(0.0, 0.0)] * 6)
    args = range(6), LIMITS, ["gyr_bias"], 1e-3, 30.0
    assert cheapest_remedy(more, session.about, *args) is None


def test_what_two_positions_leave_open_is_asked_for(tmp_path: Path) -> None:
    two = [p.degrees or (0.0, 0.0) for p in TWO_POSITIONS]
    names = tuple(f"acc_{g}.{a}" for g in ("bias", "scale") for a in "xy")
    session = about(tmp_path / "s", two)
    found = found_with(names, [1e-3] * 4)
    remedy = cheapest_remedy(
        found,
        session.about,
        range(len(session.about.positions)),
        LIMITS,
        ["acc_scale"],
        1e-4,
        30.0,
    )
    assert remedy is not None and "not determined yet" in remedy.says
    assert set(remedy.positions) <= set(ladder_settings(TWO_POSITIONS)) - set(two)
    hopeless = replace(LIMITS, acc_scale_sigma=1e-9)
    assert (
        cheapest_remedy(
            found,
            session.about,
            range(2),
            hopeless,
            ["acc_scale"],
            1e-4,
            30.0,
        )
        is None
    )


def turned_thrice(folder: Path, gammas_deg: list[float]) -> Session:
    """Six faces, once for each third angle."""
    positions = [
        {"alpha_deg": alpha, "beta_deg": beta, "gamma_deg": gamma}
        for gamma in gammas_deg
        for alpha, beta in FACES
    ]
    text = tomlkit.dumps({"format": 1, "position": positions})
    (folder / "session.toml").write_text(text)
    return Session.open(folder)


def test_positions_with_a_third_angle_are_no_ladder_to_ask_for(tmp_path: Path) -> None:
    names = tuple(f"acc_{g}.{a}" for g in ("bias", "scale") for a in "xyz")
    session = turned_thrice(tmp_path, [20.0])
    args = range(6), LIMITS, ["acc_scale"], 1e-3, 30.0
    found = found_with(names, [1.0] * 6)
    assert cheapest_remedy(found, session.about, *args) is None


def test_positions_with_a_third_angle_tell_as_much_as_others(tmp_path: Path) -> None:
    """Beside eighteen positions three more do not take a tenth off; beside six, yes."""
    names = tuple(f"acc_{g}.{a}" for g in ("bias", "scale") for a in "xyz")
    session = turned_thrice(tmp_path, [0.0, 90.0, 90.0])
    found = found_with(names, [1.01 * LIMITS.acc_bias_sigma] * 3 + [1e-4] * 3)
    found = replace(found, info={"angle_sigma_deg": 0.05})
    args = LIMITS, ["acc_bias"], 1e-3, 30.0
    assert cheapest_remedy(found, session.about, range(18), *args) is None
    assert cheapest_remedy(found, session.about, range(6), *args) is not None


def test_a_position_that_disagrees_is_taken_again(tmp_path: Path) -> None:
    session = about(tmp_path / "s", [p.degrees or (0.0, 0.0) for p in FIVE_POSITIONS])
    doubtful = {"name": session.positions[2].name, "probability": 0.99}
    info = {"doubtful_position": doubtful, "bad_position": [0.0, 0.0, 0.99, 0.0, 0.0]}
    found = replace(found_with(("acc_bias.x",), [1e-3]), info=info)
    remedy = cheapest_remedy(found, session.about, range(5), LIMITS, [], 1e-3, 30.0)
    assert remedy is not None and remedy.again == (2,)
    assert remedy.says.startswith("take position 3 (α = 22.5°, β = 2.5°) again")


def test_the_window_in_doubt_is_taken_again_not_another_at_its_place(
    tmp_path: Path,
) -> None:
    twice = [(0.0, 0.0), (45.0, 5.0), (-45.0, 5.0), (0.0, 5.0), (45.0, 5.0)]
    session = about(tmp_path / "s", twice)
    name = session.about.positions[4].name
    assert name == session.about.positions[1].name
    info = {"doubtful_position": {"name": name, "probability": 0.99}}
    found = found_with(("acc_bias.x",), [1e-3])
    found = replace(found, info={**info, "bad_position": [0.0, 0.1, 0.0, 0.99]})
    numbers = [0, 1, 3, 4]  # the third was left out
    remedy = cheapest_remedy(found, session.about, numbers, LIMITS, [], 1e-3, 30.0)
    assert remedy is not None and remedy.again == (4,)
    assert remedy.says.startswith(f"take position 5 ({name}) again")


def test_of_two_that_are_as_doubtful_the_named_one_is_taken_again(
    tmp_path: Path,
) -> None:
    """Their probabilities are rounded, so both are 1."""
    session = about(tmp_path / "s", [p.degrees or (0.0, 0.0) for p in FIVE_POSITIONS])
    name = session.positions[3].name
    info = {"doubtful_position": {"name": name, "probability": 1.0}}
    found = found_with(("acc_bias.x",), [1e-3])
    found = replace(found, info={**info, "bad_position": [0.0, 1.0, 0.0, 1.0, 0.0]})
    remedy = cheapest_remedy(found, session.about, range(5), LIMITS, [], 1e-3, 30.0)
    assert remedy is not None and remedy.again == (3,)
    assert remedy.says.startswith(f"take position 4 ({name}) again")


@pytest.mark.parametrize(
    ("failed", "others", "says"),
    [
        (["acc_bias"], [], "then GO is expected"),
        (
            ["acc_bias"],
            ["temperature change"],
            "then temperature change still fails, and has to be mended as well",
        ),
        (
            ["acc_bias", "gyr_bias"],
            ["site"],
            "then site and gyr_bias uncertainty still fail, and have to be mended as",
        ),
        (
            ["gyr_bias"],
            ["link: frames refused"],
            "s more: then link: frames refused still fails, and has to be mended",
        ),
        (
            ["acc_bias"],
            ["fit", "witnesses"],
            "then GO is expected if fit and witnesses pass as well",
        ),
        (["acc_bias"], ["level"], "then GO is expected if level passes as well"),
        (["acc_bias"], ["fit", "site"], "then site still fails, and has to be mended"),
    ],
)
def test_go_is_promised_only_as_far_as_nothing_else_fails(
    failed: list[str], others: list[str], says: str, tmp_path: Path
) -> None:
    five = [p.degrees or (0.0, 0.0) for p in FIVE_POSITIONS]
    names = tuple(f"{g}.{a}" for g in ("acc_bias", "gyr_bias") for a in "xyz")
    sigma = [1e-4, 1e-4, 1.05 * LIMITS.acc_bias_sigma, *[1e-9] * 3]
    sigma[5] = 1.1 * LIMITS.gyr_bias_sigma
    found, session = found_with(names, sigma), about(tmp_path / "s", five)
    remedy = cheapest_remedy(
        found, session.about, range(5), LIMITS, failed, 1e-4, 30.0, others
    )
    assert remedy is not None and says in remedy.says
    promised = "GO is expected (" in remedy.says
    assert promised == (not others)


def test_each_of_several_positions_takes_its_time(tmp_path: Path) -> None:
    five = [p.degrees or (0.0, 0.0) for p in FIVE_POSITIONS]
    session = about(tmp_path / "s", five)
    names = tuple(f"acc_{g}.{a}" for g in ("bias", "scale") for a in "xyz")
    for times, says in ((1.5, "one position more for 30 s, "), (2.5, "30 s each, ")):
        sigma = [1e-4] * 5 + [times * LIMITS.acc_scale_sigma]
        remedy = cheapest_remedy(
            found_with(names, sigma), session.about, range(5), LIMITS,
            ["acc_scale"], 1e-4, 30.0,
        )  # fmt: skip
        assert remedy is not None and says in remedy.says
        assert len(remedy.positions) == 1 + (times > 2)


def test_two_positions_need_a_third_one_elsewhere_to_be_checked(tmp_path: Path) -> None:
    """A wrong angle of the second shows nowhere, until a place is held besides."""
    loose = replace(LIMITS, acc_bias_sigma=1.0, acc_scale_sigma=1.0, gyr_bias_sigma=1.0)
    two = [(0.0, 0.0), (45.0, 5.0)]
    assert decided(tmp_path / "turned", two, loose, level_deg=0.01).info["decision"][
        "go"
    ]
    then = decided(tmp_path / "two", two, loose, True, level_deg=0.01)
    decision = then.info["decision"]
    assert then.dof == 0 and not decision["go"]
    assert [c["name"] for c in decision["checks"] if c["ok"] is False] == ["fit"]
    (place,) = decision["remedy"]["positions"]
    third = (place["alpha_deg"], place["beta_deg"])
    assert third not in two and "then GO is expected" in decision["remedy"]["says"]
    three = decided(tmp_path / "three", [*two, third], loose, True, level_deg=0.01)
    assert three.dof > 0 and three.info["decision"]["go"]
