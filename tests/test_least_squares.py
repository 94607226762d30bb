"""The examples of the 2017 paper as they hold, and schedules that do not."""

import doctest

import numpy as np
import pytest
from observed import BIAS, COUPLING, SCALE, observe, outputs, practice

from fieldcal import frames
from fieldcal.errors import NotObservable
from fieldcal.positions import SIX_FACES, Position
from fieldcal.samples import Array
from fieldcal.solve import least_squares, linear, solve
from fieldcal.solve.estimate import Estimate
from fieldcal.solve.least_squares import accelerometers, gyroscopes, matrix

NINE = SIX_FACES + tuple(Position.deg(a, b) for a, b in [(45, 0), (0, 45), (45, 45)])

# examples 1 and 2, with k22 = k33 = 1 and 40 positions, 0 to 390 degrees
M1 = np.array([[1.0, 0.01, -0.01], [-0.01, 1.0, 0.01], [0.01, -0.01, 1.0]])
M2 = 1e-3 * np.array([[-1.0, 1, 1], [1, -1, 1], [1, 1, -1]])


def products(v: Array) -> Array:
    x, y, z = v.T
    return np.column_stack([x * y, y * z, x * z])


def turned_about_three_axes() -> tuple[tuple[Position, ...], Array]:
    """Forty positions turned by the same angle about z, x and y in turn; in g."""
    places, directions = [], []
    for t in np.deg2rad(np.arange(0, 400, 10)):
        c, s = np.cos(t), np.sin(t)
        f = frames.force(t, t, 1.0) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        a, b = frames.angles_of(f)
        places.append(Position("", a, b))
        directions.append(f)
    return tuple(places), np.array(directions)


def values(found: Estimate, group: str) -> Array:
    return np.array([
        v for n, v in zip(found.names, found.values, strict=True)
        if n.startswith(group + ".")
    ])  # fmt: skip


def off_diagonal(m: Array) -> Array:
    return np.array([m[0, 1], m[0, 2], m[1, 0], m[1, 2], m[2, 0], m[2, 1]])


def test_examples_in_the_text() -> None:
    failed, tried = doctest.testmod(least_squares, extraglobs={"np": np})
    assert tried and not failed


def test_example_1_axial_accelerometers() -> None:
    places, f = turned_about_three_axes()
    u = 2.5 + f @ M1.T
    found = accelerometers(observe(places, u, sigma=1e-6, gravity=1.0))
    np.testing.assert_allclose(values(found, "acc_bias"), 2.5, atol=1e-9)
    np.testing.assert_allclose(values(found, "acc_scale"), 1.0, atol=1e-9)
    np.testing.assert_allclose(
        values(found, "cross_coupling"), off_diagonal(M1), atol=1e-9
    )


def test_example_2_pendulous_accelerometers() -> None:
    places, f = turned_about_three_axes()
    u = 2.5 + f @ M1.T + products(f) @ M2.T
    found = accelerometers(observe(places, u, sigma=1e-6, gravity=1.0), products=True)
    np.testing.assert_allclose(values(found, "acc_bias"), 2.5, atol=1e-9)
    np.testing.assert_allclose(values(found, "acc_scale"), 1.0, atol=1e-9)
    np.testing.assert_allclose(
        values(found, "pendulous_products").reshape(3, 3), M2, atol=1e-9
    )


def rates(table: Array) -> tuple[Position, ...]:
    return tuple(Position("", rate=tuple(row)) for row in table.tolist())


def spun(table: Array, u: Array, with_products: bool = False) -> Estimate:
    places = rates(table)
    seen = observe(places, np.full((len(u), 3), np.nan), gyr=u, sigma_gyr=1e-6)
    return gyroscopes(seen, with_products)


def condition(table: Array, with_products: bool = False) -> tuple[float, int]:
    _, _, kept, _ = linear.decompose(matrix(table, with_products))
    return float(kept[0] / kept[-1]), len(kept)


def test_example_3_gyroscopes() -> None:
    w = np.arange(0, 101, 10.0)  # eleven rates
    table = np.column_stack([w, np.sqrt(w), np.cbrt(w)])
    found = spun(table, 2.0 + table @ M1.T)
    np.testing.assert_allclose(values(found, "gyr_bias"), 2.0, atol=1e-9)
    np.testing.assert_allclose(values(found, "gyr_scale"), 1.0, atol=1e-9)
    np.testing.assert_allclose(
        values(found, "gyro_cross_coupling"), off_diagonal(M1), atol=1e-9
    )
    assert condition(table)[0] == pytest.approx(189, abs=1)
    assert condition(table[1:])[0] == pytest.approx(1930, abs=10)


def example_4() -> tuple[Array, Array]:
    w = np.arange(0, 101, 10.0)
    table = np.column_stack([w, np.exp(-w), np.cbrt(w)])
    return table, 2.0 + table @ M1.T + products(table) @ M2.T


def test_example_4_expanded_gyroscopes_with_a_standstill() -> None:
    table, u = example_4()
    found = spun(table, u, with_products=True)
    assert condition(table, True)[0] == pytest.approx(3.4e5, rel=0.02)
    np.testing.assert_allclose(values(found, "gyr_bias"), 2.0, atol=1e-6)
    np.testing.assert_allclose(values(found, "gyr_scale"), 1.0, atol=1e-4)
    np.testing.assert_allclose(
        values(found, "gyro_products").reshape(3, 3), M2, atol=1e-4
    )
    assert any("poorly" in w for w in found.warnings)


def test_example_4_without_a_standstill_is_refused_by_name() -> None:
    table, u = example_4()
    found = spun(table[1:], u[1:], with_products=True)
    assert condition(table[1:], True)[1] == 6
    (text,) = [w for w in found.warnings if "not determined" in w]
    for name in ("gyr_scale.y", "gyro_cross_coupling.s12", "gyro_products.p11",
                 "gyro_products.p12"):  # fmt: skip
        assert name in text and name not in found.names
    assert "add a rate of (" in text
    # what is left is still right
    np.testing.assert_allclose(values(found, "gyr_bias"), 2.0, atol=1e-4)
    assert found.values[found.names.index("gyr_scale.x")] == pytest.approx(1, abs=1e-4)


def test_the_proposed_rate_is_the_remedy() -> None:
    table, u = example_4()
    (text,) = [w for w in spun(table[1:], u[1:], True).warnings if "add" in w]
    numbers = text.partition("a rate of (")[2].partition(")")[0]
    extra = np.deg2rad([float(x) for x in numbers.split(",")])
    mended = np.vstack([table[1:], extra])
    u = 2.0 + mended @ M1.T + products(mended) @ M2.T
    found = spun(mended, u, with_products=True)
    assert not any("not determined" in w for w in found.warnings)


def test_rates_about_one_axis_only() -> None:
    table = np.array([[0.0, 0, 0], [0.5, 0, 0], [-0.5, 0, 0]])
    found = spun(table, 0.01 + table @ M1.T)
    assert set(found.names) == {
        "gyr_bias.x", "gyr_bias.y", "gyr_bias.z", "gyr_scale.x",
        "gyro_cross_coupling.s21", "gyro_cross_coupling.s31",
    }  # fmt: skip


def test_a_rate_table_whose_rest_says_nothing_of_the_accelerometers() -> None:
    turns = [[0.0, 0, 0], [20.0, 0, 0], [0.0, 20, 0], [0.0, 0, 20], [9.0, 9, 9]]
    table = np.deg2rad(np.array(turns))
    places = (Position("at rest"), *rates(table[1:]))
    acc = np.tile([0.0, -9.81, 0.0], (5, 1))
    seen = observe(places, acc, gyr=0.01 + table @ M1.T, sigma_gyr=1e-7)
    result = solve(seen)
    assert result.method == "least_squares" and "acc_bias" not in result.groups
    np.testing.assert_allclose(result.gyroscopes()[1], M1, atol=1e-6)
    assert any("accelerometers are not calibrated" in w for w in result.warnings)


def test_two_turned_positions_leave_everything_open() -> None:
    places = (Position.deg(20, 3), Position.deg(20, 3))
    with pytest.raises(NotObservable, match="acc_bias.x"):
        accelerometers(observe(places, outputs(places)))
    unknown = (Position("by hand"),) * 5
    with pytest.raises(NotObservable, match="scalar"):
        accelerometers(observe(unknown, np.ones((5, 3))))


def test_scatter_and_chi2_are_as_stated() -> None:
    rng = np.random.default_rng(4)
    u = outputs(NINE, coupling=COUPLING)
    truth = [*BIAS, *SCALE, *off_diagonal(COUPLING)]
    pulls, chi2 = [], []
    for _ in range(500):
        found = accelerometers(observe(NINE, u + 1e-3 * rng.standard_normal(u.shape)))
        pulls.append((found.values - truth) / np.sqrt(np.diag(found.covariance)))
        chi2.append(found.chi2 / found.dof)
    np.testing.assert_allclose(np.std(pulls, axis=0), 1, atol=0.12)
    assert np.mean(chi2) == pytest.approx(1, abs=0.04)


def test_positions_that_do_not_return_widen_the_intervals() -> None:
    rng = np.random.default_rng(14)
    u = outputs(NINE, coupling=COUPLING)
    truth = np.array([*BIAS, *SCALE, *off_diagonal(COUPLING)])
    inside = []
    for _ in range(200):
        seen = observe(NINE, u + 0.05 * rng.standard_normal(u.shape))
        found = accelerometers(seen)
        sigma = np.sqrt(np.diag(found.covariance))
        inside.append(np.abs(found.values - truth) < 1.96 * sigma)
        assert any("beyond their windows' noise" in w for w in found.warnings)
    assert 0.93 < np.mean(inside) < 0.975


def test_a_practice_session_with_cross_coupling() -> None:
    seen, answers = practice("p02")
    result = solve(seen, method="least_squares")
    matrix_put_in = np.array(answers["concealed"]["cross_coupling"]["matrix"])
    value, sigma = result.vector("cross_coupling")
    assert (np.abs(value - off_diagonal(matrix_put_in)) < 3.5 * sigma).all()
