"""Calibration through a base that sways, beside the same on firm ground.

The virtual device is held on six faces for 30 s each with white noise of 5 mm/s^2 and 1
mrad/s a sample at 50 Hz, its base swaying about both level axes by 1 degree (rms of two
waves of that amplitude). The same noise is played on firm ground. Fixture and factory
are said to be perfect, so that nothing but noise and sway is in any ±. What the turns
between the windows say of scale factors is left out: it changes no bias by a hundredth
of its ±, and takes half of the time.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.samples import Array, Block
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import profile as device
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.replay import HeldWindow, simulate
from fieldcal.sim_device.vocabulary import checked_effect

FACES = ((0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90))
HERTZ = (0.1, 0.2, 0.35, 0.5)
SECONDS, TURN_S, RATE = 30.0, 8.0, 50.0
AMPLITUDE_DEG, SPREAD = 1.0, 0.1
"""Of each wave, and of its frequency where the swaying is irregular, in itself."""

EARTH = checked_effect("earth_rate", {})
"""Felt as by a real device: whether one feels it is told by these windows just so."""

DRAWN_AGAIN = 400
"""Samples of the devices by which figures are uncertain."""

TRUTH = device.Truth(
    acc_bias=(0.05, -0.08, 0.03), acc_scale=(1.002, 0.998, 1.001),
    gyr_bias=(2e-3, -1e-3, 3e-3), gyr_scale=device.ONE,
)  # fmt: skip
PERFECT = {"squareness": 0.0, "quadratic": 0.0, "g_sensitivity": 0.0}
SITE = {
    "latitude_deg": 50.45, "height_m": 170.0, "level_deg": 1e-4,
    "angle_setting_deg": 1e-4, "sways": True,
}  # fmt: skip


@dataclass(frozen=True)
class Beside:
    """Biases of one device on a swaying base, and on firm ground with the same noise.

    Attributes
    ----------
    pull : (k,) differences from truth on the swaying base, in their ±
    wider : (k,) ± there over that on firm ground
    moved : (k,) differences between both, in the ± on firm ground
    needed_s : what a window needs, as it is told; nan where nothing is told

    """

    pull: Array
    wider: Array
    moved: Array
    needed_s: float


def held() -> list[HeldWindow]:
    """The six faces, one after another."""
    starts = 4.0 + (SECONDS + TURN_S) * np.arange(len(FACES))
    return [
        HeldWindow(math.radians(a), math.radians(b), float(s), float(s) + SECONDS)
        for (a, b), s in zip(FACES, starts, strict=True)
    ]


def played(seed: int, hz: float = 0.0, spread: float = 0.0) -> Block:
    """Samples on a base that sways at a frequency, or on firm ground."""
    rng = np.random.default_rng(seed)
    azimuth, waves = float(rng.uniform(0, 180)), []
    for turned in (0.0, 90.0):
        own = hz * float(rng.uniform(0.95, 1.05))
        waves.append({
            "amplitude_deg": AMPLITUDE_DEG, "hz": own, "spread_hz": spread * own,
            "azimuth_deg": azimuth + turned, "phase_deg": float(rng.uniform(0, 360)),
        })  # fmt: skip
    profile = Profile(
        sampling=device.Sampling(RATE),
        truth=TRUTH,
        noise=device.NoiseFigures(
            acc=(5e-3,) * 3, gyr=(1e-3,) * 3,
            acc_instability=device.ZERO, gyr_instability=device.ZERO,
        ),
        effects=(EARTH, *(checked_effect("sway", w) for w in waves if hz)),
    )  # fmt: skip
    return simulate(profile, held(), seed=seed)


def calibrated(block: Block) -> Calibration:
    """Solve the samples as `fieldcal solve` does."""
    positions = [
        {"alpha_deg": float(a), "beta_deg": float(b), "start_s": w.start,
         "end_s": w.end}
        for (a, b), w in zip(FACES, held(), strict=True)
    ]  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        about = {"format": 1, "site": SITE, "position": positions}
        with Recorder(Path(folder) / "pier", about) as recorder:
            recorder.append(block)
        session = Session.open(Path(folder) / "pier")
        return solve_session(session, usable_windows(session), "no", PERFECT)


def biases(found: Calibration, names: Sequence[str]) -> tuple[Array, Array]:
    """Values and ± of some parameters, (k,)."""
    at = [found.names.index(name) for name in names]
    return found.values[at], np.sqrt(np.diag(found.covariance))[at]


@cache
def on_firm_ground(seed: int, gyroscopes: bool) -> Calibration:
    """The same noise without swaying."""
    return calibrated(_heard(played(seed), gyroscopes))


def _heard(block: Block, gyroscopes: bool) -> Block:
    return block if gyroscopes else replace(block, gyr=np.full_like(block.gyr, np.nan))


def beside(seed: int, hz: float, spread: float, gyroscopes: bool) -> Beside:
    """Calibrate one device on both bases."""
    swaying = calibrated(_heard(played(seed, hz, spread), gyroscopes))
    firm = on_firm_ground(seed, gyroscopes)
    truth = {
        f"{sensor}_bias.{axis}": value
        for sensor, values in (("acc", TRUTH.acc_bias), ("gyr", TRUTH.gyr_bias))
        for axis, value in zip("xyz", values, strict=True)
        if gyroscopes or sensor == "acc"
    }
    (there, sigma), (here, still) = (biases(f, list(truth)) for f in (swaying, firm))
    said = " ".join(swaying.warnings)
    told = said.split("each position needs ")[1:]
    needed = float(told[0].split()[0]) if told else np.nan
    return Beside(
        (there - list(truth.values())) / sigma, sigma / still, (there - here) / still,
        needed,
    )  # fmt: skip


def through_sway(devices: int) -> None:
    """Print what biases are worth on a base that sways."""
    print(
        f"\na base that sways by {AMPLITUDE_DEG:g} deg about both axes,"
        f" {devices} devices a row: ± over that on firm ground (median, largest),"
        " moved in that ±, error in its own ± (rms, largest), needs, as told"
    )
    for gyroscopes in (True, False):
        for spread in (0.0, SPREAD):
            for hz in HERTZ:
                found = [beside(s, hz, spread, gyroscopes) for s in range(devices)]
                _row(hz, spread, gyroscopes, found)


def _row(hz: float, spread: float, gyroscopes: bool, found: Sequence[Beside]) -> None:
    pull, wider, moved = (
        np.array([getattr(f, name) for f in found])
        for name in ("pull", "wider", "moved")
    )
    needed = max(f.needed_s for f in found)
    print(f"{'six outputs' if gyroscopes else 'accelerometers':16}"
          f"{'irregular' if spread else 'regular':10}{hz:5.2f} Hz"
          f"{_with_error(np.median, wider)}{wider.max():6.2f}"
          f"{_with_error(_rms, moved)}"
          f"{_with_error(_rms, pull)}{np.abs(pull).max():6.2f}{needed:6.0f} s",
          flush=True)  # fmt: skip


def _rms(values: Array) -> float:
    return float(np.sqrt((values**2).mean()))


def _with_error(of: Callable[[Array], float], values: Array) -> str:
    """A figure of devices (d, k) with its standard error, by drawing devices again."""
    rng = np.random.default_rng(0)
    some = rng.integers(0, len(values), (DRAWN_AGAIN, len(values)))
    error = np.std([of(values[i]) for i in some])
    return f"{of(values):7.2f} ± {error:.2f}"
