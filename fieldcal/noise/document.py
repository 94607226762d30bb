"""The noise of a device as noise.json has it; SI units, nan as null."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.noise.alignment import GyrocompassHeading
from fieldcal.noise.averaging import AveragingError
from fieldcal.noise.estimate import ChannelEstimate, NoiseModel, ProcessSize
from fieldcal.noise.filters import (
    FilterNoise,
    kalibr_parameters,
    program_parameters,
    ros_covariances,
)
from fieldcal.noise.recalibration import CHANCES, Recalibration

FORMAT = 1
WINDOWS = (10.0, 30.0, 60.0, 300.0)
"""Averaging times whose error is stated, s; the papers use 30 to 60 s."""


@dataclass(frozen=True, slots=True)
class NoiseResult:
    """The noise of a device, with its consequences.

    Attributes
    ----------
    sessions : folders
    device : name, serial number and grade, as far as they are known
    model : the processes
    recalibrate : when each channel's bias leaves its limit
    since : start of that time, ISO 8601
    alignment : gyrocompassing; None unless the gyroscopes are of navigation grade, and
        the latitude is stated

    """

    sessions: Sequence[str]
    device: Mapping[str, Any]
    model: NoiseModel
    recalibrate: Mapping[str, Recalibration]
    since: str
    alignment: GyrocompassHeading | None

    @property
    def programs(self) -> dict[str, FilterNoise]:
        """Noise parameters for other programs."""
        channels = self.model.channels
        pairs = {name: c.pair for name, c in channels.items()}
        white = {n: (c.processes["N"].value, c.processes["N"].sigma)
                 for n, c in channels.items()}  # fmt: skip
        return {
            "kalibr": kalibr_parameters(pairs),
            "ros": ros_covariances(white, self.model.rate_hz),
            "ardupilot": program_parameters("ardupilot", pairs),
            "px4": program_parameters("px4", pairs),
        }

    def to_json(self) -> dict[str, Any]:
        """Return the content of noise.json."""
        model = self.model
        out: dict[str, Any] = {
            "format": FORMAT,
            "sessions": list(self.sessions),
            "device": dict(self.device),
            "seconds": model.seconds,
            "longest_s": model.longest,
            "stretches": model.stretches,
            "rate_hz": model.rate_hz,
            "disturbed_share": model.bridged,
            "channels": {n: _channel(c, model) for n, c in model.channels.items()},
            "for": {
                name: {
                    key: {"value": value, "sigma": _finite_or_none(sigma), "unit": unit}
                    for key, (value, sigma, unit) in program.items()
                }
                for name, program in self.programs.items()
            },
            "recalibrate": {
                "since": self.since,
                "channels": {n: _times(r) for n, r in self.recalibrate.items()},
            },
        }
        if self.alignment is not None:
            seconds, sigma, spread = self.alignment.best
            out["alignment"] = {
                "best_s": seconds,
                "heading_sigma_rad": sigma,
                "spread_rad": spread,
            }
        return out


def _channel(channel: ChannelEstimate, model: NoiseModel) -> dict[str, Any]:
    seen = channel.measured
    said = channel.predict_allan(seen.tau, model.longest)
    out: dict[str, Any] = {
        "unit": channel.unit,
        "processes": {n: _size(s) for n, s in channel.processes.items()},
        "below": {
            n: {"value": s.value, "unit": s.unit} for n, s in channel.limits.items()
        },
        "two_numbers": {
            "N": channel.pair.white,
            "K": channel.pair.walk,
            "left_out": channel.pair.left_out,
        },
        "dispersion": channel.dispersion,
        "filtered_above_hz": _finite_or_none(channel.filtered_hz),
        "allan": {
            "tau_s": seen.tau.tolist(),
            "deviation": seen.deviation.tolist(),
            "low": said.low.tolist(),
            "high": said.high.tolist(),
        },
        "averaging": _averaging(channel.averaging),
    }
    if channel.temperature is not None:
        value, sigma = channel.temperature
        unit = f"{channel.unit}/K"
        out["temperature"] = {"value": value, "sigma": sigma, "unit": unit}
    return out


def _size(size: ProcessSize) -> dict[str, Any]:
    out = {"value": size.value, "sigma": _finite_or_none(size.sigma), "unit": size.unit}
    if not math.isnan(size.time):
        out |= {
            "time_s": _finite_or_none(size.time),
            "time_sigma_s": _finite_or_none(size.time_sigma),
        }
    return out


def _averaging(found: AveragingError) -> dict[str, Any]:
    last = float(found.seconds[-1])
    windows = [w for w in WINDOWS if w <= last]
    return {
        "seconds": windows,
        "sigma": [found.at(w)[0] for w in windows],
        "spread": [found.at(w)[1] for w in windows],
        "best_s": _finite_or_none(found.best[0]),
        "best_sigma": float(np.min(found.sigma)),
        "white_until_s": _finite_or_none(found.white_until[0]),
    }


def _times(found: Recalibration) -> dict[str, Any]:
    return {
        "limit": found.limit,
        "chance": list(CHANCES),
        "after_s": [_finite_or_none(s) for s in found.seconds],
        "from_history": found.from_history,
        "unseen_walk": found.by_unseen_walk,
        "by_ramp": found.by_ramp,
    }


def _finite_or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None
