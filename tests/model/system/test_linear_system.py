"""Columns against numerical derivatives, and the Gram matrix against dense rows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from dense_model import Dense, shared
from small_sessions import LADDER, dictionary, ladder, rows_of

from fieldcal.core.frames import earth_rate_at_home
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model import priors
from fieldcal.model.causes.basis import (
    CentralDifference,
    General,
    RowView,
    central_differences,
)
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.state import State, Term
from fieldcal.model.system.linear_system import gram
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.physics.effect import Motion, Sensor
from fieldcal.physics.experience import Experience
from fieldcal.physics.joint_turns import JointTurns

EFFECTS = catalogue()
RNG = np.random.default_rng(7)
ROWS = 2 * len(LADDER)
TAU = np.array([1e-3, 0.0, 5e-4, 2e-5, 1e-5, 0.0, 0.0])


def rows(free: tuple[int, ...] = (), **known: Array) -> Experience:
    """Rows in which every effect of the catalogue does something."""
    has: dict[str, Array] = {
        "warming": RNG.standard_normal(ROWS),
        "heating": RNG.standard_normal(ROWS) * 1e-2,
        "variance": RNG.uniform(0, 1, (ROWS, 3)),
        "w_dot": RNG.standard_normal((ROWS, 3)),
    }
    x = ladder(2, free, **(has | known))
    first = np.unique(x.position, return_index=True)[1]
    angles = np.column_stack([x.alpha, x.beta, x.gamma])[first]
    return replace(x, joint_turns=JointTurns.of(x.t[first] - 1.0, angles))


def away(x: Experience) -> State:
    """A state that is not nominal, with effects of both kinds in it."""
    terms = (
        Term(EFFECTS["angle_offset"], np.array([0.02, -0.03])),
        Term(EFFECTS["angle_scale"], np.array([0.03, 0.02])),
        Term(EFFECTS["base_tilt"], np.array([0.02, -0.01])),
        Term(EFFECTS["settling"], np.linspace(-1e-3, 1e-3, 6), {"tau_s": 5.0}),
    )
    return State(
        np.array([0.2, -0.1, 0.3, 0.01, -0.02, 0.03]),
        np.array([1.01, 0.97, 1.03, 0.99, 1.02, 0.98]),
        np.random.default_rng(3).normal(0, 0.03, (int(x.position.max()) + 1, 2)),
        np.array([2e-5, -5e-5, 4e-5]),
        terms,
    )


def test_columns_by_differences_are_calculated_once_about_a_state() -> None:
    """Also if other columns are asked for there as well."""
    d, at = dictionary(x := ladder(2)), list[State]()

    def sides(view: RowView) -> Iterator[CentralDifference]:
        at.append(view.state)
        yield replace(view.x, f=view.x.f + 0.5), view.x, 0.25

    (own,) = d.add(General("made up", central_differences(sides)), 1)
    system, wanted = WindowSystem(rows_of(x, np.hstack([x.f, x.w])), d), d.typical < 0
    wanted[own] = True
    one, other = away(x), replace(away(x), bias=np.zeros(6))
    first = system.linearised(one, wanted)
    system.linearised(one)
    system.linearised(other, wanted)
    again = system.linearised(one, wanted)
    assert [id(state) for state in at] == [id(one), id(other), id(one)]
    for part, same in zip(first, again, strict=True):
        np.testing.assert_array_equal(part.design, same.design)
        assert part.design.any() or part.channel > 2


def output(d: Dictionary, state: State) -> Array:
    found: Array = state.output(state.experienced(d.x), d.since)
    return found


def with_more(state: State, group: Group, j: int, step: float) -> State:
    """A state in which one parameter of an effect is a step further."""
    assert group.effect is not None
    there = [t for t in state.terms if t.effect is group.effect]
    values = np.zeros(len(group.effect.params))
    values[group.params[j]] = step
    if not isinstance(group.effect, Motion):  # of another shape it is a term by itself
        more = Term(group.effect, values, group.shape, group.origin)
        return replace(state, terms=(*state.terms, more))
    rest = tuple(t for t in state.terms if t.effect is not group.effect)
    whole = sum((t.values for t in there), values)
    return replace(state, terms=(*rest, Term(group.effect, whole)))


def derivative(d: Dictionary, up: State, down: State, step: float) -> Array:
    out: Array = (output(d, up) - output(d, down)) / (2 * step)
    return out


class Columns:
    """All columns of a dictionary about a state, in outputs, (n, 6, k)."""

    def __init__(self, x: Experience, more: tuple[Term, ...] = ()) -> None:
        self.dictionary = dictionary(x)
        state = away(x)
        self.state = replace(state, terms=(*state.terms, *more))
        system = WindowSystem(rows_of(x, np.zeros((len(x), 6))), self.dictionary)
        self.table = np.zeros((len(x), 6, self.dictionary.width))
        for part in system.linearised(self.state):
            seen = part.design / part.weight[:, None]
            self.table[part.rows[:, None], part.channel, part.columns] = seen

    def assert_agree(self, column: int, numerical: Array, step: float) -> None:
        """As well as differences of outputs can tell, `step` apart."""
        found = self.table[:, :, column]
        size = np.abs(output(self.dictionary, self.state)).max(axis=0)
        floor = 1e-5 * np.abs(numerical).max() + 1e-15 * size / step
        assert (np.abs(found - numerical) <= floor + 1e-5 * np.abs(numerical)).all()


SPUN = RNG.uniform(-1, 1, (1, 3)) * np.arange(2).repeat(ROWS // 2)[:, None]
EARTH = earth_rate_at_home(0.88)
EXPERIENCES = {
    "at rest": rows(),
    "on a table": rows(rate=SPUN),
    "seeing the Earth": rows(base_rate=EARTH),
    "of unknown orientation": rows((2, 5)),
    "followed in motion": rows(
        slope=RNG.standard_normal((ROWS, 6)),
        bend=RNG.standard_normal((ROWS, 6)),
        f_dot=RNG.standard_normal((ROWS, 3)),
        f_bend=RNG.standard_normal((ROWS, 3)),
        w_bend=RNG.standard_normal((ROWS, 3)),
        missed=RNG.standard_normal((ROWS, 6)),
        passed=RNG.standard_normal((ROWS, 6)),
    ),
}
COLUMNS = {name: Columns(x) for name, x in EXPERIENCES.items()}
everywhere = pytest.mark.parametrize("one", COLUMNS.values(), ids=COLUMNS.keys())
FITTED = [e for e in EFFECTS.values() if isinstance(e, Motion | Sensor) and e.params]


@pytest.mark.parametrize("effect", FITTED, ids=lambda e: e.id)
def test_columns_of_an_effect_are_what_its_parameters_change(
    effect: Motion | Sensor,
) -> None:
    checked, small = 0, 1.0 if isinstance(effect, Sensor) else 3e-4
    for one in COLUMNS.values():
        groups = [
            g for c in one.dictionary.causes for g in c.variants if g.effect is effect
        ]
        for group in groups[:: max(1, len(groups) // 6)]:
            for j, column in enumerate(group.columns.tolist()):
                step = small * effect.params[group.params[j]].typical
                up, down = (with_more(one.state, group, j, s) for s in (step, -step))
                one.assert_agree(
                    column, derivative(one.dictionary, up, down, step), step
                )
                checked += 1
    assert checked


@pytest.mark.parametrize("name", ["base_tilt", "angle_scale"])
def test_what_moves_the_force_moves_what_is_coupled_to_it(name: str) -> None:
    coupling = Term(EFFECTS["cross_coupling"], np.linspace(-0.02, 0.02, 6))
    one = Columns(rows(), (coupling,))
    cause = next(c for c in one.dictionary.causes if c.key == name)
    group = cause.variants[0]
    for j, column in enumerate(group.columns.tolist()):
        up, down = (with_more(one.state, group, j, s) for s in (1e-5, -1e-5))
        one.assert_agree(column, derivative(one.dictionary, up, down, 1e-5), 1e-5)


@everywhere
def test_columns_of_bias_and_scale_are_what_these_change(one: Columns) -> None:
    d, state = one.dictionary, one.state
    for name, first in (("bias", d.bias), ("scale", d.scale)):
        for c in range(6):
            step = 1e-3 * np.eye(6)[c]
            up, down = (
                replace(state, **{name: getattr(state, name) + s})
                for s in (step, -step)
            )
            one.assert_agree(first + c, derivative(d, up, down, 1e-3), 1e-3)


@everywhere
def test_columns_of_turns_are_what_these_change(one: Columns) -> None:
    """Of every position about two axes, whether its angles are known or not."""
    d, state = one.dictionary, one.state
    for p in range(d.position_count):
        for joint in range(2):
            step = np.zeros_like(state.small_rotation)
            step[p, joint] = 1e-4
            up, down = (
                replace(state, small_rotation=state.small_rotation + s)
                for s in (step, -step)
            )
            turned = derivative(d, up, down, 1e-4)
            one.assert_agree(d.small_rotation + 2 * p + joint, turned, 1e-4)


@everywhere
def test_columns_of_the_earths_rate_are_what_it_changes(one: Columns) -> None:
    d, state = one.dictionary, one.state
    assert (d.earth < 0) == bool(d.x.base_rate.any())
    for axis in range(3 if d.earth >= 0 else 0):
        step = 1e-5 * np.eye(3)[axis]
        up, down = (replace(state, earth=state.earth + s) for s in (step, -step))
        one.assert_agree(d.earth + axis, derivative(d, up, down, 1e-5), 1e-5)


def test_of_some_columns_the_rest_is_left_out() -> None:
    one = COLUMNS["at rest"]
    d, wanted = one.dictionary, np.zeros(one.dictionary.width, dtype=bool)
    wanted[np.random.default_rng(0).permutation(d.width)[:100]] = True
    y = np.zeros((ROWS, 6))
    for part in WindowSystem(rows_of(d.x, y), d).linearised(one.state, wanted):
        assert wanted[part.columns].all()
        seen = one.table[part.rows[:, None], part.channel, part.columns]
        np.testing.assert_array_equal(part.design, seen * part.weight[:, None])
        left = wanted.copy()
        left[part.columns] = False
        assert not one.table[:, part.channel, left].any()


@everywhere
def test_residuals_are_what_is_recorded_less_what_the_state_predicts(
    one: Columns,
) -> None:
    d = one.dictionary
    y = np.random.default_rng(5).standard_normal((len(d.x), 6))
    linear = WindowSystem(rows_of(d.x, y), d).linearised(one.state)
    assert [p.channel for p in linear] == list(range(6))
    off = y - output(d, one.state)
    for part in linear:
        np.testing.assert_allclose(
            part.white / part.weight, off[part.rows, part.channel], rtol=1e-12
        )
        np.testing.assert_array_equal(part.window, d.x.position[part.rows])


def test_a_row_that_is_not_used_says_nothing() -> None:
    d = dictionary(x := ladder(2))
    d.used[3, 1] = False
    y = np.where(d.used, 0.0, np.nan)
    recorded = rows_of(x, y)
    recorded.sd[3, 1] = np.nan
    linear = WindowSystem(recorded, d).linearised(away(x))
    assert 3 not in linear[1].rows and len(linear[1].white) == ROWS - 1
    assert len(linear[0].white) == ROWS


@pytest.mark.parametrize("free", [(), (2, 5)], ids=["set", "loose"])
def test_the_gram_matrix_is_that_of_the_rows(free: tuple[int, ...]) -> None:
    """With what windows share, their instability, and turns that nobody knows."""
    one = COLUMNS["of unknown orientation" if free else "at rest"]
    d = dictionary(one.dictionary.x, common=3e-4)
    d.window_error[4] *= 3
    rng = np.random.default_rng(11)
    y = output(d, one.state) + rng.normal(0, 1e-3, (ROWS, 6))
    some = np.union1d(d.bias + np.arange(40), rng.permutation(d.width)[:60])
    some = np.union1d(some, d.small_rotation + np.arange(2 * d.position_count))
    values = np.zeros(d.width)
    values[some[::7]] = rng.standard_normal(len(some[::7])) * 1e-3
    recorded = rows_of(d.x, y)
    linear = WindowSystem(recorded, d).linearised(one.state)
    found = gram(linear, d, values, (), some).with_instability(TAU)
    at, channel = (i.ravel() for i in np.indices((ROWS, 6)))
    design = one.table.reshape(ROWS * 6, -1)
    sd, window = recorded.sd.ravel(), d.x.position[at]
    cov = np.diag(sd**2)
    cov += shared(
        window, channel, np.hypot(d.window_error[window, channel], TAU[channel])
    )
    for p in free:
        small_rotation = (
            priors.SMALL_ROTATION * design[:, d.small_rotation + 2 * p :][:, :2]
        )
        cov += small_rotation @ small_rotation.T
    off = (y - output(d, one.state)).ravel() + design @ values
    inner, rhs = Dense(off, design[:, some], cov, sd).information()
    size = np.linalg.norm(design[:, some] / sd[:, None], axis=0) + 1e-300
    inner, seen = (m / size / size[:, None] for m in (inner, found.matrix(some, some)))
    # turns of a radian are far beyond the noise: eight digits go, and by which route
    # of the processor the last ones are summed
    near = 5e-8 if free else 1e-9
    np.testing.assert_allclose(seen, inner, rtol=0, atol=near)
    rhs, drawn = rhs / size, found.rhs(some) / size
    np.testing.assert_allclose(drawn, rhs, rtol=0, atol=near * np.abs(rhs).max())


def test_a_force_that_is_turned_aside_stays_as_long() -> None:
    """Of a position of unknown orientation, about axes across the force."""
    x = EXPERIENCES["of unknown orientation"]
    state = State(np.zeros(6), np.ones(6), np.zeros((9, 2)), np.zeros(3))
    state.small_rotation[5] = 0.03, -0.04
    turned = state.experienced(x).f
    free = x.position == 5
    assert np.linalg.norm(turned, axis=1) == pytest.approx(np.linalg.norm(x.f, axis=1))
    np.testing.assert_array_equal(turned[~free], x.f[~free])
    cosine = (turned[free] * x.f[free]).sum(axis=1) / np.square(x.f[free]).sum(axis=1)
    np.testing.assert_allclose(np.tan(np.arccos(cosine)), 0.05, rtol=1e-6)


def test_a_free_rotation_stays_in_the_state_what_it_is_within_a_window() -> None:
    """Its mean alone is estimated, against one long regression about the same state.

    Where an effect turns the device amid a window, the rotation's column changes there.
    """
    x = rows((2, 5))
    d, rng = dictionary(x), np.random.default_rng(4)
    system = WindowSystem(rows_of(x, rng.normal(size=(len(x), 6))), d)
    knock = Term(EFFECTS["base_step"], np.array([2.0, -3.0]), {"at_s": float(x.t[5])})
    state = replace(away(x), terms=(knock,))
    linear = system.linearised(state)
    free = np.r_[d.rotations_of(2), d.rotations_of(5)]
    values = np.zeros(d.width)
    values[free] = rng.normal(0, 0.1, len(free))
    values[d.bias : d.bias + 6] = rng.normal(0, 0.1, 6)
    moved = values.copy()
    moved[free] = 0.0
    found, within = gram(linear, d, values), 0.0
    for part in linear:
        design = part.design
        about = part.white + design @ moved[part.columns]
        rotated = part.white + design @ values[part.columns]
        for w, start in zip(part.windows, part.starts, strict=True):
            at = np.flatnonzero(part.window == w)
            assert at[0] == start
            weight = part.weight[at]
            mean = weight @ rotated[at] / (weight**2).sum()
            assert found.residual[w, part.channel] == pytest.approx(mean)
            middle = weight @ about[at] / (weight**2).sum()
            within += float(((about[at] - weight * middle) ** 2).sum())
    assert found.square == pytest.approx(within)
    touched = np.abs(np.ptp(linear[0].design[x.position == 2], axis=0)) > 1e-9
    assert touched[np.isin(linear[0].columns, free)].any(), "it changes in a window"
