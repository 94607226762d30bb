"""Sessions with several effects, with chance, a broken chain, or no known effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.concealed.draws import EQUATIONS, HOT, drawn, size, sized, suited
from benchmarks.concealed.sessions import Session, plain
from fieldcal.core.samples import Array, Block
from fieldcal.sim_device import effects
from fieldcal.sim_device.profile import FullScale
from fieldcal.sim_device.profile_file import profile_from_tables

CHANCE = ("angle_setting", "random_walk")
CHAIN = (
    *("bump", "stuck", "quantisation", "saturation", "dropped", "clock_skew"),
    *("decode_fault", "noise_level", "mounting", "smoothing", "high_pass"),
)
SPECIAL = ("gravity_error", "earth_rate", "bandwidth", "vibration_rectification")
APART = (
    {"base_tilt", "angle_offset", "cross_coupling", "angle_scale"},
    {"quadratic", "scale_asymmetry", "cubic", "pendulous_products"},
    {
        *("temperature_bias", "thermal_hysteresis", "warm_up", "bias_drift"),
        *("bias_step", "base_step", "mount_slip", "scale_drift", "scale_step"),
        *("thermal_transient", "scale_transient", "scale_warm_up"),
    },
    {"temperature_bias", "temperature_scale"},
    {"temperature_scale", "scale_drift", "scale_step"},
    {"temperature_scale", "scale_warm_up", "scale_transient"},
    {"gyro_scale", "gyro_cross_coupling", "angle_scale", "angle_offset", "sway"},
    {"lever_arm", "time_delay", "sway", "hum"},
    {"settling", "joint_creep"},
    {"heading_error", "g_sensitivity", "g2_sensitivity", "base_tilt", "angle_offset"},
)
"""Effects that are much alike: those at once are drawn from different sets."""

LABELS = {2: "pair", 3: "three"}


def several(rng: np.random.Generator, sigmas: float, count: int = 2) -> Session:
    """Effects of which no two are alike, each of that size."""
    names = [n for n in EQUATIONS if n not in ("gyro_products", "heading_error")]
    while True:
        some = [str(n) for n in rng.choice(names, count, replace=False)]
        if any(len(alike & set(some)) > 1 for alike in APART):
            continue
        session = suited(next((n for n in some[:-1] if n in HOT), some[-1]), rng)
        if session.place == "static" or not session.angles:
            continue
        span, concealed = session.windows[-1].end, {}
        for name in some:
            if values := sized(session, name, drawn(name, rng, span), sigmas):
                concealed[name] = values
        if len(concealed) == count:
            label = LABELS[count]
            return replace(session.having(concealed), label=label, sigmas=sigmas)


def chance(name: str, rng: np.random.Generator) -> Session:
    """Something random, well beyond the noise of the windows."""
    session = calm(plain(rng, ("ladder", "twelve", "wide")))
    one, length = session.profile, session.windows[0].end - session.windows[0].start
    of_window = one.noise.acc[0] / np.sqrt(one.sampling.rate_hz * length)
    times = float(rng.uniform(6, 30))
    if name == "angle_setting":
        sigma = float(np.rad2deg(times * of_window / one.gravity))
        concealed: dict[str, Any] = {"sigma_deg": sigma}
    else:
        step = times / 3 * of_window / np.sqrt(session.windows[1].start)
        concealed = {n: step * float(rng.uniform(0.6, 1.5)) for n in ("ax", "ay", "az")}
    return replace(session.having({name: concealed}), label=name, sigmas=times)


def special(name: str, rng: np.random.Generator) -> Session:
    """Effects that need a session of their own."""
    if name == "gravity_error":
        session = plain(rng, ("twelve", "wide"))
        sign = float(rng.choice([-1, 1]))
        concealed = {"relative": sign * float(rng.uniform(1e-3, 3e-3))}
        session = replace(session, off=session.off * 0)
        return replace(session.having({name: concealed}), label=name)
    if name == "earth_rate":
        session = calm(plain(rng))
        rate = session.profile.sampling.rate_hz
        length = session.windows[0].end - session.windows[0].start
        gyr = 7.292e-5 / float(rng.uniform(30, 100)) * np.sqrt(rate * length)
        noise = replace(session.profile.noise, gyr=(gyr,) * 3)
        session = replace(session, profile=replace(session.profile, noise=noise))
        return replace(session, label=name, concealed={name: {}})
    if name == "bandwidth":  # of which only turns with known ends tell
        tau = float(rng.uniform(0.04, 0.1))
        session = plain(rng, ("twelve", "wide"))
        return replace(session.having({name: {"acc": tau, "gyr": tau}}), label=name)
    session = plain(rng)
    level = float(rng.uniform(0.3, 2.0))
    some = rng.random(len(session.windows)) < 0.5
    some[rng.permutation(len(some))[:2]] = [False, True]
    windows = tuple(
        replace(w, vibration=level * float(rng.uniform(0.5, 1.0)) if s else 0.0)
        for w, s in zip(session.windows, some, strict=True)
    )
    values = {n: float(3e-3 * rng.normal()) for n in "xyz"}
    session = replace(session, windows=windows, label=name)
    shaken = np.hypot(session.profile.noise.acc[0], level)
    length = session.profile.sampling.rate_hz * (windows[0].end - windows[0].start)
    there = max(abs(v) for v in values.values()) * level**2
    factor = rng.uniform(10, 30) * shaken / np.sqrt(length * some.sum()) / there
    values = {n: v * factor for n, v in values.items()}
    return session.having({name: values | {"level": 0.0}})


def flickering(rng: np.random.Generator) -> Session:
    """Nothing concealed, on a device whose biases have flicker noise.

    Allan deviations of MEMS stay at 0.02 to 0.3 mg and 3 to 30 deg/h (data sheets).
    """
    session = calm(plain(rng))
    one = session.profile
    acc = float(10 ** rng.uniform(np.log10(2e-4), np.log10(3e-3)))
    gyr = float(10 ** rng.uniform(np.log10(1.5e-5), np.log10(1.5e-4)))
    noise = replace(one.noise, acc_flicker=(acc,) * 3, gyr_flicker=(gyr,) * 3)
    profile = replace(one, noise=noise)
    return replace(session, profile=profile, label="nothing, flicker")


def chain(name: str, rng: np.random.Generator) -> Session:
    """A fault of the signal chain."""
    session = calm(plain(rng))
    one = session.profile
    w = session.windows[int(rng.integers(len(session.windows)))]
    channel = str(rng.choice(["ax", "ay", "az", "gx", "gy", "gz"]))
    acc, gyr = one.noise.acc[0], one.noise.gyr[0]
    at = float(rng.uniform(w.start + 1, w.end - 6))
    axes = ["+y+x-z", "-x-y+z", "+z+x+y", "-y-x+z", "+x+z+y", "-x+y-z"]
    kind = str(rng.choice(["low_byte_signed", "bytes_swapped"]))
    more: Mapping[str, dict[str, Any]] = {
        "bump": {"at_s": at, "for_s": float(rng.uniform(0.3, 1.5)),
                 "push": float(rng.uniform(12, 50) * acc), "tilt_deg": 0.0},
        "stuck": {"channel": channel, "from_s": at,
                  "to_s": at + float(rng.uniform(2, 6))},
        "quantisation": {"acc": float(rng.uniform(2, 6) * acc)}
        if rng.random() < 0.5 else {"gyr": float(rng.uniform(2, 6) * gyr)},
        "saturation": {"channel": "acc", "limit": 6.5},
        "dropped": {"fraction": float(rng.uniform(0.002, 0.1))},
        "clock_skew": {"ppm": float(rng.choice([-1, 1]) * rng.uniform(60, 1500))},
        "decode_fault": {"channel": "ay", "kind": kind},
        "noise_level": {"channel": channel, "ratio": float(rng.uniform(2.5, 6))},
        "mounting": {"axes": str(rng.choice(axes))},
        "smoothing": dict.fromkeys(("acc", "gyr"), float(rng.uniform(0.15, 1.5))),
        "high_pass": {"acc": float(10 ** rng.uniform(-5.5, -3))},
    }  # fmt: skip
    host = effects.kind(name).EXAMPLE.host_clock
    session = replace(session, label=name, host_clock=host)
    if name == "saturation":
        session = replace(
            session, profile=replace(one, range=FullScale(acceleration=None))
        )
    return session.having({name: more[name]})


def example(name: str, rng: np.random.Generator) -> Session:
    """An effect without a draw of its own: its example, at some device and place."""
    shown = effects.kind(name).EXAMPLE
    session = plain(rng, ("table",) if shown.turntable else ("twelve", "wide"))
    made = profile_from_tables(shown.device)
    parts = {part: getattr(made, part) for part in shown.device}
    windows = session.windows
    if shown.vibration is not None:
        levels = [shown.vibration * (i % 3 == 1) for i in range(len(windows))]
        windows = tuple(
            replace(w, vibration=v) for w, v in zip(windows, levels, strict=True)
        )
    session = replace(
        calm(session),
        label=name,
        windows=windows,
        thermometer=True,
        host_clock=shown.host_clock,
    )
    session = replace(session, profile=replace(session.profile, **parts))
    vector = effects.kind(name).VECTOR
    given = {
        n: v * float(rng.choice([-1, 1])) if n in vector else v
        for n, v in shown.given.items()
    }
    return session.having({name: given})


def calm(session: Session) -> Session:
    """Without bias instability."""
    still = (0.0, 0.0, 0.0)
    noise = replace(session.profile.noise, acc_instability=still, gyr_instability=still)
    return replace(session, profile=replace(session.profile, noise=noise))


def outside(name: str, rng: np.random.Generator, sigmas: float) -> Session:
    """Something that no effect in the catalogue makes, on one accelerometer axis."""
    while True:
        session = calm(plain(rng))
        channel = int(rng.integers(3))
        which = int(rng.integers(1, len(session.windows)))
        if name == "fading coupling":
            session = replace(session, thermometer=False)
        there = size(replace(session, added=_adding(name, channel, which, 1e-3)))
        shown = there > 1e-6 and 1e-3 * sigmas / there < 0.1
        if shown and not _like_a_step(session, name, channel, which):
            return replace(
                session,
                label=f"outside: {name}",
                added=_adding(name, channel, which, 1e-3 * sigmas / there),
                channel=("ax", "ay", "az")[channel],
                sigmas=sigmas,
            )


def _like_a_step(session: Session, name: str, channel: int, which: int) -> bool:
    """Whether in these positions a step of the bias would do for a course as well.

    Where a joint's tooth is met in the last positions only, for one.
    """
    middle = np.array([(w.start + w.end) / 2 for w in session.windows])
    course = OUTSIDE[name](session, middle, channel, which)
    design = np.column_stack([np.ones(len(middle)), _force(session)[:, channel]])

    def left(columns: Array) -> float:
        taken = columns @ np.linalg.lstsq(columns, course, rcond=None)[0]
        return float(((course - taken) ** 2).sum())

    steps = [np.arange(len(middle)) >= i for i in range(1, len(middle))]
    best = min(left(np.column_stack([design, step])) for step in steps)
    return name != "one position off" and best < STEPLIKE * left(design)


def _adding(
    name: str, channel: int, which: int, amount: float
) -> Callable[[Session, Block], Block]:
    """What adds a course to one axis."""

    def add(session: Session, block: Block) -> Block:
        acc = block.acc.copy()
        acc[:, channel] += amount * OUTSIDE[name](session, block.t, channel, which)
        return replace(block, acc=acc)

    return add


def _held(session: Session, t: Array) -> Array:
    """Index of the last window begun before each instant."""
    starts = [w.start for w in session.windows]
    return np.maximum(np.searchsorted(starts, t, side="right") - 1, 0)


def _angles(session: Session, t: Array) -> tuple[Array, Array]:
    at = _held(session, t)
    alpha = np.array([w.alpha for w in session.windows])
    beta = np.array([w.beta for w in session.windows])
    return alpha[at], beta[at]


def _tooth(session: Session, t: Array, channel: int, which: int) -> Array:
    """A course around the joint that no force has."""
    course: Array = np.sin(8 * _angles(session, t)[0] + 0.5)
    return course


def _wave(session: Session, t: Array, channel: int, which: int) -> Array:
    course: Array = np.sin(2 * np.pi * t / 71.0)
    return course


def _cubic(session: Session, t: Array, channel: int, which: int) -> Array:
    part = 2 * t / t[-1] - 1
    course: Array = part**3 - 0.6 * part
    return course


def _odd_one(session: Session, t: Array, channel: int, which: int) -> Array:
    course: Array = (_held(session, t) == which).astype(float)
    return course


def _hysteresis(session: Session, t: Array, channel: int, which: int) -> Array:
    """A bias that depends on whether the load rose or fell when it was turned."""
    force = _force(session)[:, channel]
    rose = np.sign(np.diff(force, prepend=force[0] - 1.0))
    course: Array = rose[_held(session, t)]
    return course


def _fading(session: Session, t: Array, channel: int, which: int) -> Array:
    """A cross-coupling that fades as the device warms up."""
    force = _force(session)[:, (channel + 1) % 3]
    course: Array = force[_held(session, t)] * np.exp(-3 * t / t[-1])
    return course


def _force(session: Session) -> Array:
    block = replace(session, added=None).record(0, noise=False)
    middle = [(w.start + w.end) / 2 for w in session.windows]
    force: Array = block.acc[np.searchsorted(block.t, middle)]
    return force


STEPLIKE = 0.1
"""Part of a course's squares that a step may leave to be no course of its own."""

Course = Callable[[Session, Array, int, int], Array]
OUTSIDE: Mapping[str, Course] = {
    "joint's tooth": _tooth,
    "wave in time": _wave,
    "cubic in time": _cubic,
    "one position off": _odd_one,
    "hysteresis": _hysteresis,
    "fading coupling": _fading,
}
