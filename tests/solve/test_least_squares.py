"""The examples of the 2017 paper as they hold, and schedules that do not."""

import numpy as np
import pytest
from observed import BIAS, COUPLING, SCALE, observe, outputs, practice

from fieldcal.calibration import Calibration, Nominal
from fieldcal.core import frames
from fieldcal.core.errors import NotObservable
from fieldcal.core.positions import SIX_FACES, Position
from fieldcal.core.samples import Array
from fieldcal.solve import solve

NINE = SIX_FACES + tuple(Position.deg(a, b) for a, b in [(45, 0), (0, 45), (45, 45)])

# example 1, with k22 = k33 = 1 and 40 positions, 0 to 390 degrees
M1 = np.array([[1.0, 0.01, -0.01], [-0.01, 1.0, 0.01], [0.01, -0.01, 1.0]])


def turned_about_three_axes() -> tuple[tuple[Position, ...], Array]:
    """Forty positions turned by the same angle about z, x and y in turn; in g."""
    places, directions = [], []
    for t in np.deg2rad(np.arange(0, 400, 10)):
        c, s = np.cos(t), np.sin(t)
        f = frames.specific_force_at_rest(t, t, 1.0) @ np.array(
            [[c, 0, s], [0, 1, 0], [-s, 0, c]]
        )
        a, b = frames.angles_of_force_direction(f)
        places.append(Position("", a, b))
        directions.append(f)
    return tuple(places), np.array(directions)


def off_diagonal(m: Array) -> Array:
    return np.array([m[0, 1], m[0, 2], m[1, 0], m[1, 2], m[2, 0], m[2, 1]])


@pytest.mark.parametrize("method", ["least_squares", "joint"])
def test_example_1_axial_accelerometers(method: str) -> None:
    places, f = turned_about_three_axes()
    u = 2.5 + f @ M1.T
    seen = observe(places, u, sigma=1e-6, gravity=1.0)
    found = solve(seen, method=method, tilt="none", cross=True)  # type: ignore[arg-type]
    assert found.groups == ("acc_bias", "acc_scale", "cross_coupling")
    np.testing.assert_allclose(found.vector("acc_bias")[0], 2.5, atol=1e-7)
    np.testing.assert_allclose(found.accelerometers()[1], M1, atol=1e-7)
    assert found.dof == 3 * 40 - 12


def rates(table: Array) -> tuple[Position, ...]:
    return tuple(Position("", rate=tuple(row)) for row in table.tolist())


def spun(table: Array, u: Array) -> Calibration:
    places = rates(table)
    nowhere = np.full((len(u), 3), np.nan)
    nominal = Nominal(gyr_bias=(2.0, 2.0, 2.0))
    return solve(observe(places, nowhere, gyr=u, sigma_gyr=1e-6, nominal=nominal))


def test_example_3_gyroscopes() -> None:
    w = np.arange(0, 101, 10.0)  # eleven rates
    table = np.column_stack([w, np.sqrt(w), np.cbrt(w)])
    found = spun(table, 2.0 + table @ M1.T)
    bias, matrix = found.gyroscopes()
    # the Earth's rate is not known, and taken as absent
    assert (np.abs(bias - 2.0) < 0.1 * found.vector("gyr_bias")[1]).all()
    np.testing.assert_allclose(matrix, M1, atol=1e-6)
    # the print's solution, (3.3), is the same but for its weights
    rows = np.column_stack([np.ones(11), table])
    printed = solve(
        observe(rates(table), np.full((11, 3), np.nan), gyr=2.0 + table @ M1.T),
        as_printed=True,
    )
    plain = np.linalg.lstsq(rows, 2.0 + table @ M1.T, rcond=None)[0]
    np.testing.assert_allclose(printed.vector("gyr_bias")[0], plain[0], atol=1e-9)
    np.testing.assert_allclose(printed.gyroscopes()[1], plain[1:].T, atol=1e-9)


def test_rates_about_one_axis_only() -> None:
    table = np.array([[0.0, 0, 0], [0.5, 0, 0], [-0.5, 0, 0]])
    found = spun(table, 2.0 + table @ M1.T)
    assert set(found.names) == {
        "gyr_bias.x", "gyr_bias.y", "gyr_bias.z", "gyr_scale.x",
        "gyro_cross_coupling.s21", "gyro_cross_coupling.s31",
    }  # fmt: skip
    (text,) = [w for w in found.warnings if "not determined" in w]
    assert (
        "gyr_scale.y" in text
        and "gyro_cross_coupling (4 of its 6 coefficients)" in text
    )


def test_the_proposed_rates_are_the_remedy() -> None:
    table = np.array([[0.0, 0, 0], [0.5, 0, 0], [-0.5, 0, 0]])
    (text,) = [w for w in spun(table, 2.0 + table @ M1.T).warnings if "add" in w]
    extra = [np.deg2rad(20) * np.eye(3)["xyz".index(a)]
             for a in "xyz" if f"20°/s about device axis {a}" in text]  # fmt: skip
    mended = np.vstack([table, *extra])
    found = spun(mended, 2.0 + mended @ M1.T)
    assert not any("not determined" in w for w in found.warnings)
    np.testing.assert_allclose(found.gyroscopes()[1], M1, atol=1e-5)


def test_a_rate_table_whose_rest_says_nothing_of_the_accelerometers() -> None:
    turns = [[0.0, 0, 0], [20.0, 0, 0], [0.0, 20, 0], [0.0, 0, 20], [9.0, 9, 9]]
    table = np.deg2rad(np.array(turns))
    places = (Position("at rest"), *rates(table[1:]))
    acc = np.tile([0.0, -9.81, 0.0], (5, 1))
    seen = observe(places, acc, gyr=0.01 + table @ M1.T, sigma_gyr=1e-7)
    result = solve(seen)
    assert "gyr_scale" in result.groups and "acc_scale" not in result.groups
    np.testing.assert_allclose(result.gyroscopes()[1], M1, atol=3 * result.sigma.max())


def test_two_turned_positions_leave_everything_open() -> None:
    places = (Position.deg(20, 3), Position.deg(20, 3))
    with pytest.raises(NotObservable, match="acc_bias.x"):
        solve(observe(places, outputs(places)), method="least_squares")
    unknown = (Position("by hand"),) * 5
    with pytest.raises(NotObservable, match="scalar"):
        solve(observe(unknown, np.ones((5, 3))), method="least_squares")


@pytest.mark.parametrize("count", [35, pytest.param(75, marks=pytest.mark.thorough)])
def test_scatter_and_chi2_are_as_stated(count: int) -> None:
    """Of 35, a sigma that is a tenth too small shows, and one a fifth too large."""
    rng = np.random.default_rng(4)
    u = outputs(NINE, coupling=COUPLING)
    truth = [*BIAS, *SCALE, *off_diagonal(COUPLING)]
    pulls, chi2 = [], []
    for _ in range(count):
        seen = observe(NINE, u + 1e-3 * rng.standard_normal(u.shape))
        found = solve(seen, method="least_squares")
        pulls.append((found.values - truth) / found.sigma)
        chi2.append(found.chi2 / found.dof)
    assert found.dof == 27 - 12
    assert 0.9 < np.std(pulls) < 1.06
    np.testing.assert_allclose(np.std(pulls, axis=0), 1, atol=0.27)
    assert np.mean(chi2) == pytest.approx(1, abs=0.13)


@pytest.mark.parametrize("count", [24, pytest.param(60, marks=pytest.mark.thorough)])
def test_positions_that_do_not_return_widen_the_intervals(count: int) -> None:
    rng = np.random.default_rng(14)
    u = outputs(NINE, coupling=COUPLING)
    truth = np.array([*BIAS, *SCALE, *off_diagonal(COUPLING)])
    inside = []
    for _ in range(count):
        seen = observe(NINE, u + 0.05 * rng.standard_normal(u.shape))
        found = solve(seen, method="least_squares")
        inside.append(np.abs(found.values - truth) < 1.96 * found.sigma)
        assert any("than the noise of their windows" in w for w in found.warnings)
    assert 0.92 < np.mean(inside) < 0.98


def test_a_practice_session_with_cross_coupling() -> None:
    seen, answers = practice("p02")
    result = solve(seen, method="least_squares")
    matrix_put_in = np.array(answers["concealed"]["cross_coupling"]["matrix"])
    value, sigma = result.vector("cross_coupling")
    assert (np.abs(value - off_diagonal(matrix_put_in)) < 3.5 * sigma).all()
