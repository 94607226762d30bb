"""GO or NO-GO: each reason by itself, and the statistics behind them."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from scipy.spatial.transform import Rotation
from session_folders import CALM, NINE, SITE, places, recorded, write_session

from fieldcal.acceptance import assessment
from fieldcal.acceptance.conditions import check_link
from fieldcal.acceptance.decision import Circumstances, Decision, decide, with_decision
from fieldcal.acceptance.growth import navigation_errors
from fieldcal.acceptance.verification import propose_verification, verify
from fieldcal.calibration import Calibration, limits
from fieldcal.calibration.document import schema
from fieldcal.core.errors import InputError
from fieldcal.core.frames import mounting_matrix
from fieldcal.core.positions import (
    FIVE_POSITIONS,
    TWO_POSITIONS,
    WIDE_POSITIONS,
    Position,
)
from fieldcal.evaluation.prepared_session import PreparedSession
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.history.family import next_run_distribution
from fieldcal.session import description_file
from fieldcal.session.folder import Session
from fieldcal.solve import Observations, solve
from fieldcal.windows import Average

G = 9.81
ABOUT = description_file.parse_description({"site": {"gravity": G}})
BOUNDS = limits.read("tactical")
GROUPS = ("acc_bias", "acc_scale", "gyr_bias")
LINK = {"samples": 10000, "missing": 0, "bad": 0}


def calibration(
    sigma: tuple[float, float, float] = (1e-3, 1e-4, 1e-5), good: bool = True
) -> Calibration:
    units = ("m/s^2", "1", "rad/s")
    return Calibration(
        "joint",
        tuple(f"{g}.{a}" for g in GROUPS for a in "xyz"),
        np.repeat([0.1, 1.0, 0.01], 3),
        np.diag(np.repeat(np.square(sigma), 3)),
        tuple(np.repeat(units, 3).tolist()),
        7.0,
        7,
        1e-3,
        good=good,
        info={"level_sigma_deg": 0.02},
    )


def decided(found: Calibration, **seen: object) -> Decision:
    known: dict[str, object] = {"temperatures": [21.0, 21.5], "link": LINK}
    return decide(found, ABOUT, BOUNDS, Circumstances(**(known | seen)))  # type: ignore[arg-type]


def test_a_sound_calibration_is_go_and_says_what_it_could_not_check() -> None:
    made = decided(calibration())
    assert made.go and not made.reasons
    unknown = [c.name for c in made.checks if c.ok is None]
    assert unknown == ["change", "verification"]
    document = with_decision(calibration(), made).to_json()
    assert document["verdict"] == "good" and document["decision"]["go"]
    Draft202012Validator(schema()).validate(document)
    again = Calibration.from_json(document)
    assert again.info["expectation"][1]["seconds"] == 600.0


def test_a_history_that_could_not_be_read_is_no_lack_of_a_serial_number() -> None:
    about = replace(ABOUT, device={"serial": "A1"})
    for one, why in ((ABOUT, "no serial number"), (about, "the history was not read")):
        made = decide(calibration(), one, BOUNDS, Circumstances([21.0], LINK))
        (change,) = (c for c in made.checks if c.name == "change")
        assert change.ok is None
        assert change.says.startswith(f"no comparison with earlier calibrations: {why}")


@pytest.mark.parametrize(
    ("found", "seen", "says"),
    [
        (calibration(good=False), {}, "the estimate is bad"),
        (calibration((0.03, 1e-4, 1e-5)), {}, "acc_bias x is known to ± 0.03 m/s²"),
        (calibration((1e-3, 1e-2, 1e-5)), {}, "acc_scale x is known to ± 0.01"),
        (calibration((1e-3, 1e-4, 1e-3)), {}, "gyr_bias x is known to ± 0.001 rad/s"),
        (calibration(), {"temperatures": [70.0]}, "70.0 to 70.0 °C"),
        (calibration(), {"temperatures": [20, 26.5]}, "let the device warm up"),
        (calibration(), {"link": {**LINK, "missing": 50}}, "50 of 10050 samples"),
        (calibration(), {"link": {**LINK, "bad": 50}}, "50 of 10050 frames refused"),
        (calibration(), {"doubts": ["position 3 was insisted on"]}, "insisted on"),
    ],
)
def test_every_reason_by_itself_makes_it_no_go(
    found: Calibration, seen: dict[str, object], says: str
) -> None:
    made = decided(found, **seen)
    assert not made.go and len(made.reasons) == 1 and says in made.reasons[0]


def test_a_fit_that_disagrees_with_itself_is_no_go() -> None:
    found = calibration()
    odd = Calibration.from_json({**found.to_json(), "fit": {"chi2": 60.0, "dof": 7,
                                 "rms": 1e-3, "unit": "m/s^2"}})  # fmt: skip
    assert "do not agree" in decided(odd).reasons[0]


@pytest.mark.parametrize(
    ("chi2", "scatter", "go"),
    [(269.0, 6e-5, False), (269.0, 1.4e-5, True), (9.0, 6e-5, True)],
)
def test_gyroscopes_that_disagree_are_no_go_where_it_matters(
    chi2: float, scatter: float, go: bool
) -> None:
    """A tenth of the 1.5e-4 rad/s that a bias is allowed does not."""
    seen = {"chi2": chi2, "dof": 7, "unit": "rad/s", "extra_scatter": scatter}
    found = calibration()
    made = decided(replace(found, info={**found.info, "gyroscopes": seen}))
    assert made.go is go
    if not go:
        (reason,) = made.reasons
        assert "the gyroscopes at rest do not agree" in reason and "269.0" in reason


def test_a_required_group_that_is_missing_is_no_go_unless_its_sensor_is_not_read() -> (
    None
):
    whole = calibration()
    without_scale = _only(whole, ("acc_bias", "gyr_bias"))
    assert "acc_scale x y z was not determined" in decided(without_scale).reasons[0]
    alone = _only(whole, ("acc_bias", "acc_scale"))
    assert decided(alone).go
    # gyroscopes that were there, and gave nothing, are no sensor that is not read
    windows = [_held(position, np.random.default_rng(1)) for position in FIVE_POSITIONS]
    made = _on_the_ladder(alone, windows)
    assert not made.go and "gyr_bias x y z was not determined" in made.reasons[0]
    without = [replace(w, mean=np.r_[w.mean[:3], [np.nan] * 3]) for w in windows]
    assert _on_the_ladder(alone, without).go


def _on_the_ladder(found: Calibration, windows: list[Average]) -> Decision:
    known = Circumstances(temperatures=[21.0, 21.5], link=LINK, windows=windows)
    return decide(found, replace(ABOUT, positions=FIVE_POSITIONS), BOUNDS, known)


def test_a_tilt_that_nobody_saw_and_nobody_excluded_is_no_go() -> None:
    whole = calibration()
    unsaid = decided(replace(whole, info={}))
    assert not unsaid.go and len(unsaid.reasons) == 1
    assert "how level the base is" in unsaid.reasons[0]
    assert "--level" in unsaid.reasons[0] and "0.17 m/s²" in unsaid.reasons[0]
    said = [check for check in decided(whole).checks if check.name == "level"]
    assert [check.ok for check in said] == [True] and "± 0.02°" in said[0].says
    seen = replace(whole, info={}, method="scalar")
    assert decided(seen).go, "the norm of the force knows of no tilt"
    rng = np.random.default_rng(1)
    windows = [_held(p, rng) for p in FIVE_POSITIONS]
    found = solve(Observations.of(FIVE_POSITIONS, windows, G))
    assert {"base_tilt", "angle_offset"} & set(found.groups)
    assert "level" not in [check.name for check in decided(found).checks]
    beside = replace(found, info={**found.info, "beside_tilt_sigma_deg": 0.05})
    (told,) = [check for check in decided(beside).checks if check.name == "level"]
    assert told.ok is None, "it is relied on, and no reason for NO-GO"
    other = "tilt of the base" if "angle_offset" in found.groups else "offsets of the"
    assert other in told.says and "0 ± 0.05°" in told.says


def test_a_position_that_does_not_fit_is_told_beside_the_decision() -> None:
    rng = np.random.default_rng(2)
    windows = [_held(p, rng) for p in FIVE_POSITIONS]
    windows[1] = _held(Position.deg(22.0, 0.4), rng)
    made = decided(solve(Observations.of(FIVE_POSITIONS, windows, G)))
    told = [check for check in made.checks if check.name == "positions"]
    assert [check.ok for check in told] == [None]
    assert told[0].says.startswith("the position α = 22.5°, β = 0°")


def _only(found: Calibration, groups: tuple[str, ...]) -> Calibration:
    rows = [i for i, n in enumerate(found.names) if n.startswith(groups)]
    return Calibration(
        "joint",
        tuple(found.names[i] for i in rows),
        found.values[rows],
        found.covariance[np.ix_(rows, rows)],
        tuple(found.units[i] for i in rows),
        7.0,
        7,
        1e-3,
        info=found.info,
    )


def _shifted(found: Calibration, by: float) -> Calibration:
    values = found.values.copy()
    values[0] += by
    return replace(found, values=values)


def test_a_change_is_judged_by_the_history_of_the_device() -> None:
    found, rng = calibration(), np.random.default_rng(1)
    quiet = [_shifted(found, 1e-3 * rng.standard_normal()) for _ in range(30)]
    wild = [_shifted(found, 0.3 * rng.standard_normal()) for _ in range(30)]
    moved = _shifted(found, 0.2)
    assert decided(moved, family=[]).go
    assert decided(found, family=quiet).go
    assert "acc_bias x differs from 30" in decided(moved, family=quiet).reasons[0]
    assert decided(moved, family=wild).go, "this device has always done that"


@pytest.mark.parametrize("runs", [1, 2, 5, 20])
def test_false_alarms_are_as_rare_as_said(runs: int) -> None:
    rng, usual, sigma = np.random.default_rng(runs), 0.05, 0.02
    tries = 3000
    spread = rng.normal(0.0, usual, (tries, runs + 1))
    seen = spread + rng.normal(0.0, sigma, spread.shape)
    sigmas = np.full(runs, sigma)
    chances = [
        next_run_distribution(x[:-1], sigmas, usual).chance(x[-1], sigma) for x in seen
    ]
    assert np.mean(np.array(chances) < 0.01) < 0.016
    assert np.mean(np.array(chances) < 0.5) > 0.3, "nor is everything expected"


def test_many_runs_make_the_usual_spread_forgotten() -> None:
    rng = np.random.default_rng(3)
    values = rng.normal(1.0, 0.5, 200)
    found = next_run_distribution(values, np.full(200, 0.01), 0.001)
    assert found.spread == pytest.approx(0.5, rel=0.15)
    assert found.mean == pytest.approx(values.mean(), abs=1e-3)


@pytest.mark.parametrize("axes", [("+x", "+y", "+z"), ("+x", "-z", "+y")])
def test_the_growth_of_errors_is_that_of_a_navigator(axes: tuple[str, ...]) -> None:
    """A strapdown navigator run many times with errors drawn from the covariance."""
    rng, n, t, steps = np.random.default_rng(5), 1500, 60.0, 120
    sigma = np.array([2e-3, 5e-3, 9e-3, 1e-3, 5e-4, 2e-3, 3e-5, 6e-5, 1e-5])
    found = calibration()
    mixing = np.eye(9)
    mixing[4, 1], mixing[5, 2] = 0.5, -0.3  # bias and scale go together
    root = np.diag(sigma) @ mixing
    found = Calibration(
        "joint", found.names, found.values, root @ root.T, found.units, 1.0, 1, 0.0
    )
    p = mounting_matrix(axes)
    drawn = (root @ rng.standard_normal((9, n))).T
    bias, scale, rate = drawn[:, :3], drawn[:, 3:6], drawn[:, 6:]
    up = np.array([0.0, -G, 0.0])
    f = (bias + scale * (up @ p)) @ p.T + up
    levelled = (root @ rng.standard_normal((9, n))).T[:, :3] @ p.T
    tilt0 = np.column_stack([-levelled[:, 2], 0 * levelled[:, 1], levelled[:, 0]]) / G
    w = rate @ p.T
    velocity = np.zeros((n, 3))
    for k in range(steps):
        now = (k + 0.5) * t / steps
        attitude = Rotation.from_rotvec(tilt0) * Rotation.from_rotvec(w * now)
        velocity += (attitude.apply(f) - up) * t / steps
    end = (Rotation.from_rotvec(tilt0) * Rotation.from_rotvec(w * t)).as_rotvec()
    told = navigation_errors(found, G, p, t)
    assert told.level == pytest.approx(velocity[:, [0, 2]].std(axis=0).max(), rel=0.07)
    assert told.vertical == pytest.approx(velocity[:, 1].std(), rel=0.07)
    assert told.tilt == pytest.approx(end[:, [0, 2]].std(axis=0).max(), rel=0.07)
    assert told.heading == pytest.approx(end[:, 1].std(), rel=0.07)


def test_growth_is_not_told_of_what_was_not_determined() -> None:
    told = navigation_errors(
        _only(calibration(), ("acc_bias",)), G, np.eye(3), 60.0
    ).to_json()
    assert told["heading_sigma_deg"] is None and told["tilt_sigma_deg"] is None
    assert told["vertical_velocity_sigma_m_s"] is not None


def _held(position: Position, rng: np.random.Generator, cross: float = 0.0) -> Average:
    """A window of a device on a tilted base, worked out by other means than ours."""
    alpha, beta = np.deg2rad(position.degrees or (0.0, 0.0))
    base = Rotation.from_euler("x", np.deg2rad(-1)) * Rotation.from_euler(
        "z", np.deg2rad(0.7)
    )
    body = Rotation.from_euler("x", -beta) * Rotation.from_euler("z", -alpha) * base
    f = body.apply([0.0, -G, 0.0])
    f = np.array([0.2, -0.3, 0.1]) + np.array([1.004, 0.996, 1.007]) * f
    f[0] += cross * G
    covariance = np.diag([4e-7] * 3 + [1e-9] * 3)
    mean = np.concatenate([f, [0.01, -0.02, 0.006]])
    mean += rng.multivariate_normal(np.zeros(6), covariance)
    return Average(mean, covariance, 21.0, 3000, 0.0, 30.0)


@pytest.mark.thorough
@pytest.mark.parametrize("runs", [50, pytest.param(150, marks=pytest.mark.thorough)])
def test_a_position_not_fitted_is_predicted_within_its_uncertainty(runs: int) -> None:
    rng, position, chances = (
        np.random.default_rng(8),
        propose_verification(FIVE_POSITIONS),
        [],
    )
    for _ in range(runs):
        windows = [_held(p, rng) for p in FIVE_POSITIONS]
        found = solve(Observations.of(FIVE_POSITIONS, windows, G))
        chances.append(verify(found, ABOUT, position, _held(position, rng)).chance)
    assert 0.01 < np.mean(np.array(chances) < 0.05) < 0.12
    assert np.mean(chances) == pytest.approx(0.5, abs=0.1)


def test_a_position_that_is_off_is_no_go() -> None:
    rng, position = np.random.default_rng(9), propose_verification(FIVE_POSITIONS)
    found = solve(
        Observations.of(FIVE_POSITIONS, [_held(p, rng) for p in FIVE_POSITIONS], G)
    )
    seen = verify(found, ABOUT, position, _held(position, rng, cross=0.02))
    assert seen.residual_size == pytest.approx(0.2, abs=0.05)
    made = decide(found, ABOUT, BOUNDS, Circumstances([21.0], LINK, seen))
    reason = next(r for r in made.reasons if "not fitted" in r)
    assert position.name in reason and "does not explain" in reason


@pytest.mark.parametrize("positions", [TWO_POSITIONS, FIVE_POSITIONS, WIDE_POSITIONS])
def test_the_verification_position_is_within_the_ladder_and_new(
    positions: tuple[Position, ...],
) -> None:
    found = propose_verification(positions).degrees
    assert found is not None and found not in [p.degrees for p in positions]
    known = np.array([p.degrees for p in positions])
    assert (known.min(axis=0) <= found).all() and (found <= known.max(axis=0)).all()


def test_limits_of_a_file_go_over_the_defaults(tmp_path: Path) -> None:
    path = tmp_path / "limits.toml"
    path.write_text("[tactical]\nacc_bias_sigma = 0.5\n")
    mine = limits.read("tactical", path)
    assert mine.acc_bias_sigma == 0.5
    assert mine.gyr_bias_sigma == BOUNDS.gyr_bias_sigma
    assert limits.read("navigation", path).acc_bias_sigma < 0.5


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "[tactical]\nacc_bias = 1\n",
            "acc_bias is no limit; there are acc_bias_sigma",
        ),
        ("[tactical]\nacc_bias_sigma = -1\n", "must be a number above 0"),
        ("[tactical]\nacc_bias_sigma = 'x'\n", "must be a number above 0"),
        ("[tactical]\nacc_bias_sigma = true\n", "must be a number above 0"),
        ("[tactical]\ntemperature_min_c = 90.0\n", "must be below temperature_max_c"),
        ("[lunar]\n", "[lunar] is no grade"),
        ("tactical = 3\n", "write [tactical]"),
        ("x = [", "is no file of limits"),
    ],
)
def test_a_wrong_file_of_limits_names_file_key_and_remedy(
    tmp_path: Path, text: str, says: str
) -> None:
    path = tmp_path / "limits.toml"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        limits.read("tactical", path)
    assert says in str(error.value) and "limits.toml" in str(error.value)


@pytest.mark.parametrize("sigma", [1e-3, 7e-3, 5e-2])
def test_a_gyroscopes_scale_that_is_loosely_known_is_not_worse_than_none(
    sigma: float,
) -> None:
    found = calibration()
    covariance = np.diag([*found.sigma**2, *[sigma**2] * 3])
    more = replace(
        found,
        names=(*found.names, *(f"gyr_scale.{a}" for a in "xyz")),
        values=np.append(found.values, np.ones(3)),
        covariance=covariance,
        units=(*found.units, "1", "1", "1"),
    )
    made = decided(more)
    check = next(c for c in made.checks if c.name == "gyr_scale uncertainty")
    assert made.go and check.ok is (True if sigma < 5e-3 else None)
    assert ("counts as not determined" in check.says) is (sigma > 5e-3)


def test_gravity_that_nobody_said_is_no_go_and_one_that_was_is_not() -> None:
    known = {"temperatures": [21.0], "link": LINK}
    seen = Circumstances(**known)  # type: ignore[arg-type]
    unsaid = decide(calibration(), description_file.parse_description({}), BOUNDS, seen)
    assert not unsaid.go and len(unsaid.reasons) == 1
    assert "--latitude" in unsaid.reasons[0] and "9.780 m/s²" in unsaid.reasons[0]
    for site in ({"latitude_deg": 0.0}, {"gravity": G}):
        about = description_file.parse_description({"site": site})
        assert decide(calibration(), about, BOUNDS, seen).go
    gyroscopes = _only(calibration(), ("gyr_bias",))
    made = decide(gyroscopes, description_file.parse_description({}), BOUNDS, seen)
    assert "site" not in [check.name for check in made.checks]


@pytest.mark.parametrize(
    ("held", "method", "go"),
    [(6, "joint", True), (5, "joint", True), (4, "joint", False),
     (12, "scalar", True), (11, "scalar", False)],
)  # fmt: skip
def test_a_position_left_out_is_go_only_with_witnesses(
    held: int, method: str, go: bool
) -> None:
    """Six parameters take two windows with angles, or six lengths of the force."""
    chances = [0.0] * (held - 1) + [0.999]
    found = replace(
        calibration(),
        method=method,  # type: ignore[arg-type]
        info={**calibration().info, "bad_position": chances},
    )
    if method == "scalar":
        found = replace(found, info={**found.info, "bad_position": [*chances, 0.0]})
    made = decided(found)
    assert made.go == go
    said = [check.says for check in made.checks if check.name == "witnesses"]
    assert len(said) == 1 and "1 position disagreed" in said[0]
    assert ("--verify" in said[0]) == (not go)


def test_a_position_that_was_not_fitted_is_a_witness() -> None:
    chances = [0.0, 0.0, 0.0, 0.999]
    found = calibration()
    found = replace(found, info={**found.info, "bad_position": chances})
    assert "witnesses" in [c.name for c in decided(found).checks if c.ok is False]
    about = description_file.parse_description({"site": {"gravity": G}})
    held = Position.deg(30, 0)
    truth = 0.1 + np.array([-G * np.sin(np.pi / 6), -G * np.cos(np.pi / 6), 0.0])
    mean = np.concatenate([truth, np.full(3, 0.01)])
    window = Average(mean, np.eye(6) * 1e-8, 21.0, 3000, 0.0, 30.0)
    agrees = verify(found, about, held, window)
    assert decided(found, verification=agrees).go


def test_frames_are_those_of_the_whole_run() -> None:
    """They may have been refused anywhere, and windows are a part of it."""
    seen = {**LINK, "bad": 9}
    share = BOUNDS.bad_share
    assert 9 / 10009 > 0.5 * share > 9 / 90009
    (check,) = (
        c
        for c in decided(calibration(), link={**seen, "taken": 90000}).checks
        if c.name == "link: frames refused"
    )
    assert check.value == pytest.approx(9 / 90009) and "9 of 90009" in check.says


@pytest.mark.parametrize("missing", ["residual", "sigma"])
def test_a_verification_that_was_not_measured_verifies_nothing(missing: str) -> None:
    about = description_file.parse_description({"site": {"gravity": G}})
    mean = np.concatenate([[0.1, 0.1 - G, 0.1], np.full(3, 0.01)])
    cov = np.eye(6) * 1e-8
    if missing == "residual":
        mean[2] = np.nan
    else:
        cov[2, 2] = np.nan
    window = Average(mean, cov, 21.0, 3000, 0.0, 30.0)
    seen = verify(calibration(), about, Position.deg(0, 0), window)
    made = decided(calibration(), verification=seen)
    (said,) = made.reasons
    assert not made.go and "could not be measured" in said


def test_missing_samples_that_the_times_cannot_show_are_not_counted() -> None:
    """Nor is it said that there are none."""
    uneven = {k: v for k, v in LINK.items() if k != "missing"}
    (lost, refused) = check_link(uneven, BOUNDS)
    assert lost.ok is None and "too uneven" in lost.says and refused.ok
    assert [c.ok for c in check_link({**LINK, "missing": 50}, BOUNDS)] == [False, True]


LAST = {"alpha_deg": NINE[5][0], "beta_deg": NINE[5][1]}


@pytest.fixture(scope="module")
def five_held_of_six(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[Path, Calibration]:
    """A session of five positions, in which a sixth was held to verify, solved."""
    folder, held = tmp_path_factory.mktemp("six") / "s", places(NINE[:6], 10.0, 5.0)
    block = recorded(CALM, held)
    write_session(folder, block, held[:5], site=SITE, verification=LAST)
    session = Session.open(folder)
    windows = usable_windows(session)
    return folder, solve(PreparedSession(session, windows).observations)


@pytest.mark.parametrize(
    ("spans", "says", "ok"),
    [
        ([(0.0, 30.0)], "differ from the prediction", True),
        ([(0.0, 0.001)], "could not be measured (", False),
        pytest.param(
            [(0.0, 0.001), (0.0, 30.0)],
            *("differ from the prediction", True),
            marks=pytest.mark.thorough,
        ),
        ([(0.0, 30.0), None], "no verification position was recorded", None),
    ],
)
def test_a_verification_window_without_samples_is_told_from_none(
    spans: list[tuple[float, float] | None],
    says: str,
    ok: bool | None,
    five_held_of_six: tuple[Path, Calibration],
    tmp_path: Path,
) -> None:
    """It was asked for, so that it is missing is NO-GO; a discarded one is none."""
    solved, found = five_held_of_six
    shutil.copytree(solved, tmp_path / "s")
    start, lines = places(NINE[:6], 10.0, 5.0)[5]["start_s"], []
    for span in spans:
        mark: dict[str, object] = {"event": "repeated", "position": 5}
        if span is not None:
            ends = {"start_s": start + span[0], "end_s": start + span[1]}
            mark = {"event": "window", "position": 5, **ends}
        lines.append(json.dumps(mark) + "\n")
    (tmp_path / "s" / "marks.jsonl").write_text("".join(lines))
    session = Session.open(tmp_path / "s")
    windows = usable_windows(session)
    made = assessment.assess(found, session, windows, limits.read("tactical"), None)
    checks = made.info["decision"]["checks"]
    (check,) = [c for c in checks if c["name"] == "verification"]
    assert says in check["says"] and check["ok"] is ok


@pytest.mark.parametrize(("stated", "expected"), [(0.2, 0.2), (None, 0.05)])
def test_a_verification_is_set_as_well_as_the_session_says(
    stated: float | None,
    expected: float,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The angle setting of the grade holds only where none is stated."""
    asked: list[float] = []
    monkeypatch.setattr(
        assessment, "verify", lambda *args: asked.append(np.rad2deg(args[-1]))
    )
    held = places(NINE[:6])
    site = dict(SITE) if stated is None else {**SITE, "angle_setting_deg": stated}
    block = recorded(CALM, held)
    write_session(tmp_path / "s", block, held[:5], site=site, verification=LAST)
    span = {key: held[5][key] for key in ("start_s", "end_s")}
    mark = {"event": "window", "position": 5, **span}
    (tmp_path / "s" / "marks.jsonl").write_text(json.dumps(mark) + "\n")
    session = Session.open(tmp_path / "s")
    windows = usable_windows(session)
    found = calibration()
    bounds = limits.read("tactical")
    assert bounds.angle_setting_deg == 0.05
    assessment.assess(found, session, windows, bounds, None)
    assert asked == pytest.approx([expected])


@pytest.mark.parametrize(
    ("scatter", "doubt", "go"),
    [(3.4e-5, 0.0, True), (1.9e-3, 0.0, True), (2.1e-3, 0.0, False),
     (3.4e-5, 0.5, False), (0.0, 0.0, False), (None, 0.0, False)],
)  # fmt: skip
def test_a_misfit_counts_by_what_it_does_to_the_navigator(
    scatter: float | None, doubt: float, go: bool
) -> None:
    found = replace(calibration(), chi2=57.0, dof=22)
    more = {"extra_scatter": scatter, "bad_position": [0.0, doubt]}
    made = decided(replace(found, info={**found.info, **more}))
    fit = next(check for check in made.checks if check.name == "fit")
    assert (fit.ok, made.go) == (go, go)
    assert (
        "57.0 with 22" in fit.says and ("not matter for navigation" in fit.says) == go
    )


def test_where_all_positions_have_a_third_angle_home_verifies_them() -> None:
    three = [Position.deg(a, 10.0, gamma=c) for a, c in ((0, 90), (30, -90))]
    assert propose_verification(three) == Position.deg(0.0, 0.0)


def test_as_many_parameters_as_means_are_no_go_without_a_witness() -> None:
    """Any mistake has an exact solution then: chi2 is 0, however large it is."""
    exact = replace(calibration(), chi2=0.0, dof=0)
    made = decided(exact)
    assert [c.name for c in made.checks if c.ok is False] == ["fit"]
    assert "one position more" in made.reasons[0] and "--verify" in made.reasons[0]
    held = Position.deg(30, 0)
    truth = 0.1 + np.array([-G * np.sin(np.pi / 6), -G * np.cos(np.pi / 6), 0.0])
    window = Average(np.r_[truth, [0.01] * 3], np.eye(6) * 1e-8, 21.0, 3000, 0.0, 30.0)
    about = description_file.parse_description({"site": {"gravity": G}})
    assert decided(exact, verification=verify(exact, about, held, window)).go
    earlier = [_shifted(exact, 1e-4 * k) for k in range(5)]
    assert decided(exact, family=earlier).go
    assert not decided(_shifted(exact, 0.2), family=earlier).go
    assert not decided(exact, family=[]).go, "the first of a device has no witness"
    for dof, go in ((2, True), (0, False)):
        turns = {"chi2": 1.5, "dof": dof, "scatter_rad": 0.0}
        seen = decided(replace(exact, info={**exact.info, "turns": turns}))
        assert seen.go is go
        said = [c.says for c in seen.checks if c.name == "fit"]
        assert (
            "only the turns that the gyroscopes measured confirm it" in said[0]
        ) == go
