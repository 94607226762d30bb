"""Effects drawn at random and brought to a size in standard deviations.

The size is what an effect does to the means of the windows' parts, beyond what bias
and scale factor take up, over their white noise; of what shows while the device is
turned, or as a line, what it does to the samples there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.concealed.sessions import SIX, Session, plain
from fieldcal.core.samples import Array, Block
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Line
from fieldcal.sim_device import profile as device
from fieldcal.sim_device.effects import ids, kind

Values = dict[str, Any]


USUAL: Mapping[str, float] = {
    "cross_coupling": 5e-3,
    "gyro_cross_coupling": 5e-3,
    "gyro_products": 5e-3,
    "gyro_scale": 5e-3,
    "quadratic": 2e-4,
    "cubic": 5e-6,
    "scale_asymmetry": 2e-3,
    "pendulous_products": 5e-5,
    "g_sensitivity": 3e-5,
    "g2_sensitivity": 3e-7,
    "base_tilt": 1.0,
    "angle_offset": 1.0,
    "angle_scale": 1e-2,
    "temperature_scale": 1e-4,
    "lever_arm": 0.1,
}
"""What the components of a vector usually are; each is drawn by itself."""

TIMED = (
    *("temperature_bias", "thermal_hysteresis", "warm_up", "bias_drift", "bias_step"),
    *("settling", "hum", "base_step", "mount_slip", "joint_creep"),
    *("scale_drift", "scale_step", "scale_warm_up"),
    *("thermal_transient", "scale_transient"),
)
EQUATIONS = (*USUAL, *TIMED, "sway", "time_delay", "heading_error")
"""Effects with numbers that can be made larger and smaller."""

LINES = tuple(i for i, one in catalogue().items() if isinstance(one, Line))
TURNING = ("gyro_cross_coupling", "gyro_scale", "lever_arm", "time_delay")
HOT = tuple(i for i in ids() if "temperature" in kind(i).EXAMPLE.device)
"""Effects that need a temperature that changes."""

FIXED = ("tau_s", "at_s", "hz", "azimuth_deg", "phase_deg", "level")
LARGEST = {
    **{"base_tilt": 5.0, "angle_offset": 5.0, "thermal_hysteresis": 2.0},
    **{"lever_arm": 0.5, "time_delay": 0.06, "sway": 0.3, "heading_error": 60.0},
    **{"base_step": 2.0, "mount_slip": 1.0, "joint_creep": 1.0},
}
ANYWHERE = ("warm_up", "bias_drift", "bias_step", "hum", "temperature_bias")
"""Effects that one long recording in one position shows as well."""

UNORIENTED = ("cross_coupling", "quadratic", "scale_asymmetry", "temperature_bias")
"""Effects that show if the angles are not known, too."""


def drawn(name: str, rng: np.random.Generator, span: float) -> Values:
    """An effect's parameters at about their typical size, some of them zero."""
    if name in USUAL:
        names, size = kind(name).VECTOR, USUAL[name]
        values = {n: float(size * rng.normal()) for n in names}
        if len(names) > 3:
            for n in rng.permutation(list(names))[: len(names) // 2]:
                values[str(n)] = 0.0
        return values
    both = _along(rng, 0.02, 1e-3)
    more: dict[str, Values] = {
        "temperature_bias": _along(rng, 4e-3, 1e-4),
        "thermal_hysteresis": _along(rng, 0.2, 5e-3),
        "warm_up": both | {"tau_s": float(rng.uniform(0.3, 1.0) * span)},
        "bias_drift": _along(rng, 0.02 / span, 1e-3 / span),
        "bias_step": both | {"at_s": float(rng.uniform(0.25, 0.75) * span)},
        "base_step": {
            "about_x_deg": float(rng.normal(0, 0.1)),
            "about_z_deg": float(rng.normal(0, 0.1)),
            "at_s": float(rng.uniform(0.25, 0.75) * span),
        },
        "mount_slip": {
            "about_x_deg": float(rng.normal(0, 0.1)),
            "about_y_deg": float(rng.normal(0, 0.1)),
            "about_z_deg": float(rng.normal(0, 0.1)),
            "at_s": float(rng.uniform(0.25, 0.75) * span),
        },
        "joint_creep": {
            "alpha_deg": float(rng.normal(0, 0.1)),
            "beta_deg": float(rng.normal(0, 0.1)),
            "tau_s": float(rng.uniform(2.5, 10.0)),
        },
        "scale_drift": {n: float(rng.normal(0, 2e-3 / span)) for n in "xyz"},
        "scale_step": {n: float(rng.normal(0, 1e-3)) for n in "xyz"}
        | {"at_s": float(rng.uniform(0.25, 0.75) * span)},
        "scale_warm_up": {n: float(rng.normal(0, 2e-3)) for n in "xyz"}
        | {"tau_s": float(rng.uniform(0.3, 1.0) * span)},
        "thermal_transient": both | _onset(rng, span),
        "scale_transient": {n: float(rng.normal(0, 2e-3)) for n in "xyz"}
        | _onset(rng, span),
        "settling": both | {"tau_s": float(rng.uniform(2.5, 10.0))},
        "hum": _along(rng, 5e-3, 4e-4) | {"hz": float(rng.uniform(0.5, 9.0))},
        "time_delay": {"seconds": float(rng.uniform(0.003, 0.03))},
        "heading_error": {"psi_deg": float(rng.normal(0, 10))},
        "sway": {
            "amplitude_deg": float(rng.uniform(0.01, 0.1)),
            "hz": float(rng.uniform(0.2, 2.0)),
            "azimuth_deg": float(rng.uniform(0, 180)),
        },
    }
    return more[name]


def _onset(rng: np.random.Generator, span: float) -> Values:
    """When something begins to change gradually, and how fast."""
    return {
        "at_s": float(rng.uniform(0.15, 0.6) * span),
        "tau_s": float(rng.uniform(0.1, 0.5) * span),
    }


def _along(rng: np.random.Generator, acc: float, gyr: float) -> Values:
    """On the accelerometers, the gyroscopes or both."""
    which = int(rng.integers(3))
    out = {n: float(acc * rng.normal()) for n in SIX[:3]} if which != 1 else {}
    return out | ({n: float(gyr * rng.normal()) for n in SIX[3:]} if which else {})


def single(name: str, rng: np.random.Generator, sigmas: float) -> Session:
    """One effect at a size in standard deviations."""
    while True:
        session = suited(name, rng)
        span = session.windows[-1].end
        values = sized(session, name, drawn(name, rng, span), sigmas)
        if values is not None:
            return replace(session.having({name: values}), label=name, sigmas=sigmas)


def suited(name: str, rng: np.random.Generator) -> Session:
    """A session in which an effect shows."""
    if kind(name).EXAMPLE.turntable:
        return plain(rng, ("table",))
    if name in ANYWHERE and rng.random() < 0.2:
        return _warmed(plain(rng, ("static",)), name, rng)
    if name in UNORIENTED and rng.random() < 0.2:
        return _warmed(replace(plain(rng, ("wide",)), angles=False), name, rng)
    session = plain(rng)
    if kind(name).NEEDS_EARTH:
        one = session.profile
        noise = replace(
            one.noise,
            gyr=(10 ** rng.uniform(-4.5, -4),) * 3,
            gyr_instability=device.ZERO,
        )
        one = replace(one, noise=noise, device=device.Identity(grade="navigation"))
        return replace(session, profile=replace(one, effects=()))
    return _warmed(session, name, rng)


def _warmed(session: Session, name: str, rng: np.random.Generator) -> Session:
    """With a temperature that changes, and is known, if the effect needs it."""
    if name not in HOT:
        return session
    span = session.windows[-1].end
    times = np.linspace(0.0, span + 10.0, 60)
    course = rng.choice([4.0, 10.0]) * np.sin(
        2 * np.pi * times / span * rng.uniform(0.4, 1.6) + rng.uniform(0, 6)
    )
    points = tuple(
        (float(t), 20.0 + float(k)) for t, k in zip(times, course, strict=True)
    )
    climate = device.Climate(points=points, self_heating_k=0.0)
    if name != "thermal_hysteresis" and rng.random() < 0.5:
        ramp = float(rng.choice([-1.0, 1.0]) * rng.uniform(3, 10) / span)
        climate = device.Climate(ramp_k_s=ramp, self_heating_k=2.0, warm_up_s=span / 2)
    one = replace(session.profile, temperature=climate)
    return replace(session, profile=one, thermometer=True)


def sized(session: Session, name: str, values: Values, sigmas: float) -> Values | None:
    """The effect at that size; None if no device is that bad, or it does not show."""
    for _ in range(3):
        there = size(session.having({name: values}))
        if there < 1e-9:
            return None
        factor = sigmas / there
        values = {n: v if n in FIXED else v * factor for n, v in values.items()}
    largest = max(abs(v) for n, v in values.items() if n not in FIXED)
    usual = 4 * USUAL.get(name, 0.025)
    return values if largest < LARGEST.get(name, usual) else None


def size(session: Session) -> float:
    """How many standard deviations what is concealed makes where it shows."""
    bare = tuple(e for e in session.profile.effects if e.id not in session.concealed)
    plain_one = replace(session, profile=replace(session.profile, effects=bare))
    before = replace(plain_one, added=None).record(0, noise=False)
    seen = session.record(0, noise=False)
    noise = np.array(session.profile.noise.acc + session.profile.noise.gyr)
    ids, off = set(session.concealed), seen.six - before.six
    inside = np.zeros(len(seen), dtype=bool)
    for w in session.windows:
        inside |= (seen.t >= w.start) & (seen.t < w.end)
    if ids and ids <= set(LINES):
        return float(np.sqrt(((off[inside] / noise) ** 2).sum()))
    if ids and ids <= set(TURNING):
        return _turning(session, before, off, noise)
    return _means(session, before, off, noise)


def _turning(session: Session, before: Block, off: Array, noise: Array) -> float:
    """The same for what shows while the device is turned."""
    shift = off[:, :3]
    if "time_delay" in session.concealed:
        late = session.concealed["time_delay"]["seconds"] * session.profile.gravity
        shift = late * (before.gyr - np.array(session.profile.truth.gyr_bias))
    total = 0.0
    for one, two in zip(session.windows, session.windows[1:], strict=False):
        first, last = np.searchsorted(before.t, [one.end, two.start])
        gap = slice(int(first), int(last))
        if {"lever_arm", "time_delay"} & set(session.concealed):
            total += _on_the_way(session, before.t[gap], shift[gap], noise)
        else:
            whole = off[gap, 3:].sum(axis=0) / noise[3:]
            total += float((whole**2).sum() / max(last - first, 1))
    return float(np.sqrt(total))


def _on_the_way(session: Session, t: Array, shift: Array, noise: Array) -> float:
    """Squares of a shift of the accelerometers (n, 3) during a turn.

    What the gyroscopes' noise makes of the attitude on the way is smooth as well: a
    bridge between the ends, seen through gravity.
    """
    each = max(1, len(t) // 200)
    n = len(t) // each * each
    middle = t[:n].reshape(-1, each).mean(axis=1) - t[0]
    mean = shift[:n].reshape(-1, each, 3).mean(axis=1)
    length = t[-1] - t[0]
    bridge = np.minimum.outer(middle, middle) - np.outer(middle, middle) / length
    astray = session.profile.gravity * noise[3:] * np.sqrt(np.median(np.diff(t)))
    total = 0.0
    for c in range(3):
        cov = noise[c] ** 2 / each * np.eye(len(middle)) + astray[c] ** 2 * bridge
        total += float(mean[:, c] @ np.linalg.solve(cov, mean[:, c]))
    return total


def _means(session: Session, before: Block, off: Array, noise: Array) -> float:
    cuts: list[tuple[int, int]] = []
    for w in session.windows:
        parts = np.array([0, 0.1, 0.25, 0.5, 1])
        edges = np.searchsorted(before.t, w.start + (w.end - w.start) * parts)
        cuts += list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
    weight = np.sqrt([b - a for a, b in cuts])
    mean = np.array([before.six[a:b].mean(axis=0) for a, b in cuts])
    change = np.array([off[a:b].mean(axis=0) for a, b in cuts])
    total = 0.0
    if not session.angles:
        total = _along_force(session, mean[:, :3], change[:, :3], weight / noise[0])
    for c in range(6) if session.angles else range(3, 6):
        scaled = c < 3 or session.place == "table"
        known = [np.ones(len(cuts)), mean[:, c]][: 2 if scaled else 1]
        design = np.column_stack(known) * (weight / noise[c])[:, None]
        rest = change[:, c] * weight / noise[c]
        rest = rest - design @ np.linalg.lstsq(design, rest, rcond=1e-9)[0]
        total += float(rest @ rest)
    return float(np.sqrt(total))


def _along_force(session: Session, mean: Array, change: Array, weight: Array) -> float:
    """Squares of what is seen in the norm of the force alone."""
    truth = session.profile.truth
    force = (mean - np.array(truth.acc_bias)) / np.array(truth.acc_scale)
    along = force / np.linalg.norm(force, axis=1, keepdims=True)
    design = np.hstack([along, along * force]) * weight[:, None]
    rest = (along * change).sum(axis=1) * weight
    rest = rest - design @ np.linalg.lstsq(design, rest, rcond=1e-9)[0]
    return float(rest @ rest)
