"""Functions of a covariate with which a residual without a known effect may correlate.

The names are those that the sentences show.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.experience import Experience


def covariate_functions(name: str, x: Experience, channel: int) -> Mapping[str, Array]:
    """Functions (n,) of a covariate that a residual of a channel could follow."""
    if name == "force and time":
        force, t = x.f[:, channel % 3], x.since_start
        return {f"force*time^{k}": force * t**k for k in (1, 2, 3)}
    if name == "time":
        t = x.since_start
        return {"time": t, "time^2": t**2, "time^3": t**3} | _sinusoids(t)
    if name == "temperature":
        return {"temperature": x.warming, "temperature^2": x.warming**2}
    if name == "since turn":
        since = np.maximum(x.since_turn, 0.1)
        return {"time since the turn": since, "log(time since the turn)": np.log(since)}
    if name == "force":
        names = [f"f_{a}" for a in "xyz"]
        forces = dict(zip(names, x.f.T, strict=True))
        return {f"{n}^{k}": f**k for n, f in forces.items() for k in (1, 2, 3, 4)}
    of_alpha = _angle_functions("alpha", x.alpha)
    of_beta = _angle_functions("beta", x.beta)
    if name == "joints":
        return {f"{a}*{b}": of_alpha[a] * of_beta[b] for a in of_alpha for b in of_beta}
    return of_alpha if name == "alpha" else of_beta


def _angle_functions(name: str, angle: Array) -> dict[str, Array]:
    out = {name: angle}
    for k in (1, 2, 3, 4):
        inner = f"{k}*{name}" if k > 1 else name
        out[f"sin({inner})"] = np.sin(k * angle)
        out[f"cos({inner})"] = np.cos(k * angle)
    return out


def _sinusoids(t: Array) -> dict[str, Array]:
    span = float(np.ptp(t))
    out = {}
    for cycles in np.arange(1.0, 12.01, 0.25):
        for name, wave in (("sin", np.sin), ("cos", np.cos)):
            out[f"{name}(2*pi*time/{span / cycles:.3g} s)"] = wave(
                2 * np.pi * cycles * t / span
            )
    return out
