"""Two and five positions against devices turned another way; each misprint held."""

import itertools
import tomllib

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from observed import (
    BIAS,
    GYR_BIAS,
    OMEGA,
    SCALE,
    SHARED,
    carried,
    observe,
    outputs,
    practice,
)

from fieldcal.calibration.names import Tilt
from fieldcal.core.errors import InputError, NotObservable
from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS, Position
from fieldcal.core.samples import Array
from fieldcal.solve import Observations, solve
from fieldcal.solve.closed_form import two_position
from fieldcal.solve.five_position import axis_estimates, five_position

LATITUDE = float(np.deg2rad(50.45))
NOT_45 = (Position.deg(0, 0), Position.deg(30, 7))
SPREAD_OUT = tuple(
    Position.deg(a, b) for a, b in [(-40, -30), (-35, 25), (5, 0), (30, -20), (45, 35),
                                    (10, 30)]
)  # fmt: skip

MOUNTINGS = [
    m for axes in itertools.permutations(range(3))
    for signs in itertools.product([1.0, -1.0], repeat=3)
    for m in [np.diag(signs) @ np.eye(3)[list(axes)]]
    if np.linalg.det(m) > 0
]  # fmt: skip


def test_two_positions_give_back_what_was_put_in() -> None:
    found = two_position(observe(NOT_45, outputs(NOT_45)))
    np.testing.assert_allclose(found.values, [*BIAS, *SCALE], rtol=1e-12)


@pytest.mark.parametrize("places", [TWO_POSITIONS, FIVE_POSITIONS])
def test_an_axis_the_other_way_round_does_not_pass(
    places: tuple[Position, ...],
) -> None:
    u = outputs(places)
    assert solve(observe(places, u)).good
    u[:, 1] *= -1
    found = solve(observe(places, u))
    assert not found.good
    assert "acc_scale.y" in found.warnings[0] and "other way" in found.warnings[0]


def test_the_printed_solution_follows_from_the_turns_and_not_from_the_print() -> None:
    # (11)-(14) with the signs of (3), solved symbolically from U = U0 + k f
    a, b, g, k, u0 = sympy.symbols("a b g k u0")
    turned = sympy.Matrix([0, -g, 0])
    first = sympy.Matrix(
        [[sympy.cos(a), sympy.sin(a), 0], [-sympy.sin(a), sympy.cos(a), 0], [0, 0, 1]]
    )
    second = sympy.Matrix(
        [[1, 0, 0], [0, sympy.cos(b), sympy.sin(b)], [0, -sympy.sin(b), sympy.cos(b)]]
    )
    f = second * first * turned
    assert sympy.simplify(f[2] - g * sympy.cos(a) * sympy.sin(b)) == 0
    printed = (u0 - (u0 + k * f[2])) / (g * sympy.cos(a) * sympy.sin(b))  # (12)
    assert sympy.simplify(printed + k) == 0


def test_print_of_12_returns_minus_k33() -> None:
    found = two_position(observe(NOT_45, outputs(NOT_45)), as_printed=True)
    expected = [*BIAS, SCALE[0], SCALE[1], -SCALE[2]]
    np.testing.assert_allclose(found.values, expected, rtol=1e-12)


@given(
    st.sampled_from(MOUNTINGS),
    st.floats(0.2, 1.3),
    st.floats(0.05, 1.3),
    st.booleans(),
)
def test_two_positions_in_any_mounting_and_order(
    mounting: Array, a: float, b: float, swapped: bool
) -> None:
    places = (Position("first", 0.0, 0.0), Position("second", a, b))
    if swapped:
        places = places[::-1]
    u = outputs(places, mounting=mounting)
    found = two_position(observe(places, u, mounting=mounting))
    np.testing.assert_allclose(found.values, [*BIAS, *SCALE], atol=1e-9)


def test_covariance_is_that_of_the_windows_carried_through() -> None:
    rng = np.random.default_rng(3)
    truth = outputs(TWO_POSITIONS)
    half = rng.standard_normal((2, 3, 3))
    cov = 1e-6 * (half @ half.transpose(0, 2, 1) + np.eye(3))
    drawn = []
    for _ in range(500):
        noise = (np.linalg.cholesky(cov) @ rng.standard_normal((2, 3, 1)))[..., 0]
        seen = observe(TWO_POSITIONS, truth + noise)
        seen.covariance[:, :3, :3] = cov
        found = two_position(seen)
        drawn.append(found.values)
    ratio = np.std(drawn, axis=0) / np.sqrt(np.diag(found.covariance))
    np.testing.assert_allclose(ratio, 1, atol=0.07)


def test_table_2_is_one_degree_of_tilt() -> None:
    path = SHARED / "paper" / "tables.toml"
    if not path.is_file():
        pytest.skip(f"the paper's tables are not here: {path}")
    tables = tomllib.loads(path.read_text())
    # the experiment's device reads +g on y at home, which turns y and z over
    flipped = np.diag([1.0, -1.0, -1.0])
    u = outputs(TWO_POSITIONS, offset_deg=(1, 1), mounting=flipped, bias=np.zeros(3),
                scale=np.ones(3), g=9.80665)  # fmt: skip
    seen = observe(TWO_POSITIONS, u, mounting=flipped, gravity=9.80665)
    found = two_position(seen)
    keys = ["dUx0", "dUy0", "dUz0", "dK11", "dK22", "dK33"]
    published = np.array(
        [np.subtract(tables["table2"][k][2], tables["table1"][k][2]) for k in keys]
    )
    errors = found.values - [0, 0, 0, 1, 1, 1]
    np.testing.assert_allclose(errors[:3], published[:3], rtol=0.05)
    np.testing.assert_allclose(errors[3:], published[3:], rtol=0.06)
    np.testing.assert_allclose(
        errors, [-0.171, -0.443, -0.171, -0.0074, 0.0449, -0.105], atol=6e-4
    )
    # a base that is itself tilted would not have given this
    u = outputs(TWO_POSITIONS, base_deg=(1, 1), mounting=flipped, bias=np.zeros(3),
                scale=np.ones(3), g=9.80665)  # fmt: skip
    rigid = two_position(observe(TWO_POSITIONS, u, mounting=flipped, gravity=9.80665))
    assert abs(rigid.values[5] - 1) < 0.025


@pytest.mark.parametrize("beta", [0.0, 180.0])
def test_a_turn_that_loads_z_alike_leaves_z_out_and_says_what_would_help(
    beta: float,
) -> None:
    places = (Position.deg(0, 0), Position.deg(40, beta))
    found = two_position(observe(places, outputs(places)))
    assert "acc_scale.z" not in found.names and "acc_scale.x" in found.names
    np.testing.assert_allclose(
        found.values[list(found.names).index("acc_bias.z")], BIAS[2], atol=1e-12
    )
    whole = solve(observe(places, outputs(places)))
    assert set(whole.names) == set(found.names)
    np.testing.assert_allclose(whole.values, found.values, atol=1e-6)
    text = " ".join(whole.warnings)
    assert "acc_scale.z is not determined" in text and "β = 5°" in text


@pytest.mark.parametrize(
    "places",
    [
        (TWO_POSITIONS[0], TWO_POSITIONS[0]),
        (TWO_POSITIONS[1], TWO_POSITIONS[1]),
        TWO_POSITIONS[:1],
    ],
)
def test_positions_that_hold_no_scale_factor_are_refused(
    places: tuple[Position, ...],
) -> None:
    with pytest.raises(NotObservable) as told:
        two_position(observe(places, outputs(places)))
    alike = (
        f"{places[0].name} and {places[-1].name} give every accelerometer the same"
        " specific force, so they hold no scale factor: turn the second position, to"
        " α = 45°, β = 5° for instance"
    )
    few = "two positions with known angles are needed, not 1"
    assert str(told.value) == (alike if len(places) == 2 else few)


@pytest.mark.parametrize("g", [0.0, -9.81, float("nan")])
def test_gravity_that_is_none_is_refused(g: float) -> None:
    with pytest.raises(InputError, match="gravity"):
        observe(TWO_POSITIONS, outputs(TWO_POSITIONS), gravity=g)


@pytest.mark.thorough
def test_how_level_the_base_is_enters_the_uncertainty() -> None:
    rng = np.random.default_rng(0)
    level = np.deg2rad(0.5)
    pulls = []
    for _ in range(100):
        tilt = np.rad2deg(level * rng.standard_normal(2))
        u = outputs(TWO_POSITIONS, base_deg=tilt.tolist()) + 1e-3 * rng.standard_normal(
            (2, 3)
        )
        found = solve(observe(TWO_POSITIONS, u), level_sigma_deg=0.5)
        value = np.concatenate([found.vector(g)[0] for g in ("acc_bias", "acc_scale")])
        sigma = np.concatenate([found.vector(g)[1] for g in ("acc_bias", "acc_scale")])
        pulls.append((value - [*BIAS, *SCALE]) / sigma)
    np.testing.assert_allclose(np.std(pulls, axis=0), 1, atol=0.17)


OFFSET = (1.3, -0.7)
TILTED: dict[Tilt, dict[str, tuple[float, float]]] = {
    "angle_offset": {"offset_deg": OFFSET},
    "base_tilt": {"base_deg": (-0.7, 1.3)},
}


@pytest.mark.parametrize("places", [FIVE_POSITIONS, SPREAD_OUT])
def test_five_positions_give_back_what_was_put_in(places: tuple[Position, ...]) -> None:
    u = outputs(places, offset_deg=OFFSET)
    found = five_position(observe(places, u, sigma=1e-5))
    np.testing.assert_allclose(found.values[:6], [*BIAS, *SCALE], atol=1e-9)
    np.testing.assert_allclose(found.values[6:], OFFSET, atol=1e-7)


@given(st.sampled_from(MOUNTINGS))
def test_five_positions_in_any_mounting(mounting: Array) -> None:
    u = outputs(SPREAD_OUT, mounting=mounting, offset_deg=OFFSET)
    found = five_position(observe(SPREAD_OUT, u, mounting=mounting))
    np.testing.assert_allclose(found.values[:6], [*BIAS, *SCALE], atol=1e-9)


def test_a_reversed_axis_shows_in_the_sign_that_22_30_34_lose() -> None:
    scale = SCALE * [-1, -1, -1]
    seen = observe(SPREAD_OUT, outputs(SPREAD_OUT, scale=scale, offset_deg=OFFSET))
    found = five_position(seen)
    np.testing.assert_allclose(found.values[3:6], scale, atol=1e-9)
    printed = five_position(seen, as_printed=True)
    np.testing.assert_allclose(printed.values[3:6], -scale, atol=1e-9)


def test_23_is_inverted_in_print() -> None:
    u = outputs(SPREAD_OUT, offset_deg=(1.3, -0.7))
    each = axis_estimates(observe(SPREAD_OUT, u), as_printed=True)
    at = dict(zip(each.names, each.values, strict=True))
    assert at["x.alpha0_deg"] == pytest.approx(90 - 1.3)
    assert at["y.alpha0_deg"] == pytest.approx(1.3)  # (29) holds
    assert at["z.beta0_deg"] == pytest.approx(-0.7)  # (32) holds


def test_coefficients_of_17_both_carry_the_minus() -> None:
    a, a0, k, g = sympy.symbols("a a0 k g")
    out = sympy.expand(-k * g * sympy.sin(a + a0), trig=True)
    assert out.coeff(sympy.sin(a)) == -k * g * sympy.cos(a0)
    assert out.coeff(sympy.cos(a)) == -k * g * sympy.sin(a0)


def test_five_positions_scatter_as_stated() -> None:
    rng = np.random.default_rng(5)
    u = outputs(SPREAD_OUT, offset_deg=OFFSET)
    truth = [*BIAS, *SCALE, *OFFSET]
    pulls = []
    for _ in range(250):
        noise = 1e-3 * rng.standard_normal(u.shape)
        found = five_position(observe(SPREAD_OUT, u + noise))
        pulls.append((found.values - truth) / np.sqrt(np.diag(found.covariance)))
    np.testing.assert_allclose(np.std(pulls, axis=0), 1, atol=0.1)
    np.testing.assert_allclose(np.mean(pulls, axis=0), 0, atol=0.15)


def test_axes_that_few_positions_leave_open_are_left_out() -> None:
    places = tuple(Position.deg(a, 0) for a in (0, 20, 45))
    found = five_position(observe(places, outputs(places, offset_deg=(1, 0))))
    assert found.names == ("acc_bias.x", "acc_scale.x", "angle_offset.alpha0_deg")
    with pytest.raises(NotObservable) as told:
        five_position(observe(TWO_POSITIONS, outputs(TWO_POSITIONS)))
    assert str(told.value) == (
        "2 positions separate bias, scale factor and tilt on no axis: take at least"
        " three different α, or assume a level base"
    )


def earth(a: float, b: float) -> Array:
    down = -OMEGA * np.sin(LATITUDE)
    return carried(a, b, [0.0, down, OMEGA * np.cos(LATITUDE)])


def gyro_means(places: tuple[Position, ...], scale: Array) -> Array:
    rows = [GYR_BIAS + scale * earth(p.alpha or 0, p.beta or 0) for p in places]
    return np.array(rows)


def navigation(scale: Array) -> Observations:
    """Two positions of gyroscopes that see the Earth turn."""
    return observe(NOT_45, outputs(NOT_45), gyr=gyro_means(NOT_45, scale),
                   sigma_gyr=1e-9, latitude=LATITUDE, grade="navigation")  # fmt: skip


def by_45_to_48(u: Array, a: float, b: float) -> Array:
    """Bias and scale factor from outputs (2, 3) at home and at a, b, written out."""
    up, north = OMEGA * np.sin(LATITUDE), OMEGA * np.cos(LATITUDE)
    w2 = [
        -up * np.sin(a),
        -up * np.cos(a) * np.cos(b) + north * np.sin(b),
        up * np.cos(a) * np.sin(b) + north * np.cos(b),
    ]
    scale = (u[1] - u[0]) / (np.array(w2) - [0, -up, north])
    return np.concatenate([u[0] - scale * [0, -up, north], scale])


def test_navigation_gyroscopes_by_45_to_48() -> None:
    scale = np.array([1.01, 0.98, 1.03])
    seen = navigation(scale)
    closed = by_45_to_48(seen.mean[:, 3:], *np.deg2rad([30, 7]).tolist())
    np.testing.assert_allclose(closed, [*GYR_BIAS, *scale], rtol=1e-9)
    found = solve(seen)
    names = [f"gyr_{g}.{x}" for g in ("bias", "scale") for x in "xyz"]
    assert set(names) <= set(found.names)
    for name, value in zip(names, closed, strict=True):
        # what is found is drawn to nominal by (uncertainty / prior)^2
        assert found.value(name) == pytest.approx(
            value, abs=0.02 * found.uncertainty(name)
        )


def test_misprints_of_40_and_41_show_at_other_angles_than_45() -> None:
    printed = solve(navigation(np.ones(3)), as_printed=True)
    assert printed.value("gyr_scale.x") == pytest.approx(-1)  # +sin phi in (39)
    assert abs(printed.value("gyr_scale.y") - 1) > 0.5
    assert abs(printed.value("gyr_scale.z") - 1) > 0.5
    # of (41) alone: cos alpha, which sin alpha equals at 45 degrees only
    a, b = np.deg2rad([30, 7])
    third = OMEGA * (np.sin(LATITUDE) * np.cos(a) * np.sin(b)
                     + np.cos(LATITUDE) * np.cos(b))  # fmt: skip
    assert earth(a, b)[2] == pytest.approx(third)


def test_tactical_bias_is_the_mean_less_what_is_known_of_the_earth() -> None:
    rng = np.random.default_rng(8)
    pulls = []
    nothing = np.full((5, 3), np.nan)
    for _ in range(30):
        psi = rng.uniform(-np.pi, np.pi)
        base = OMEGA * np.array(
            [np.cos(LATITUDE) * np.sin(psi), -np.sin(LATITUDE),
             np.cos(LATITUDE) * np.cos(psi)]
        )  # fmt: skip
        turning = [
            carried(p.alpha or 0, p.beta or 0, base.tolist()) for p in FIVE_POSITIONS
        ]
        gyr = GYR_BIAS + np.array(turning) + 2e-5 * rng.standard_normal((5, 3))
        seen = observe(FIVE_POSITIONS, nothing, gyr=gyr, latitude=LATITUDE)
        found = solve(seen, tilt="none")
        assert found.groups == ("gyr_bias",)
        pulls.append((found.values - GYR_BIAS) / found.sigma)
    assert 0.82 < np.std(pulls) < 1.08
    np.testing.assert_allclose(np.mean(pulls, axis=0), 0, atol=0.3)
    printed = solve(observe(FIVE_POSITIONS, nothing, gyr=gyr), as_printed=True)
    np.testing.assert_allclose(printed.values, np.mean(gyr, axis=0))


def test_a_scale_factor_beyond_the_gyroscopes_is_not_offered() -> None:
    seen = observe(TWO_POSITIONS, outputs(TWO_POSITIONS),
                   gyr=gyro_means(TWO_POSITIONS, np.ones(3)), sigma_gyr=2e-5,
                   latitude=LATITUDE, grade="navigation")  # fmt: skip
    found = solve(seen)
    assert not any(n.startswith("gyr_scale") for n in found.names)
    assert any("record the turns" in w for w in found.warnings)


def test_as_printed_everything_is_as_in_print() -> None:
    seen = observe(SPREAD_OUT, outputs(SPREAD_OUT, offset_deg=(1.3, -0.7)))
    printed = solve(seen, as_printed=True)
    assert printed.method == "five_position" and len(printed.warnings) == 1
    closed = five_position(seen, as_printed=True)
    assert printed.names == closed.names
    np.testing.assert_array_equal(printed.values, closed.values)
    np.testing.assert_array_equal(printed.covariance, closed.covariance)
    two = solve(observe(NOT_45, outputs(NOT_45)), as_printed=True)
    assert two.method == "two_position"
    assert two.value("acc_scale.z") == pytest.approx(-SCALE[2])
    assert any("the sign of (5) makes" in w for w in two.warnings)


@pytest.mark.parametrize("method", ["two_position", "joint"])
def test_two_position_session_without_tilt(method: str) -> None:
    seen, answers = practice("p10")
    result = solve(seen, method=method, tilt="none")  # type: ignore[arg-type]
    for group in ("acc_bias", "acc_scale", "gyr_bias"):
        value, sigma = result.vector(group)
        assert (np.abs(value - answers["truth"][group]) < 3 * sigma).all()


def test_five_position_session_with_an_offset_of_one_degree() -> None:
    seen, answers = practice("p09")
    result = solve(seen, method="five_position")
    for group in ("acc_bias", "acc_scale", "gyr_bias"):
        value, sigma = result.vector(group)
        assert (np.abs(value - answers["truth"][group]) < 3 * sigma).all()
    value, sigma = result.vector("angle_offset")
    assert (np.abs(value + 1) < 3 * sigma).all() and (sigma < 0.05).all()
