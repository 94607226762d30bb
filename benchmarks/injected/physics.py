"""Effects of the sensors, added to samples as multiples of what an oracle can see.

Each is a pattern: the change of the six outputs, sample by sample, by an effect whose
numbers have unit length. What depends on the force uses the force that the samples
themselves show, f = (U - bias) / scale by the untouched diagnosis, as nobody knows
another one of a device held by hand.

    bias step          U += p [t >= t0]
    bias drift         U += p (t - t_first) / span
    K2                 U_i += p_i f_i^2
    scale asymmetry    U_i += p_i |f_i|
    g-sensitivity      W_i += sum p_ij f_j
    settling           U += p exp(-(time since the window began) / tau)
    temperature bias   U += p (T - T_first)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from benchmarks.injected.readout import put_out
from benchmarks.injected.scene import Scene
from fieldcal.core.samples import Array, Block

Rng = np.random.Generator


class Added(NamedTuple):
    """A recording with an effect in it.

    Attributes
    ----------
    block : the samples
    about : what was added, a few words
    where : what tells it from others of its kind: channel, instant, ...
    hides : effects that nobody can see behind it

    """

    block: Block
    about: str
    where: Mapping[str, float | str] = {}
    hides: tuple[str, ...] = ()


class CannotShow(Exception):  # the recording is no place for it
    """Why an effect cannot be shown in a recording."""


LARGEST: Mapping[str, tuple[float, float]] = {
    "bias_step": (1.0, 0.1),
    "bias_drift": (1.0, 0.1),
    "quadratic": (2e-3, np.nan),
    "scale_asymmetry": (2e-2, np.nan),
    "g_sensitivity": (np.nan, 1e-3),
    "settling": (1.0, 0.1),
    "temperature_bias": (0.2, 0.02),
}
"""Numbers beyond which no device goes, accelerometers and gyroscopes."""

TELLS = 12.0
"""Evidence, ln, below which even an oracle could take an effect for chance."""

WARMER_K, TURNS, READ_K = 4.0, 1.3, 0.02
"""Course of a temperature made up: its amplitude, how many waves, and how well read."""

WARM_K = 1.0
"""Range of a temperature from which a recording has a course of its own."""


def direction(scene: Scene, rng: Rng, first: int | None = None) -> Array:
    """Unit length along the axes of one triad, (6,); `first` is its first channel."""
    out = np.zeros(6)
    if not (scene.fine if first is None else first in scene.fine):
        raise CannotShow("no such sensors, or in coarse steps")
    start = int(rng.choice(scene.fine)) if first is None else first
    out[start : start + 3] = rng.normal(size=3)
    unit: Array = out / np.linalg.norm(out)
    return unit


def instant(scene: Scene, rng: Rng) -> float:
    """Time of a change: between windows where there are several, or amid the one."""
    t, rows = scene.block.t, scene.windows
    if len(rows) < 4:
        a, b = rows[np.argmax(np.diff(rows, axis=1))]
        return float(t[a] + rng.uniform(0.35, 0.65) * (t[b - 1] - t[a]))
    k = int(rng.integers(len(rows) // 3, len(rows) - len(rows) // 3))
    return float((t[rows[k - 1, 1] - 1] + t[rows[k, 0]]) / 2)


def _step(scene: Scene, rng: Rng) -> Array:
    at = instant(scene, rng)
    return np.outer(scene.block.t >= at, direction(scene, rng))


def _drift(scene: Scene, rng: Rng) -> Array:
    t = scene.block.t
    return np.outer((t - t[0]) / (t[-1] - t[0]), direction(scene, rng))


def _own(scene: Scene, rng: Rng, of: Callable[[Array], Array]) -> Array:
    """A function of the force along each accelerometer's own axis."""
    if not scene.turned:
        raise CannotShow("never turned")
    axes = direction(scene, rng, 0)
    own: Array = np.hstack([of(scene.force), np.zeros_like(scene.block.gyr)]) * axes
    return own


def _quadratic(scene: Scene, rng: Rng) -> Array:
    return _own(scene, rng, np.square)


def _asymmetry(scene: Scene, rng: Rng) -> Array:
    return _own(scene, rng, np.abs)


def _g_sensitivity(scene: Scene, rng: Rng) -> Array:
    """Three of its nine numbers."""
    if 0 not in scene.triads or 3 not in scene.fine:
        raise CannotShow("no such sensors, or in coarse steps")
    if not scene.turned:
        raise CannotShow("never turned")
    numbers = np.zeros(9)
    numbers[rng.choice(9, 3, replace=False)] = rng.normal(size=3)
    rates = scene.force @ (numbers / np.linalg.norm(numbers)).reshape(3, 3).T
    return np.hstack([np.zeros_like(rates), rates])


def _settling(scene: Scene, rng: Rng) -> Array:
    if not scene.turned:
        raise CannotShow("never turned")
    t, axes = scene.block.t, direction(scene, rng)
    began = t[scene.windows[:, 0]]
    if began[0] - t[0] < 2:
        began = began[1:]  # it lay there before anybody listened
    last = np.searchsorted(began, t, side="right") - 1
    since = np.where(last >= 0, t - began[np.maximum(last, 0)], np.inf)
    return np.outer(np.exp(-since / rng.uniform(2, 5)), axes)


def warmth(scene: Scene, rng: Rng) -> Array:
    """Temperature of each sample: the recording's own, or a wave made up."""
    own, t = scene.block.temperature, scene.block.t
    if np.isfinite(own).all() and np.ptp(own) > WARM_K:
        return own
    phase = 2 * np.pi * (TURNS * (t - t[0]) / (t[-1] - t[0]) + rng.random())
    course: Array = 25 + WARMER_K * np.sin(phase)
    return course


def read(scene: Scene, degrees: Array, rng: Rng) -> Array:
    """What a thermometer shows of it."""
    if degrees is scene.block.temperature:
        return degrees
    return degrees + READ_K * rng.normal(size=len(degrees))


def pattern(name: str, scene: Scene, rng: Rng) -> Array:
    """Change of the outputs by an effect of unit length, (n, 6)."""
    makes: dict[str, Callable[[Scene, Rng], Array]] = {
        "bias_step": _step,
        "bias_drift": _drift,
        "quadratic": _quadratic,
        "scale_asymmetry": _asymmetry,
        "g_sensitivity": _g_sensitivity,
        "settling": _settling,
    }
    return makes[name](scene, rng)


def physical(name: str, scene: Scene, sigmas: float, rng: Rng) -> Added:
    """A recording with an effect of that many standard deviations."""
    degrees = None
    if name == "temperature_bias":
        truly = warmth(scene, rng)
        degrees = read(scene, truly, rng)
        change = np.outer(truly - truly[0], direction(scene, rng))
    else:
        change = pattern(name, scene, rng)
    seen = scene.oracle.sees(name, change)
    size = sigmas * seen.sigma
    triad = int(np.abs(change[:, :3]).max() == 0)
    if not size < LARGEST[name][triad]:
        raise CannotShow(f"{size:.2g} is more than any device has")
    if seen.evidence(sigmas) < TELLS:
        raise CannotShow(f"{seen.freedom:.1f} degrees of freedom tell the scatter")
    six = put_out(scene.block.six, size * change, rng)
    return Added(
        scene.but(six, degrees),
        f"{('accelerometers', 'gyroscopes')[triad]}, {size:.3g}",
    )


def thermometer(scene: Scene, _: float, rng: Rng) -> Added:
    """A temperature that changes and does nothing."""
    degrees = warmth(scene, rng)
    if degrees is scene.block.temperature:
        raise CannotShow("it has a temperature of its own")
    return Added(scene.but(scene.block.six, read(scene, degrees, rng)), "only read")


PHYSICAL = tuple(LARGEST)
