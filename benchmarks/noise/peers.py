"""What other programs make of the same noise: allantools, avar, allan-variance."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from fieldcal.core.samples import Array

PEERS = {"quantization": "Q", "white": "N", "flicker": "B", "walk": "K"}


def allan_variance(values: Array, dt: float, sizes: dict[str, float]) -> Array:
    """Sizes by allan-variance, the processes being known, (c, p)."""
    peer = import_module("allan_variance")
    effects = [e for e, p in PEERS.items() if p in sizes]
    tau, avar = peer.compute_avar(values, dt)
    found, _ = peer.estimate_parameters(tau, avar, effects)
    return np.array(found)[:, [effects.index(_word(p)) for p in sizes]]


def _word(process: str) -> str:
    return next(word for word, p in PEERS.items() if p == process)


def white_freedom(tau: Array, length: float, dt: float) -> Array:
    """Degrees of freedom of an overlapping estimate of white noise, allantools'."""
    tools = import_module("allantools")
    return np.array(
        [
            tools.edf_greenhall(0, 2, round(t / dt), round(length / dt), True)
            for t in tau.tolist()
        ]
    )


def of_allantools(x: Array, dt: float, tau: Array) -> Array:
    """Allan variances of the first half as they are; the last where it has none."""
    tools = import_module("allantools")
    there = tau[tau <= len(x) * dt / 4]
    found = tools.oadev(x - x.mean(), 1 / dt, "freq", there)[1] ** 2
    return np.append(found, np.full(len(tau) - len(found), found[-1]))


def of_allan_variance(x: Array, dt: float, tau: Array) -> Array:
    """Allan variance of all its five processes fitted."""
    peer = import_module("allan_variance")
    at, avar = peer.compute_avar(x, dt)
    q, n, b, k, r = np.array(peer.estimate_parameters(at, avar)[0])
    flicker = 2 * np.log(2) / np.pi * b**2
    slow = flicker + k**2 * tau / 3 + r**2 * tau**2 / 2
    whole: Array = 3 * q**2 / tau**2 + n**2 / tau + slow
    return whole


def of_avar(x: Array, dt: float, tau: Array) -> Array:
    """Allan variance of its processes, their sizes by least squares of logarithms."""
    from scipy.optimize import least_squares

    peer = import_module("avar")
    m = peer.windows(len(x))
    m = m[m <= len(x) // 10]
    with contextlib.redirect_stdout(io.StringIO()):
        seen = peer.variance(x, m)
    time = len(x) * dt / 30

    def model(at: Array, logs: Array) -> Any:
        q, n, g, k, r = np.exp(logs)
        ks = [(-2, q), (-1, n), (0, g, time), (1, k), (2, r)]
        return peer.ideal_variance(at, ks, dt)

    last = float(seen[-1])
    start = np.log([1e-3 * dt**2 * seen[0], seen[0] * dt, last,
                    last / time, last / time**2])  # fmt: skip
    best = least_squares(lambda v: np.log(model(m * dt, v) / seen), start)
    return np.asarray(model(tau, best.x))


THEIRS: dict[str, tuple[str, Callable[[Array, float, Array], Array]]] = {
    "allantools": ("allantools", of_allantools),
    "avar": ("avar", of_avar),
    "allan-variance": ("allan_variance", of_allan_variance),
}
