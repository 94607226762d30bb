"""Every effect keeps the contract of its form; a new file needs no new test."""

import doctest
import sys
from dataclasses import fields, replace

import numpy as np
import pytest

from fieldcal.core.errors import InputError
from fieldcal.core.frames import earth_rate_at_home
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.effects.earth_rate import EarthRate
from fieldcal.model.causes.basis import RowView
from fieldcal.model.causes.effect_columns import effect_basis
from fieldcal.model.state import State
from fieldcal.physics.effect import Effect, Line, Motion, Sensor
from fieldcal.physics.experience import Experience
from fieldcal.physics.joint_turns import JointTurns
from fieldcal.physics.lag import Lag

SHAPE = {"tau_s": 7.0, "at_s": 20.0}
ROWS = 40


def experience() -> Experience:
    rng = np.random.default_rng(0)
    joints = JointTurns.of(
        np.arange(0.0, ROWS, 5.0), rng.uniform(-1, 1, (ROWS // 5, 3))
    )
    return Experience.at_rest(
        rng.uniform(-np.pi, np.pi, ROWS),
        rng.uniform(-1.5, 1.5, ROWS),
        9.81,
        rate=rng.standard_normal((ROWS, 3)),
        w_dot=rng.standard_normal((ROWS, 3)),
        slope=rng.standard_normal((ROWS, 6)),
        bend=rng.standard_normal((ROWS, 6)),
        missed=rng.standard_normal((ROWS, 6)),
        passed=rng.standard_normal((ROWS, 6)),
        f_dot=rng.standard_normal((ROWS, 3)),
        f_bend=rng.standard_normal((ROWS, 3)),
        w_bend=rng.standard_normal((ROWS, 3)),
        since_turn=rng.uniform(0, 30, ROWS),
        warming=rng.standard_normal(ROWS),
        heating=rng.standard_normal(ROWS),
        variance=rng.uniform(0, 1, (ROWS, 3)),
        base_rate=earth_rate_at_home(0.9),
        latitude=0.9,
        joint_turns=joints,
    )


def rows_of(x: Experience, rows: slice) -> Experience:
    cut = {
        f.name: getattr(x, f.name)[rows]
        for f in fields(x)
        if np.ndim(getattr(x, f.name)) and len(getattr(x, f.name)) == ROWS
    }
    return replace(x, **cut)


def columns(effect: Motion | Sensor, x: Experience) -> Array:
    """What a perfect device's outputs change by with each parameter, (n, 6, k)."""
    perfect = State(np.zeros(6), np.ones(6), np.zeros((0, 2)), np.zeros(3))
    since = x.since_turn[None]
    shape = {s.name: SHAPE[s.name] for s in effect.shapes}
    return effect_basis(effect, shape, 0).evaluate(RowView.of(x, since, perfect))


EFFECTS = catalogue()
X = experience()
every_effect = pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS.keys())
FITTED = [e for e in EFFECTS.values() if isinstance(e, Motion | Sensor) and e.params]
every_fitted = pytest.mark.parametrize("effect", FITTED, ids=lambda e: e.id)


@every_effect
def test_says_what_it_is(effect: Effect) -> None:
    assert effect.kind in ("motion", "sensor", "chain")
    assert effect.covariate and effect.decided_by and effect.source
    assert effect.cure.endswith(".") or effect.cure.endswith(").")
    assert len(set(effect.names)) == len(effect.names)
    assert all(p.typical > 0 for p in effect.params)
    assert all(effect.unit(name) for name in effect.names)


@pytest.mark.parametrize("effect", [e for e in FITTED if e.absent], ids=lambda e: e.id)
def test_adds_nothing_when_it_is_said_to_be_absent(effect: Sensor) -> None:
    """After a warm-up, at the start and its temperature, before a step."""
    place = {
        "since_start": 1e6 if effect.absent == "when warmed up" else 0.0,
        "warming": 0.0,
    }
    x = Experience.at_rest(
        np.zeros(1), np.zeros(1), 9.8, **{k: np.full(1, v) for k, v in place.items()}
    )
    assert not effect.design(x, SHAPE | {"tau_s": 100.0, "at_s": 1.0}).any()
    later = replace(
        x, t=x.t + 9, since_start=x.t + 9, warming=x.warming + 9, passed=x.passed + 9
    )
    assert effect.design(later, SHAPE | {"tau_s": 100.0, "at_s": 1.0}).any()


@pytest.mark.parametrize("name", ["gyro_scale", "gyro_cross_coupling"])
def test_what_solve_does_by_itself_is_no_remedy(name: str) -> None:
    """`--turns` is auto: whoever has solved has used the turns already."""
    assert EFFECTS[name].cure.startswith("Apply")


@every_effect
def test_has_a_known_answer(effect: Effect) -> None:
    failed, tried = doctest.testmod(sys.modules[type(effect).__module__])
    assert tried and not failed


@every_fitted
def test_each_row_stands_alone(effect: Motion | Sensor) -> None:
    whole = columns(effect, X)
    assert whole.shape == (ROWS, 6, len(effect.params))
    half = columns(effect, rows_of(X, slice(0, 20)))
    np.testing.assert_array_equal(whole[:20], half)


@every_fitted
def test_parameters_can_be_told_apart(effect: Motion | Sensor) -> None:
    design = columns(effect, X).reshape(-1, len(effect.params))
    assert np.linalg.matrix_rank(design) == len(effect.params)


@pytest.mark.parametrize(
    "effect", [e for e in EFFECTS.values() if isinstance(e, Motion)], ids=lambda e: e.id
)
def test_no_effect_changes_nothing(effect: Motion) -> None:
    same = effect.change(X, np.zeros(len(effect.params)))
    np.testing.assert_allclose(same.f, X.f, atol=1e-12)
    np.testing.assert_allclose(same.w, X.w, atol=1e-15)


@pytest.mark.parametrize(
    "effect", [e for e in EFFECTS.values() if isinstance(e, Line)], ids=lambda e: e.id
)
def test_line_responds_in_every_row(effect: Line) -> None:
    response = effect.response(X, 0.5)
    assert response.shape[:2] == (ROWS, 6)
    assert (np.abs(response).max(axis=(1, 2)) > 0).all()


def test_what_lags_behind_the_motion_has_the_columns_of_its_lag() -> None:
    """To first order a lag takes away what the motion changes by meanwhile."""
    lagging = []
    for effect in FITTED:
        for k, one in enumerate(np.eye(len(effect.params))):
            lag = effect.lag(one)
            if lag != Lag():
                lagging.append((effect.id, effect.params[k].name))
                first = [lag.acc * X.slope[:, :3], lag.gyr * X.slope[:, 3:]]
                other = [lag.acc_second * X.bend[:, :3], lag.gyr_second * X.bend[:, 3:]]
                late = np.hstack(first) + np.hstack(other) + lag.stamps * X.missed
                late[:, 3:] += lag.delay * X.w_dot
                np.testing.assert_allclose(columns(effect, X)[:, :, k], -late)
    assert {EFFECTS[id_].unit(name) for id_, name in lagging} == {"s", "1"}
    assert len(lagging) >= 6


def test_tilt_and_offset_differ_once_both_joints_turn() -> None:
    tilt, offset = EFFECTS["base_tilt"], EFFECTS["angle_offset"]
    assert isinstance(tilt, Motion) and isinstance(offset, Motion)
    x = Experience.at_rest(np.deg2rad([0.0, 45.0]), np.deg2rad([0.0, 5.0]), 9.81)
    apart = tilt.change(x, [1.0, 1.0]).f - offset.change(x, [1.0, 1.0]).f
    np.testing.assert_allclose(apart[0], 0, atol=1e-12)
    assert abs(apart[1, 2]) == pytest.approx(0.05, abs=0.005)  # the errata's number


def test_the_rate_of_the_earth_at_a_place_nobody_stated_is_refused() -> None:
    x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8)
    with pytest.raises(InputError, match="latitude_deg"):
        EarthRate().change(x, [])
