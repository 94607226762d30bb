"""The set that is given: its names and places, detents, and the Earth's rate."""

from dataclasses import replace

import numpy as np
import pytest
from observed import GYR_BIAS, OMEGA, carried, observe, outputs
from small_sessions import nominal

from fieldcal.core.factory import FactoryErrors
from fieldcal.core.positions import (
    FIVE_POSITIONS,
    SIX_FACES,
    Position,
    alpha_beta_angles,
)
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model import priors
from fieldcal.model.causes.basis import RowView
from fieldcal.model.causes.detents import detent_rotations as turned_alike
from fieldcal.model.causes.detents import detents
from fieldcal.physics.experience import Experience
from fieldcal.solve import Observations, solve
from fieldcal.solve.base_rate import with_base_rate
from fieldcal.solve.observation_rows import rows_of_observations
from fieldcal.solve.parameter_set import ParameterSet, ParameterSetOptions

HAND = Position("by hand")
ACC = [f"acc_{g}.{x}" for g in ("bias", "scale") for x in "xyz"]
GYR = [f"gyr_{g}.{x}" for g in ("bias", "scale") for x in "xyz"]


def seen(places: tuple[Position, ...], gyr: bool = False) -> Observations:
    acc = outputs([p if p.oriented else FIVE_POSITIONS[3] for p in places])
    return observe(
        places, acc, gyr=np.tile(GYR_BIAS, (len(places), 1)) if gyr else None
    )


def given(
    places: tuple[Position, ...], wanted: ParameterSetOptions, gyr: bool = False
) -> ParameterSet:
    recorded = rows_of_observations(seen(places, gyr))
    rows = with_base_rate(recorded.rows, np.zeros(3))
    return ParameterSet(rows, np.ones(6), recorded.since_turn, wanted.turned, wanted)


def experience(places: tuple[Position, ...]) -> Experience:
    return Experience.at_rest(
        *alpha_beta_angles(places), 9.81, position=np.arange(len(places))
    )


# --- detents


def together(places: tuple[Position, ...]) -> set[tuple[tuple[int, int], ...]]:
    """Which turns share an error: pairs of position and joint."""
    oriented = [i for i, p in enumerate(places) if p.oriented]
    every = list(detents(experience(places), oriented))
    table = turned_alike(every, len(places))
    assert table.shape[0] == 2 * len(places) and set(np.unique(table)) <= {0.0, 1.0}
    return {
        tuple((int(i) // 2, int(i) % 2) for i in np.flatnonzero(column))
        for column in table.T
    }


def test_positions_at_the_same_angle_of_a_joint_share_its_detent() -> None:
    places = tuple(
        Position.deg(a, b) for a, b in [(0, 0), (45, 5), (45, -5), (0, 5), (-45, 45)]
    )
    assert together(places) == {
        ((0, 0), (3, 0)),  # alpha = 0, which a detent may miss as well
        ((0, 1),),
        ((1, 0), (2, 0)),  # alpha = 45
        ((4, 0),),  # alpha = -45
        ((1, 1), (3, 1)),  # beta = 5
        ((2, 1),),
        ((4, 1),),  # beta = 45 is not alpha = 45
    }


def test_what_nobody_set_has_no_detent() -> None:
    assert together((Position.deg(0, 0), HAND, Position.deg(9, 0))) == {
        ((0, 0),),
        ((2, 0),),
        ((0, 1), (2, 1)),
    }


def test_a_repeated_angle_is_off_by_the_same_in_half_of_the_variance() -> None:
    places = (Position.deg(0, 0), *[Position.deg(20, 0)] * 4, Position.deg(30, 0))
    d = given(places, ParameterSetOptions(angles_deg=0.3))
    size = np.deg2rad(0.3) / np.sqrt(2)
    parts = {g.part: g for _, g in d.members}
    assert set(parts) == {"own", "repeated"}
    assert len(parts["own"].columns) == 2 * 6 and len(parts["repeated"].columns) == 4
    for group in parts.values():
        assert group.fixed_size == 1.0
        np.testing.assert_allclose(group.typical, size)


def test_repeating_an_angle_helps_against_half_of_the_variance_only() -> None:
    def sigma(places: tuple[Position, ...]) -> float:
        found = solve(
            observe(places, outputs(places), sigma=1e-6), tilt="none",
            angle_sigma_deg=0.1,
        )  # fmt: skip
        return found.uncertainty("acc_bias.x")

    home, away = Position.deg(0, 0), Position.deg(180, 0)
    # of bias x, each place says g times the error of its detent and the mean of its own
    one = 9.81 * np.deg2rad(0.1) / np.sqrt(2)
    for n in (2, 9):
        expected = one / np.sqrt(1 / 2 + 1 / (1 + 1 / n))
        assert sigma((home, *[away] * n)) == pytest.approx(expected, rel=0.02)


# --- the Earth's rate


@pytest.mark.parametrize("heading_deg", [None, 0.0, 3.0])
def test_what_is_known_of_the_earth_is_in_the_gyroscopes_bias(
    heading_deg: float | None,
) -> None:
    phi = 0.8
    home = [0.0, -OMEGA * np.sin(phi), OMEGA * np.cos(phi)]
    rates = np.array([carried(p.alpha or 0, p.beta or 0, home) for p in FIVE_POSITIONS])
    nothing = np.full((5, 3), np.nan)
    noise = 1e-4 if heading_deg is None else 1e-7
    found = solve(
        observe(FIVE_POSITIONS, nothing, gyr=GYR_BIAS + rates, sigma_gyr=noise,
                latitude=phi),
        tilt="none", heading_sigma_deg=heading_deg,
    )  # fmt: skip
    bias, sigma = found.vector("gyr_bias")
    if heading_deg is None:
        assert (np.abs(bias - GYR_BIAS) < 2.5 * sigma).all()
        assert sigma.max() > 0.3 * OMEGA * np.cos(phi)
    else:
        assert (np.abs(bias - GYR_BIAS) < 0.1 * sigma).all()
        level = OMEGA * np.cos(phi) * np.deg2rad(heading_deg)
        assert sigma.max() < level + 2e-7


# --- names and places


@pytest.mark.parametrize(
    ("wanted", "names"),
    [
        (ParameterSetOptions(), ACC),
        (ParameterSetOptions("base_tilt"),
         [*ACC, "base_tilt.about_x_deg", "base_tilt.about_z_deg"]),
        (ParameterSetOptions("angle_offset", cross=True),
         [*ACC, *(f"cross_coupling.k{i}" for i in ("12", "13", "21", "23", "31", "32")),
          "angle_offset.alpha0_deg", "angle_offset.beta0_deg"]),
    ],
)  # fmt: skip
def test_names_are_in_the_order_of_results(
    wanted: ParameterSetOptions, names: list[str]
) -> None:
    d = given(SIX_FACES, wanted)
    assert list(d.names) == names
    places = {d.column_by_name[n] for n in names}
    assert len(places) == len(names)
    columns = {c for g in d.always for c in g.columns.tolist()}
    columns |= {c for _, g in d.members for c in g.columns.tolist()}
    assert places == columns


def test_gyroscopes_have_a_scale_factor_if_it_is_wanted() -> None:
    plain = given(FIVE_POSITIONS, ParameterSetOptions(), gyr=True)
    assert list(plain.names) == [*ACC, *GYR[:3]]
    assert "gyr_scale.x" not in plain.column_by_name
    scaled = given(
        FIVE_POSITIONS, ParameterSetOptions(gyr_scale=True, gyro_cross=True), gyr=True
    )
    assert list(scaled.names[:12]) == [*ACC, *GYR]
    assert [n[-3:] for n in scaled.names[12:]] == [
        "s12", "s13", "s21", "s23", "s31", "s32",
    ]  # fmt: skip
    sizes = [g.typical for g in scaled.always if (g.cause, g.part) == ("scale", "gyr")]
    np.testing.assert_allclose(sizes, [[priors.SCALE] * 3])


def test_where_nobody_knows_an_orientation_a_common_rotation_is_left_out() -> None:
    d = given((HAND,) * 12, ParameterSetOptions("base_tilt", cross=True))
    kept = [n for n in d.names if n.startswith("cross")]
    assert kept == [f"cross_coupling.k{i}" for i in ("12", "13", "23")]
    assert not {"k21", "k31", "k32"} & {n[-3:] for n in d.names}
    assert not any("tilt" in n for n in d.names)


@pytest.mark.parametrize("name", ["acc_bias.x", "acc_scale.z", "gyr_bias.y"])
def test_a_column_in_its_place_is_what_the_parameter_does(name: str) -> None:
    d = given(FIVE_POSITIONS, ParameterSetOptions(), gyr=True)
    at = d.column_by_name[name]
    start = d.bias if "bias" in name else d.scale
    channel = "xyz".index(name[-1]) + 3 * name.startswith("gyr")
    assert at == start + channel


@pytest.mark.parametrize(
    "name", ["cross_coupling.k12", "angle_offset.beta0_deg", "gyr_bias.x"]
)
def test_a_parameter_that_is_not_in_the_set_has_no_column(name: str) -> None:
    d = given(FIVE_POSITIONS, ParameterSetOptions("base_tilt"))
    assert name not in d.column_by_name


def test_what_is_estimated_is_free_and_what_is_said_has_its_size() -> None:
    free = given(FIVE_POSITIONS, ParameterSetOptions("base_tilt"))
    assert all(g.fixed_size == priors.FREE_SIZE for g in free.always)
    (tilt,) = [g for c, g in free.members if c.name == "base_tilt"]
    assert tilt.fixed_size == priors.FREE_SIZE
    level = given(FIVE_POSITIONS, ParameterSetOptions("base_tilt", level_deg=0.2))
    (tilt,) = [g for c, g in level.members if c.name == "base_tilt"]
    sizes: Array = tilt.prior_sigma(tilt.fixed_size or 0.0)
    np.testing.assert_allclose(sizes, [0.2, 0.2])


def test_turns_are_followed_with_what_the_factory_left() -> None:
    """A cross-coupling of 2 % to first order alone moved a bias by 7 sigma."""
    left = FactoryErrors(1e-2, 2.5e-4, 9e-5)
    d = given(FIVE_POSITIONS, ParameterSetOptions(factory=left, turned=True), gyr=True)
    groups = [g for c, g in d.members if c.name == "factory"]
    assert [g.part for g in groups] == list(left.by_effect)
    assert all(g.in_state and g.effect is catalogue()[g.part] for g in groups)
    for group, size in zip(groups, left.by_effect.values(), strict=True):
        np.testing.assert_allclose(group.typical, size)


def test_no_unknown_function_and_no_cause_is_searched_for() -> None:
    d = given(
        FIVE_POSITIONS, ParameterSetOptions("base_tilt", cross=True, angles_deg=0.1)
    )
    assert {c.kind for c in d.causes} == {"given"}
    assert {c.name for c in d.causes} - {"detents"} == {
        "base_tilt", "cross_coupling", "angle_setting",
    }  # fmt: skip


# --- what is cut toward zero


def test_outputs_that_are_cut_are_shorter_than_they_are() -> None:
    """Toward zero from either side; of values of both signs by less."""
    recorded = rows_of_observations(seen(FIVE_POSITIONS))
    y = recorded.rows.y.copy()
    y[:, 0] = [0.5, -0.5, 0.005, -0.02, np.nan]
    rows = with_base_rate(replace(recorded.rows, y=y), np.zeros(3))
    d = ParameterSet(
        rows,
        np.ones(6),
        recorded.since_turn,
        False,
        ParameterSetOptions(),
        cut=(0.01, 0.0, 0.02),
    )
    (one,) = (g for _, g in d.base_members if g.cause == "rounding")
    assert one.typical.tolist() == [0.01, 0.02] and one.fixed_size == 1.0
    assert one.part == "acc", "gyroscopes are not cut"
    np.testing.assert_allclose(d.sign[:5, 0], [1.0, -1.0, 0.5, -1.0, 0.0])
    assert not d.sign[:, 1].any() and not d.sign[-1].any(), "none on the way"
    basis = next(b for first, b in d.bases if first <= one.columns[0] < first + 3)
    view = RowView.of(rows.x, recorded.since_turn, nominal(len(FIVE_POSITIONS)))
    table = basis.evaluate(view)
    assert table.shape == (5, 6, 3), "of every output by each accelerometer"
    np.testing.assert_allclose(np.abs(table[:, 0, 0]), np.abs(d.sign[:5, 0]))
    np.testing.assert_allclose(table[:, 0, 0], -d.sign[:5, 0])
    assert np.count_nonzero(table[:, 1:, 0]) == 0
    plain = ParameterSet(
        rows, np.ones(6), recorded.since_turn, False, ParameterSetOptions()
    )
    assert "rounding" not in {g.cause for _, g in plain.base_members}
    assert d.width == plain.width + 3, "a column for each accelerometer"
