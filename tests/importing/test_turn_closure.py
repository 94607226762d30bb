"""Turns by a hand that jerks: the rests at both ends tell the scale of the rates."""

import numpy as np
import pytest
from laid_about import G, turned
from scipy.spatial.transform import Rotation

from fieldcal.core.samples import Array
from fieldcal.importing.units.gravity_size import GravityReading
from fieldcal.importing.units.rate_size import estimate_rate_unit
from fieldcal.importing.units.turn_closure import closing_scale

RATE = 100.0
KNOWN = GravityReading(G, np.zeros(3), True)


def jerked(seed: int, force: float) -> Array:
    """Rows t, a, w with a hand's own forces while it turns, m/s^2."""
    rows = turned(seed, RATE)
    rng = np.random.default_rng(seed)
    rows[:, 4:] -= np.median(rows[:, 4:], axis=0)
    moves = np.linalg.norm(rows[:, 4:], axis=1) > 0.05
    slow = np.repeat(rng.normal(0, force, (len(rows) // 25 + 1, 3)), 25, axis=0)
    rows[moves, 1:4] += slow[: len(rows)][moves]
    return rows


@pytest.mark.parametrize("unit", [1.0, 180 / np.pi, 939.65])
@pytest.mark.parametrize("force", [0.0, 3.0])
def test_the_scale_of_rates_is_found_however_the_hand_jerks(
    unit: float, force: float
) -> None:
    rows = jerked(3, force)
    found = estimate_rate_unit(rows[:, 0], rows[:, 1:4], rows[:, 4:] * unit, KNOWN)
    assert found == pytest.approx(unit, rel=0.03)


def swung(seed: int) -> Array:
    """Rows t, a, w of a device that a forearm turns about its elbow."""
    rng = np.random.default_rng(seed)
    now, arm, parts = Rotation.identity(), np.array([0.15, -0.05, 0.06]), []
    for _ in range(12):
        axis, angle, lasts = _unit(rng), rng.uniform(0.6, 2.6), rng.uniform(0.9, 2.5)
        part = np.arange(int(lasts * RATE)) / int(lasts * RATE)
        way = angle * (part - np.sin(2 * np.pi * part) / (2 * np.pi))
        speed = np.outer(angle / lasts * (1 - np.cos(2 * np.pi * part)), axis)
        up = (now * Rotation.from_rotvec(np.outer(way, axis))).inv().apply([0, 0, G])
        pull = np.cross(np.gradient(speed, 1 / RATE, axis=0), arm)
        parts.append(
            np.hstack([up + pull + np.cross(speed, np.cross(speed, arm)), speed])
        )
        now = now * Rotation.from_rotvec(angle * axis)
        held = [*now.inv().apply([0, 0, G]), 0, 0, 0]
        parts.append(np.tile(held, (int(rng.uniform(3, 6) * RATE), 1)))
    rows = np.vstack(parts) + rng.normal(
        0, [*[0.02] * 3, *[0.002] * 3], (sum(map(len, parts)), 6)
    )
    return np.column_stack([np.arange(len(rows)) / RATE, rows])


def _unit(rng: np.random.Generator) -> Array:
    axis = rng.standard_normal(3)
    unit: Array = axis / np.linalg.norm(axis)
    return unit


@pytest.mark.parametrize("rail", [np.inf, 2.5])
@pytest.mark.parametrize("seed", range(5))
def test_turns_about_an_elbow_or_into_a_rail_show_no_other_scale(
    seed: int, rail: float
) -> None:
    rows = swung(seed)
    rates = np.clip(rows[:, 4:], -rail, rail)
    found = estimate_rate_unit(rows[:, 0], rows[:, 1:4], rates, KNOWN)
    assert found == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize("seed", range(6))
def test_what_a_trembling_hand_reads_in_one_short_rest_is_no_bias(seed: int) -> None:
    """It trembles by half a degree, now more and now less: parts of it are calm."""
    rows, rng = swung(seed), np.random.default_rng(seed)
    t = rows[:, 0]
    for hz in rng.uniform(0.4, 6.0, 4):
        phase = 2 * np.pi * hz * t + rng.uniform(0, 6.28)
        now = 0.008 * np.sin(0.7 * t + rng.uniform(0, 6.28, (3, 1))).T
        angle = now * np.sin(phase)[:, None]
        rows[:, 1:4] -= np.cross(angle, rows[:, 1:4])
        rows[:, 1:4] -= 0.06 * (2 * np.pi * hz) ** 2 * angle
        rows[:, 4:] += now * (2 * np.pi * hz * np.cos(phase))[:, None]
    found = closing_scale(t, rows[:, 1:4] / G, rows[:, 4:], 1.15)
    assert found == pytest.approx(1.0, rel=0.03)


def test_a_rate_that_is_not_known_at_rest_costs_the_others_nothing() -> None:
    rows = swung(3)
    rest = np.flatnonzero(np.linalg.norm(rows[:, 4:], axis=1) < 0.01)
    rates = rows[:, 4:].copy()
    rates[rest[50:53]] = np.nan
    found = closing_scale(rows[:, 0], rows[:, 1:4] / G, rates, 1.15)
    assert found == pytest.approx(1.0, rel=0.03)
    rates[rest] = np.nan
    assert closing_scale(rows[:, 0], rows[:, 1:4] / G, rates, 1.15) is None


def test_a_slow_turn_is_no_rest() -> None:
    """Gravity turns by 10 degrees a second, as calm as it lies."""
    rows = swung(2)
    rest = np.flatnonzero(np.linalg.norm(rows[:, 4:], axis=1) < 0.05)
    goes_on = np.diff(np.concatenate([[0], rest])) == 1
    assert goes_on.sum() > 1000
    slow = np.deg2rad(10.0)
    path = Rotation.from_rotvec(
        np.outer(np.cumsum(goes_on * slow / RATE), [0.0, 0.6, 0.8])
    )
    rows[rest, 1:4] = path.inv().apply(rows[rest, 1:4])
    rows[rest, 4:] += slow * np.array([0.0, 0.6, 0.8])
    assert closing_scale(rows[:, 0], rows[:, 1:4] / G, rows[:, 4:], 1.0) is None


def test_the_rests_alone_give_it() -> None:
    rows = jerked(4, 15.0)
    found = closing_scale(rows[:, 0], rows[:, 1:4] / G, rows[:, 4:], 1.3)
    assert found == pytest.approx(1.0, rel=0.03)


def test_rates_of_another_device_close_at_no_scale() -> None:
    rows, other = jerked(5, 6.0), jerked(5, 6.0)
    away = np.roll(other[:, 4:], 1, axis=1)
    assert closing_scale(rows[:, 0], rows[:, 1:4] / G, away, 1.0) is None
    assert closing_scale(rows[:, 0], rows[:, 1:4] / G, -other[:, 4:], 1.0) is None


def test_times_that_most_rows_share_tell_no_scale() -> None:
    rows = jerked(3, 0.0)
    shared = np.floor(rows[:, 0] * 10) / 10
    assert closing_scale(shared, rows[:, 1:4] / G, rows[:, 4:], 1.0) is None
