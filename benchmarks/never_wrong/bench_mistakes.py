"""Mistakes of a hand and a fixture, and benches and devices that are not as usual.

Each takes a bench on which nothing was recorded yet, and spoils one thing of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.never_wrong.bench import Bench, wrongly_set
from benchmarks.never_wrong.beside import Beside
from benchmarks.never_wrong.device import Device
from benchmarks.never_wrong.fixture_mistakes import OF_FIXTURE
from benchmarks.never_wrong.written import Before, Rng, acting, log_uniform


def _one(bench: Bench, rng: Rng) -> int:
    return int(rng.integers(len(bench.angles)))


# -- of the hand and the fixture


def repeated_angle(bench: Bench, rng: Rng) -> Bench:
    """One angle of the fixture is off by 0.02 to 0.2 degrees wherever it is set."""
    off, joint = np.zeros_like(bench.off), int(rng.integers(2))
    values = bench.angles[:, joint].copy()
    values[bench.stated or len(values) :] = 0.0  # laid by hand
    one = rng.choice(np.unique(values[values != 0]))
    off[values == one, joint] = np.deg2rad(
        np.exp(rng.uniform(np.log(0.02), np.log(0.2)))
    )
    return wrongly_set(bench, off)


def gauge_long(bench: Bench, rng: Rng) -> Bench:
    """The gauge that sets the angles is 0.05 to 0.5 % long."""
    off = np.deg2rad(bench.angles) * rng.uniform(5e-4, 5e-3)
    off[bench.stated or len(off) :] = 0.0  # laid by hand
    return wrongly_set(bench, off)


def position_off(bench: Bench, rng: Rng) -> Bench:
    """One position is set 0.3 to 10 degrees off."""
    off = np.zeros_like(bench.off)
    size = np.deg2rad(np.exp(rng.uniform(np.log(0.3), np.log(10))))
    off[_one(bench, rng), rng.integers(2)] = size * rng.choice([-1, 1])
    return wrongly_set(bench, off)


def no_witness(bench: Bench, rng: Rng) -> Bench:
    """The device is not laid on its faces, though angles need a witness."""
    known = len(bench.angles) - bench.faces
    return replace(bench, faces=0, off=bench.off[:known])


def table_tilted(bench: Bench, rng: Rng) -> Bench:
    """The base is 0.1 to 2 degrees out of level, and nobody says so."""
    tilt = np.deg2rad(rng.uniform(0.1, 2, 2)) * rng.choice([-1, 1], 2)
    return replace(bench, tilt=tuple(tilt.tolist()))


def two_off(bench: Bench, rng: Rng) -> Bench:
    """Two positions are off, or two repeated angles."""
    kind = position_off if rng.integers(2) else repeated_angle
    return kind(kind(bench, rng), rng)


# -- what nobody knows of the device and of the bench


def low_cost(bench: Bench, rng: Rng) -> Bench:
    """A low-cost device; one in two is called tactical."""
    return replace(
        bench,
        device=Device.low_cost(rng),
        acc_bias=rng.normal(0, 0.3, 3),
        acc_scale=1 + rng.normal(0, 1.2e-2, 3),
        gyr_bias=rng.normal(0, 0.05, 3),
        gyr_scale=1 + rng.normal(0, 1.2e-2, 3),
        grade=str(rng.choice(["tactical", "consumer"])),
    )


def shaken(bench: Bench, rng: Rng) -> Bench:
    """The bench vibrates."""
    return acting(
        bench, shaken=log_uniform(rng, 0.01, 1.0), hum_hz=log_uniform(rng, 3, 80)
    )


def swaying(bench: Bench, rng: Rng) -> Bench:
    """The bench sways, or a hand trembles."""
    sway = float(np.deg2rad(log_uniform(rng, 0.003, 0.3)))
    return acting(bench, swaying=sway, sway_hz=log_uniform(rng, 0.2, 5))


def filtered(bench: Bench, rng: Rng) -> Bench:
    """The outputs are behind a filter."""
    return acting(bench, filtered=log_uniform(rng, 3e-3, 0.1))


def delayed(bench: Bench, rng: Rng) -> Bench:
    """The gyroscopes are late."""
    return acting(bench, delayed=log_uniform(rng, 2e-3, 0.05))


def on_an_arm(bench: Bench, rng: Rng) -> Bench:
    """The device is not in the axes of the fixture."""
    return acting(bench, arm=tuple(rng.normal(0, 0.15, 3).tolist()))


def stays(bench: Bench, rng: Rng) -> Bench:
    """Biases keep something of the last turn, 0.03 to 0.2 mg."""
    return acting(bench, stays=log_uniform(rng, 3e-4, 2e-3))


def wandering(bench: Bench, rng: Rng) -> Bench:
    """Biases wander by 0.01 to 0.2 mg and 0.2 to 10 deg/h in 100 s."""
    walk = {
        "acc_walk": log_uniform(rng, 1e-4, 2e-3),
        "gyr_walk": log_uniform(rng, 1e-6, 5e-5),
    }
    return acting(bench, **walk)


def warming(bench: Bench, rng: Rng) -> Bench:
    """The device was switched on just before; biases come to rest in 30 to 600 s."""
    cold = {
        "acc_cold": log_uniform(rng, 1e-3, 0.1),
        "gyr_cold": log_uniform(rng, 1e-5, 2e-3),
    }
    return acting(bench, warming=log_uniform(rng, 30, 600), **cold)


def kicked(bench: Bench, rng: Rng) -> Bench:
    """Somebody kicks the table in a position: it stands 0.02 to 1 degrees otherwise."""
    start, end = bench.windows[_one(bench, rng)]
    size = float(np.deg2rad(log_uniform(rng, 0.02, 1.0))) * float(rng.choice([-1, 1]))
    return acting(bench, kicked=size, kick_s=float(rng.uniform(start, end)))


def slipping(bench: Bench, rng: Rng) -> Bench:
    """The device slips by 0.02 to 1 degrees in its mount, at rest or on the way."""
    axis = rng.normal(size=3)
    size = np.deg2rad(log_uniform(rng, 0.02, 1.0)) / np.linalg.norm(axis)
    x, y, z = (size * axis).tolist()
    when = float(rng.uniform(bench.windows[0, 0], bench.windows[-1, 1]))
    return acting(bench, slips=(x, y, z), slip_s=when)


def crooked(bench: Bench, rng: Rng) -> Bench:
    """The device is fastened 0.1 to 2 degrees askew."""
    axis = rng.normal(size=3)
    size = np.deg2rad(log_uniform(rng, 0.1, 2.0)) / np.linalg.norm(axis)
    x, y, z = (size * axis).tolist()
    return acting(bench, slips=(x, y, z), slip_s=-10.0)


def read_coarsely(bench: Bench, rng: Rng) -> Bench:
    """Angles are read to the next 0.05 to 1 degrees, and said to be set better."""
    step = np.deg2rad(log_uniform(rng, 0.05, 1.0))
    return wrongly_set(bench, rng.uniform(-step / 2, step / 2, bench.off.shape))


def second_heard(bench: Bench, rng: Rng) -> Bench:
    """A second device of the make sends into the same stream, under the same names.

    Its biases are other ones by 0.1 to 10 mg and 2 to 500 deg/h, and it is mounted 0.05
    to 1 degrees otherwise. For each of its samples there are one to eight of the first.
    """
    acc, gyr = log_uniform(rng, 1e-3, 0.1), log_uniform(rng, 1e-5, 2.4e-3)
    scale, axis = log_uniform(rng, 1e-4, 3e-3), rng.normal(size=3)
    size = np.deg2rad(log_uniform(rng, 0.05, 1.0)) / np.linalg.norm(axis)
    x, y, z = (size * axis).tolist()
    beside = Beside(
        acc_bias=bench.acc_bias + rng.normal(0, acc, 3),
        acc_scale=bench.acc_scale + rng.normal(0, scale, 3),
        gyr_bias=bench.gyr_bias + rng.normal(0, gyr, 3),
        gyr_scale=bench.gyr_scale + rng.normal(0, scale, 3),
        device=Device.drawn(rng),
        turned=(x, y, z),
        every=int(rng.choice([1, 1, 1, 2, 4, 8])),
        late=float(rng.uniform(0.05, 0.95)),
        exchanged=float(rng.choice([0.0, 0.0, rng.uniform(0.0, 0.3)])),
        counted=bool(rng.integers(2)),
    )
    return replace(bench, beside=beside)


def sinking(bench: Bench, rng: Rng) -> Bench:
    """Soft ground gives way by 0.02 to 0.5 degrees, in 50 to 500 s."""
    size = float(np.deg2rad(log_uniform(rng, 0.02, 0.5))) * float(rng.choice([-1, 1]))
    return acting(bench, sinking=size, sinks_s=log_uniform(rng, 50, 500))


BEFORE: dict[str, Before] = OF_FIXTURE | {
    "a repeated angle off": repeated_angle,
    "gauge long": gauge_long,
    "a position off": position_off,
    "table tilted": table_tilted,
    "faces left out": no_witness,
    "two positions or angles off": two_off,
    "low-cost device": low_cost,
    "vibration": shaken,
    "sway": swaying,
    "filter": filtered,
    "delay of the gyroscopes": delayed,
    "lever arm": on_an_arm,
    "bias that a turn leaves": stays,
    "wandering biases": wandering,
    "warm-up": warming,
    "table kicked": kicked,
    "ground gives way": sinking,
    "slips in its mount": slipping,
    "fastened askew": crooked,
    "angles read coarsely": read_coarsely,
    "a second device heard": second_heard,
}


def spoilt(bench: Bench, names: tuple[str, ...], rng: Rng) -> Bench:
    """The bench with the mistakes that are made before anything is recorded."""
    for name in names:
        if name in BEFORE:
            bench = BEFORE[name](bench, rng)
    return bench
