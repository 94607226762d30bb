"""What happens to samples between the sensors and the wire.

In this order: clipped at full scale, rounded to the least significant bit, decoded
wrongly, stuck, put out in a unit that is not the declared one, dropped. The raw words
of a wrong decoding are 16 bit, r = round(x 2^15 / full scale):

    low_byte_signed   256 (r >> 8) + signed(r & 255): 256 too low in half of all cases
    bytes_swapped     the low byte taken for the high one
    wrapped           r beyond 2^15 comes out at the other end instead of clipped

Outputs (6, n) in m/s^2 and rad/s.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.sim_device.noise import stream
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.vocabulary import SIX, SimulatedEffect

STANDARD_GRAVITY = 9.80665
ACC_FULL_SCALE = 16 * STANDARD_GRAVITY
GYR_FULL_SCALE = float(np.deg2rad(2000))
WRAPPED_ACC, WRAPPED_GYR = 8.0, 0.2
"""Full scale that wraps, if none is given: passed at home, and in an ordinary turn."""

UNITS = {
    "g": (1 / STANDARD_GRAVITY, 1.0),
    "mg": (1e3 / STANDARD_GRAVITY, 1.0),
    "deg/s": (1.0, 180 / np.pi),
    "mrad/s": (1.0, 1e3),
}


def rows(channel: str) -> list[int]:
    """Rows of the outputs that a channel's name means."""
    groups = {"acc": [0, 1, 2], "gyr": [3, 4, 5], "all": [0, 1, 2, 3, 4, 5]}
    return groups[channel] if channel in groups else [SIX.index(channel)]


class SignalChain:
    """The signal chain of one device; it remembers what is stuck."""

    def __init__(self, profile: Profile, seed: int) -> None:
        self._profile = profile
        self._held: dict[tuple[int, int], float] = {}
        self._rng = stream(seed, "dropped")
        dropped = profile.one("dropped")
        self._dropped = dropped["fraction"] if dropped else 0.0

    def passes(self, t: Array, outputs: Array) -> Array:
        """What comes out of the chain for `outputs` (6, n) at `t` (n,) s."""
        x = outputs.copy()
        self._clip(x)
        for effect in self._profile.every("quantisation"):
            _round(x, effect)
        for effect in self._profile.every("decode_fault"):
            self._decode_wrongly(x, effect)
        for k, effect in enumerate(self._profile.every("stuck")):
            self._stick(x, t, k, effect)
        mounting = self._profile.one("mounting")
        if mounting and mounting.words["unit"]:
            acc, gyr = UNITS[mounting.words["unit"]]
            x[:3] *= acc
            x[3:] *= gyr
        return x

    def arrives(self, n: int) -> NDArray[np.bool_]:
        """Which of the next `n` samples are not dropped, (n,) bool."""
        kept: NDArray[np.bool_] = self._rng.random(n) >= self._dropped
        return kept

    def _clip(self, x: Array) -> None:
        scale = self._profile.range
        for channel, limit in (
            ("acc", scale.acceleration),
            ("gyr", scale.angular_rate),
        ):
            if limit is not None:
                x[rows(channel)] = np.clip(x[rows(channel)], -limit, limit)
        for effect in self._profile.every("saturation"):
            at = rows(effect.words["channel"])
            x[at] = np.clip(x[at], -effect["limit"], effect["limit"])

    def _decode_wrongly(self, x: Array, effect: SimulatedEffect) -> None:
        for row in rows(effect.words["channel"]):
            kind = effect.words["kind"]
            full = effect["full_scale"] or self._full_scale(row, kind)
            raw = np.rint(x[row] * (32768 / full)).astype(np.int64)
            if kind != "wrapped":
                raw = np.clip(raw, -32768, 32767)
            x[row] = _misread(raw, kind) * (full / 32768)

    def _full_scale(self, row: int, kind: str) -> float:
        if kind == "wrapped":
            return WRAPPED_ACC if row < 3 else WRAPPED_GYR
        scale = self._profile.range
        if row < 3:
            return scale.acceleration or ACC_FULL_SCALE
        return scale.angular_rate or GYR_FULL_SCALE

    def _stick(self, x: Array, t: Array, k: int, effect: SimulatedEffect) -> None:
        stuck = (t >= effect["from_s"]) & (t < effect["to_s"])
        if not stuck.any():
            return
        for row in rows(effect.words["channel"]):
            value = self._held.setdefault((k, row), float(x[row, np.argmax(stuck)]))
            x[row, stuck] = value


def _round(x: Array, effect: SimulatedEffect) -> None:
    for channel in ("acc", "gyr"):
        lsb = effect[channel]
        if lsb:
            x[rows(channel)] = np.rint(x[rows(channel)] / lsb) * lsb


def _misread(raw: NDArray[np.int64], kind: str) -> Array:
    """16-bit words as a faulty decoder reads them, (n,)."""
    low, high = raw & 0xFF, (raw >> 8) & 0xFF
    if kind == "low_byte_signed":
        word = (high << 8) + np.where(low < 128, low, low - 256)
    elif kind == "bytes_swapped":
        word = (low << 8) + high
    else:
        word = raw
    return ((word + 32768) % 65536 - 32768).astype(float)
