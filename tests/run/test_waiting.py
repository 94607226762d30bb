"""Waiting for the device to come to rest where it should."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.errors import InputError
from fieldcal.core.positions import Position
from fieldcal.core.samples import Block
from fieldcal.planning.steps import Hold
from fieldcal.run.waiting import SETTLE_S, SWAY_SETTLE_S, PositionWait
from fieldcal.session import description_file

G, RATE, TURN_S = 9.81, 100.0, 3.0


def turning_to(alpha_deg: float, sways: bool) -> float:
    """Seconds from the end of a small turn until it has arrived."""
    rng = np.random.default_rng(0)
    t = np.arange(0.0, 30.0, 1 / RATE)
    part = np.clip((t - 5.0) / TURN_S, 0.0, 1.0)
    sway = np.deg2rad(0.3) * np.sin(2 * np.pi * 0.2 * t) * sways
    alpha = np.deg2rad(alpha_deg) * (1 - np.cos(np.pi * part)) / 2 + sway
    acc = -G * np.column_stack([np.sin(alpha), np.cos(alpha), np.zeros_like(t)])
    gyr = np.zeros_like(acc)
    gyr[:, 2] = np.gradient(alpha, t)
    noise = rng.standard_normal((len(t), 6)) * np.repeat([5e-3, 1e-3], 3)
    block = Block.of(t, acc + noise[:, :3], gyr + noise[:, 3:])
    about = description_file.parse_description(
        {
            "format": 1,
            "site": {"gravity": G, "sways": sways},
            "position": [{"alpha_deg": alpha_deg, "beta_deg": 0.0}],
        }
    )
    waiting = PositionWait(Hold(0, Position.deg(alpha_deg, 0.0), 10.0), about, None)
    for first in range(0, len(t), 10):
        waiting.add(block[first : first + 10], float(t[first]))
        if waiting.arrived and t[first] > 5.0:
            return float(t[first] + 0.1 - 5.0 - TURN_S)
    raise AssertionError("never arrived")


@pytest.mark.parametrize("sways", [False, True])
def test_no_window_begins_in_a_turn(sways: bool) -> None:
    """Of 2.5 degrees in three seconds, slower than what sways may be."""
    assert turning_to(2.5, sways) > (
        SWAY_SETTLE_S - TURN_S if sways else SETTLE_S - 0.5
    )


@pytest.mark.parametrize(
    ("creeps", "calls"),
    [pytest.param(0.0, [20.0], marks=pytest.mark.thorough), (4.0, [8.0])],
)
def test_a_gust_is_no_turn_and_calls_nobody_anew(
    creeps: float, calls: list[float]
) -> None:
    """Gusts of a second every seven; the first may leave it elsewhere, still wrong."""
    rng = np.random.default_rng(7)
    t = np.arange(0.0, 60.0, 1 / RATE)
    gust = (t % 7.0 > 5.0) & (t % 7.0 < 6.0)
    alpha = np.deg2rad(creeps) * (t > 6.0)
    acc = -G * np.column_stack([np.sin(alpha), np.cos(alpha), np.zeros_like(t)])
    acc += 5e-3 * rng.standard_normal(acc.shape)
    acc += gust[:, None] * 0.5 * rng.standard_normal(acc.shape)
    gyr = 1e-3 * rng.standard_normal(acc.shape) * (1 + 50 * gust[:, None])
    block = Block.of(t, acc, gyr)
    about = description_file.parse_description(
        {
            "format": 1,
            "site": {"gravity": G},
            "position": [{"alpha_deg": 45.0, "beta_deg": 0.0}],
        }
    )
    waiting, called = (
        PositionWait(Hold(0, Position.deg(45.0, 0.0), 10.0), about, None),
        [],
    )
    for first in range(0, len(t), 10):
        waiting.add(block[first : first + 10], float(t[first]))
        if waiting.alarm_due() is not None:
            called.append(float(t[first]))
    assert len(called) == len(calls)
    assert all(0.0 <= c - w < 8.0 for c, w in zip(called, calls, strict=True))


@pytest.mark.parametrize(
    ("lacks", "says"),
    [
        ([2], r"^α = 0°, β = 0°: az gives no value"),
        ([0, 1, 2], r"^α = 0°, β = 0°: ax, ay and az give no value"),
    ],
)
def test_nobody_waits_for_an_axis_that_is_missing(lacks: list[int], says: str) -> None:
    """The mounting exchanges axes; those of the device are named."""
    rng = np.random.default_rng(0)
    t = np.arange(0.0, 10.0, 1 / RATE)
    acc = [-G, 0.0, 0.0] + 5e-3 * rng.standard_normal((len(t), 3))
    acc[:, lacks] = np.nan
    block = Block.of(t, acc, 1e-3 * rng.standard_normal(acc.shape))
    about = description_file.parse_description(
        {
            "format": 1,
            "site": {"gravity": G},
            "frame": {"mounting": ["+y", "+x", "-z"]},
            "position": [{"alpha_deg": 0.0, "beta_deg": 0.0}],
        }
    )
    waiting = PositionWait(Hold(0, Position.deg(0.0, 0.0), 10.0), about, None)
    with pytest.raises(InputError, match=says):
        for first in range(0, len(t), 10):
            waiting.add(block[first : first + 10], float(t[first]))
    assert waiting.waited < 6.0
