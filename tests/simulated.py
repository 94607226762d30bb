"""A simulated device at rest and on the move, with effects as text."""

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.sim_device import Profile, VirtualDevice
from fieldcal.sim_device.profile import (
    ONE,
    ZERO,
    Climate,
    NoiseFigures,
    Sampling,
    Site,
    Truth,
)
from fieldcal.sim_device.vocabulary import parse

A = float(np.arcsin(0.6))


RATE = (0.1, 0.2, -0.3)


QUIET = NoiseFigures(
    ZERO, ZERO, acc_instability=ZERO, gyr_instability=ZERO, temperature=0.0
)


PLAIN = Profile(
    site=Site(gravity=10.0),
    sampling=Sampling(100.0),
    truth=Truth(ZERO, ONE, ZERO, ONE),
    noise=QUIET,
    temperature=Climate(ramp_k_s=0.01, self_heating_k=0.0),
)


def told(text: str) -> Profile:
    return PLAIN.having(parse(text))


def at_rest(profile: Profile) -> Block:
    """100 s at the turns, the last sample being that of 100 s."""
    device = VirtualDevice(profile, 9)
    device.turn(A, A, 0.05)
    return device.take(10_001)


def turning(profile: Profile) -> Block:
    """The last second of a steady turn at `RATE`."""
    device = VirtualDevice(profile, 9)
    device.take(round(100 * device.spin(RATE, seconds=1.0)))
    return device.take(100)


def added(text: str) -> Array:
    """What the effect adds after 100 s at rest, (6,)."""
    more: Array = at_rest(told(text)).six[-1] - at_rest(PLAIN).six[-1]
    return more


F = 10 * np.array([-0.6, -0.64, 0.48])
