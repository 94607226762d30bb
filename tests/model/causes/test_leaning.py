"""What gives way under a device: columns by rotation matrices, and whole recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from small_sessions import SD, WINDOW_S, G, dictionary, ladder, nominal, rows_of

from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis.explain import Explanation, explain
from fieldcal.diagnosis.findings.found_effects import parameter_estimates
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.leaning import leaning
from fieldcal.model.causes.wander import Wander
from fieldcal.model.rows.lean_modes import lean_modes
from fieldcal.session.description_file import parse_description

SIDES = [*np.vstack([np.eye(3), -np.eye(3)]), *np.array(
    [[1, 1, 0], [0, -1, 1], [-1, 0, -1], [1, -1, 1], [-1, 1, 1], [1, 1, -1]]
) / np.sqrt([[2], [2], [2], [3], [3], [3]])]  # fmt: skip
"""Where the force points in each stop: faces, edges and corners."""

WARMING = (0.012, -0.01, 0.02)
"""What a kelvin does to the accelerometers, m/s^2."""

RATE, STOP_S, WAY_S = 50.0, 20.0, 4.0


def test_a_lean_turns_force_and_gyroscopes_as_a_rotation_does() -> None:
    """Rotation matrices about an axis in space, differentiated by differences."""
    x = ladder(rows=6, free=[4])
    table = dictionary(x)
    table.wander = replace(Wander.none(), leans=np.array([0, 0, 0, 0, 3, 0, 0, 0, 0]))
    group = leaning(table)
    assert group is not None and len(group.columns) == 2 * 3
    assert group.random and not group.in_state
    np.testing.assert_allclose(group.typical * [1, 2, 3, 1, 2, 3], group.typical[0])
    _, basis = table.bases[-1]
    assert isinstance(basis, General)
    found = basis.evaluate(RowView.of(x, np.zeros((1, len(x))), nominal()))
    there = np.flatnonzero(x.position == 4)
    assert not np.delete(found, there, axis=0).any()
    begin, force = x.t[there].min(), x.f[there[0]]
    lasts = float(np.ptp(x.t[there]))  # rows of samples last no time by themselves
    about = np.cross(found[there[0], :3, 0], force)
    about /= np.linalg.norm(about)
    for column, k in enumerate((1, 2, 3)):

        def angle(t: Array, k: int = k) -> Array:
            out: Array = np.cos(np.pi * k * (t - begin) / lasts)
            return out

        eps, dt = 1e-6, 1e-4
        t = x.t[there]
        turn = Rotation.from_rotvec(eps * angle(t)[:, None] * about)
        # a device that has turned by R sees what is fixed in space by its inverse
        off = (turn.inv().apply(force) - force) / eps
        np.testing.assert_allclose(found[there, :3, column], off, atol=1e-4)
        later = Rotation.from_rotvec(eps * angle(t + dt)[:, None] * about)
        before = Rotation.from_rotvec(eps * angle(t - dt)[:, None] * about)
        rate = (before.inv() * later).as_rotvec() / (2 * dt * eps)
        np.testing.assert_allclose(found[there, 3:, column], rate, atol=1e-4)


def test_cosines_are_those_that_rows_show() -> None:
    """A walk of a thousandth, of a hundred-thousandth, none, and where it is known."""
    rng = np.random.default_rng(7)
    x = ladder(rows=20, free=range(8))
    k = np.arange(1, 20)
    u = (x.t - 40.0 * x.position)[:, None] / WINDOW_S
    modes = []
    for size in (1e-3, 1e-5, 0.0):
        walk = np.zeros(len(x))
        for p in range(9):
            there = x.position == p
            walk[there] = np.cos(np.pi * k * u[there]) @ (rng.normal(size=19) / k)
        y = np.hstack([x.f, x.w]) + SD * rng.normal(size=(len(x), 6))
        y[:, 2] += size * G * walk
        modes.append(lean_modes(rows_of(x, y)))
        y[:, 3:] = np.nan  # accelerometers alone show it as well
        np.testing.assert_array_equal(lean_modes(rows_of(x, y)), modes[-1])
    assert (np.array(modes)[:, 8] == 0).all(), "its angles are set"
    assert modes[0][:8].min() >= 15 and modes[1][:8].max() <= 4
    assert modes[2][:8].max() <= 4 and modes[2][:8].mean() < modes[0][:8].mean() / 4


def turned(one: Array, other: Array, part: Array) -> Rotation:
    """How a device turns whose force then points along another of its directions."""
    axis = np.cross(one, other)
    axis = axis if axis.any() else np.cross(one, [0.3, 0.5, 0.8])
    angle = np.arccos(np.clip(one @ other, -1.0, 1.0))
    return Rotation.from_rotvec(np.outer(part * -angle, axis / np.linalg.norm(axis)))


def stops(rng: np.random.Generator, lean: float, firm: bool = False) -> Block:
    """A device that is laid down twelve times, on what gives way by some rad.

    `firm` leaves the gyroscopes out of it, as where a bias changes and nothing turns.
    """
    n, way = int(STOP_S * RATE), int(WAY_S * RATE)
    u, on = (np.arange(n) + 0.5) / n, (np.arange(way) + 0.5) / way
    waves = np.cos(np.pi * np.outer(u, np.arange(1, 7)))
    bends = [waves @ (rng.normal(0, lean, (6, 3)) / np.arange(1, 7)[:, None])
             for _ in SIDES]  # fmt: skip
    at = turned(np.array([0, 0, 1.0]), SIDES[0], np.ones(1))[0]
    straight, bent = [], []
    for i, bend in enumerate(bends):
        bend -= np.outer(bend @ SIDES[i], SIDES[i])  # nothing turns about gravity
        straight.append(at * Rotation.identity(n))
        bent.append(bend)
        if i + 1 < len(SIDES):
            goes = turned(SIDES[i], SIDES[i + 1], (1 - np.cos(np.pi * on)) / 2)
            straight.append(at * goes)
            bent.append(bend[-1] + np.outer(on, bends[i + 1][0] - bend[-1]))
            at = at * turned(SIDES[i], SIDES[i + 1], np.ones(1))[0]
    frame = Rotation.concatenate(straight)
    whole = frame * Rotation.from_rotvec(np.vstack(bent))
    turns = frame if firm else whole
    rate = (turns[:-1].inv() * turns[1:]).as_rotvec() * RATE
    a = whole.inv().apply([0, 0, G]) + [0.05, -0.03, 0.02]
    w = (np.vstack([rate[:1], rate]) + np.vstack([rate, rate[-1:]])) / 2
    noise = np.repeat([4e-3, 4e-4], 3) * rng.normal(size=(len(a), 6))
    t = np.arange(len(a)) / RATE
    warmth = 25.0 + 6.0 * np.sin(t / 32.0)  # sun and clouds
    a = a + np.outer(warmth - 25.0, WARMING) + noise[:, :3]
    w = w + [1e-3, -2e-3, 5e-4] + noise[:, 3:]
    return Block.of(t, a, w, temperature=warmth)


def explained(block: Block) -> Explanation:
    every = STOP_S + WAY_S
    positions = [
        {"start_s": i * every + 0.5, "end_s": i * every + STOP_S - 0.5}
        for i in range(len(SIDES))
    ]
    about = {"format": 1, "site": {"gravity": G, "latitude_deg": 50.0},
             "position": positions}  # fmt: skip
    return explain(prepare_recording(block, parse_description(about)))


@pytest.mark.thorough
@pytest.mark.parametrize(("seed", "lean"), [(0, 2e-4), (2, 3e-4)])
def test_what_leans_is_no_change_of_a_bias(seed: int, lean: float) -> None:
    """Sun and clouds warm the device as well, and that alone is named."""
    found = explained(stops(np.random.default_rng(seed), lean))
    assert "leaning" in found.best.set.keys
    assert found.posterior.cause_names(found.best.set) == ("temperature_bias",)
    (standing,) = found.probable_causes
    told = parameter_estimates(found, standing)
    for axis, true in zip("xyz", WARMING, strict=True):
        one = told[f"a{axis}"]
        assert one.sigma is not None and one.sigma < 5e-4
        assert one.value == pytest.approx(true, abs=4 * one.sigma)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "seed", [2, *(pytest.param(s, marks=pytest.mark.thorough) for s in (3, 4))]
)
def test_on_firm_ground_nothing_leans(seed: int) -> None:
    """Nor is one window off for itself: turns end at the force that is read."""
    found = explained(stops(np.random.default_rng(seed), 0.0))
    assert "leaning" not in found.best.set.keys
    assert found.posterior.cause_names(found.best.set) == ("temperature_bias",)


@pytest.mark.thorough
def test_what_gyroscopes_would_have_seen_is_no_lean() -> None:
    """Outputs that change by as much as a tilt of 20 mrad, while nothing turns."""
    found = explained(stops(np.random.default_rng(5), 2e-2, firm=True))
    assert "leaning" not in found.best.set.keys
