"""A virtual device: told to turn, it hands out the samples it would put out.

Time runs by samples alone: `take` advances it, and what the device is told takes effect
at the sample that comes next. Whatever the size of the blocks it is asked for, the same
commands at the same device times give the same samples.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block, concat
from fieldcal.sim_device.body import Body
from fieldcal.sim_device.chain import SignalChain
from fieldcal.sim_device.joints import Angles
from fieldcal.sim_device.noise import RandomErrors
from fieldcal.sim_device.profile import Profile, Truth
from fieldcal.sim_device.random_process import random_stream
from fieldcal.sim_device.sensor_conditions import SensorConditions
from fieldcal.sim_device.vocabulary import checked_effect

PIECE = 4096
"""Samples calculated at once: few enough to stay in the processor's cache."""

LATENCY_S = 0.002
JITTER_S = 0.001
"""A sample reaches the host so much later: at least, and in the mean beyond that."""


class VirtualDevice:
    """A device with its own physics; angles in rad, times in s of its own clock.

    Parameters
    ----------
    profile : its true parameters
    seed : of all random numbers

    """

    def __init__(self, profile: Profile | None = None, seed: int = 0) -> None:
        if seed < 0:
            raise InputError(f"seed = {seed} must be 0 or more")
        self.profile = profile or Profile()
        self.seed = seed
        self.rate = self.profile.sampling.rate_hz
        self.sensing = Sensing(self.profile, seed)
        self._arrival = random_stream(seed, "arrival")
        self._tick = 0

    @property
    def body(self) -> Body:
        """How it is held and moved."""
        return self.sensing.body

    @property
    def time(self) -> float:
        """Device time of the next sample, s."""
        return self._tick / self.rate

    @property
    def angles(self) -> Angles:
        """Alpha, beta and gamma that it was last told to turn to, rad."""
        return self.body.commanded_angles

    @property
    def busy_until(self) -> float:
        """When the last turn it was told ends, s; -inf before any."""
        return self.body.joints.busy_until * self.sensing.pace

    def turn(
        self,
        alpha: float,
        beta: float,
        seconds: float | None = None,
        at: float | None = None,
        gamma: float = 0.0,
    ) -> float:
        """Turn to the angles; returns the device time at which that is done.

        The turn begins with the next sample, or at a device time `at` still to come; a
        turn that is told while another is under way or to come follows it.

        Raises
        ------
        InputError
            If the angles or the duration are not finite, or the duration not above 0.

        """
        there = (alpha, beta, gamma)
        _, end = self.body.turn(self._start(at), self._duration(seconds), there)
        return end * self.sensing.pace

    def spin(
        self,
        rate: tuple[float, float, float],
        angles: Angles | None = None,
        seconds: float | None = None,
        at: float | None = None,
    ) -> float:
        """Run up to a constant rate about procedure axes, rad/s, as on a rate table.

        Returns the device time from which on the rate is constant. `turn` ends it.

        Raises
        ------
        InputError
            As for `turn`.

        """
        where = self.angles if angles is None else angles
        _, end = self.body.spin(self._start(at), self._duration(seconds), where, rate)
        return end * self.sensing.pace

    def bump(
        self,
        push: float = 2.0,
        tilt_deg: float = 0.5,
        seconds: float = 0.5,
        at: float | None = None,
    ) -> float:
        """Bump the base: peaks in m/s^2 and degrees, s; returns when it is over.

        It begins with the next sample, or at a device time `at` still to come.

        Raises
        ------
        InputError
            If a number is not finite, the duration not above 0, or the time past.

        """
        if not (seconds > 0 and np.isfinite([push, tilt_deg, seconds]).all()):
            raise InputError(f"a bump lasts more than 0 s, not {seconds:g} s")
        start = self._start(at)
        given = {"at_s": start, "for_s": seconds, "push": push, "tilt_deg": tilt_deg}
        self.body.disturb(checked_effect("bump", given))
        return (start + seconds) * self.sensing.pace

    def take(self, n: int) -> Block:
        """Next `n` samples; fewer come where samples are dropped."""
        pieces = [
            self._piece(min(PIECE, n - first)) for first in range(0, max(n, 0), PIECE)
        ]
        return concat(pieces)

    def concealed(self) -> dict[str, Any]:
        """What a recalibration should find out, as JSON."""
        return {**self.profile.concealed(), "seed": self.seed}

    def _piece(self, n: int) -> Block:
        seq = np.arange(self._tick, self._tick + n, dtype=float)
        self._tick += n
        t = seq / self.rate
        stamps, taken = self.sensing.stamped(t)
        true = taken / self.sensing.pace
        six, degrees = self.sensing.sense(true, np.ones(n, dtype=np.int64), stamps)
        late = LATENCY_S + JITTER_S * self._arrival.standard_exponential(n)
        host = np.maximum.accumulate(true + late)
        block = Block.of(stamps, six[:3].T, six[3:].T, degrees, seq, host)
        kept = self.sensing.chain.arrives(n)
        return block if kept.all() else _selected_samples(block, kept)

    def _start(self, at: float | None) -> float:
        """True time of the next sample, or of a device time to come."""
        start = self.time if at is None else at
        if not start >= self.time:
            raise InputError(
                f"at {start:g} s nothing can begin any more: it is {self.time:g} s"
            )
        return start / self.sensing.pace

    def _duration(self, seconds: float | None) -> float:
        value = self.profile.motion.turn_s if seconds is None else seconds
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"a turn takes more than 0 s, not {value:g} s")
        return float(value)


class Sensing:
    """Calculates outputs at given instants: motion, sensors, noise, signal chain.

    Attributes
    ----------
    body : motion of the device
    chain : signal chain of its samples
    pace : seconds of the device's clock in a true second

    """

    def __init__(self, profile: Profile, seed: int) -> None:
        self.profile = profile
        self.pace = profile.clock_rate
        self.body = Body(profile, seed)
        self.chain = SignalChain(profile, seed)
        rate = profile.sampling.rate_hz
        effects = profile.effects
        ratio: Array = np.prod([e.noise_ratio() for e in effects], axis=0, initial=1.0)
        self._noise = RandomErrors(profile.noise, rate, seed, ratio)
        wanders = (e.random_bias(rate, random_stream(seed, e.id)) for e in effects)
        self._wanders = [wander for wander in wanders if wander is not None]
        self._thermometer = random_stream(seed, "thermometer")
        stamps = (e.stamps(random_stream(seed, e.id)) for e in effects)
        self._stamps = [stamp for stamp in stamps if stamp is not None]
        self._lag = sum(e.lag() for e in effects)

    def stamped(self, t: Array) -> tuple[Array, Array]:
        """Stamps of samples due at (n,) s of the device's clock, and when they are."""
        shown = taken = t
        for stamp in self._stamps:
            shown, taken = stamp(taken)
        return shown, taken

    def sense(
        self, true: Array, ticks: NDArray[np.int64], t: Array
    ) -> tuple[Array, Array]:
        """Outputs (6, n) and temperature (n,) °C at instants in true time.

        Parameters
        ----------
        true : (n,) s of true time
        ticks : (n,) how many periods of the sampling clock each took
        t : (n,) s of the device's clock

        """
        clean = self.noiseless(true)
        n = len(t)
        noisy = clean + self._noise.white(n) + self._wander(ticks)
        degrees = self.body.temperature(true)
        degrees = degrees + self.profile.noise.temperature * (
            self._thermometer.standard_normal(n)
        )
        return self.chain.passes(t, noisy), degrees

    def noiseless(self, true: Array) -> Array:
        """Outputs of the sensors without noise and signal chain, (6, n)."""
        late = abs(self._lag)
        vibration = self.body.vibration(true)

        def at_once(t: Array) -> Array:
            return self._outputs(t, vibration)

        outputs = at_once
        for one in self.profile.effects:
            outputs = partial(one.filtered_outputs, outputs)
        now = outputs(true)
        if not late:
            return now
        before = outputs(true - late)
        first, last = (now, before) if self._lag > 0 else (before, now)
        return np.concatenate([first[:3], last[3:]])

    def _outputs(self, t: Array, vibration: Array) -> Array:
        conditions = self.body.conditions(t, vibration)
        six = _ideal_outputs(self.profile.truth, conditions)
        for one in self.profile.in_order:
            if (more := one.added_output(conditions)) is not None:
                six = six + more
        return six

    def _wander(self, ticks: NDArray[np.int64]) -> Array:
        total = int(ticks.sum())
        slow = self._noise.slow(total)
        for process in self._wanders:
            slow = slow + process.draw(total)
        if total == len(ticks):
            return slow
        picked: Array = slow[:, np.cumsum(ticks) - 1]
        return picked


def _selected_samples(block: Block, kept: NDArray[np.bool_]) -> Block:
    columns = (block.acc, block.gyr, block.temperature, block.seq, block.t_host)
    return Block.of(block.t[kept], *(column[kept] for column in columns))


def _ideal_outputs(truth: Truth, conditions: SensorConditions) -> Array:
    """Outputs (6, n) by bias and scale factor alone."""
    bias = np.array([*truth.acc_bias, *truth.gyr_bias])[:, None]
    scale = np.array([*truth.acc_scale, *truth.gyr_scale])[:, None]
    true = np.concatenate([conditions.f + conditions.vibration, conditions.w])
    six: Array = bias + scale * true
    return six
