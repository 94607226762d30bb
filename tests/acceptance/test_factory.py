"""What a factory leaves of errors is in every uncertainty, and the decision says it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from observed import observe
from small_sessions import SD, ladder, nominal, rows_of

from fieldcal.acceptance.factory import check_factory_errors
from fieldcal.calibration import Calibration, limits
from fieldcal.core.errors import InputError
from fieldcal.core.factory import FactoryErrors
from fieldcal.core.grade import Grade
from fieldcal.core.positions import FIVE_POSITIONS, SIX_FACES, Position, specific_forces
from fieldcal.core.samples import Array
from fieldcal.session import description_file
from fieldcal.session.factory import factory_errors
from fieldcal.solve import solve
from fieldcal.solve.estimation import RecordedRows, estimate_parameters
from fieldcal.solve.parameter_set import ParameterSetOptions

TACTICAL = limits.read("tactical")
ABOUT = description_file.parse_description({"format": 1})
G = 9.81
NINE = tuple(Position.deg(a, b) for a in (-45, 0, 45) for b in (-30, 0, 30))
SEEDS = [0, *(pytest.param(s, marks=pytest.mark.thorough) for s in (1, 2, 3))]

FAR_OFF = 4
"""Devices that show that a plain estimate is off: it is by several sigma."""


def found(square: float, positions: tuple[Position, ...] = SIX_FACES) -> Calibration:
    seen = observe(positions, specific_forces(positions, G), sigma=1e-4)
    return solve(seen, tilt="none", factory=FactoryErrors(square))


def plain_pulls(found: Calibration) -> list[Array]:
    """Errors of biases and scale factors in their sigmas, of a perfect device."""
    out = list[Array]()
    for group, true in (("acc_bias", 0.0), ("acc_scale", 1.0)):
        value, sigma = found.vector(group)
        out.append((value - true) / sigma)
    return out


@pytest.mark.parametrize(
    ("square", "stated", "says"),
    [
        (1e-3, None, "0.1 %, as usual for the grade"),
        (1e-3, 1e-3, "0.1 %, as stated"),
        (3e-4, None, "0.03 %, as stated"),
    ],
)
def test_it_says_how_square_axes_were_taken_to_be(
    square: float, stated: float | None, says: str
) -> None:
    """It may be stated in session.toml, or to `solve` alone."""
    about = replace(ABOUT, squareness=stated)
    (check,) = check_factory_errors(found(square), about, TACTICAL)
    assert check.ok is None and f"square to ± {says}" in check.says


def test_cross_coupling_that_is_estimated_is_relied_on_by_nothing() -> None:
    result = solve(
        observe(NINE, specific_forces(NINE, G)), cross=True, factory=FactoryErrors(3e-4)
    )
    assert check_factory_errors(result, ABOUT, TACTICAL) == []
    assert check_factory_errors(found(0.0), ABOUT, TACTICAL) == []


def test_faces_have_of_it_what_each_bias_takes_in() -> None:
    """Between faces up and down along each axis a bias has no part of it at all."""
    plain, square = found(0.0), found(5e-4)
    assert square.info["square_sigma"] == 5e-4
    for group in ("acc_bias", "acc_scale"):
        np.testing.assert_allclose(
            square.vector(group)[1], plain.vector(group)[1], rtol=0.02
        )


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_unknown_of_it_is_in_every_uncertainty(seed: int) -> None:
    """Devices of that squareness, drawn: a plain estimate is far off, this one not."""
    rng = np.random.default_rng(seed)
    off: list[Array] = []
    plain: list[Array] = []
    for k in range(25):
        mixing = np.eye(3) + rng.normal(0, 5e-4, (3, 3)) * (1 - np.eye(3))
        mean = specific_forces(FIVE_POSITIONS, G) @ mixing.T + rng.normal(
            0, 1e-4, (len(FIVE_POSITIONS), 3)
        )
        seen = observe(FIVE_POSITIONS, mean, sigma=1e-4)
        for square, pulls in ((5e-4, off), (0.0, plain))[: 2 if k < FAR_OFF else 1]:
            result = solve(seen, tilt="none", factory=FactoryErrors(square))
            pulls += plain_pulls(result)
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.2)
    assert np.sqrt(np.mean(np.square(plain))) > 3


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.thorough
def test_bent_accelerometers_are_in_every_uncertainty(seed: int) -> None:
    """Of devices with a curve the plain estimate is far off, this one not; by hand."""
    rng = np.random.default_rng(seed)
    off: list[Array] = []
    plain: list[Array] = []
    for k in range(25):
        force = specific_forces(FIVE_POSITIONS, G)
        bent = rng.normal(0, 2e-5, 3) * force**2
        bent += rng.normal(0, 1.961e-4, 3) * np.abs(force)  # as much at 1 g
        bent += rng.normal(0, 2.039e-7, 3) * force**3  # as much at 10 g
        mean = force + bent + rng.normal(0, 1e-4, (len(FIVE_POSITIONS), 3))
        seen = observe(FIVE_POSITIONS, mean, sigma=1e-4)
        both = ((FactoryErrors(0.0, 2e-5), off), (FactoryErrors(), plain))
        for left, pulls in both[: 2 if k < FAR_OFF else 1]:
            result = solve(seen, tilt="none", factory=left)
            pulls += plain_pulls(result)
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.25)
    assert np.sqrt(np.mean(np.square(plain))) > 2


def test_a_kink_is_not_taken_for_a_curve() -> None:
    """Inclined axes tell K2, and a kink at zero would be in the bias beside it."""
    inclined = tuple(Position.deg(a, b) for a in (45, -45, 135, -135) for b in (0, 35))
    places = (*SIX_FACES, *inclined)
    force = specific_forces(places, G)
    mean = force + 1.961e-4 * np.abs(force)
    seen = observe(places, mean, sigma=1e-5)
    result = solve(seen, tilt="none", factory=FactoryErrors(0.0, 2e-5))
    value, sigma = result.vector("acc_bias")
    assert (np.abs(value) < sigma).all() and (sigma < 1e-3).all()


def test_what_a_turn_leaves_is_in_every_uncertainty() -> None:
    """Each bias keeps a part of its last change; without it the estimate is far off."""
    rng, off, plain = np.random.default_rng(1), list[Array](), list[Array]()
    force = specific_forces(SIX_FACES, G)
    came = np.vstack([np.zeros(3), np.clip(np.diff(force, axis=0) / 9.80665, -1, 1)])
    for k in range(20):
        mean = force + rng.normal(0, 5e-4, 3) * came
        mean += rng.normal(0, 1e-5, force.shape)
        seen = observe(SIX_FACES, mean, sigma=1e-5)
        both = ((FactoryErrors(hysteresis=5e-4), off), (FactoryErrors(), plain))
        for left, pulls in both[: 2 if k < FAR_OFF else 1]:
            result = solve(seen, tilt="none", factory=left)
            pulls += plain_pulls(result)
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.25)
    assert np.sqrt(np.mean(np.square(plain))) > 2


PER_K = {"acc_per_k": 5e-4, "gyr_per_k": 1e-5}


@pytest.mark.parametrize("shown", [False, True])
def test_biases_that_a_warm_up_moves_are_known_as_well_as_stated(shown: bool) -> None:
    """At the end of the recording; the course is that of a thermometer, or of a box."""
    rng, off, plain = np.random.default_rng(3), list[Array](), list[Array]()
    warming: dict[str, Any] = {} if shown else {"warming": np.zeros(27)}
    x, wanted = ladder(**warming), ParameterSetOptions(tilt="none")
    left = FactoryErrors(**PER_K, warming_k=1.25)
    course = x.warming if shown else 1.25 * np.exp(-x.since_start / 300)
    end = 2e-3 * x.t[-1] if shown else 1.25 * np.exp(-x.since_start[-1] / 300)
    for k in range(10):
        drift = rng.normal(0, np.repeat([5e-4, 1e-5], 3))
        y = np.hstack([x.f, x.w]) + drift * course[:, None]
        y += SD / 20 * rng.standard_normal(y.shape)
        rows = rows_of(x, y)
        recorded = RecordedRows(
            replace(rows, sd=rows.sd / 20), np.array([x.since_turn])
        )
        both = ((left, off), (FactoryErrors(), plain))
        for factory, pulls in both[: 2 if k < FAR_OFF else 1]:
            found = estimate_parameters(
                recorded, None, nominal(), replace(wanted, factory=factory)
            )
            at = [found.names.index(f"gyr_bias.{axis}") for axis in "xyz"]
            error = found.values[at] - (drift * end)[3:]
            pulls.append(error / np.sqrt(np.diag(found.covariance)[at]))
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.25
    assert np.sqrt(np.mean(np.square(plain))) > 2.5


def test_gyroscopes_that_feel_gravity_may_have_another_bias_without() -> None:
    """At home g12 turns a bias by g12 g, and nothing of small angles tells it apart."""
    felt, level = 9e-6, (Position.deg(0, 0), Position.deg(1, 0), Position.deg(0, 1))
    seen = observe(level, specific_forces(level, G), gyr=np.zeros((3, 3)))
    plain = solve(seen, tilt="none").vector("gyr_bias")[1]
    result = solve(seen, tilt="none", factory=FactoryErrors(g_sensitivity=felt))
    more = np.sqrt(result.vector("gyr_bias")[1] ** 2 - plain**2)
    np.testing.assert_allclose(more, felt * G, rtol=0.02)
    checks = {c.name: c for c in check_factory_errors(result, ABOUT, TACTICAL)}
    assert "18 deg/h per g, as usual for the grade" in checks["g-sensitivity"].says
    result = solve(seen, tilt="none", factory=FactoryErrors(g_sensitivity=10 * felt))
    checks = {c.name: c for c in check_factory_errors(result, ABOUT, TACTICAL)}
    assert "0 ± 180 deg/h per g, as stated" in checks["g-sensitivity"].says


@pytest.mark.parametrize("left", [{"quadratic": -1e-5}, {"g_sensitivity": 0.3}])
def test_a_size_in_another_unit_is_refused(left: dict[str, float]) -> None:
    with pytest.raises(InputError, match="SI units"):
        FactoryErrors(**left)


@pytest.mark.parametrize(
    ("device", "left"),
    [
        ({}, (1e-3, 2e-5, 9e-6)),
        ({"grade": "consumer"}, (1e-2, 2.5e-4, 9e-5)),
        ({"grade": "consumer", "quadratic": 1e-5}, (1e-2, 1e-5, 9e-5)),
        ({"squareness": 1e-4, "g_sensitivity": 1e-7}, (1e-4, 2e-5, 1e-7)),
    ],
)
def test_the_grade_says_what_nobody_states(
    device: dict[str, object], left: tuple[float, float, float]
) -> None:
    about = description_file.parse_description({"format": 1, "device": device})
    found = factory_errors(about)
    assert (found.cross_coupling, found.quadratic, found.g_sensitivity) == left


@pytest.mark.parametrize(
    ("moves", "shows", "ok"),
    [
        (0.06, 1.0, False),  # 4 % by two thirds of the mistake, which shows by 0.7
        (0.06, 20.0, None),  # which would be seen
        (0.02, 1.0, None),  # which is not enough
    ],
)
def test_a_wrong_angle_is_not_taken_for_a_coarse_device(
    moves: float, shows: float, ok: bool | None
) -> None:
    seen = observe(
        SIX_FACES, specific_forces(SIX_FACES, G) * [1.0, 0.96, 1.0], sigma=1e-4
    )
    result = solve(seen, tilt="none", factory=FactoryErrors(1e-3))
    told = {"grade": "consumer", "because": "acc_scale.y is -0.04 from nominal",
            "beyond": ("acc_scale.y",)}  # fmt: skip
    wrong: dict[str, Any] = {"joint": 0, "angle_deg": None, "position": 4}
    wrong |= {"shows": shows, "moves": {"acc_scale.y": moves}}
    info = {**result.info, "grade_shown": told, "wrong_angles": [wrong]}
    checks = check_factory_errors(replace(result, info=info), ABOUT, TACTICAL)
    (check,) = [c for c in checks if c.name == "grade"]
    assert check.ok is ok
    assert ("position 5 with a wrong α" in check.says) == (ok is False)


@pytest.mark.thorough
def test_devices_of_consumer_grade_are_within_its_uncertainties() -> None:
    """A percent of cross-coupling, and 0.5 % of 2 g off a line, both by hand."""
    rng = np.random.default_rng(7)
    off: list[Array] = []
    plain: list[Array] = []
    for _ in range(30):
        force = specific_forces(FIVE_POSITIONS, G)
        mixing = np.eye(3) + rng.normal(0, 1e-2, (3, 3)) * (1 - np.eye(3))
        mean = force @ mixing.T + rng.normal(0, 2.5e-4, 3) * force * force
        seen = observe(
            FIVE_POSITIONS, mean + rng.normal(0, 1e-3, mean.shape), sigma=1e-3
        )
        for grade, pulls in (("consumer", off), ("tactical", plain)):
            left = limits.read(grade).factory
            result = solve(seen, tilt="none", factory=left)
            pulls += plain_pulls(result)
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.25)
    assert np.sqrt(np.mean(np.square(plain))) > 3


@pytest.mark.parametrize(
    ("grade", "says"),
    [("consumer", "as usual for consumer grade"), ("tactical", "the recording shows")],
)
def test_a_device_beyond_its_grade_has_of_each_kind_what_the_recording_shows(
    grade: Grade, says: str
) -> None:
    left = limits.read(grade).factory
    seen = found(1e-3)
    shows = {"grade": "consumer", "because": "acc_bias.x is far off",
             "beyond": ["acc_bias.x"]}  # fmt: skip
    info = {
        **seen.info, "grade_shown": shows, "acc_hysteresis_sigma": left.hysteresis,
        "quadratic_sigma": left.quadratic, "acc_bias_per_k_sigma": left.acc_per_k,
    }  # fmt: skip
    told = check_factory_errors(replace(seen, info=info), ABOUT, TACTICAL)
    by_name = {check.name: check.says for check in told}
    for name in ("linearity", "hysteresis", "warm-up"):
        assert says in by_name[name]


@pytest.mark.parametrize(
    ("value", "sigma", "square", "fails"),
    [
        (-0.02, 1e-4, 1e-3, True),
        (0.02, 6e-3, 1e-3, False),
        (0.004, 1e-4, 1e-3, False),
        (-0.02, 1e-4, 1e-2, False),
    ],
)
def test_a_device_askew_contradicts_the_axes_that_a_result_relies_on(
    value: float, sigma: float, square: float, fails: bool
) -> None:
    shown = {"axis": "y", "of": "z", "value": value, "sigma": sigma}
    calibration = found(square)
    more = {**calibration.info, "coupling_left_out": shown}
    checks = check_factory_errors(replace(calibration, info=more), ABOUT, TACTICAL)
    failed = [c for c in checks if c.ok is False]
    assert bool(failed) == fails
    for one in failed:
        assert "accelerometer y feels 2 ± 0.01 % of the force along z" in one.says
        assert "by about 1.1°" in one.says and "--cross" in one.says


def test_a_result_with_cross_coupling_leaves_none_out() -> None:
    """A device that is turned by 2 degrees in nine positions."""
    turn = np.deg2rad(2.0)
    turned = np.array(
        [[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    )
    seen = observe(NINE, specific_forces(NINE, G) @ turned.T, sigma=1e-4)
    left = solve(seen, tilt="none", factory=FactoryErrors(1e-3)).info
    assert "coupling_left_out" not in left  # means alone are not examined
    whole = solve(seen, tilt="none", cross=True, factory=FactoryErrors(1e-3))
    assert whole.value("cross_coupling.k12") == pytest.approx(np.sin(turn), abs=1e-3)
