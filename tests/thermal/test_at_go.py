"""GO at another temperature: what the difference costs, and what it does not forbid."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from session_folders import write_session
from thermal_devices import Warming, exact, session

from fieldcal.acceptance.assessment import assess, store_in_history
from fieldcal.acceptance.change import check_change
from fieldcal.acceptance.family_at_temperature import family_at_temperature
from fieldcal.calibration import Calibration, limits
from fieldcal.evaluation.observations import observe, with_provenance
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.history.store import History, HistoryRun
from fieldcal.history.trend import parameter_trend
from fieldcal.session.folder import Session
from fieldcal.session.marks import MARKS, mark_line
from fieldcal.sim_device.profile import Climate, NoiseFigures, Profile, Truth
from fieldcal.sim_device.replay import simulate
from fieldcal.solve import solve

BOUNDS = limits.read("tactical")
ANGLES = ((0, 0), (90, 0), (180, 0), (-90, 0), (0, 90), (0, -90), (45, 45), (-135, 45))
SLOPE = {"acc_bias": (4e-4, -3e-4, 2e-4), "gyr_bias": (1e-5, 0.0, -2e-5)}
"""Per kelvin: a good device of its grade."""

AT_20 = {"acc_bias": (0.05, -0.08, 0.03), "gyr_bias": (2e-3, -1e-3, 3e-3)}


def at(temperature: float, group: str) -> tuple[float, float, float]:
    """What the device is at a temperature."""
    x, y, z = np.array(AT_20[group]) + np.array(SLOPE[group]) * (temperature - 20.0)
    return float(x), float(y), float(z)


def assessed(folder: Path, temperature: float, seed: int) -> Calibration:
    """A virtual device at a temperature, judged by its history and kept there."""
    noise = NoiseFigures(acc_instability=(0.0,) * 3, gyr_instability=(0.0,) * 3)
    climate = Climate(ambient_c=temperature, self_heating_k=0.0)
    true = Truth(
        acc_bias=at(temperature, "acc_bias"),
        acc_scale=(1.002, 0.998, 1.001),
        gyr_bias=at(temperature, "gyr_bias"),
    )
    profile = Profile(truth=true, noise=noise, temperature=climate)
    windows = [
        (np.deg2rad(a), np.deg2rad(b), 18.0 * i + 6, 18.0 * i + 16)
        for i, (a, b) in enumerate(ANGLES)
    ]
    positions = [
        {"alpha_deg": float(a), "beta_deg": float(b), "start_s": s, "end_s": e}
        for (a, b), (_, _, s, e) in zip(ANGLES, windows, strict=True)
    ]
    site = {"latitude_deg": 50.45, "height_m": 170.0, "angle_setting_deg": 0.02}
    block = simulate(profile, windows, seed=seed)
    write_session(folder, block, positions, site=site, device={"serial": "SIM-1"})
    days = (datetime(2026, 3, 1, tzinfo=UTC) + timedelta(days=seed)).timestamp()
    (folder / MARKS).write_text(mark_line({"event": "told", "host_s": days}))
    recorded, history = Session.open(folder), History(folder.parent / "h.db")
    means = with_provenance(solve(observe(recorded)[0]), recorded.about)
    found = assess(means, recorded, usable_windows(recorded), BOUNDS, history)
    assert not store_in_history(history, recorded, found)
    return found


@pytest.mark.thorough
def test_sessions_at_several_temperatures_tell_what_the_next_one_costs(
    tmp_path: Path,
) -> None:
    first, second, third = (
        assessed(tmp_path / name, t, seed)
        for seed, (name, t) in enumerate((("a", 20.0), ("b", 4.0), ("c", 37.0)))
    )
    assert "temperature_change" not in first.info
    # two temperatures tell no curve
    assert second.info["temperature_change"]["parameters"] is None
    change = third.info["temperature_change"]
    assert (change["then_degc"], change["now_degc"]) == pytest.approx((4, 37), abs=0.1)
    for name, one in change["parameters"].items():
        group, axis = name.split(".")
        per_k = SLOPE.get(group, (0.0, 0.0, 0.0))
        true = per_k["xyz".index(axis)] * 33.0
        assert abs(one["change"] - true) < 4 * one["sigma"], name
    tilted = np.rad2deg(change["parameters"]["acc_bias.x"]["change"] / 9.80665)
    assert f"a level wrong by {tilted:.2g}°" in change["says"][0]
    checks = {c["name"]: c["ok"] for c in third.info["decision"]["checks"]}
    assert checks["acc_bias change"] and checks["gyr_bias change"]


def runs(of: Warming, temperatures: list[float]) -> list[HistoryRun]:
    """A history of good runs."""
    rng = np.random.default_rng(4)
    out = []
    for i, t in enumerate(temperatures):
        covariance = exact(of)
        error = np.sqrt(np.diag(covariance)) * rng.standard_normal(len(covariance))
        found = session(of, t, error, covariance)
        at = f"2026-03-01T10:00:{i:02d}"
        out.append(
            HistoryRun(i + 1, "A1", at, f"/{i}", True, False, t, 50.0, 0.0, "", found)
        )
    return out


def steady(step: float) -> Warming:
    """A device whose x accelerometer changes by so much a kelvin."""
    return Warming({"acc_bias": np.array([[0.1] * 3, [step, 0, 0], [0] * 3, [0] * 3])})


def refused(found: Calibration, earlier: list[HistoryRun]) -> list[str]:
    """What is out of family, at its temperature."""
    family = family_at_temperature(found, earlier, BOUNDS)
    checks = check_change(found, BOUNDS, family.calibrations, family.sigma)
    return [c.says for c in checks if c.ok is False]


def test_a_cold_day_is_no_broken_device() -> None:
    """Thirty runs in a room, and one 50 K below: 2.4 usual coefficients."""
    room = [20.0 + 0.5 * (i % 3) for i in range(30)]
    of = steady(1.2e-3)
    cold = session(of, -30.0, np.zeros(3), exact(of))
    assert not refused(cold, runs(of, room))
    # without the temperatures it is out of family
    earlier = [run.calibration for run in runs(of, room)]
    assert check_change(cold, BOUNDS, earlier, {})[0].ok is False
    # and as much in the room is so with them
    broken = session(of, 20.0, np.array([-0.06, 0, 0]), exact(of))
    assert "out of family" in refused(broken, runs(of, room))[0]


def test_what_the_history_knows_of_temperature_is_taken_off() -> None:
    of = steady(0.01)
    earlier = runs(of, [5.0, 20.0, 35.0, 12.0, 28.0, 40.0, 8.0, 33.0, 16.0])
    assert not refused(session(of, 6.0, np.zeros(3), exact(of)), earlier)
    wrong = session(of, 6.0, np.array([0.25, 0, 0]), exact(of))
    assert "at other temperatures" in refused(wrong, earlier)[0]
    family = family_at_temperature(
        session(of, 6.0, np.zeros(3), exact(of)), earlier, BOUNDS
    )
    true = of.values(6.0)["acc_bias"][0]
    for one in family.calibrations:
        assert abs(one.value("acc_bias.x") - true) < 5 * 1.5e-3


def test_the_history_knows_a_cold_day_as_well() -> None:
    of = steady(1.2e-3)
    every = runs(of, [20.0] * 30 + [-30.0])
    *_, last = parameter_trend(every, "acc_bias.x", BOUNDS)
    assert not last.out_of_family
    *_, untold = parameter_trend([replace(r, temperature=None) for r in every],
                                 "acc_bias.x",
                       BOUNDS)  # fmt: skip
    assert untold.out_of_family
