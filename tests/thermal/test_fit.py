"""Polynomials over temperature, against devices with polynomials of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from thermal_devices import SIGMA, Warming, drawn, exact, session

from fieldcal.calibration import limits
from fieldcal.core.errors import InputError
from fieldcal.thermal import ThermalPoint, thermal_model, thermal_point
from fieldcal.thermal.group_fit import GroupData, fit_group

BOUNDS = limits.read("tactical")
SEVEN = (1.0, 8.0, 17.0, 25.0, 33.0, 42.0, 49.0)


def points(
    device: Warming,
    rng: np.random.Generator,
    temperatures: tuple[float, ...] = SEVEN,
    run: float = 0.0,
    share: float = 0.0,
) -> list[ThermalPoint]:
    """Sessions with errors, part of them common, and changes from run to run."""
    covariance = exact(device)
    sigma = np.sqrt(np.diag(covariance))
    common = np.sqrt(share) * rng.normal(0, sigma)
    return [
        thermal_point(
            f"s{i}",
            session(
                device,
                t,
                common
                + np.sqrt(1 - share) * rng.normal(0, sigma)
                + run * rng.normal(0, sigma),
                covariance,
            ),
        )
        for i, t in enumerate(temperatures)
    ]


@pytest.mark.thorough
@pytest.mark.statistical
def test_what_is_stated_holds_over_many_devices() -> None:
    """Orders, what sessions have in common and what changes from run to run drawn."""
    rng, pulls, inside = np.random.default_rng(11), [], []
    for _ in range(60):
        device = drawn(rng, "acc_bias")
        share = rng.choice([0.0, 0.0, 0.3, 0.9])
        inner = np.sort(rng.uniform(5, 45, 5))
        warm = (float(rng.uniform(0, 5)), *inner.tolist(), float(rng.uniform(45, 50)))
        run = float(rng.choice([0.0, 1.0, 10.0]))
        made = thermal_model(points(device, rng, warm, run, share), BOUNDS)
        for t in np.linspace(made.low, made.high, 5):
            true = device.values(t)["acc_bias"]
            for axis, value in zip("xyz", true, strict=True):
                found, sigma = made.at(t)[f"acc_bias.{axis}"]
                pulls.append((found - value) / sigma)
        first, last = device.values(made.low), device.values(made.high)
        for i, axis in enumerate("xyz"):
            change, sigma = made.change(made.high, made.low)[f"acc_bias.{axis}"]
            true_change = last["acc_bias"][i] - first["acc_bias"][i]
            inside.append(abs(change - true_change) < sigma)
    assert 0.9 < np.sqrt(np.mean(np.square(pulls))) < 1.1
    assert 0.58 < np.mean(inside) < 0.82


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_the_order_is_that_of_the_device(order: int) -> None:
    c = np.zeros((4, 3))
    c[: order + 1] = np.array([0.2, 3e-3, 2e-4, 8e-6])[: order + 1, None]
    device = Warming({"acc_bias": c})
    made = thermal_model(points(device, np.random.default_rng(order)), BOUNDS)
    curve = made.curves["acc_bias.x"]
    assert curve.order == order and curve.orders[order] > 0.7
    assert np.sum(curve.orders) == pytest.approx(1.0)


def test_one_set_is_generalised_least_squares() -> None:
    """Mean and covariance of one n, v, r, tau against one dense system."""
    rng = np.random.default_rng(3)
    x, p, s = np.linspace(-1, 1, 6), 2, 6
    a = rng.normal(0, 1, (s, p, p))
    covariance = a @ a.transpose(0, 2, 1) + np.eye(p)
    y = rng.normal(0, 1, (s, p))
    data = GroupData(
        x, y, np.zeros(p), covariance, np.full(s, 0.3), np.full((s, p), 2.0)
    )
    order, size, share, spread = 2, 3.0, 0.3, 0.5
    found = fit_group(data, np.array([[order, size, share, spread]]))
    roots = []
    for c in covariance:
        values, vectors = np.linalg.eigh(c)
        roots.append(vectors @ np.diag(np.sqrt(values)) @ vectors.T)
    legendre = [np.ones(s), x, (3 * x**2 - 1) / 2]
    columns = np.vstack([
        np.hstack([*(np.eye(p) * f[i] for f in legendre), roots[i]]) for i in range(s)
    ])  # fmt: skip
    wide = np.abs(y).max() + np.sqrt(covariance.max())
    prior = np.repeat([100 * wide, size, size / 2, np.sqrt(share)], p) ** 2
    noise = np.zeros((s * p, s * p))
    for i in range(s):
        here = slice(i * p, i * p + p)
        noise[here, here] = (1 - share) * covariance[i] + np.eye(p) * (0.25 + 0.36)
    precision = columns.T @ np.linalg.inv(noise) @ columns + np.diag(1 / prior)
    expected = np.linalg.solve(precision, columns.T @ np.linalg.inv(noise) @ y.ravel())
    used = [*range(3 * p), *range(4 * p, 5 * p)]  # the third order is not in
    np.testing.assert_allclose(found.mean[used], expected, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(
        found.covariance[np.ix_(used, used)], np.linalg.inv(precision), rtol=1e-6,
        atol=1e-9,
    )  # fmt: skip
    assert not found.mean[3 * p : 4 * p].any()


def test_what_all_sessions_have_in_common_stays_in_the_constant() -> None:
    """A base that is tilted alike in each: wrong values, right differences."""
    device = drawn(np.random.default_rng(1), "acc_bias")
    covariance = exact(device) * 100
    every = [
        thermal_point("s", session(device, t, np.full(3, 0.012), covariance))
        for t in SEVEN
    ]
    made = thermal_model(every, BOUNDS)
    value, sigma = made.at(25.0)["acc_bias.x"]
    assert abs(value - device.values(25.0)["acc_bias"][0] - 0.012) < 1e-4
    assert sigma > 0.012 > 2 * made.change(49.0, 1.0)["acc_bias.x"][1]


def test_temperature_that_wanders_within_a_session_widens_it() -> None:
    device = Warming({"acc_bias": np.outer([0.1, 5e-3, 0, 0], np.ones(3))})
    still = points(device, np.random.default_rng(2))
    wandering = [replace(p, temperature_sd=1.0) for p in still]
    narrow, wide = (thermal_model(p, BOUNDS) for p in (still, wandering))
    assert wide.at(25.0)["acc_bias.x"][1] > 1.5 * narrow.at(25.0)["acc_bias.x"][1]


def test_a_session_that_jumped_is_not_what_the_others_predict() -> None:
    device = drawn(np.random.default_rng(4), "gyr_bias")
    every = points(device, np.random.default_rng(4))
    odd = every[3].calibration
    values = odd.values + [1e-2, 0, 0]
    every[3] = replace(every[3], calibration=replace(odd, values=values))
    z = np.abs(thermal_model(every, BOUNDS).curves["gyr_bias.x"].held_out)
    assert z.argmax() == 3 and z[3] > 4
    assert np.abs(thermal_model(points(device, np.random.default_rng(4)), BOUNDS)
                  .curves["gyr_bias.x"].held_out).max() < 4  # fmt: skip


@pytest.mark.parametrize("temperature", [0.5, 49.5, -40.0, 85.0])
def test_beyond_the_sessions_nothing_is_said(temperature: float) -> None:
    device = drawn(np.random.default_rng(5), "acc_bias")
    made = thermal_model(points(device, np.random.default_rng(5)), BOUNDS)
    with pytest.raises(InputError, match=r"beyond the sessions.*1\.0 to 49\.0 °C"):
        made.at(temperature)
    with pytest.raises(InputError, match="beyond the sessions"):
        made.change(temperature, 25.0)


@pytest.mark.parametrize("warm", [(20.0, 40.0), (20.0, 20.5, 40.0), (20.0, 24.0, 29.0)])
def test_too_few_temperatures_are_refused(warm: tuple[float, ...]) -> None:
    device = drawn(np.random.default_rng(6), "acc_bias")
    with pytest.raises(InputError, match="at least 3 temperatures over 10 K"):
        thermal_model(points(device, np.random.default_rng(6), warm), BOUNDS)


def test_groups_that_not_all_sessions_have_are_left_out() -> None:
    both = drawn(np.random.default_rng(7), "acc_bias", "gyr_bias")
    one = Warming({"acc_bias": both.coefficients["acc_bias"]})
    every = points(both, np.random.default_rng(7))[:-1]
    every += points(one, np.random.default_rng(8), (49.0,))
    made = thermal_model(every, BOUNDS)
    assert set(made.curves) == {f"acc_bias.{axis}" for axis in "xyz"}
    assert made.of("gyr_bias") is None and len(made.of("acc_bias") or []) == 3


def test_the_sigma_of_a_session_is_that_of_the_test_device() -> None:
    device = drawn(np.random.default_rng(8))
    made = thermal_model(points(device, np.random.default_rng(8)), BOUNDS)
    for name, (value, sigma) in made.at(33.0).items():
        group, axis = name.split(".")
        true = device.values(33.0)[group]["xyz".index(axis)]
        assert abs(value - true) < 4 * sigma < 8 * SIGMA[group]
