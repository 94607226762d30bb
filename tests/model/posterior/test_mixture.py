"""The mixture over instabilities and bad windows, against all of them written out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from observed import observe, outputs

from fieldcal.core.positions import TWO_POSITIONS, Position
from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.posterior.mixture import Mixing, Mixture
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.state import State
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.solve.base_rate import with_base_rate
from fieldcal.solve.observation_rows import rows_of_observations
from fieldcal.solve.parameter_set import ParameterSet, ParameterSetOptions

SD = 1e-3
PLACES = tuple(
    Position.deg(a, b) for a, b in [(0, 0), (60, 20), (-50, 40), (20, -70), (150, 10)]
)
WIDE = priors.FREE_SIZE * np.append(priors.BIAS[:3], [priors.SCALE] * 3)
UNSTABLE = priors.INSTABILITY[0]


@dataclass(frozen=True)
class Case:
    """What is found, and what went in: off (n, 3), design (3 n, 6), likeliest sizes."""

    found: Mixture
    off: Array
    design: Array
    mode: tuple[int, ...]


def case(off: Array, places: tuple[Position, ...] = PLACES) -> Case:
    """Means of a perfect device that are off by something."""
    perfect = outputs(places, bias=np.zeros(3), scale=np.ones(3))
    seen = observe(places, perfect + off, sigma=SD)
    recorded = rows_of_observations(seen)
    rows = with_base_rate(recorded.rows, np.zeros(3))
    d = ParameterSet(
        rows, np.ones(6), recorded.since_turn, False, ParameterSetOptions()
    )
    nominal = State(np.zeros(6), np.ones(6), np.zeros((len(places), 2)), np.zeros(3))
    gram = GaussNewton(WindowSystem(rows, d), nominal).gram(
        nominal, np.zeros(d.width), None
    )
    sets = Sets(d, gram)
    there = sets.evaluate(())
    found = Mixing(d, gram, there, sets.typical_instability).run()
    names = [f"acc_{g}.{x}" for g in ("bias", "scale") for x in "xyz"]
    assert found.columns.tolist() == [d.column_by_name[n] for n in names]
    design = np.zeros((len(places), 3, 6))
    for c in range(3):
        design[:, c, c], design[:, c, 3 + c] = 1.0, perfect[:, c]
    return Case(found, off, design.reshape(-1, 6), there.sizes.instability)


def posterior(one: Case, cov: Array) -> tuple[float, Array, Array]:
    """Evidence but for a constant, mean and covariance, with a covariance of means."""
    y, a, s = one.off.ravel(), one.design, np.diag(cov)
    inner = (a.T / s) @ a + np.diag(WIDE**-2.0)
    mean = np.linalg.solve(inner, (a.T / s) @ y)
    square = ((y - a @ mean) ** 2 / s).sum() + ((mean / WIDE) ** 2).sum()
    log_det = np.log(s).sum() + np.linalg.slogdet(inner * np.outer(WIDE, WIDE))[1]
    return float(-0.5 * (square + log_det)), mean, np.linalg.inv(inner)


def steep(power: float) -> Array:
    """Chance of each size, ln."""
    weight = 1 / (1 + priors.SIZES**power)
    return np.asarray(np.log(weight / weight.sum()))


def scattered() -> Array:
    """Chance of each size of what windows wander by, ln: or of a fixture that does."""
    wide = (priors.SIZES > 1) & (priors.SIZES <= priors.LOOSEST_FIXTURE)
    usual = (1 - priors.LOOSE_FIXTURE_CHANCE) * np.exp(steep(priors.INSTABILITY_TAIL))
    return np.asarray(np.log(usual + priors.LOOSE_FIXTURE_CHANCE * wide / wide.sum()))


def known(sizes: Array) -> float:
    """Chance of the instabilities of three axes that are made alike, ln."""
    apart = np.log(priors.SIZES[sizes])
    apart = apart - apart.mean()
    middle = np.interp(sizes.mean(), np.arange(33), scattered())
    return float(middle - 0.5 * ((apart / priors.AXES_LOG_SPREAD) ** 2).sum())


def hypotheses(one: Case) -> list[tuple[float, int, Array]]:
    """Chance, bad window and covariance of every hypothesis on the whole grid."""
    mode, n = np.array(one.mode[:3]), len(one.off)
    middle, out = round(float(mode.mean())), []
    for m in range(33):
        sizes = np.clip(mode + m - middle, 0, 32)
        tau = UNSTABLE * priors.SIZES[sizes]
        cov = np.diag(np.tile(SD**2 + tau**2, n))
        out.append((known(sizes), -1, cov))
        for i in range(n):
            for v in range(33):
                push = np.zeros((n, 3))
                push[i] = (priors.SIZES[v] * priors.UNKNOWN[0]) ** 2
                chance = np.log(priors.BAD_WINDOW_CHANCE) + steep(priors.SIZE_TAIL)[v]
                bad = cov + np.diag(push.ravel())
                out.append((known(sizes) + float(chance), i, bad))
    return out


def brute(one: Case) -> tuple[Array, Array, Array, float]:
    """Mean, covariance, probabilities of windows to be bad, evidence."""
    every = hypotheses(one)
    parts = [posterior(one, cov) for _, _, cov in every]
    score = np.array([h[0] + p[0] for h, p in zip(every, parts, strict=True)])
    total = np.logaddexp.reduce(score)
    weight = np.exp(score - total)
    means = np.array([p[1] for p in parts])
    mean = weight @ means
    cov = np.einsum("h,hij->ij", weight, np.array([p[2] for p in parts]))
    cov += np.einsum("h,hi,hj->ij", weight, means - mean, means - mean)
    window = np.array([h[1] for h in every])
    bad = [weight[window == i].sum() for i in range(len(one.off))]
    const = 3 * len(one.off) * np.log(SD)
    return mean, cov, np.array(bad), float(total + const)


def drawn(seed: int, tau: float, push: float) -> Array:
    rng = np.random.default_rng(seed)
    off = np.hypot(SD, tau) * rng.standard_normal((len(PLACES), 3))
    off[1] += push * np.array([0.6, -0.5, 0.62])
    return np.asarray(off)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.thorough)])
@pytest.mark.parametrize(
    ("tau", "push"),
    [
        (3e-3, 0.0),
        (0.0, 0.03),
        *(
            pytest.param(0.0, push, marks=pytest.mark.thorough)
            for push in (0.0, 6e-3, 3.0)
        ),
    ],
)
def test_it_is_that_of_every_hypothesis_on_the_whole_grid(
    seed: int, tau: float, push: float
) -> None:
    one = case(drawn(seed, tau, push))
    mean, cov, bad, score = brute(one)
    sigma = np.sqrt(np.diag(cov))
    found = np.sqrt(np.diag(one.found.covariance))
    # what is pruned has a weight of a fiftieth at most, each
    np.testing.assert_allclose(one.found.mean / sigma, mean / sigma, atol=0.06)
    np.testing.assert_allclose(found, sigma, rtol=0.06)
    np.testing.assert_allclose(one.found.bad, bad, atol=0.03)
    assert one.found.score == pytest.approx(score, abs=0.15)


@pytest.mark.parametrize(("push", "low", "high"), [(0.0, 0, 0.1), (3.0, 0.999, 1.0)])
def test_a_window_that_is_far_off_is_bad(push: float, low: float, high: float) -> None:
    one = case(drawn(3, 0.0, push))
    assert low <= one.found.bad[1] <= high
    if push:
        # and has no weight left: the others alone say the same
        rest = [0, 2, 3, 4]
        others = case(one.off[rest], tuple(PLACES[i] for i in rest))
        sigma = np.sqrt(np.diag(one.found.covariance))
        off = (one.found.mean - others.found.mean) / sigma
        np.testing.assert_allclose(off, 0, atol=0.3)


def test_one_hypothesis_is_exact() -> None:
    """Of two windows nobody can tell instability, nor which is bad."""
    rng = np.random.default_rng(5)
    one = case(SD * rng.standard_normal((2, 3)), TWO_POSITIONS)
    score, mean, cov = posterior(one, np.diag(np.full(6, SD**2)))
    np.testing.assert_allclose(one.found.mean, mean, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(one.found.covariance, cov, rtol=1e-6, atol=1e-12)
    assert one.found.bad.tolist() == [0.0, 0.0]
    assert one.found.score == pytest.approx(score + 6 * np.log(SD), abs=1e-6)


def test_what_windows_wander_by_is_found() -> None:
    found = [case(drawn(seed, 5e-3, 0.0)).found for seed in range(12)]
    scatter = np.array([f.scatter[:3] for f in found])
    assert 3e-3 < np.median(scatter) < 8e-3
    quiet = [case(drawn(seed, 0.0, 0.0)).found.scatter[:3] for seed in range(12)]
    assert np.median(quiet) < 1e-3
    assert all((f.scatter[3:] == 0).all() for f in found)
