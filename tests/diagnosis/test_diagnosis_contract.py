"""Every id of the catalogue: put into the virtual device, and named from the recording.

What is put in is the example that the virtual device's effect states. Its physics is
its own; the diagnosis sees samples, angles and the calibration that a simulation would
start from. Numbers must hold within 3 sigma.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from closed_circle import every_effect

from fieldcal.core.samples import Block
from fieldcal.diagnosis import Diagnosis, diagnose
from fieldcal.effects import catalogue
from fieldcal.session import description_file
from fieldcal.session.description import Description
from fieldcal.sim_device.effect import Example
from fieldcal.sim_device.effects import kind
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.profile_file import profile_from_tables
from fieldcal.sim_device.replay import HeldWindow, simulate
from fieldcal.sim_device.vocabulary import checked_effect

POSITIONS = (
    *((0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90), (45, 0), (-45, 0)),
    *((0, 45), (135, 0), (45, 35), (-135, -35)),
)
RATE_HZ, GAP_S = 50.0, 7.0
RIGHT = ("left_out", "ambiguous")
NOISE = {"acc": 0.01, "gyr": 5e-4, "acc_instability": 0.0, "gyr_instability": 0.0}


@pytest.mark.parametrize("name", every_effect())
def test_put_in_and_named(name: str) -> None:
    example = kind(name).EXAMPLE
    profile, windows = _device(name, example), _windows(example)
    seed = sum(map(ord, name))
    block = _recorded(simulate(profile, windows, seed=seed), profile, example)
    told = diagnose(block, _about(profile, windows))
    named = {e.id: e for e in told.effects}
    said = {i for e in told.effects for i in (e.id, *e.aliases)}
    assert name in said, told.says
    extra = {i for i, e in named.items() if i != name and name not in e.aliases}
    assert extra <= {e.id for e in profile.effects}, told.says
    only_possible = catalogue()[name].like_calibration
    assert told.verdict in (("ambiguous",) if only_possible else RIGHT)
    held_out = told.before.held_out_rms * (1.02 if example.unmended else 1.0)
    assert told.after.held_out_rms < held_out
    _check_numbers(told, name, example.given)


def _check_numbers(told: Diagnosis, name: str, truth: Mapping[str, Any]) -> None:
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


def _device(name: str, example: Example) -> Profile:
    tables = {"sampling": {"rate_hz": RATE_HZ}, **example.device}
    tables["noise"] = NOISE | dict(tables.get("noise", {}))
    tables["temperature"] = {"self_heating_k": 0.0, **tables.get("temperature", {})}
    plain = profile_from_tables(tables)
    earth = () if plain.feels_earth else (checked_effect("earth_rate", {}),)
    return plain.having(*earth, checked_effect(name, example.given))


def _windows(example: Example) -> list[HeldWindow]:
    out = []
    for i, (alpha, beta) in enumerate(POSITIONS):
        start = 3.0 + i * (example.window_s + GAP_S)
        rate = (0.0, 0.0, 0.0)
        if example.turntable:
            alpha, beta = 0, 0
            turned = np.roll([0.5, 0.35 * (i % 4 > 1), 0.0], i) * (-1) ** (i // 3)
            rate = (float(turned[0]), float(turned[1]), float(turned[2]))
        shaken = example.vibration
        if shaken is not None and i % 3 != 1:
            shaken = 0.0
        a, b = np.deg2rad([alpha, beta]).tolist()
        end = start + example.window_s
        out.append(HeldWindow(a, b, start, end, rate, vibration=shaken))
    return out


def _recorded(block: Block, profile: Profile, example: Example) -> Block:
    rng = np.random.default_rng(1)
    if example.host_clock:
        true = block.t / profile.clock_rate
        block = replace(block, t_host=1e5 + true + rng.exponential(1e-3, len(block)))
    keep = np.ones(len(block), dtype=bool)
    for arrival in (e.arrival(rng) for e in profile.effects):
        if arrival is not None:
            keep &= arrival(len(block))
    columns = (block.acc, block.gyr, block.temperature, block.seq, block.t_host)
    return Block.of(block.t[keep], *(c[keep] for c in columns))


def _about(profile: Profile, windows: list[HeldWindow]) -> Description:
    truth = profile.truth
    positions = []
    for w in windows:
        alpha, beta = np.rad2deg([w.alpha, w.beta]).tolist()
        table = {"alpha_deg": alpha, "beta_deg": beta, "start_s": w.start}
        table |= {"end_s": w.end, "rate_deg_s": np.rad2deg(w.rate).tolist()}
        positions.append(table)
    return description_file.parse_description(
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
