"""Norms where angles are unknown: simulated, and real devices against peers."""

from functools import cache

import numpy as np
import pytest
from observed import BIAS, SCALE, G, motionless, observe
from recordings import ferraris, hand_held, mpu9150, mpu9150_published
from scipy.spatial.transform import Rotation

from fieldcal.calibration import Calibration, Nominal
from fieldcal.core.errors import NotObservable
from fieldcal.core.positions import SIX_FACES, Position
from fieldcal.core.samples import Array
from fieldcal.solve import Observations, solve

UPPER = np.array([[0.0, 0.004, -0.011], [0.0, 0.0, 0.007], [0.0, 0.0, 0.0]])
TRUTH = np.array([*BIAS, *SCALE, 0.004, -0.011, 0.007])
NAMES = [f"acc_{g}.{x}" for g in ("bias", "scale") for x in "xyz"]
FACES = np.vstack([np.eye(3), -np.eye(3)])
FIT_PUBLISHED = [0.0017, 0.0022, 0.0022, 0.0015, 0.0032]
"""Norm residuals of the peer's model on the five units, m/s^2."""


def by_hand(n: int) -> tuple[Position, ...]:
    return (Position("by hand"),) * n


def spread_over_the_sphere(n: int, seed: int) -> Array:
    f = np.random.default_rng(seed).standard_normal((n, 3))
    return np.asarray(G * f / np.linalg.norm(f, axis=1, keepdims=True))


def shown(f: Array, coupling: Array = UPPER) -> Array:
    return np.asarray(BIAS + f @ (np.diag(SCALE) + coupling).T)


@pytest.mark.parametrize("cross", [False, True])
def test_what_was_put_in_comes_back(cross: bool) -> None:
    f = spread_over_the_sphere(20, 1)
    seen = observe(by_hand(20), shown(f, UPPER * cross), sigma=1e-6)
    found = solve(seen, cross=cross)
    assert found.method == "scalar"
    assert [n for n in found.names if n.startswith("cross")] == [
        f"cross_coupling.k{ij}" for ij in ("12", "13", "23")
    ][: 3 * cross]
    np.testing.assert_allclose(found.values, TRUTH[: 9 if cross else 6], atol=1e-6)
    assert found.dof == 20 - (9 if cross else 6)


def test_it_finds_its_way_from_far() -> None:
    f = spread_over_the_sphere(14, 2)
    u = np.array([3.0, -2.0, 1.5]) + f @ np.diag([0.6, 1.5, -1.2])
    nominal = Nominal(acc_scale=(1.0, 1.0, -1.0))
    found = solve(observe(by_hand(14), u, sigma=1e-5, nominal=nominal))
    np.testing.assert_allclose(found.values, [3, -2, 1.5, 0.6, 1.5, -1.2], atol=1e-5)


def test_a_common_rotation_does_not_show() -> None:
    f = spread_over_the_sphere(16, 3)
    turned = f @ Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix()
    a = solve(observe(by_hand(16), shown(f)), cross=True)
    b = solve(observe(by_hand(16), shown(turned)), cross=True)
    np.testing.assert_allclose(a.values, b.values, atol=1e-5)


def test_stated_angles_are_nothing_to_it() -> None:
    """Not even if none of them is right."""
    u = shown(spread_over_the_sphere(12, 5))
    angles = tuple(Position.deg(15.0 * i, 5.0 * i) for i in range(12))
    stated = solve(observe(angles, u), "scalar")
    np.testing.assert_allclose(stated.values, solve(observe(by_hand(12), u)).values)
    assert stated.dof == 6


def norms(x: Array, u: Array) -> Array:
    """Lengths of the force by (9,) parameters, (n,)."""
    matrix = np.diag(x[3:6])
    matrix[np.triu_indices(3, 1)] = x[6:]
    return np.asarray(np.linalg.norm(np.linalg.solve(matrix, (u - x[:3]).T), axis=0))


def test_uncertainties_are_those_of_least_squares_of_the_norms() -> None:
    """By differences of the norms, of windows with unequal noise."""
    u = shown(spread_over_the_sphere(15, 4))
    size = np.random.default_rng(6).uniform(0.5e-3, 4e-3, (15, 3))
    seen = observe(by_hand(15), u)
    seen.covariance[:, range(3), range(3)] = size**2
    found = solve(seen, cross=True)
    step = 1e-6
    by_u = [norms(TRUTH, u + s) - norms(TRUTH, u - s) for s in step * np.eye(3)]
    noise = np.linalg.norm(np.array(by_u).T / (2 * step) * size, axis=1)
    rows = [norms(TRUTH + s, u) - norms(TRUTH - s, u) for s in step * np.eye(9)]
    weighed = np.array(rows).T / (2 * step) / noise[:, None]
    bound = np.linalg.inv(weighed.T @ weighed)
    # windows may be off by more than their noise, if not by much
    assert (found.sigma / np.sqrt(np.diag(bound)) > 0.99).all()
    assert (found.sigma / np.sqrt(np.diag(bound)) < 1.15).all()
    at_bound = np.linalg.inv(np.linalg.cholesky(bound))
    shape = np.linalg.eigvalsh(at_bound @ found.covariance @ at_bound.T)
    assert shape.min() > 0.98 and shape.max() < 1.4


@pytest.mark.thorough
@pytest.mark.parametrize("cross", [False, True])
def test_pulls_and_chi2_with_unequal_windows(cross: bool) -> None:
    rng = np.random.default_rng(6)
    f = spread_over_the_sphere(15, 4)
    size = rng.uniform(0.5e-3, 4e-3, (15, 3))
    u = shown(f, UPPER * cross)
    p = 9 if cross else 6
    pulls, chi2 = [], []
    for _ in range(40):
        seen = observe(by_hand(15), u + size * rng.standard_normal((15, 3)))
        seen.covariance[:, range(3), range(3)] = size**2
        found = solve(seen, cross=cross)
        pulls.append((found.values - TRUTH[:p]) / found.sigma)
        chi2.append(found.chi2 / found.dof)
    assert found.dof == 15 - p
    assert 0.88 < np.std(pulls) < 1.07
    np.testing.assert_allclose(np.mean(pulls, axis=0), 0, atol=0.4)
    assert np.mean(chi2) == pytest.approx(1, abs=0.2)
    assert 0.92 < (np.abs(pulls) < 1.96).mean() < 0.98


@pytest.mark.thorough
@pytest.mark.parametrize("n", [8, pytest.param(14, marks=pytest.mark.thorough)])
def test_scatter_beyond_the_windows_widens_the_intervals(n: int) -> None:
    rng = np.random.default_rng(n)
    inside = []
    for seed in range(30):
        f = spread_over_the_sphere(n, 100 + seed % 7)
        u = shown(f, 0 * UPPER) + 5e-3 * rng.standard_normal((n, 3))
        found = solve(observe(by_hand(n), u, sigma=2e-4))
        values = np.array([found.value(name) for name in NAMES])
        sigma = np.array([found.uncertainty(name) for name in NAMES])
        inside.append(np.abs(values - TRUTH[:6]) < 1.96 * sigma)
    # few degrees of freedom, yet what is called 95 % is
    assert 0.9 < np.mean(inside) < 0.98


@pytest.mark.parametrize(
    ("n", "says"),
    [
        (6, "no degree of freedom is left"),
        (7, "only one degree of freedom: "),
        (8, "only two degrees of freedom: "),
        (9, ""),
    ],
)
def test_how_little_so_few_windows_check_is_said(n: int, says: str) -> None:
    f = spread_over_the_sphere(n, 3)
    found = solve(observe(by_hand(n), shown(f, 0 * UPPER), sigma=1e-6))
    assert found.dof == n - 6
    about = [w for w in found.warnings if "of freedom" in w]
    assert len(about) == bool(says) and all(w.startswith(says) for w in about)


def test_six_faces_cannot_show_non_orthogonality() -> None:
    found = solve(observe(by_hand(6), shown(G * FACES)), cross=True)
    assert not any(n.startswith("cross") for n in found.names)
    text = " ".join(found.warnings)
    assert "cross_coupling.k12" in text and "not determined" in text
    assert "no degree of freedom" in text


def test_twelve_windows_on_six_faces_cannot_either() -> None:
    rng = np.random.default_rng(9)
    f = np.vstack([G * FACES, G * FACES])
    u = shown(f) + 1e-3 * rng.standard_normal((12, 3))
    found = solve(observe(by_hand(12), u), cross=True)
    assert found.names[-1] == "acc_scale.z"
    assert "half way between x and y" in " ".join(found.warnings)


def test_orientations_that_leave_an_axis_out_are_named() -> None:
    t = np.linspace(0, 5, 9)
    f = G * np.column_stack([np.cos(t), np.sin(t), 0 * t])
    found = solve(observe(by_hand(9), shown(f, 0 * UPPER)))
    assert "acc_scale.z" not in found.names
    assert any("acc_scale.z" in w for w in found.warnings)
    with pytest.raises(NotObservable):
        solve(observe(by_hand(1), shown(G * FACES[:1])))


def test_leave_one_out_is_the_fit_without_the_position() -> None:
    rng = np.random.default_rng(10)
    f = spread_over_the_sphere(12, 5)
    y = shown(f, 0 * UPPER) + 1e-3 * rng.standard_normal((12, 3))
    whole = solve(observe(by_hand(12), y))
    alone = []
    for i in range(12):
        rest = np.arange(12) != i
        x = solve(observe(by_hand(11), y[rest])).values
        alone.append(np.linalg.norm((y[i] - x[:3]) / x[3:6]) - G)
    rms = np.sqrt(np.mean(np.square(alone)))
    assert whole.info["left_out_rms"] == pytest.approx(rms, rel=0.01)
    assert rms > 1.2 * whole.rms


# --- real devices ---


@cache
def unit(i: int, cross: bool = True) -> Calibration:
    block = mpu9150(i)
    still = motionless(block.t, block.acc, block.gyr)
    assert 18 <= len(still) <= 20
    seen = Observations.of(by_hand(len(still)), still, 9.81)
    return solve(seen, cross=cross)


@pytest.mark.parametrize("i", range(5))
def test_five_units_against_the_published_table(i: int) -> None:
    peer = mpu9150_published()["accelerometer"]
    result = unit(i)
    assert result.method == "scalar"
    assert result.rms <= FIT_PUBLISHED[i]
    # without non-orthogonality the norm does not close, and the result says so
    without = unit(i, cross=False)
    assert without.rms > 2.5 * result.rms
    if i != 3:
        assert any("than the noise of their windows" in w for w in without.warnings)
    published = {
        "acc_bias": [peer[f"bias_{x}"][i] for x in "xyz"],
        "acc_scale": [1 + peer[f"scale_percent_{x}"][i] / 100 for x in "xyz"],
        "cross_coupling": [
            np.deg2rad(peer[f"m_{xy}_deg"][i]) for xy in ("xy", "xz", "yz")
        ],
    }
    # the peer states no uncertainty: on the same windows it is about ours
    for group, values in published.items():
        value, sigma = result.vector(group)
        assert (np.abs(value - values) < 3 * np.sqrt(2) * sigma).all(), group


def test_left_out_residual_is_better_with_the_couplings() -> None:
    for i in (0, 1):
        assert unit(i).info["left_out_rms"] < 0.4 * unit(i, False).info["left_out_rms"]


def test_ten_short_intervals_leave_one_degree_of_freedom() -> None:
    table, intervals = hand_held()
    size = 9.81 / 16384
    mean, cov = [], []
    noise = size * np.std(np.diff(table[1000:3000, :3], axis=0), axis=0) / np.sqrt(2)
    for first, last in intervals.T.astype(int):
        part = size * table[first : last + 1, :3]
        mean.append(part.mean(axis=0))
        cov.append(np.diag(noise**2) / len(part))
    seen = observe(by_hand(10), np.array(mean))
    seen.covariance[:, :3, :3] = cov
    result = solve(seen, cross=True)
    # nine parameters of ten norms, and one of them rests on next to nothing
    text = " ".join(result.warnings)
    assert "one degree of freedom" in text and result.dof == 1
    assert "cross_coupling.k13" in result.names
    if "cross_coupling.k12" in result.names:
        assert result.uncertainty("cross_coupling.k12") > 0.05


FERRARIS = ("y_a", "y_p", "x_a", "x_p", "z_p", "z_a")
"""The faces in the order of `SIX_FACES`: f = -y, +y, -x, +x, +z, -z."""


def faces() -> tuple[Observations, Array]:
    parts = ferraris()
    size = 9.81 / 2048
    mean = size * np.array([parts[k][:, :3].mean(axis=0) for k in FERRARIS])
    seen = observe(SIX_FACES, mean, gravity=9.81)
    for i, k in enumerate(FERRARIS):
        cells = parts[k][: len(parts[k]) // 20 * 20, :3].reshape(-1, 20, 3).mean(axis=1)
        seen.covariance[i, :3, :3] = size**2 * np.cov(cells.T) / len(cells)
    return seen, mean


def test_six_faces_by_known_axes_against_the_published_session() -> None:
    seen, mean = faces()
    result = solve(seen, method="least_squares")
    # three pairs of faces give three values of each bias; they differ by 3, 13, 2 mg
    pairs = np.array([mean[i : i + 2].mean(axis=0) for i in (0, 2, 4)])
    apart = np.ptp(pairs, axis=0) / 9.81e-3
    np.testing.assert_allclose(apart, [3, 13, 2], atol=0.7)
    assert any("than the noise of their windows" in w for w in result.warnings)
    bias, sigma = result.vector("acc_bias")
    # so far apart, no bias is known to a hundredth of what its pairs disagree by
    assert sigma[1] > 0.025
    np.testing.assert_allclose(bias, pairs.mean(axis=0), atol=0.02)
    assert 0.03 < result.rms < 0.06
    assert not result.good
    peer = np.array([-6.0189, -48.2879, -28.9664]) * 9.81 / 2048
    assert (np.abs(bias - peer) < 2 * sigma).all()
    # faces that stand a third of a degree off explain it: a level error hardly reaches
    # the axis along gravity, so each bias is near its own pair's, as the peer takes it
    loose = solve(seen, method="least_squares", angle_sigma_deg=0.35)
    assert loose.chi2 / loose.dof < 12
    np.testing.assert_allclose(loose.vector("acc_bias")[0], peer, atol=8e-3)


def test_six_faces_by_their_norms_say_that_nothing_checks_them() -> None:
    seen, _ = faces()
    result = solve(seen, method="scalar", cross=True)
    text = " ".join(result.warnings)
    assert result.dof == 0 and "no degree of freedom" in text
    assert "not determined" in text
