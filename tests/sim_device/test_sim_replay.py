"""A session played again: on made-up schedules, and against another program's."""

import gzip
import json
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fieldcal.core import frames
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.effect import SimulatedEffect
from fieldcal.sim_device.profile import (
    ONE,
    ZERO,
    Climate,
    NoiseFigures,
    Profile,
    Truth,
)
from fieldcal.sim_device.profile_file import profile_from_tables
from fieldcal.sim_device.replay import HeldWindow, simulate
from fieldcal.sim_device.vocabulary import checked_effect, parse

PLAIN = Profile(
    truth=Truth(ZERO, ONE, ZERO, ONE), temperature=Climate(self_heating_k=0.0)
)
PLACES = [(0.1, 0.0, 2.0, 12.0), (0.7, 0.1, 20.0, 30.0), (-0.7, 0.1, 31.0, 40.0)]


def test_every_window_has_its_position() -> None:
    block = simulate(PLAIN, PLACES, noise=False)
    assert block.t[-1] == pytest.approx(42.99)
    for alpha, beta, start, end in PLACES:
        held = block.between(start, end)
        expected = frames.specific_force_at_rest(alpha, beta, PLAIN.gravity)
        np.testing.assert_allclose(held.acc, np.tile(expected, (len(held), 1)))
        np.testing.assert_allclose(held.gyr, 0, atol=1e-12)


def test_the_turn_is_where_it_is_said_to_be() -> None:
    windows = [
        HeldWindow(0.0, 0.0, 2.0, 12.0),
        HeldWindow(0.7, 0.1, 20.0, 30.0, turn=(13.0, 15.0)),
    ]
    for profile in (PLAIN, PLAIN.having(parse("clock_skew:ppm=50000"))):
        block = simulate(profile, windows, noise=False)
        moving = block.t[np.abs(block.gyr).max(axis=1) > 1e-9]
        assert 13 < moving[0] < 13.05 and 14.95 < moving[-1] < 15


def test_it_is_the_running_device_with_the_same_orders() -> None:
    profile = PLAIN.having(
        parse("lever_arm:x=0.1"),
        parse("settling:ax=0.1,tau_s=2"),
        parse("hum:hz=3,gx=1"),
    )
    windows = [
        HeldWindow(0.0, 0.0, 0.0, 12.0),
        HeldWindow(0.7, 0.1, 20.0, 30.0, turn=(13.0, 17.0)),
    ]
    device = VirtualDevice(profile, seed=4)
    device.turn(0.7, 0.1, at=13.0)
    block = device.take(3300)
    again = simulate(profile, windows, seed=4)
    np.testing.assert_array_equal(again.t, block.t)
    np.testing.assert_allclose(again.six, block.six, rtol=0, atol=1e-12)


def test_windows_at_constant_rate() -> None:
    windows = [
        HeldWindow(0.0, 0.0, 3.0, 6.0, rate=(0.0, 1.0, 0.0)),
        HeldWindow(0.0, 0.0, 12.0, 15.0, rate=(0.5, 0.0, 0.5)),
        HeldWindow(0.3, 0.0, 22.0, 25.0),
    ]
    block = simulate(PLAIN, windows, noise=False)
    for w in windows:
        held = block.between(w.start, w.end)
        np.testing.assert_allclose(held.gyr, np.tile(w.rate, (len(held), 1)), atol=1e-9)
    last = block.between(22, 25).acc
    np.testing.assert_allclose(
        last[0], frames.specific_force_at_rest(0.3, 0, PLAIN.gravity), atol=1e-9
    )


def test_times_with_jitter_and_gaps_are_kept() -> None:
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(0, 40, 2000))
    t[1000:] += 3600.0
    windows = [HeldWindow(0.5, 0.0, 0.0, 4000.0)]
    block = simulate(replace(PLAIN, noise=NoiseFigures(acc_walk=ONE)), windows, t)
    np.testing.assert_array_equal(block.t, t)
    walked = block.acc - frames.specific_force_at_rest(0.5, 0.0, PLAIN.gravity)
    jump = np.abs(walked[1000] - walked[999])
    assert jump.max() > 5 * np.abs(np.diff(walked, axis=0)[:900]).max()


def test_a_recorded_temperature_is_followed() -> None:
    t = np.arange(0, 100, 0.01)
    degrees = 20 + 0.1 * t
    profile = PLAIN.having(parse("temperature_bias:gx=1e-3"))
    block = simulate(profile, [(0, 0, 0.0, 100.0)], t, degrees, noise=False)
    np.testing.assert_allclose(block.temperature, degrees, atol=0.26)
    np.testing.assert_allclose(block.gyr[:, 0], 1e-4 * t, atol=5e-4)


def test_vibration_can_be_set_for_each_window() -> None:
    profile = PLAIN.having(parse("vibration_rectification:x=1e-9"))
    windows = [
        HeldWindow(0, 0, 0, 10, vibration=0.0),
        HeldWindow(0, 0, 12, 22, vibration=0.4),
    ]
    block = simulate(profile, windows)
    assert block.between(0, 10).acc[:, 0].std() < 0.03
    assert block.between(12, 22).acc[:, 0].std() == pytest.approx(0.4, rel=0.1)


@pytest.mark.parametrize(
    ("windows", "says"),
    [
        ([], "no window"),
        ([(0, 0, 5.0, 4.0)], "position 1: its window"),
        ([(0, 0, 0.0, 4.0), (0, 0, 3.0, 6.0)], "position 2: its window"),
        ([(np.nan, 0, 0.0, 4.0)], "unknown"),
    ],
)
def test_a_schedule_that_cannot_be_is_refused(windows: Any, says: str) -> None:
    with pytest.raises(InputError, match=says):
        simulate(PLAIN, windows)


@pytest.mark.parametrize("t", [[0.0, np.nan], [1.0, 0.0]])
def test_times_that_cannot_be_are_refused(t: list[float]) -> None:
    with pytest.raises(InputError, match="finite and ascending"):
        simulate(PLAIN, PLACES, np.array(t))


def concealed(id_: str, given: dict[str, Any]) -> SimulatedEffect:
    """An effect of the practice sessions' answers in our words."""
    letters = {"cross_coupling": "k", "g_sensitivity": "g"}
    named = {"acc": "xyz" if id_ == "quadratic" else ("ax", "ay", "az"),
             "gyr": ("gx", "gy", "gz")}  # fmt: skip
    numbers: dict[str, float] = {}
    for key, value in given.items():
        if key == "matrix":
            for (i, j), number in np.ndenumerate(np.array(value)):
                if number:
                    numbers[f"{letters[id_]}{i + 1}{j + 1}"] = float(number)
        elif key in named:
            numbers |= dict(zip(named[key], value, strict=True))
        else:
            numbers[key] = value
    return checked_effect(id_, numbers)


def told(path: Path) -> tuple[Profile, list[HeldWindow]]:
    """Device and windows that a session.toml of another program says it simulated."""
    tables = tomllib.loads(path.read_text("utf-8"))
    model = tables["model"]
    profile = profile_from_tables(
        {name: tables[name] for name in ("device", "sampling", "site", "frame")}
        | {"truth": tables["nominal"]}
        | {"effects": {id_: model.get(id_, {}) for id_ in model["effects"]}}
    )
    windows = [
        HeldWindow(
            float(np.deg2rad(row["alpha_deg"])),
            float(np.deg2rad(row["beta_deg"])),
            row["start_s"],
            row["end_s"],
        )
        for row in tables["position"]
    ]
    return profile, windows


@pytest.mark.parametrize(
    "name", ["p01", "p02", "p03", "p04", "p05", "p07", "p09", "p10"]
)
def test_another_programs_sessions_are_reproduced_from_what_they_conceal(
    shared: Path, name: str
) -> None:
    folder = shared / "practice" / name
    answers = json.loads((shared / "practice" / "answers.json").read_text())[name]
    profile, windows = told(folder / "session.toml")
    truth = {key: tuple(value) for key, value in answers["truth"].items()}
    profile = replace(profile, truth=Truth(**truth)).having(
        *(concealed(id_, given) for id_, given in answers["concealed"].items())
    )
    with gzip.open(folder / "samples.csv.gz") as file:
        table: Array = np.loadtxt(file, delimiter=",", skiprows=1)
    t, recorded, degrees = table[:, 0], table[:, 1:7], table[:, 7]
    again = simulate(profile, windows, t, degrees, noise=False)
    off = []
    for w in windows:
        rest = (recorded - again.six)[(t >= w.start) & (t < w.end)]
        off.append(rest.mean(axis=0) / (rest.std(axis=0) / np.sqrt(len(rest))))
    rms = np.sqrt(np.mean(np.square(off), axis=0))
    assert rms[:3].max() < 2.0, "white noise, and a little that wanders"
    assert rms[3:].max() < 4.0, "gyroscopes that wander more"
