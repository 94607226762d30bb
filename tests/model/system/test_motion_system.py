"""Rows in motion, linearised, against devices whose motion and errors are known."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.core.samples import Array, Block
from fieldcal.effects import catalogue
from fieldcal.model import priors
from fieldcal.model.causes.motion_dictionary import MotionDictionary
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.gram import WeightedGram
from fieldcal.model.rows.coloured_noise import Bands
from fieldcal.model.rows.motion import Alignment, MotionRows
from fieldcal.model.rows.motion_reduction import rows_in_motion
from fieldcal.model.rows.reference import Reference
from fieldcal.model.rows.response import Response
from fieldcal.model.state import State, Term
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.motion_rows import (
    MotionSystem,
    fit_residuals,
    noise_levels,
)
from fieldcal.physics.effect import Motion

EFFECTS = catalogue()
TURN = Rotation.from_rotvec([0.2, 0.5, -1.0]).as_matrix()
ALIGNMENT = Alignment(0.3, 1e-3, 12.0, TURN)
SCALE = np.array([1.02, 0.98, 1.01, 0.97, 1.03, 0.99])
BIAS = np.array([0.1, -0.2, 0.3, 0.01, -0.02, 0.03])
MISSING = (1, 5)


def course(t: Array) -> Array:
    return np.stack([np.sin((0.7 + 0.1 * c) * t + c) for c in range(6)], axis=1)


def rows(alignment: Alignment = ALIGNMENT, missing: tuple[int, ...] = ()) -> MotionRows:
    """A device that shows the motion, and a reference without some channels of it."""
    t, s = np.arange(5.0, 30.0, 0.02), np.arange(0.0, 40.0, 0.02)
    true = course(t - 0.3 + 1e-3 * (t - 12.0))
    y = BIAS + SCALE * np.hstack([true[:, :3] @ TURN.T, true[:, 3:] @ TURN.T])
    known = course(s)
    known[:, list(missing)] = np.nan
    block = Block.of(t, y[:, :3], y[:, 3:])
    reference = Reference(Block.of(s, known[:, :3], known[:, 3:]))
    return rows_in_motion(block, reference, alignment, 2, 2.0, 1.0)


def state(*terms: Term, bias: Array = BIAS, scale: Array = SCALE) -> State:
    return State(bias, scale, np.zeros((8, 2)), np.zeros(3), terms)


def system_of(there: MotionRows) -> MotionSystem:
    power = np.random.default_rng(6).uniform(0.5, 2.0, (len(there), 6))
    return MotionSystem(MotionDictionary(there, np.ones(6)), power)


def whitened(system: MotionSystem, at: State) -> Array:
    """What the state leaves of each channel's coefficients, (n, 6)."""
    return np.column_stack([part.white for part in system.linearised(at)])


def columns_of(system: MotionSystem, at: State, index: int) -> Array:
    """A column of every channel's coefficients, whitened, (n, 6)."""
    out = np.zeros((len(system.motion), 6))
    for part in system.linearised(at):
        for j in np.flatnonzero(part.columns == index):
            out[:, part.channel] += part.design[:, j]
    return out


def test_of_a_device_that_is_known_nothing_is_left() -> None:
    """Of one whose bias is another, the difference in the first coefficient."""
    system = system_of(rows())
    assert np.abs(whitened(system, state())).max() < 1e-4
    step = np.linspace(1.0, 2.0, 6)
    left = whitened(system, state(bias=BIAS - step))
    count = len(system.motion)
    weight = 1 / np.sqrt(system.power)
    np.testing.assert_allclose(left[0], step * np.sqrt(count) * weight[0], rtol=1e-4)
    assert np.abs(left[1:]).max() < 1e-4
    for part in system.linearised(state()):
        np.testing.assert_array_equal(part.weight, weight[:, part.channel])
        np.testing.assert_array_equal(part.window, system.motion.part)
        np.testing.assert_array_equal(part.rows, np.arange(count))
        assert len(np.unique(part.columns)) == len(part.columns)


@pytest.mark.parametrize("c", range(6))
def test_columns_of_the_calibration_are_what_it_changes(c: int) -> None:
    system, step = system_of(rows()), 1e-3 * np.eye(6)[c]
    d = system.dictionary
    for index, up, down in (
        (d.bias + c, state(bias=BIAS + step), state(bias=BIAS - step)),
        (d.scale + c, state(scale=SCALE + step), state(scale=SCALE - step)),
    ):
        left, more = whitened(system, down), whitened(system, up)
        found = columns_of(system, state(), index)
        np.testing.assert_allclose(found, (left - more) / 2e-3, atol=1e-6)
        assert np.abs(found[:, c]).max() > 1


def test_columns_of_an_effect_are_what_its_parameters_change() -> None:
    system, effect = system_of(rows()), EFFECTS["quadratic"]
    (cause,) = [c for c in system.dictionary.causes if c.key == "quadratic"]
    group = cause.full_variant(cause.variants[0])
    for column, p in zip(group.columns, group.params, strict=True):
        values = 1e-2 * np.eye(3)[p]
        left, more = (
            whitened(system, state(Term(effect, v))) for v in (-values, values)
        )
        found = columns_of(system, state(), int(column))
        np.testing.assert_allclose(found, (left - more) / 2e-2, atol=1e-5)


def turned(by: Array) -> Alignment:
    rotation = Rotation.from_rotvec(by).as_matrix() @ TURN
    return replace(ALIGNMENT, rotation=rotation)


@pytest.mark.parametrize("j", range(5))
def test_columns_of_the_alignment_are_what_another_one_changes(j: int) -> None:
    """Delay, drift about the middle, and a turn about each axis of the device."""
    d = system_of(rows()).dictionary
    index = [d.clock, d.clock + 1, d.turn, d.turn + 1, d.turn + 2][j]
    # what drifts is taken in the middle of each row of two samples
    step, apart = 1e-4, 4e-3 if j == 1 else 5e-4
    one = step * np.eye(5)[j]
    sides = [
        replace(turned(s * one[2:]), delay=0.3 + s * one[0], drift=1e-3 + s * one[1])
        for s in (1, -1)
    ]
    whole = rows()
    up, down = (
        whitened(system_of(replace(whole, alignment=other)), state()) for other in sides
    )
    found = columns_of(system_of(whole), state(), index)
    np.testing.assert_allclose(found, (down - up) / (2 * step), atol=apart)
    assert np.abs(found).max() > 1


def test_a_channel_that_the_reference_lacks_has_a_constant_value() -> None:
    """Along its own axis; upright, gravity is known to some part alone."""
    whole = rows(missing=MISSING)
    d = system_of(whole).dictionary
    np.testing.assert_array_equal(d.missing_channels, MISSING)
    for j, c in enumerate(MISSING):
        found = columns_of(system_of(whole), state(), d.unseen + j)
        six = np.zeros(6)
        triad = slice(0, 3) if c < 3 else slice(3, 6)
        six[triad] = TURN[:, c % 3]
        expected = six * SCALE * np.sqrt(len(whole) / system_of(whole).power[0])
        np.testing.assert_allclose(found[0], expected)
        assert np.abs(found[1:]).max() < 1e-9
    (group,) = (g for g in d.always if g.cause == "unseen")
    np.testing.assert_array_equal(group.columns, [d.unseen, d.unseen + 1])
    np.testing.assert_allclose(group.typical, priors.UNSEEN[list(MISSING)])
    assert group.fixed_size == 1.0
    gravity = np.array([0.0, 9.81, 0.0, 0.0, 0.0, 0.0])
    upright = replace(whole, alignment=replace(ALIGNMENT, unseen_gravity=gravity))
    (group,) = (g for g in system_of(upright).dictionary.always if g.cause == "unseen")
    np.testing.assert_allclose(group.typical, [priors.UPRIGHT, priors.UNSEEN[5]])


def test_what_is_always_there_is_free_and_positions_do_not_move() -> None:
    d = system_of(rows()).dictionary
    groups = {g.cause: g for g in d.always}
    assert set(groups) == {"bias", "scale", "clock", "turn"}
    clock, turn = groups["clock"], groups["turn"]
    np.testing.assert_array_equal(clock.columns, d.clock + np.arange(2))
    np.testing.assert_allclose(clock.typical, [priors.CLOCK_S, priors.CLOCK_RATE])
    np.testing.assert_array_equal(turn.columns, d.turn + np.arange(3))
    np.testing.assert_allclose(turn.typical, priors.AXES_TURNED)
    assert clock.fixed_size == turn.fixed_size == priors.FREE_SIZE
    effects = [v.effect for c in d.causes for v in c.variants if v.effect is not None]
    assert all(not isinstance(e, Motion) or e.on_the_way for e in effects)
    names = {c.name for c in d.causes}
    assert {"time_delay", "lever_arm", "quadratic", "bandwidth"} <= names
    assert not {"angle_offset", "base_tilt", "mount_slip"} & names
    assert any(c.kind == "unknown" for c in d.causes)
    assert not d.typical_instability.any() and d.typical_instability.shape == (7,)
    assert not d.unoriented.any()
    assert not d.window_error.any() and np.isinf(d.since).all()


LATE, TAU, SECOND = 0.02, 4e-3, 0.02


def with_responses(there: MotionRows) -> MotionRows:
    """Rows of which gyroscopes are known to be late, and both triads to be slow."""
    reference = there.reference
    return replace(there, acc=Response.of(reference, 0.0, 0.003, 0.018),
                   gyr=Response.of(reference, LATE, TAU, SECOND))  # fmt: skip


def test_what_a_state_says_of_a_known_response_is_not_taken_off_twice() -> None:
    """The motion of the reference goes through the filters themselves already."""
    there = with_responses(rows())
    acc, gyr = there.motion(there.acc), there.motion(there.gyr)
    felt = np.hstack([acc[:, :3], gyr[:, 3:]])
    there = replace(there, y=BIAS + SCALE * felt)
    system = system_of(rows())
    system.dictionary.realign(there)
    d = system.dictionary
    assert d.gyro_inputs is not d.x and system.motion is there
    # to first order these add what the filters did, by the same derivatives
    own = [
        Term(EFFECTS["time_delay"], np.array([LATE])),
        Term(EFFECTS["bandwidth"], np.array([0.003, TAU])),
        Term(EFFECTS["second_order"], np.array([0.018, SECOND])),
    ]
    plain = state(*own, scale=np.ones(6))
    there = replace(there, y=BIAS + felt)
    d.realign(there)
    assert np.abs(whitened(system, plain)).max() < 1e-9
    other = whitened(system, state(scale=np.ones(6)))
    known = np.zeros((len(there), 6))
    change = np.hstack([there.motion(there.acc, 1)[:, :3],
                        there.motion(there.gyr, 1)[:, 3:]])  # fmt: skip
    np.testing.assert_allclose(d.current.change, change)
    for triad, one in ((slice(0, 3), there.acc), (slice(3, 6), there.gyr)):
        x = there.experience(one)
        known[:, triad] = (
            one.late * change[:, triad]
            + one.tau * x.slope[:, triad]
            + one.second * x.bend[:, triad]
        )
    expected = there.cosines(-known) / np.sqrt(system.power)
    np.testing.assert_allclose(other, expected, atol=1e-9)
    # the columns of each triad are by its own inputs
    for c, x in ((2, there.experience(there.acc)), (4, there.experience(there.gyr))):
        column = columns_of(system, plain, d.scale + c)[:, c]
        value = np.hstack([x.f, x.w])[:, c : c + 1]
        white = there.cosines(value)[:, 0] / np.sqrt(system.power[:, c])
        np.testing.assert_allclose(column, white, atol=1e-9)
    d.realign(rows())
    assert d.gyro_inputs is d.x


def test_a_share_of_what_stamps_miss_is_known() -> None:
    there = rows()
    uneven = np.random.default_rng(2).normal(0.0, 1e-3, there.at.shape)
    there = replace(there, uneven=uneven, share=0.4)
    missed = there.experience(there.acc).missed
    there = replace(there, y=BIAS + SCALE * there.motion(there.acc))
    left = whitened(system_of(there), state())
    system = system_of(there)
    expected = there.cosines(-0.4 * SCALE * missed) / np.sqrt(system.power)
    np.testing.assert_allclose(left, expected, atol=1e-9)
    assert np.abs(expected).max() > 1e-3


def test_a_value_that_was_not_measured_counts_as_what_is_expected() -> None:
    there = rows()
    y = there.y + 1.0
    y[3, 2] = np.nan
    system = system_of(replace(there, y=y))
    off = np.ones((len(there), 6))
    off[3, 2] = 0.0
    expected = there.cosines(off) / np.sqrt(system.power)
    np.testing.assert_allclose(whitened(system, state()), expected, atol=1e-4)


def test_columns_that_are_not_wanted_are_left_out() -> None:
    system = system_of(rows())
    d = system.dictionary
    wanted = np.zeros(d.width, dtype=bool)
    wanted[[d.bias + 2, d.scale + 4, d.turn + 1]] = True
    shown = d.shown.copy()
    for part in system.linearised(state(), wanted):
        expected = {2: {d.bias + 2}, 4: {d.scale + 4}}.get(part.channel, set())
        assert set(part.columns.tolist()) <= expected | {d.turn + 1}
        assert expected <= set(part.columns.tolist())
    np.testing.assert_array_equal(d.shown, shown)
    system.linearised(state())
    grouped = {int(c) for g in d.always for c in g.columns}
    grouped |= {int(c) for o in d.causes for v in o.variants for c in v.columns}
    linear = system.linearised(state())
    assert set(np.concatenate([p.columns for p in linear]).tolist()) <= grouped
    assert d.shown[d.bias : d.bias + 6].all()


def test_a_copy_has_columns_of_its_own_and_the_same_rows() -> None:
    system = system_of(rows())
    other = system.independent_copy()
    assert other.power is system.power and other.motion is system.motion
    width = system.dictionary.width
    other.dictionary.add_course("more", lambda x: np.ones((len(x.t), 1)), 1, False)
    assert other.dictionary.width > width == system.dictionary.width


# --- what is left after a fit


def fitted(seed: int) -> tuple[LinearRows, Array, Eliminated, Array, Array]:
    """Rows of a channel with two fitted columns of five, and priors of these."""
    rng = np.random.default_rng(seed)
    count, columns = 60, np.array([3, 9, 4, 7, 1])
    design = rng.standard_normal((count, 5))
    white, weight = rng.standard_normal(count), rng.uniform(0.5, 2.0, count)
    values = rng.standard_normal(10)
    some = LinearRows(1, np.arange(count), np.zeros(count, int), weight, columns,
                      design, white)  # fmt: skip
    kept = np.array([1, 3])  # columns 9 and 7
    prior = np.array([0.5, 2.0])
    information = design[:, kept].T @ design[:, kept] + np.diag(prior**-2)
    cov = np.linalg.inv(information)
    best = cov @ (design[:, kept].T @ (white + design[:, kept] @ values[[9, 7]]))
    # the other channels' columns are fitted as well
    half = np.zeros((3, 3))
    half[:2, [2, 0]], half[2, 1] = np.linalg.cholesky(cov).T, 1.0
    found = Eliminated(
        cast(WeightedGram, None), np.array([7, 8, 9]), np.ones(3), half,
        np.array([best[1], 5.0, best[0]]), 0.0,
    )  # fmt: skip
    return some, values, found, cov, best


def test_residuals_are_less_what_was_fitted_and_leverages_what_it_takes() -> None:
    part, values, found, cov, best = fitted(1)
    left, leverage = fit_residuals(part, values, found)
    design = part.design[:, [1, 3]]
    expected = (part.white - design @ (best - values[[9, 7]])) / part.weight
    np.testing.assert_allclose(left, expected)
    hat = design @ cov @ design.T
    np.testing.assert_allclose(leverage, np.diag(hat))


def test_noise_is_measured_by_triad() -> None:
    """Each channel in its place, those of a triad together; a triad may be missing."""
    part, values, found, *_ = fitted(2)
    hz = np.arange(60) / 20
    bands = Bands.between(hz)
    parts = [replace(part, channel=c, white=(c + 1) * part.white) for c in (4, 2, 5)]
    levels = noise_levels(bands, hz, parts, values, found)
    assert set(levels) == {2, 4, 5}
    for some in ((4, 5), (2,)):
        own = [p for p in parts if p.channel in some]
        left, leverage = zip(*(fit_residuals(p, values, found) for p in own),
                             strict=True)  # fmt: skip
        expected = bands.levels(hz, left, leverage)
        for p, level in zip(own, expected, strict=True):
            np.testing.assert_allclose(levels[p.channel], level)
    assert set(noise_levels(bands, hz, parts[1:2], values, found)) == {2}
