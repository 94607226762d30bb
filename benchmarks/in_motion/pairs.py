"""A device and its motion, drawn, and what is said of it held against the truth."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.in_motion.driven import Drive, Shaken, recorded
from fieldcal.against import Match
from fieldcal.against.motion import compare_in_motion
from fieldcal.against.result import RealAndSimulated
from fieldcal.core.samples import Array, Block
from fieldcal.session import description_file

SECONDS, HZ = 60.0, 25.0
WHITE = np.repeat([0.02, 1e-3], 3)
CALIBRATION = frozenset(
    {"acc_bias", "acc_scale", "gyr_bias", "gyr_scale", "misalignment"}
)
"""Differences that are drawn beside each effect."""

KINDS = (
    "", "lever_arm", "g_sensitivity", "time_delay", "cubic", "bandwidth",
    "second_order", "stamp_error", "increments", "flexible_mount",
)  # fmt: skip
ABOUT = description_file.parse_description({"format": 1})


@dataclass(frozen=True)
class Drawn:
    """A device that was drawn.

    Attributes
    ----------
    kind : the effect that it has, empty for none
    device : as the motion program takes it
    truth : what is to be found, by id and parameter

    """

    kind: str
    device: dict[str, Any]
    truth: dict[tuple[str, str], float]


def drawn(
    number: int, seed: int, lag: float = 0.0, jitter: float = 0.0, hz: float = HZ
) -> Drawn:
    """Draw the device with a number, of samples at `hz`.

    `lag` is a time constant of the gyroscopes, s, and `jitter` by how much its samples'
    stamps are off, s, one sigma.
    """
    rng = np.random.default_rng(seed + number)
    kind = KINDS[number % len(KINDS)]
    bias = rng.normal(0, 1, 6) * np.repeat([0.1, 2e-3], 3)
    scale = rng.normal(0, 3e-3, 6)
    device: dict[str, Any] = {
        "seed": seed + 1000 + number,
        "noise": {
            "white": WHITE,
            "markov": WHITE * rng.uniform(0.2, 1.0),
            "tau": rng.uniform(0.2, 5.0),
            "walk": WHITE * rng.choice([0.0, 0.002]),
        },
        "clock": (rng.uniform(-3, 3), rng.normal(0, 5e-5)),
        "turn": Rotation.from_rotvec(rng.normal(0, 0.3, 3)).as_matrix(),
        "bias": bias,
        "matrix_acc": np.diag(1 + scale[:3]),
        "matrix_gyr": np.diag(1 + scale[3:]),
        "start": 10.0,
        "lag": (0.0, lag),
        "jitter": jitter,
    }
    if kind == "flexible_mount":  # its modes lie along the body's axes
        device["turn"] = np.eye(3)
    truth = {
        (f"{part}_{name}", axis): float(values[3 * i + j] + offset)
        for name, values, offset in (("bias", bias, 0.0), ("scale", scale, 1.0))
        for i, part in enumerate(("acc", "gyr"))
        for j, axis in enumerate("xyz")
    }
    if kind:
        values, names = _effect(kind, device, rng, hz)
        truth |= {(kind, n): float(v) for n, v in zip(names, values, strict=True)}
    if lag and kind != "bandwidth":
        truth["bandwidth", "gyr"] = lag
    return Drawn(kind, device, truth)


def _effect(
    kind: str, device: dict[str, Any], rng: np.random.Generator, hz: float
) -> tuple[Array, list[str]]:
    """Give a device an effect; its values, and what they are called."""
    if kind == "g_sensitivity":
        matrix = rng.normal(0, 1e-4, (3, 3))
        device["g"] = matrix
        return matrix.ravel(), [f"g{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)]
    if kind == "time_delay":
        device["late"] = float(rng.normal(0, 0.02))
        return np.array([device["late"]]), ["seconds"]
    if kind == "bandwidth":
        taus = rng.uniform(0.008, 0.03, 2)
        taus[rng.integers(2)] *= rng.integers(2)
        device["lag"] = tuple(taus.tolist())
        return taus, ["acc", "gyr"]
    if kind == "second_order":
        taus = rng.uniform(0.016, 0.04, 2)
        taus[rng.integers(2)] *= rng.integers(2)
        device["second"] = tuple(taus.tolist())
        return taus, ["acc", "gyr"]
    if kind == "stamp_error":
        device["jitter"] = float(rng.uniform(0.05, 0.15)) / hz
        return np.ones(1), ["share"]
    if kind == "increments":
        device["interval"] = float(rng.uniform(0.003, 0.01))
        return np.array([device["interval"] / 2]), ["sculling"]
    if kind == "flexible_mount":
        device["compliance"] = (2 * np.pi * rng.uniform(10, 20, 3)) ** -2
        return device["compliance"], ["x", "y", "z"]
    size = 0.1 if kind == "lever_arm" else 3e-5
    values = rng.normal(0, size, 3)
    device["arm" if kind == "lever_arm" else "cubic"] = values
    return values, ["x", "y", "z"]


def block_of(table: Array) -> Block:
    """Samples of a table of times and outputs."""
    return Block.of(table[:, 0], table[:, 1:4], table[:, 4:7])


def compared(
    number: int,
    seed: int,
    lag: float = 0.0,
    jitter: float = 0.0,
    seconds: float = SECONDS,
    hz: float = HZ,
    noise: float = 0.0,
) -> tuple[Drawn, Match, float]:
    """A drawn device held against the motion that it went through.

    With `noise` the reference has white noise of its own, in that of the device, and
    the motion has all frequencies.

    Returns
    -------
    What was drawn, what was found, and the processor time that it took, s.

    """
    one = drawn(number, seed, lag, jitter, hz)
    drive = Shaken(seed + number) if noise else Drive(seed + number)
    real = block_of(recorded(drive, one.device, seconds, hz))
    own = {"noise": {"white": noise * WHITE}, "seed": seed + 2000 + number}
    sim = block_of(recorded(drive, own, seconds + 20, hz))
    start = time.process_time()
    found = compare_in_motion((real, ABOUT), sim, ("recording", "simulator"))
    return one, found, time.process_time() - start


def pulls(one: Drawn, found: Match) -> list[float]:
    """By how many standard deviations each number that is told is off."""
    out = []
    for difference in found.differences:
        for name, pair in difference.parameters.items():
            wanted = one.truth.get((difference.id, name))
            if wanted is not None:
                out.append(_pull(pair, wanted))
    return out


def _pull(pair: RealAndSimulated, wanted: float) -> float:
    told = pair.real
    if told is None or not told.sigma:
        return 0.0
    return (float(told.value) - wanted) / told.sigma
