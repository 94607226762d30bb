"""How well windows agree: explicit least squares, and fits without each window."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from observed import BIAS, SCALE, G, observe, outputs

from fieldcal.core.positions import Position
from fieldcal.core.samples import Array, Index
from fieldcal.model import priors
from fieldcal.model.state import State
from fieldcal.solve import agreement, solve
from fieldcal.solve.agreement import LargestResidual, TriadFit
from fieldcal.solve.base_rate import with_base_rate
from fieldcal.solve.estimation import ParameterEstimate, estimate_parameters
from fieldcal.solve.observation_rows import rows_of_observations
from fieldcal.solve.parameter_set import ParameterSetOptions

SIZE = np.array([1e-3, 2e-3, 0.7e-3])
PLACES = tuple(
    Position.deg(a, b)
    for a, b in [(0, 0), (45, 5), (45, -40), (-45, 5), (120, 60), (0, 5), (-100, -40)]
)
HAND = Position("by hand")
WIDE = priors.FREE_SIZE * np.append(priors.BIAS[:3], [priors.SCALE] * 3)
STEP = 1e-4


def found(
    places: tuple[Position, ...], u: Array, degrees: float = 0.0, counts: float = 1.0
) -> ParameterEstimate:
    """The estimate from outputs u, m/s^2, of a device with so many counts for one."""
    seen = observe(places, counts * u)
    seen.covariance[:, range(3), range(3)] = (counts * SIZE) ** 2
    recorded = rows_of_observations(seen)
    rows = with_base_rate(recorded.rows, np.zeros(3))
    scale = np.repeat([counts, 1.0], 3)
    nominal = State(np.zeros(6), scale, np.zeros((len(places), 2)), np.zeros(3))
    wanted = ParameterSetOptions(angles_deg=degrees)
    return estimate_parameters(
        type(recorded)(rows, recorded.since_turn), None, nominal, wanted
    )


@dataclass(frozen=True)
class Explicit:
    """Means y less those of a perfect device, their design and stated covariance."""

    y: Array
    design: Array
    stated: Array

    def fitted(self, rows: Index) -> tuple[Array, Array]:
        """Generalised least squares with what is known before, of some rows."""
        a, s = self.design[rows], self.stated[np.ix_(rows, rows)]
        inner = a.T @ np.linalg.solve(s, a) + np.diag(WIDE**-2.0)
        x = np.linalg.solve(inner, a.T @ np.linalg.solve(s, self.y[rows]))
        return x, self.y[rows] - a @ x

    def without(self, rows: Index) -> Array:
        """Residual of some rows by a fit that did not see them."""
        rest = np.setdiff1d(np.arange(len(self.y)), rows)
        x, off = self.fitted(rest)
        shared = self.stated[np.ix_(rows, rest)]
        foretold = shared @ np.linalg.solve(self.stated[np.ix_(rest, rest)], off)
        return np.asarray(self.y[rows] - self.design[rows] @ x - foretold)

    def unsure(self, rows: Index) -> Array:
        """Covariance of these residuals."""
        rest = np.setdiff1d(np.arange(len(self.y)), rows)
        s, shared = self.stated[np.ix_(rest, rest)], self.stated[np.ix_(rows, rest)]
        a = self.design[rest]
        inner = a.T @ np.linalg.solve(s, a) + np.diag(WIDE**-2.0)
        free = self.design[rows] - shared @ np.linalg.solve(s, a)
        own = self.stated[np.ix_(rows, rows)] - shared @ np.linalg.solve(s, shared.T)
        return np.asarray(own + free @ np.linalg.solve(inner, free.T))


def explicit(places: tuple[Position, ...], u: Array, degrees: float = 0.0) -> Explicit:
    """By differences of outputs; angles are off by their own and by their detent's."""
    n = len(places)
    perfect = outputs(places, bias=np.zeros(3), scale=np.ones(3))
    design = np.zeros((n, 3, 6))
    for c in range(3):
        design[:, c, c], design[:, c, 3 + c] = 1.0, perfect[:, c]
    stated = np.diag(np.tile(SIZE**2, n))
    columns: dict[object, Array] = {}
    for i, p in enumerate(places):
        for joint, angle in enumerate(p.degrees or ()):
            moved = np.zeros((n, 3))
            ends = []
            for sign in (1, -1):
                at = list(p.degrees or ())
                at[joint] += sign * np.rad2deg(STEP)
                ends.append(outputs([Position.deg(at[0], at[1])])[0])
            moved[i] = (ends[0] - ends[1]) / (2 * STEP)
            columns[i, joint] = moved
            same = "detent", joint, angle
            columns[same] = columns.get(same, np.zeros((n, 3))) + moved
    for column in columns.values():
        stated += np.deg2rad(degrees) ** 2 / 2 * np.outer(column, column)
    return Explicit((u - perfect).ravel(), design.reshape(-1, 6), stated)


def noisy(places: tuple[Position, ...], seed: int = 1) -> Array:
    rng = np.random.default_rng(seed)
    return outputs(places) + SIZE * rng.standard_normal((len(places), 3))


@pytest.mark.parametrize("degrees", [0.0, 0.02])
def test_chi2_is_that_of_generalised_least_squares(degrees: float) -> None:
    u = noisy(PLACES)
    one, plain = found(PLACES, u, degrees).acc, explicit(PLACES, u, degrees)
    _, off = plain.fitted(np.arange(21))
    chi2 = off @ np.linalg.solve(plain.stated, off)
    assert one.chi2 == pytest.approx(chi2, rel=2e-3)
    assert one.dof == 21 - 6


@pytest.mark.parametrize("degrees", [0.0, 0.02])
def test_what_is_left_out_is_foretold_by_the_others(degrees: float) -> None:
    u = noisy(PLACES, 2)
    one, plain = found(PLACES, u, degrees).acc, explicit(PLACES, u, degrees)
    off = np.array([plain.without(3 * i + np.arange(3)) for i in range(len(PLACES))])
    weight = np.tile(SIZE**-2.0, (len(PLACES), 1))
    expected = np.sqrt(np.average(off**2, weights=weight))
    assert one.held_out_rms == pytest.approx(expected, rel=2e-3)
    assert one.held_out_rms > 1.1 * one.rms


@pytest.mark.parametrize("seed", [2, 5, 9])
def test_the_furthest_is_the_largest_residual_by_what_it_was_foretold_to(
    seed: int,
) -> None:
    u = noisy(PLACES, seed)
    plain = explicit(PLACES, u, 0.02)
    rows = [3 * i + np.arange(3) for i in range(len(PLACES))]
    off = np.array([plain.without(r) for r in rows])
    sd = np.sqrt([np.diag(plain.unsure(r)) for r in rows])
    i, c = divmod(int(np.argmax(np.abs(off) / sd)), 3)
    far = found(PLACES, u, 0.02).acc.largest
    assert far is not None and (far.window, far.axis) == (i, c)
    assert far.residual == pytest.approx(off[i, c], rel=5e-3)
    assert far.sigma == pytest.approx(sd[i, c], rel=0.1)


@pytest.mark.parametrize("places", [PLACES[:2], PLACES[:3], PLACES])
def test_what_checks_what_does_not_depend_on_the_unit(
    places: tuple[Position, ...],
) -> None:
    """Of two positions none is checked by the other, and of three not every axis."""
    u = noisy(places, 3)
    si, whole = (found(places, u, counts=counts).acc for counts in (1.0, 1000.0))
    assert np.isnan(si.held_out_rms) == (len(places) == 2)
    assert whole.held_out_rms == pytest.approx(1000 * si.held_out_rms, nan_ok=True)
    assert (si.largest is None) == (whole.largest is None) == (len(places) == 2)
    if si.largest is not None and whole.largest is not None:
        assert (whole.largest.window, whole.largest.axis) == (
            si.largest.window, si.largest.axis
        )  # fmt: skip
        assert whole.largest.sigma == pytest.approx(1000 * si.largest.sigma, rel=1e-4)


def test_forces_that_contradict_each_other_are_why_it_is_bad() -> None:
    """Two angles wrong: the first sentence says so, and where most of it is."""
    u = noisy(PLACES, 1)
    u[1, 0] += 0.9
    u[4, 2] -= 0.7
    seen = observe(PLACES, u)
    seen.covariance[:, range(3), range(3)] = SIZE**2
    result = solve(seen, tilt="none")
    assert not result.good
    assert "contradict each other" in result.warnings[0]
    assert f"{PLACES[1].name}, ax by +" in result.warnings[0]


def test_residuals_are_what_the_estimate_leaves() -> None:
    u = noisy(PLACES, 3)
    whole = found(PLACES, u)
    b, k = whole.values[:3], whole.values[3:6]
    perfect = outputs(PLACES, bias=np.zeros(3), scale=np.ones(3))
    np.testing.assert_allclose(whole.acc.residuals, u - b - k * perfect, atol=1e-9)
    weight = np.tile(SIZE**-2.0, (len(PLACES), 1))
    rms = np.sqrt(np.average(whole.acc.residuals**2, weights=weight))
    assert whole.acc.rms == pytest.approx(rms)
    assert np.isnan(whole.gyr.rms) and whole.gyr.dof == 0


def test_a_misfit_stays_visible_whatever_the_scatter_that_is_found() -> None:
    u = outputs(PLACES)
    u += 30 * SIZE * np.random.default_rng(4).standard_normal(u.shape)
    plain = explicit(PLACES, u)
    _, off = plain.fitted(np.arange(21))
    chi2 = off @ np.linalg.solve(plain.stated, off)
    assert chi2 > 5000 and found(PLACES, u).acc.chi2 == pytest.approx(chi2, rel=1e-3)


def by_hand(n: int, seed: int = 6) -> Array:
    rng = np.random.default_rng(seed)
    f = rng.standard_normal((n, 3))
    f *= G / np.linalg.norm(f, axis=1, keepdims=True)
    return BIAS + SCALE * f + SIZE * rng.standard_normal((n, 3))


def norms(u: Array, x: Array) -> tuple[Array, Array]:
    """Length of the force less gravity, and its standard deviation."""
    f = (u - x[:3]) / x[3:6]
    length = np.linalg.norm(f, axis=1)
    slope = f / length[:, None] / x[3:6]
    return length - G, np.sqrt(((slope * SIZE) ** 2).sum(axis=1))


@pytest.mark.parametrize("n", [8, 14])
def test_of_an_unknown_orientation_the_length_is_one_degree_of_freedom(n: int) -> None:
    u = by_hand(n)
    whole = found((HAND,) * n, u)
    off, sd = norms(u, whole.values)
    assert whole.acc.dof == n - 6
    assert whole.acc.chi2 == pytest.approx(float(((off / sd) ** 2).sum()), rel=0.02)
    assert np.isnan(whole.acc.residuals[:, 1:]).all()
    np.testing.assert_allclose(whole.acc.residuals[:, 0], off, rtol=0.01, atol=1e-6)


def test_known_and_unknown_orientations_count_together() -> None:
    places = (*PLACES, *[HAND] * 5)
    u = np.vstack([noisy(PLACES, 7), by_hand(5, 8)])
    assert found(places, u).acc.dof == 21 + 5 - 6


def test_directions_that_nothing_shows_take_no_degree_of_freedom() -> None:
    faces = np.vstack([np.eye(3), -np.eye(3)])
    u = BIAS + SCALE * G * np.vstack([faces, faces])
    seen = observe((HAND,) * 12, u)
    recorded = rows_of_observations(seen)
    nominal = State(np.zeros(6), np.ones(6), np.zeros((12, 2)), np.zeros(3))
    crossed = estimate_parameters(
        recorded, None, nominal, ParameterSetOptions(cross=True)
    )
    assert crossed.acc.dof == 12 - 6


def test_what_does_not_turn_has_no_direction_of_its_rate() -> None:
    """Of a device at rest on a base that does not turn, laid by hand."""
    places = (*PLACES, HAND)
    one = found(places, outputs([*PLACES, PLACES[0]]))
    known = (one.sets.gram.info[: len(places), 3:] > 0).ravel()
    means = agreement._MeasuredMeans(one.sets.gram, one.parameter_set, (3, 4, 5), known)
    assert np.isnan(means._force_direction(len(places) - 1)).all()
    forces = agreement._MeasuredMeans(
        one.sets.gram, one.parameter_set, (0, 1, 2), known
    )
    assert np.isfinite(forces._force_direction(len(places) - 1)).all()


def test_a_length_of_which_an_axis_is_clipped_is_no_length() -> None:
    """Gravity along the clipped axis is as it may be, whatever the others read."""
    n, clipped = 12, 5
    u = by_hand(n)
    seen = observe((HAND,) * n, u)
    seen.mean[clipped, 1] = np.nan
    recorded = rows_of_observations(seen)
    nominal = State(np.zeros(6), np.ones(6), np.zeros((n, 2)), np.zeros(3))
    one = estimate_parameters(recorded, None, nominal, ParameterSetOptions())
    assert np.isnan(one.acc.residuals[clipped]).all()
    assert np.isfinite(np.delete(one.acc.residuals[:, 0], clipped)).all()
    assert one.acc.dof == n - 1 - 6


@pytest.mark.parametrize(
    ("chi2", "dof", "rejects"),
    [(53.9, 6, False), (54.0, 6, True), (90.0, 0, False), (np.nan, 6, True)],
)
def test_noise_never_makes_nine_times_its_own_variance(
    chi2: float, dof: int, rejects: bool
) -> None:
    fit = TriadFit(chi2, dof, 0.0, 0.0, np.zeros((1, 3)))
    assert fit.rejects_model is rejects


def test_the_largest_residual_is_the_one_of_most_sigmas() -> None:
    off = np.array([[3.0, np.nan, 1.0], [-4.0, np.nan, np.nan]])
    sigma = np.array([[1.0, 1.0, 0.25], [0.5, np.nan, np.nan]])
    lengths = np.array([False, True])
    assert LargestResidual.of(off, sigma, lengths) == LargestResidual(1, -1, -4.0, 0.5)
    assert LargestResidual.of(off[:1], sigma[:1], lengths[:1]) == LargestResidual(
        0, 2, 1.0, 0.25
    )
    assert LargestResidual.of(off * np.nan, sigma, lengths) is None
