"""A recording with its untouched diagnosis: what an effect is added to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from benchmarks.injected.oracle import Oracle
from benchmarks.injected.parts import windows_of
from benchmarks.injected.readout import grid
from benchmarks.injected.recorded import Real
from fieldcal.core.samples import CHANNELS, Array, Block
from fieldcal.diagnosis import Diagnosis

PIECE_S = 0.5
"""Over which the noise of a sample is measured."""

COARSE = 1.5
"""Steps, in standard deviations of a sample, that hide what is smaller than they."""

TURN = np.cos(np.deg2rad(5.0))
"""Between the forces of windows that the device was turned between."""


@dataclass(frozen=True)
class Scene:
    """A recording, and what its diagnosis says before anything is added.

    Attributes
    ----------
    real : the recording
    told : its diagnosis

    """

    real: Real
    told: Diagnosis

    @property
    def block(self) -> Block:
        """Its samples."""
        return self.real.block

    @cached_property
    def windows(self) -> NDArray[np.intp]:
        """First and one past the last sample of each window in time, (w, 2)."""
        rows = windows_of(self.block, self.real.about)
        return rows[np.argsort(rows[:, 0])]

    @cached_property
    def present(self) -> tuple[int, ...]:
        """Channels that have samples."""
        return tuple(np.flatnonzero(np.isfinite(self.block.six).all(axis=0)).tolist())

    @property
    def triads(self) -> tuple[int, ...]:
        """First channel of each triad that has samples."""
        return tuple(first for first in (0, 3) if first in self.present)

    @cached_property
    def fine(self) -> tuple[int, ...]:
        """The triads whose steps are no matter beside the noise."""
        steps = np.array([grid(self.block.six[:, c]) for c in range(6)])
        coarse = steps > COARSE * self.noise
        return tuple(f for f in self.triads if not coarse[f : f + 3].any())

    @cached_property
    def rate_hz(self) -> float:
        """Samples in a second of a window."""
        rows = self.windows
        t = self.block.t
        long = sum(float(t[b - 1] - t[a]) for a, b in rows)
        return float((np.diff(rows, axis=1) - 1).sum() / long)

    @cached_property
    def noise(self) -> Array:
        """Standard deviation of a sample about the line through half a second, (6,)."""
        found = []
        six, width = self.block.six, max(8, round(PIECE_S * self.rate_hz))
        x = np.linspace(-1, 1, width)
        line = np.column_stack([np.ones(width), x])
        for a, b in self.windows:
            for first in range(int(a), int(b) - width + 1, width):
                piece = np.nan_to_num(six[first : first + width])
                rest = piece - line @ np.linalg.lstsq(line, piece, rcond=None)[0]
                found.append((rest**2).sum(axis=0) / (width - 2))
        noise: Array = np.sqrt(np.median(found, axis=0))
        return noise

    @cached_property
    def oracle(self) -> Oracle:
        """Who knows everything but how large an effect is."""
        return Oracle(self.block, self.real.about, self.told, self.noise)

    @cached_property
    def force(self) -> Array:
        """Force that the accelerometers saw by their calibration, (n, 3)."""
        groups = self.told.calibration
        bias, scale = np.zeros(3), np.ones(3)
        if "acc_bias" in groups:
            bias = np.nan_to_num(groups["acc_bias"].value)
        if "acc_scale" in groups:
            scale = np.nan_to_num(groups["acc_scale"].value, nan=1.0)
        force: Array = (self.block.acc - bias) / np.where(scale == 0, 1.0, scale)
        return force

    @cached_property
    def turned(self) -> bool:
        """Whether the device was turned from window to window."""
        if len(self.windows) < 2 or 0 not in self.present:
            return False
        mean = np.array([self.block.acc[a:b].mean(axis=0) for a, b in self.windows])
        unit = mean / np.linalg.norm(mean, axis=1, keepdims=True)
        return bool(((unit[1:] * unit[:-1]).sum(axis=1) < TURN).mean() > 0.5)

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Channels in which nothing was named, or all if there are none."""
        taken = {
            c for e in self.told.effects for n in e.parameters for c in _of(e.id, n)
        }
        left = tuple(c for c in self.present if c not in taken)
        return left or self.present

    def but(self, six: Array, temperature: Array | None = None) -> Block:
        """The samples with other outputs, and another temperature if one is given."""
        warmth = self.block.temperature if temperature is None else temperature
        return replace(self.block, acc=six[:, :3], gyr=six[:, 3:], temperature=warmth)


def _of(effect: str, parameter: str) -> tuple[int, ...]:
    """Channels that a parameter of an effect is about."""
    if parameter in CHANNELS:
        return (CHANNELS.index(parameter),)
    gyro = effect.startswith("g")  # g_sensitivity, gyro_scale and their kind
    if parameter in ("x", "y", "z"):
        return ("xyz".index(parameter) + 3 * gyro,)
    if parameter[-1:].isdigit() and parameter[1:2] in ("1", "2", "3"):
        return (int(parameter[1]) - 1 + 3 * gyro,)
    return ()
