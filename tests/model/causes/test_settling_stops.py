"""A device that turns on after it was put down: its columns, and an estimate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation
from small_sessions import SD, dictionary, ladder, nominal, rows_of

from fieldcal.core.samples import Array
from fieldcal.model import resolutions
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.settling_stops import settling_stops
from fieldcal.model.causes.wander import Wander
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.inference import Inference
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.physics.experience import Experience

TAU = resolutions.STOP_SETTLING_S


def free_stop(rows: int = 8) -> Experience:
    """Nine positions; nobody knows how the device stands in one of them."""
    return ladder(rows=rows, free=[4])


def leaning_in(position: int) -> Wander:
    leans = np.zeros(9, dtype=np.intp)
    leans[position] = 3
    return replace(Wander.none(), leans=leans)


def test_it_turns_force_and_gyroscopes_as_a_rotation_does() -> None:
    """About three axes; rotation matrices, differentiated by differences."""
    x = free_stop()
    table = dictionary(x)
    table.wander = leaning_in(4)
    group = settling_stops(table)
    assert group is not None and len(group.columns) == 3 * len(TAU)
    assert group.random and not group.in_state
    _, basis = table.bases[-1]
    assert isinstance(basis, General)
    found = basis.evaluate(RowView.of(x, np.zeros((1, len(x))), nominal()))
    there = np.flatnonzero(x.position == 4)
    assert not np.delete(found, there, axis=0).any()
    t, force = x.t[there], x.f[there[0]]
    axes = []
    for axis in range(3):
        rate = found[there[0], 3:, axis * len(TAU)]
        axes.append(-rate / np.linalg.norm(rate))
        for k, tau in enumerate(TAU):
            column = found[there][:, :, axis * len(TAU) + k]

            def angle(at: Array, tau: float = tau) -> Array:
                out: Array = np.exp(-(at - t.min()) / tau)
                return out

            eps, dt = 1e-6, 1e-4
            about = axes[-1]
            turn = Rotation.from_rotvec(eps * angle(t)[:, None] * about)
            # a device that has turned by R sees what is fixed in space by its inverse
            off = (turn.inv().apply(force) - force) / eps
            np.testing.assert_allclose(column[:, :3], off, atol=1e-4)
            later, before = (
                Rotation.from_rotvec(eps * angle(t + d)[:, None] * about)
                for d in (dt, -dt)
            )
            speed = (before.inv() * later).as_rotvec() / (2 * dt * eps)
            np.testing.assert_allclose(column[:, 3:], speed, atol=1e-4)
    np.testing.assert_allclose(np.abs(np.linalg.det(axes)), 1.0)
    np.testing.assert_allclose(np.abs(axes[2] @ force), np.linalg.norm(force))


def test_a_row_is_a_mean_over_its_time() -> None:
    x = free_stop()
    long = replace(x, lasts=np.full(len(x), 3.0))
    table = dictionary(x)
    table.wander = leaning_in(4)
    assert settling_stops(table) is not None
    basis = table.bases[-1][1]
    assert isinstance(basis, General)
    found = basis.evaluate(RowView.of(long, np.zeros((1, len(x))), nominal()))
    there = np.flatnonzero(x.position == 4)
    begin = x.t[there[0]] - 1.5
    for k, tau in enumerate(TAU):
        fine = np.linspace(-1.5, 1.5, 3001)
        exact = [np.exp(-(t + fine - begin) / tau).mean() for t in x.t[there]]
        rate = found[there][:, 3:, 2 * len(TAU) + k]
        size = np.linalg.norm(rate, axis=1) * tau
        np.testing.assert_allclose(size, exact, rtol=1e-3)


def crept(seed: int, angle_rad: float) -> tuple[Dictionary, WindowSystem]:
    """The device was put down in one stop, and turned on for three seconds there."""
    x = free_stop(rows=12)
    there = np.flatnonzero(x.position == 4)
    decay = np.exp(-(x.t[there] - x.t[there].min()) / 3.0)
    about = np.array([0.3, -0.5, 0.81])
    turn = Rotation.from_rotvec(angle_rad * decay[:, None] * about)
    y = np.hstack([x.f, x.w])
    y[there, :3] = turn.inv().apply(x.f[there[0]])
    y[there, 3:] += -angle_rad / 3.0 * decay[:, None] * about
    y += SD * np.random.default_rng(seed).standard_normal(y.shape)
    d = Dictionary(
        x, np.ones((len(x), 6), bool), np.array([x.since_turn]), np.zeros((9, 6)),
        np.ones(6), False, leaning_in(4),
    )  # fmt: skip
    return d, WindowSystem(rows_of(x, y), d)


def test_what_turns_on_in_one_stop_is_no_course_of_a_bias() -> None:
    """It is found, nothing else is, and biases are those of a still device."""
    off = []
    for seed in range(6):
        d, system = crept(seed, 5e-3)
        found = Inference(GaussNewton(system, nominal())).run()
        assert [c.name for c, _ in found.best.members] == ["settling_stops"]
        state = found.best.state
        at = state.places_of(d.bias + np.arange(6))
        sigma = np.sqrt(np.diag(state.inverse)[at])
        off.append(found.state.bias / sigma)
    assert np.sqrt(np.mean(np.square(off))) < 1.4


def test_a_still_stop_does_not_turn_on() -> None:
    d, system = crept(1, 0.0)
    fit = GaussNewton(system, nominal())
    state, values, _ = fit.settle(fit.nominal, np.zeros(d.width), ())
    cause = next(c for c in d.causes if c.name == "settling_stops")
    sets = Sets(d, fit.gram(state, values, None))
    with_it = sets.evaluate(((cause, cause.variants[0]),)).score
    assert with_it < sets.evaluate(()).score - 2
