"""Every id of the catalogue: put into the virtual device, and named from the recording.

The virtual device's physics is its own; the diagnosis sees samples, angles and the
calibration that a simulation would start from. Numbers must hold within 3 sigma.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from closed_circle import every_effect

from fieldcal import description
from fieldcal.description import Description
from fieldcal.diagnosis import Diagnosis, diagnose
from fieldcal.effects import catalogue
from fieldcal.samples import Block
from fieldcal.sim_device.profile import (
    ZERO,
    Climate,
    Identity,
    NoiseFigures,
    Profile,
    Sampling,
    Triad,
)
from fieldcal.sim_device.replay import Window, simulate
from fieldcal.sim_device.vocabulary import effect

POSITIONS = (
    *((0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90), (45, 0), (-45, 0)),
    *((0, 45), (135, 0), (45, 35), (-135, -35)),
)
RATE_HZ, GAP_S = 50.0, 7.0
GYR: Triad = (5e-4, 5e-4, 5e-4)
FINE: Triad = (2e-5, 2e-5, 2e-5)


@dataclass(frozen=True)
class Case:
    """One id: its parameters, and what the session needs to show it."""

    given: dict[str, Any]
    gyr: Triad = GYR
    grade: str = "tactical"
    climate: Climate = Climate(self_heating_k=0.0)
    long_s: float = 10.0
    table: bool = False
    shaken: bool = False
    host: bool = False
    lost: float = 0.0


WARMING = Climate(ramp_k_s=0.03, self_heating_k=0.0)
CYCLING = Climate(
    self_heating_k=0.0,
    points=tuple((float(t), 20 + 6 * np.sin(t / 35.0)) for t in range(0, 400, 5)),
)
CASES = {
    "cross_coupling": Case({"k13": 3e-3, "k21": -2e-3, "k32": 4e-3}),
    "gyro_cross_coupling": Case({"s13": 1e-2, "s31": -1.2e-2, "s23": 1.5e-2}),
    "gyro_scale": Case({"s1": 2e-2, "s2": -1e-2, "s3": 1.5e-2}),
    "quadratic": Case({"x": 1e-4, "y": -8e-5, "z": 1.2e-4}),
    "cubic": Case({"x": 2e-5, "y": -3e-5, "z": 2e-5}),
    "scale_asymmetry": Case({"x": 3e-3, "y": -2e-3, "z": 2e-3}),
    "pendulous_products": Case({"l11": 2e-4, "l22": -2e-4, "l33": 2e-4}),
    "g_sensitivity": Case({"g12": 5e-5, "g23": -6e-5, "g31": 7e-5}),
    "g2_sensitivity": Case({"x": 4e-6, "y": -5e-6, "z": 5e-6}),
    "gyro_products": Case({"p11": 5e-3, "p22": -6e-3, "p33": 4e-3}, table=True),
    "base_tilt": Case({"about_x_deg": 0.5, "about_z_deg": -0.7}),
    "angle_offset": Case({"alpha0_deg": 0.8, "beta0_deg": -0.9}),
    "angle_scale": Case({"alpha": 8e-3, "beta": -6e-3}),
    "angle_setting": Case({"sigma_deg": 0.15}),
    "gravity_error": Case({"relative": 2e-3}),
    "earth_rate": Case({}, gyr=FINE),
    "heading_error": Case({"psi_deg": 12.0}, gyr=FINE, grade="navigation"),
    "sway": Case({"amplitude_deg": 0.05, "hz": 0.6}),
    "mounting": Case({"axes": "+y-x+z"}),
    "temperature_bias": Case({"ax": 4e-3, "ay": -3e-3, "gz": 1e-4}, climate=WARMING),
    "temperature_scale": Case({"x": 4e-4, "y": -3e-4, "z": 3e-4}, climate=WARMING),
    "thermal_hysteresis": Case({"ax": 0.15, "ay": -0.1}, climate=CYCLING),
    "warm_up": Case({"ax": 0.03, "ay": -0.02, "gx": 4e-4, "tau_s": 90.0}),
    "bias_drift": Case({"ax": 5e-5, "gy": 2e-6, "az": -4e-5}),
    "bias_step": Case({"ax": 0.01, "az": -0.008, "at_s": 101.0}),
    "random_walk": Case({"ax": 8e-4, "ay": 8e-4, "az": 8e-4}),
    "settling": Case({"ax": 0.03, "ay": 0.02, "az": -0.03, "tau_s": 4.0}),
    "lever_arm": Case({"x": 0.2, "y": -0.15, "z": 0.1}),
    "vibration_rectification": Case(
        {"x": 0.08, "y": -0.09, "z": 0.08}, shaken=True, long_s=25.0
    ),
    "hum": Case({"ax": 0.01, "ay": 0.008, "hz": 7.0}),
    "bump": Case({"at_s": 55.0, "for_s": 0.7}),
    "time_delay": Case({"seconds": 0.03}),
    "quantisation": Case({"acc": 0.03, "gyr": 1.5e-3}),
    "saturation": Case({"channel": "ay", "limit": 8.0}),
    "stuck": Case({"channel": "gy", "from_s": 53.0, "to_s": 57.0}),
    "dropped": Case({}, lost=0.03),
    "clock_skew": Case({"ppm": 500.0}, host=True),
    "decode_fault": Case({"channel": "ax", "kind": "low_byte_signed"}),
    "noise_level": Case({"channel": "az", "ratio": 3.0}),
}


UNMENDED = ("dropped", "clock_skew", "noise_level", "quantisation", "gravity_error")
"""Only noted, or what scale factors make up for: no position is foretold better."""


def test_every_id_has_a_case() -> None:
    assert set(CASES) == set(catalogue())


@pytest.mark.parametrize("name", every_effect())
def test_put_in_and_named(name: str) -> None:
    case = CASES[name]
    profile, windows = _device(name, case), _windows(case)
    seed = sum(map(ord, name))
    block = _recorded(simulate(profile, windows, seed=seed), case)
    told = diagnose(block, _about(profile, windows))
    named = {e.id: e for e in told.effects}
    said = {i for e in told.effects for i in (e.id, *e.aliases)}
    assert name in said, told.says
    extra = {i for i, e in named.items() if i != name and name not in e.aliases}
    assert extra <= {"earth_rate"}, told.says
    assert told.verdict == ("ambiguous" if name == "gravity_error" else told.verdict)
    assert told.verdict in ("left_out", "ambiguous")
    held_out = told.before.held_out_rms * (1.02 if name in UNMENDED else 1.0)
    assert told.after.held_out_rms < held_out
    truth = {"fraction": case.lost, **case.given}
    _check_numbers(told, name, truth)


def _check_numbers(told: Diagnosis, name: str, truth: dict[str, Any]) -> None:
    for found in (e for e in told.effects if e.id == name):
        for part, quantity in found.parameters.items():
            if isinstance(quantity.value, str):
                expected = truth.get(part)
                assert part in ("axes", "unit") or quantity.value == expected
            else:
                assert quantity.sigma is not None and quantity.sigma > 0, part
                off = quantity.value - truth.get(part, 0.0)
                # of the many that are nothing, chance puts one beyond 3
                most = 3 if truth.get(part) else 4
                assert abs(off) < most * quantity.sigma, (part, off, quantity.sigma)


def _device(name: str, case: Case) -> Profile:
    there = [effect("earth_rate", {})] if case.grade == "tactical" else []
    if case.given:
        there.append(effect(name, case.given))
    grade: Any = case.grade
    return Profile(
        device=Identity(grade=grade),
        sampling=Sampling(RATE_HZ),
        noise=NoiseFigures(
            acc=(0.01, 0.01, 0.01),
            gyr=case.gyr,
            acc_instability=ZERO,
            gyr_instability=ZERO,
        ),
        temperature=case.climate,
        effects=tuple(there),
    )


def _windows(case: Case) -> list[Window]:
    out = []
    for i, (alpha, beta) in enumerate(POSITIONS):
        start = 3.0 + i * (case.long_s + GAP_S)
        rate = (0.0, 0.0, 0.0)
        if case.table:
            alpha, beta = 0, 0
            turned = np.roll([0.5, 0.35 * (i % 4 > 1), 0.0], i) * (-1) ** (i // 3)
            rate = (float(turned[0]), float(turned[1]), float(turned[2]))
        shaking = (1.5 if i % 3 == 1 else 0.0) if case.shaken else None
        a, b = np.deg2rad([alpha, beta]).tolist()
        end = start + case.long_s
        out.append(Window(a, b, start, end, rate, vibration=shaking))
    return out


def _recorded(block: Block, case: Case) -> Block:
    rng = np.random.default_rng(1)
    if case.host:
        true = block.t / (1 + 1e-6 * case.given["ppm"])
        block = replace(block, t_host=1e5 + true + rng.exponential(1e-3, len(block)))
    keep = np.flatnonzero(rng.random(len(block)) >= case.lost)
    if not case.lost:
        return block
    columns = (block.acc, block.gyr, block.temperature, block.seq, block.t_host)
    return Block.of(block.t[keep], *(c[keep] for c in columns))


def _about(profile: Profile, windows: list[Window]) -> Description:
    truth = profile.truth
    positions = []
    for w in windows:
        alpha, beta = np.rad2deg([w.alpha, w.beta]).tolist()
        table = {"alpha_deg": alpha, "beta_deg": beta, "start_s": w.start}
        table |= {"end_s": w.end, "rate_deg_s": np.rad2deg(w.rate).tolist()}
        positions.append(table)
    return description.parse(
        {
            "format": 1,
            "device": {"name": "contract", "grade": profile.device.grade},
            "sampling": {"rate_hz": RATE_HZ},
            "site": {
                "latitude_deg": profile.site.latitude_deg,
                "height_m": profile.site.height_m,
            },
            "nominal": {
                "acc_bias": list(truth.acc_bias),
                "acc_scale": list(truth.acc_scale),
                "gyr_bias": list(truth.gyr_bias),
                "gyr_scale": list(truth.gyr_scale),
            },
            "position": positions,
        }
    )
