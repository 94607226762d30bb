"""The joint estimate against its bound, its statements against many seeds."""

import doctest
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from closed_circle import one_in
from hypothesis import given, settings
from hypothesis import strategies as st
from observed import BIAS, COUPLING, SCALE, G, observe, outputs, practice
from test_closed_form import MOUNTINGS, SPREAD_OUT, TILTED

import fieldcal
from fieldcal.calibration import Calibration
from fieldcal.calibration.names import Tilt
from fieldcal.core.errors import InputError, NotObservable
from fieldcal.core.positions import (
    FIVE_POSITIONS,
    SIX_FACES,
    TWO_POSITIONS,
    WIDE_POSITIONS,
    Position,
)
from fieldcal.core.samples import Array
from fieldcal.model.posterior.mixture import Mixture
from fieldcal.solve import Observations, choose, rank, solve
from fieldcal.solve.estimation import window_scatter
from fieldcal.windows import Average

SIGMA = 1e-3
SIX = tuple(
    Position.deg(a, b)
    for a, b in [(-45, -5), (-45, 5), (0, 0), (45, -5), (45, 5), (0, 5)]
)
NINE = (*SIX, Position.deg(-22, 0), Position.deg(22, 3), Position.deg(0, -5))
OFF = np.array([COUPLING[i, j] for i in range(3) for j in range(3) if i != j])
STEP = 1e-4
"""Of derivatives by differences."""


@dataclass(frozen=True)
class Model:
    """What a device has, and what is asked for."""

    tilt: Tilt = "none"
    cross: bool = False

    @property
    def truth(self) -> Array:
        tilt = next(iter(TILTED[self.tilt].values())) if self.tilt != "none" else ()
        return np.array([*BIAS, *SCALE, *(OFF if self.cross else ()), *tilt])

    def means(self, places: Sequence[Position], x: Array | None = None) -> Array:
        """What is put out with parameters in the order of results."""
        x = self.truth if x is None else x
        coupling = np.zeros((3, 3))
        if self.cross:
            coupling[~np.eye(3, dtype=bool)] = x[6:12]
        known: dict[str, Any] = {"bias": x[:3], "scale": x[3:6], "coupling": coupling}
        if self.tilt != "none":
            known[next(iter(TILTED[self.tilt]))] = x[-2:]
        return outputs(places, **known)

    def bound(self, places: Sequence[Position]) -> Array:
        """Cramer-Rao bound of the covariance, by differences of outputs."""
        columns = []
        for step in STEP * np.eye(len(self.truth)):
            up, down = (self.means(places, self.truth + s) for s in (step, -step))
            columns.append((up - down).ravel() / (2 * STEP))
        rows = np.array(columns).T
        return np.asarray(SIGMA**2 * np.linalg.inv(rows.T @ rows))


Disturb = Callable[[np.random.Generator, Array, int], Array]


def run(
    model: Model, places: tuple[Position, ...], seeds: int, seed: int,
    disturb: Disturb | None = None,
) -> tuple[list[Calibration], Array]:  # fmt: skip
    """Sessions solved, and their errors."""
    rng = np.random.default_rng(seed)
    found = []
    for i in range(seeds):
        y: Array = model.means(places) + SIGMA * rng.standard_normal((len(places), 3))
        if disturb:
            y = disturb(rng, y, i)
        found.append(solve(observe(places, y), tilt=model.tilt, cross=model.cross))
    return found, np.array([f.values for f in found]) - model.truth


def whitened(found: Sequence[Calibration], error: Array) -> Array:
    """Errors in standard deviations, those of parameters that go together apart."""
    return np.array([
        np.linalg.solve(np.linalg.cholesky(f.covariance), e)
        for f, e in zip(found, error, strict=True)
    ])  # fmt: skip


CASES = [
    pytest.param(Model(), TWO_POSITIONS, 100, marks=pytest.mark.thorough),
    pytest.param(Model("angle_offset"), FIVE_POSITIONS, 40, marks=pytest.mark.thorough),
    pytest.param(Model("angle_offset"), WIDE_POSITIONS, 60, marks=pytest.mark.thorough),
    pytest.param(Model("base_tilt"), WIDE_POSITIONS, 60, marks=pytest.mark.thorough),
    (Model("base_tilt"), NINE, 12),
    pytest.param(Model("base_tilt"), NINE, 25, marks=pytest.mark.thorough),
    pytest.param(Model(cross=True), SIX_FACES, 50, marks=pytest.mark.thorough),
]


@pytest.mark.parametrize(("model", "places", "seeds"), CASES)
def test_it_reaches_its_bound_and_says_how_well(
    model: Model, places: tuple[Position, ...], seeds: int
) -> None:
    found, error = run(model, places, seeds, 1)
    bound = model.bound(places)
    at_bound = np.linalg.solve(np.linalg.cholesky(bound), error.T)
    assert 0.92 < at_bound.std() < 1.08
    # what is said is the bound, but for an instability that is only not large
    ratio = np.array([f.sigma for f in found]) / np.sqrt(np.diag(bound))
    assert (np.median(ratio, axis=0) > 0.99).all()
    assert (np.median(ratio, axis=0) < 1.12).all()
    pulls = whitened(found, error)
    assert 0.9 < pulls.std() < 1.05
    np.testing.assert_allclose(pulls.mean(axis=0), 0, atol=4 / np.sqrt(seeds))
    assert 0.935 < (np.abs(pulls) < 1.96).mean() < 0.975
    dof = 3 * len(places) - len(model.truth)
    assert all(f.dof == dof for f in found)
    if dof:
        chi2 = np.array([f.chi2 for f in found])
        assert abs(chi2.mean() / dof - 1) < 4 * np.sqrt(2 / dof / seeds)


def bumped(size: float) -> Disturb:
    def disturb(rng: np.random.Generator, y: Array, i: int) -> Array:
        push = rng.standard_normal(3)
        y = y.copy()
        y[i % len(y)] += push * size * SIGMA / np.linalg.norm(push)
        return y

    return disturb


@pytest.mark.parametrize(
    ("places", "size"),
    one_in(
        5,
        [
            (some, size)
            for size in (3.0, 5.0, 10.0, 100.0, 3000.0)
            for some in (NINE, SIX)
        ],
    ),
)
def test_one_bad_position_is_doubted_and_never_spoils_the_interval(
    places: tuple[Position, ...], size: float
) -> None:
    seeds = 2 * len(places)
    model = Model("angle_offset")
    found, error = run(model, places, seeds, 2, bumped(size))
    pulls = error / np.array([f.sigma for f in found])
    assert np.sqrt((pulls**2).mean()) < 1.5
    assert np.quantile(np.abs(pulls), 0.95) < 1.5 * 1.96
    if size >= 10:
        doubt = np.array([f.info["bad_position"] for f in found])
        guilty = np.arange(seeds) % len(places)
        # at ten times the noise it may as well be scatter: the operator is told
        told = 0.1 if size == 10 else 0.5
        assert (doubt[np.arange(seeds), guilty] > told).mean() > 0.9
        np.put_along_axis(doubt, guilty[:, None], 0.0, axis=1)
        assert (doubt > 0.5).sum() <= 1
    if size >= 100:
        assert 0.85 < pulls.std() < 1.15


@pytest.mark.thorough
def test_good_positions_are_not_doubted() -> None:
    found, _ = run(Model("angle_offset"), NINE, 40, 3)
    doubt = np.array([f.info["bad_position"] for f in found])
    assert doubt.shape == (40, 9)
    assert (doubt.max(axis=1) > 0.5).sum() <= 1
    assert np.median(doubt.max(axis=1)) < 0.1


@pytest.mark.parametrize("count", [15, pytest.param(45, marks=pytest.mark.thorough)])
def test_three_positions_cannot_say_which_one_is_bad(count: int) -> None:
    places = (Position.deg(0, 0), Position.deg(40, 5), Position.deg(-40, -5))
    found, _ = run(Model(), places, count, 4, bumped(30.0))
    doubt = np.array([f.info["bad_position"] for f in found])
    assert (doubt.max(axis=1) > 0.99).mean() < 0.05


@settings(max_examples=10)
@given(st.sampled_from(MOUNTINGS), st.sampled_from(["angle_offset", "base_tilt"]))
def test_any_mounting(mounting: Array, tilt: Tilt) -> None:
    u = outputs(SPREAD_OUT, mounting=mounting, **TILTED[tilt])  # type: ignore[arg-type]
    found = solve(observe(SPREAD_OUT, u, mounting=mounting), tilt=tilt)
    np.testing.assert_allclose(found.values, Model(tilt).truth, atol=1e-5)


def test_auto_takes_the_model_of_the_tilt_that_fits() -> None:
    for tilt, name in [("angle_offset", "base_tilt"), ("base_tilt", "angle_offset")]:
        u = outputs(NINE, **TILTED[tilt])  # type: ignore[arg-type, index]
        result = solve(observe(NINE, u))
        assert tilt in result.groups and name not in result.groups
        assert any(f"{name} fits worse" in w for w in result.warnings)


@pytest.mark.parametrize("count", [10, pytest.param(24, marks=pytest.mark.thorough)])
def test_where_the_models_of_the_tilt_cannot_be_told_apart_both_are_covered(
    count: int,
) -> None:
    rng = np.random.default_rng(7)
    pulls = []
    for k in range(count):
        small = (0.05 * rng.standard_normal(2)).tolist()
        tilt = {"base_deg": small} if k % 2 else {"offset_deg": small}
        u = outputs(FIVE_POSITIONS, **tilt)
        u = u + SIGMA * rng.standard_normal((5, 3))
        result = solve(observe(FIVE_POSITIONS, u))
        pulls.append((result.values[:6] - [*BIAS, *SCALE]) / result.sigma[:6])
    rms = np.sqrt((np.array(pulls) ** 2).mean(axis=0))
    assert (rms < 1.2).all() and rms.mean() > 0.7


def test_the_other_model_is_covered_by_its_weight() -> None:
    """At least C + w (d d^T + C' - C), d from one model to the other, and C + w d d^T.

    w = 1 / (1 + e^ahead).
    """
    u = outputs(FIVE_POSITIONS, offset_deg=(0.02, -0.03))
    seen = observe(
        FIVE_POSITIONS, u + 3e-4 * np.random.default_rng(2).standard_normal((5, 3))
    )
    both = solve(seen)
    (note,) = [w for w in both.warnings if "cannot tell it from" in w]
    ahead = float(note.partition("chi2 differs by ")[2].partition(")")[0]) / 2
    one, other = (solve(seen, tilt=t) for t in ("base_tilt", "angle_offset"))
    if "angle_offset" in both.groups:
        one, other = other, one
    order = [*one.names[:6]] + ["base_tilt.about_z_deg", "base_tilt.about_x_deg"]
    names = dict(zip(order, [*one.names[:6], "angle_offset.alpha0_deg",
                             "angle_offset.beta0_deg"], strict=True))  # fmt: skip
    names |= {b: a for a, b in names.items()}
    at = [other.names.index(n if n in other.names else names[n]) for n in one.names]
    apart = other.values[at] - one.values
    wider = other.covariance[np.ix_(at, at)] - one.covariance
    np.testing.assert_allclose(both.values, one.values)
    weight, scaled = 1 / (1 + np.exp(ahead)), np.outer(one.sigma, one.sigma)
    more = weight * np.outer(apart, apart)
    assert (np.sqrt(np.diag(more)) > 0.05 * one.sigma).sum() > 4, "it shows"
    # the difference in chi2 is printed to a tenth
    beyond = (both.covariance - one.covariance - more) / scaled
    low = -0.06 * np.diag(more / scaled).sum()
    assert np.linalg.eigvalsh(beyond).min() > low
    assert np.linalg.eigvalsh(beyond - weight * wider / scaled).min() > low
    most = weight * np.abs(np.linalg.eigvalsh(wider / scaled)).sum()
    assert np.trace(beyond) < most - low


def test_what_windows_scatter_by_is_an_rms_of_a_triad() -> None:
    none = np.empty(0)
    scatter = np.array([3e-3, 4e-3, 5e-3, 1e-4, 2e-4, 2e-4, 0.0])
    mixture = Mixture(none.astype(int), none, none, none, none, scatter, 0.0)
    assert window_scatter(mixture, (0, 1, 2)) == pytest.approx(1e-3 * np.sqrt(50 / 3))
    assert window_scatter(mixture, (3, 4, 5)) == pytest.approx(1e-4 * np.sqrt(3))


@pytest.mark.thorough
def test_a_base_known_to_be_nearly_level_helps() -> None:
    rng = np.random.default_rng(11)
    places = (Position.deg(0, 0), Position.deg(45, 5), Position.deg(20, -5))
    pulls = []
    for _ in range(75):
        base = 0.3 * rng.standard_normal(2)
        u = outputs(places, base_deg=base.tolist())
        u = u + SIGMA * rng.standard_normal(u.shape)
        result = solve(observe(places, u), level_sigma_deg=0.3)
        truth = [*BIAS, *SCALE]
        pulls.append((result.values[:6] - truth) / result.sigma[:6])
    np.testing.assert_allclose(np.std(pulls, axis=0), 1, atol=0.2)
    assert 0.9 < np.std(pulls) < 1.1
    free = solve(observe(places, u), tilt="base_tilt")
    assert (result.sigma[:3] < free.sigma[:3]).all()
    named = solve(observe(places, u), tilt="base_tilt", level_sigma_deg=0.3)
    np.testing.assert_allclose(named.sigma[:6], result.sigma[:6])


def set_by_hand(
    rng: np.random.Generator, places: Sequence[Position], degrees: float
) -> list[Position]:
    """Where a device really is: half of the variance is the detent's."""
    detents: dict[tuple[int, float], float] = {}
    really = []
    for p in places:
        angles = []
        for joint, angle in enumerate((p.alpha or 0.0, p.beta or 0.0)):
            shared = detents.setdefault((joint, angle), float(rng.standard_normal()))
            off = degrees / np.sqrt(2) * (shared * (angle != 0) + rng.standard_normal())
            angles.append(float(np.rad2deg(angle)) + off)
        really.append(Position.deg(*angles))
    return really


@pytest.mark.thorough
def test_angles_that_are_loosely_set_are_in_the_uncertainty() -> None:
    rng = np.random.default_rng(12)
    found, error, chi2 = [], [], []
    for _ in range(40):
        u = outputs(set_by_hand(rng, NINE, 0.1))
        u = u + SIGMA * rng.standard_normal((9, 3))
        result = solve(observe(NINE, u), tilt="none", angle_sigma_deg=0.1)
        found.append(result)
        error.append(result.values[:6] - [*BIAS, *SCALE])
        chi2.append(result.chi2 / result.dof)
    assert 0.88 < whitened(found, np.array(error)).std() < 1.08
    assert np.mean(chi2) == pytest.approx(1, abs=0.12)


def test_positions_that_do_not_show_the_tilt_say_so() -> None:
    places = (Position.deg(0, 0), Position.deg(45, 5), Position.deg(45, 5))
    result = solve(observe(places, outputs(places)))
    assert result.groups == ("acc_bias", "acc_scale")
    assert any("taken as level; add" in w for w in result.warnings)
    asked = solve(observe(places, outputs(places)), tilt="angle_offset")
    assert any("not determined" in w and "add α" in w for w in asked.warnings)


def test_an_effect_left_out_makes_the_verdict_bad() -> None:
    u = outputs(NINE, coupling=COUPLING) + SIGMA * np.random.default_rng(
        1
    ).standard_normal((9, 3))
    result = solve(observe(NINE, u))
    assert not result.good
    assert any("than the noise of their windows" in w for w in result.warnings)
    assert solve(observe(NINE, u), cross=True).good


def by_hand(rng: np.random.Generator, n: int) -> Array:
    """What a device puts out in any orientation."""
    f = rng.standard_normal((n, 3))
    f *= G / np.linalg.norm(f, axis=1, keepdims=True)
    return np.asarray(BIAS + SCALE * f)


@pytest.mark.parametrize("count", [2, pytest.param(18, marks=pytest.mark.thorough)])
def test_positions_without_angles_among_others_are_used_by_their_length(
    count: int,
) -> None:
    rng = np.random.default_rng(21)
    places = (*FIVE_POSITIONS, *[Position("somewhere")] * 4)
    found, error, narrower = [], [], []
    for _ in range(count):
        u = np.vstack([outputs(FIVE_POSITIONS), by_hand(rng, 4)])
        u += SIGMA * rng.standard_normal(u.shape)
        found.append(solve(observe(places, u), tilt="none"))
        error.append(found[-1].values - [*BIAS, *SCALE])
        known = solve(observe(FIVE_POSITIONS, u[:5]), tilt="none")
        narrower.append(found[-1].sigma / known.sigma)
    assert found[0].method == "joint" and found[0].dof == 3 * 5 + 4 - 6
    if count > 2:
        assert 0.88 < whitened(found, np.array(error)).std() < 1.08
        chi2 = np.mean([f.chi2 for f in found]) / found[0].dof
        assert chi2 == pytest.approx(1, abs=0.15)
    # z is hardly loaded on a small ladder
    assert (np.median(narrower, axis=0) < 1.0).all()
    assert np.median(narrower, axis=0)[5] < 0.2


def test_a_position_without_angles_that_is_disturbed_does_no_harm() -> None:
    u = outputs(NINE)
    places = (*NINE, Position("somewhere"))
    result = solve(observe(places, np.vstack([u, u[0] + 1.0])), tilt="none")
    assert result.method == "joint"
    assert result.info["bad_position"][-1] > 0.99
    pull = (result.values - [*BIAS, *SCALE]) / result.sigma
    np.testing.assert_allclose(pull, 0, atol=0.05)
    others = solve(observe(NINE, u), tilt="none")
    np.testing.assert_allclose(result.sigma, others.sigma, rtol=0.15)


def test_what_is_no_method_is_refused() -> None:
    seen = observe(TWO_POSITIONS, outputs(TWO_POSITIONS))
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
    u = outputs(WIDE_POSITIONS)
    averages = []
    for row in u:
        few = np.hstack([row, np.zeros(3)]) + SIGMA * rng.standard_normal((3, 6))
        averages.append(Average(few.mean(axis=0), np.cov(few.T) / 3, 20.0, 3, 0.0, 1.0))
    result = solve(Observations.of(WIDE_POSITIONS, averages, G), tilt="none")
    assert np.isfinite(result.sigma).all()


def test_importing_the_estimators_loads_no_scipy() -> None:
    code = "import sys, fieldcal.solve; sys.exit('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("module", [choose, rank, fieldcal])
def test_examples_in_the_text(module: ModuleType) -> None:
    failed, tried = doctest.testmod(module, extraglobs={"np": np})
    assert not failed and (tried or module is not choose)
