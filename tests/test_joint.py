"""The joint estimate against its bound, its statements against many seeds."""

import doctest
import subprocess
import sys
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from observed import BIAS, COUPLING, SCALE, G, observe, outputs, practice
from test_closed_form import MOUNTINGS, SPREAD_OUT, TILTED

import fieldcal
from fieldcal.errors import InputError, NotObservable
from fieldcal.positions import FIVE, SIX_FACES, TWO, WIDE, Position
from fieldcal.samples import Array
from fieldcal.solve import Observations, choose, scatter, solve
from fieldcal.solve.design import Model, design, predict
from fieldcal.solve.joint import Solution, estimate, joint
from fieldcal.solve.tilt import Tilt
from fieldcal.windows import Average

SIGMA = 1e-3
SIX = tuple(
    Position.deg(a, b)
    for a, b in [(-45, -5), (-45, 5), (0, 0), (45, -5), (45, 5), (0, 5)]
)
NINE = (*SIX, Position.deg(-22, 0), Position.deg(22, 3), Position.deg(0, -5))
OFF = np.array([COUPLING[i, j] for i in range(3) for j in range(3) if i != j])


def put_in(model: Model) -> Array:
    tilt = list(TILTED[model.tilt].values())[0] if model.tilt != "none" else ()
    return np.array([*BIAS, *SCALE, *(OFF if model.cross else ()), *tilt])


def means(model: Model, places: tuple[Position, ...]) -> Array:
    tilt = TILTED.get(model.tilt, {})
    coupling: Array | None = COUPLING if model.cross else None
    return outputs(places, coupling=coupling, **tilt)  # type: ignore[arg-type]


def run(
    model: Model, places: tuple[Position, ...], seed: int,
    disturb: Callable[[np.random.Generator, Array], Array] | None = None,
    seeds: int = 2500,
) -> tuple[Solution, Array]:  # fmt: skip
    """Many data sets at once; the solution and its errors."""
    rng = np.random.default_rng(seed)
    noisy = SIGMA * rng.standard_normal((seeds, len(places), 3))
    y: Array = means(model, places) + noisy
    if disturb:
        y = disturb(rng, y)
    noise: Array = np.tile(SIGMA**2 * np.eye(3), (len(places), 1, 1))
    solution = estimate(model, places, G, y, noise)
    return solution, solution.x - put_in(model)


def bound(model: Model, places: tuple[Position, ...]) -> Array:
    """Cramer-Rao bound by differences of the independent outputs."""
    rows = design(model, places, G, x=put_in(model)).reshape(-1, len(model.names))
    return SIGMA * np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))


@pytest.mark.parametrize("tilt", ["none", "angle_offset", "base_tilt"])
@pytest.mark.parametrize("cross", [False, True])
@pytest.mark.parametrize("mounting", MOUNTINGS[::5])
def test_design_is_the_derivative_and_agrees_with_turned_devices(
    tilt: Tilt, cross: bool, mounting: Array
) -> None:
    model = Model(tilt, cross)
    x = put_in(model)
    u, slope = predict(model, SPREAD_OUT, G, mounting, x)
    seen = outputs(
        SPREAD_OUT, mounting=mounting, coupling=COUPLING if cross else None,
        **TILTED.get(tilt, {}),  # type: ignore[arg-type]
    )  # fmt: skip
    np.testing.assert_allclose(u, seen, atol=1e-12)
    for k in range(len(x)):
        step = np.eye(len(x))[k] * 1e-6
        up, _ = predict(model, SPREAD_OUT, G, mounting, x + step)
        down, _ = predict(model, SPREAD_OUT, G, mounting, x - step)
        np.testing.assert_allclose(slope[..., k], (up - down) / 2e-6, atol=1e-8)


CASES = [
    (Model(), TWO),
    (Model("angle_offset"), FIVE),
    (Model("angle_offset"), WIDE),
    (Model("base_tilt"), WIDE),
    (Model("base_tilt"), NINE),
    (Model(cross=True), SIX_FACES),
]


@pytest.mark.parametrize(("model", "places"), CASES)
def test_it_reaches_its_bound_and_says_how_well(
    model: Model, places: tuple[Position, ...]
) -> None:
    solution, error = run(model, places, 1)
    sigma = np.sqrt(np.diagonal(solution.covariance, axis1=-2, axis2=-1))
    rmse = np.sqrt((error**2).mean(axis=0))
    assert (rmse < 1.06 * bound(model, places)).all()
    pulls = error / sigma
    np.testing.assert_allclose(pulls.std(axis=0), 1, atol=0.05)
    np.testing.assert_allclose(pulls.mean(axis=0), 0, atol=0.08)
    inside = (np.abs(pulls) < 1.96).mean(axis=0)
    assert (inside > 0.935).all() and (inside < 0.965).all()
    if solution.fit.dof:
        ratio = (solution.chi2 / solution.dof).mean()
        assert ratio == pytest.approx(1, abs=0.03)


def bumped(size: float) -> Callable[[np.random.Generator, Array], Array]:
    def disturb(rng: np.random.Generator, y: Array) -> Array:
        push = rng.standard_normal((len(y), 3))
        push *= size * SIGMA / np.linalg.norm(push, axis=1, keepdims=True)
        y = y.copy()
        y[np.arange(len(y)), np.arange(len(y)) % y.shape[1]] += push
        return y

    return disturb


@pytest.mark.parametrize("places", [SIX, NINE])
@pytest.mark.parametrize("size", [3.0, 5.0, 10.0, 100.0, 3000.0])
def test_one_bad_position_is_doubted_and_never_spoils_the_interval(
    places: tuple[Position, ...], size: float
) -> None:
    seeds = 1500 if size < 100 else 300
    solution, error = run(Model("angle_offset"), places, 2, bumped(size), seeds)
    sigma = np.sqrt(np.diagonal(solution.covariance, axis1=-2, axis2=-1))
    pulls = error / sigma
    assert (np.sqrt((pulls**2).mean(axis=0)) < 1.5).all()
    assert np.quantile(np.abs(pulls), 0.95) < 1.5 * 1.96
    if size >= 10:
        guilty = np.arange(seeds) % len(places)
        found = solution.bad[np.arange(seeds), guilty] > 0.5
        assert found.mean() > 0.95
    if size >= 100:
        np.testing.assert_allclose(pulls.std(axis=0), 1, atol=0.15)


def test_good_positions_are_not_doubted() -> None:
    solution, _ = run(Model("angle_offset"), NINE, 3)
    assert (solution.bad.max(axis=1) > 0.5).mean() < 0.002


def test_three_positions_cannot_say_which_one_is_bad() -> None:
    places = (Position.deg(0, 0), Position.deg(40, 5), Position.deg(-40, -5))
    solution, _ = run(Model(), places, 4, bumped(30.0))
    assert (solution.bad.max(axis=1) > 0.99).mean() < 0.05


@given(st.sampled_from(MOUNTINGS), st.sampled_from(["angle_offset", "base_tilt"]))
def test_any_mounting(mounting: Array, tilt: Tilt) -> None:
    u = outputs(SPREAD_OUT, mounting=mounting, **TILTED[tilt])  # type: ignore[arg-type]
    found = joint(observe(SPREAD_OUT, u, mounting=mounting), Model(tilt))
    np.testing.assert_allclose(found.values, put_in(Model(tilt)), atol=1e-7)


def test_auto_takes_the_model_of_the_tilt_that_fits() -> None:
    for tilt, name in [("angle_offset", "base_tilt"), ("base_tilt", "angle_offset")]:
        u = outputs(NINE, **TILTED[tilt])  # type: ignore[arg-type, index]
        result = solve(observe(NINE, u))
        assert tilt in result.groups and name not in result.groups
        assert any(f"{name} fits worse" in w for w in result.warnings)


def test_where_the_models_of_the_tilt_cannot_be_told_apart_both_are_covered() -> None:
    rng = np.random.default_rng(7)
    pulls = []
    for k in range(150):
        small = (0.05 * rng.standard_normal(2)).tolist()
        tilt = {"base_deg": small} if k % 2 else {"offset_deg": small}
        u = outputs(FIVE, **tilt)
        u = u + SIGMA * rng.standard_normal((5, 3))
        result = solve(observe(FIVE, u))
        pulls.append((result.values[:6] - [*BIAS, *SCALE]) / result.sigma[:6])
    assert (np.sqrt((np.array(pulls) ** 2).mean(axis=0)) < 1.2).all()


def test_a_base_known_to_be_nearly_level_helps() -> None:
    rng = np.random.default_rng(11)
    places = (Position.deg(0, 0), Position.deg(45, 5), Position.deg(20, -5))
    pulls = []
    for _ in range(200):
        base = 0.3 * rng.standard_normal(2)
        u = outputs(places, base_deg=base.tolist())
        u = u + SIGMA * rng.standard_normal(u.shape)
        result = solve(observe(places, u), level_sigma_deg=0.3)
        truth = [*BIAS, *SCALE]
        pulls.append((result.values[:6] - truth) / result.sigma[:6])
    np.testing.assert_allclose(np.std(pulls, axis=0), 1, atol=0.17)


def test_angles_that_are_loosely_set_are_in_the_uncertainty() -> None:
    rng = np.random.default_rng(12)
    pulls, chi2 = [], []
    for _ in range(150):
        f = (outputs(NINE) - BIAS) / SCALE
        f += np.cross(np.deg2rad(0.1) * rng.standard_normal((9, 3)), f)
        u = BIAS + SCALE * f + SIGMA * rng.standard_normal((9, 3))
        result = solve(observe(NINE, u), tilt="none", angle_sigma_deg=0.1)
        pulls.append((result.values[:6] - [*BIAS, *SCALE]) / result.sigma[:6])
        chi2.append(result.chi2 / result.dof)
    np.testing.assert_allclose(np.std(pulls, axis=0), 1, atol=0.2)
    assert np.mean(chi2) == pytest.approx(1, abs=0.1)


def test_positions_that_do_not_show_the_tilt_say_so() -> None:
    places = (Position.deg(0, 0), Position.deg(45, 5), Position.deg(45, 5))
    result = solve(observe(places, outputs(places)))
    assert result.groups == ("acc_bias", "acc_scale")
    assert any("taken as level; add" in w for w in result.warnings)
    with pytest.raises(NotObservable, match="add α"):
        joint(observe(TWO, outputs(TWO)), Model("angle_offset"))


def test_an_effect_left_out_makes_the_verdict_bad() -> None:
    u = outputs(NINE, coupling=COUPLING) + SIGMA * np.random.default_rng(
        1
    ).standard_normal((9, 3))
    result = solve(observe(NINE, u))
    assert not result.good
    assert any("beyond their windows' noise" in w for w in result.warnings)
    assert solve(observe(NINE, u), cross=True).good


def test_positions_without_angles_among_others_are_not_used_and_named() -> None:
    u = outputs(NINE)
    places = (*NINE, Position("somewhere"))
    seen = observe(places, np.vstack([u, u[0] + 1.0]))
    result = solve(seen, tilt="none")
    assert result.method == "joint"
    np.testing.assert_allclose(result.vector("acc_bias")[0], BIAS, atol=1e-9)
    assert any("1 of 10 positions have no angles" in w for w in result.warnings)


def test_what_is_no_method_is_refused() -> None:
    seen = observe(TWO, outputs(TWO))
    with pytest.raises(InputError, match="methods are"):
        solve(seen, method="guess")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="0 to 90°"):
        solve(seen, level_sigma_deg=-1.0)
    with pytest.raises(InputError, match="prints no joint"):
        solve(seen, method="joint", as_printed=True)
    with pytest.raises(NotObservable, match="five positions"):
        solve(seen, tilt="angle_offset", method="two_position")


@pytest.mark.parametrize(
    ("name", "tilt"), [("p01", ""), ("p03", "angle_offset"), ("p04", "base_tilt"),
                       ("p09", "angle_offset"), ("p10", "")]
)  # fmt: skip
def test_practice_sessions_within_the_stated_uncertainty(name: str, tilt: str) -> None:
    seen, answers = practice(name)
    result = solve(seen)
    assert result.good
    for group in ("acc_bias", "acc_scale", "gyr_bias"):
        value, sigma = result.vector(group)
        assert (np.abs(value - answers["truth"][group]) < 3 * sigma).all(), group
    if tilt:
        value, sigma = result.vector(tilt)
        expected = list(answers["concealed"][tilt].values())
        assert (np.abs(value - expected) < 3 * sigma).all()


def test_the_practice_session_with_a_stuck_axis_loses_that_position_only() -> None:
    seen, answers = practice("p08")
    result = solve(seen)
    name = f"the position {seen.positions[5].name} "
    assert any(w.startswith(name) and "no weight" in w for w in result.warnings)
    value, sigma = result.vector("acc_bias")
    assert (np.abs(value - answers["truth"]["acc_bias"]) < 3 * sigma).all()


def test_a_window_too_short_to_know_its_correlations_is_still_used() -> None:
    rng = np.random.default_rng(2)
    u = outputs(WIDE)
    averages = []
    for row in u:
        few = np.hstack([row, np.zeros(3)]) + SIGMA * rng.standard_normal((3, 6))
        averages.append(Average(few.mean(axis=0), np.cov(few.T) / 3, 20.0, 3, 0.0, 1.0))
    result = solve(Observations.of(WIDE, averages, G), tilt="none")
    assert np.isfinite(result.sigma).all()


def test_importing_the_estimators_loads_no_scipy() -> None:
    code = "import sys, fieldcal.solve; sys.exit('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("module", [choose, scatter, fieldcal])
def test_examples_in_the_text(module: ModuleType) -> None:
    failed, tried = doctest.testmod(module, extraglobs={"np": np})
    assert not failed and (tried or module is fieldcal)
