"""How long to average: a session solved with shorter and shorter windows.

Only the first T seconds of each window are used. Each parameter then has a value x(T)
with the uncertainty s(T). n(T) is the part of s(T) by the noise of the means. The other
part r, by the errors of fixture, level and factory, is about the same at every T,

    r^2 = s^2(T) - n^2(T)                                                          (1)

For white noise, n falls as 1 / sqrt(T), and the difference of nested means has

    var(x(T) - x(T')) = n^2 (1 - T/T')             n the larger of both, T < T'    (2)

The dominant error of a parameter is that which exceeds noise at the smallest T:

    the fixture     r > n(T)                                                       (3)
    flicker         n^2(T) T > 2 n^2(T0) T0                 T0 the shortest time    (4)
    drift           x(T') is further from x(T) than (2) allows                     (5)

A disturbance also makes (5) true. Source: (2) of white noise, whose increments are
independent. Units are those of the parameters; s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.errors import FieldcalError
from fieldcal.core.factory import FactoryErrors
from fieldcal.core.samples import Array
from fieldcal.evaluation.observations import angle_setting, build_observations
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.model import priors
from fieldcal.session.factory import factory_errors
from fieldcal.session.folder import Session
from fieldcal.solve import solve

TIMES = (5, 10, 15, 30, 45, 60, 120, 300, 600, 1800, 3600)
"""Lengths that are tried besides the whole window, s."""

SHORTER = 0.8
"""Largest of these lengths that is tried, as a part of the whole window."""

MIN_CHANGE_SIGMAS = 4.0
"""Standard deviations of (2) from which a change is no noise, among a hundred
changes."""

EXACT_DEG = 1e-6
"""Level, heading and angles of a fixture that leaves nothing, deg."""


@dataclass(frozen=True, slots=True)
class NestedWindows:
    """Each parameter against the averaging time.

    Attributes
    ----------
    names, units : of the k parameters
    seconds : (t,) T, ascending; the last is that of the whole windows
    values, sigma, noise : (t, k) x, s and n

    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    seconds: Array
    values: Array
    sigma: Array
    noise: Array

    def dominant_error(self, name: str) -> tuple[str, float] | None:
        """Error that first exceeds noise, and from which T, s; None if none."""
        k = self.names.index(name)
        x, n, rest = self.values[:, k], self.noise[:, k], self._systematic_sigma(k)
        share = 1 - self.seconds[:-1] / self.seconds[1:]
        sigma = np.maximum(n[:-1], n[1:]) * np.sqrt(share)  # (2)
        jumped = np.append(False, np.abs(np.diff(x)) > MIN_CHANGE_SIGMAS * sigma)
        white = n[0] ** 2 * self.seconds[0]
        exceeds = {
            "fixture": rest > n,  # (3)
            "flicker": n**2 * self.seconds > 2 * white,  # (4)
            "drift": jumped,  # (5)
        }
        first = {
            error: float(self.seconds[np.argmax(at)])
            for error, at in exceeds.items()
            if at.any()
        }
        return min(first.items(), key=lambda error: error[1]) if first else None

    def _systematic_sigma(self, k: int) -> Array:
        """Part r of the uncertainty that is not noise of the means, (t,), (1)."""
        return np.sqrt(np.maximum(self.sigma[:, k] ** 2 - self.noise[:, k] ** 2, 0.0))

    def to_json(self) -> dict[str, Any]:
        """Return the object of result.json."""
        out: dict[str, Any] = {"seconds": self.seconds.tolist(), "parameters": {}}
        for k, name in enumerate(self.names):
            dominant = self.dominant_error(name)
            out["parameters"][name] = {
                "unit": self.units[k],
                "value": self.values[:, k].tolist(),
                "sigma": self.sigma[:, k].tolist(),
                "noise": self.noise[:, k].tolist(),
                "wins": None
                if dominant is None
                else {"what": dominant[0], "from_s": dominant[1]},
            }
        return out


def solve_nested_windows(session: Session) -> NestedWindows | None:
    """Solve a session for several lengths of its windows.

    None if its windows are too short, or consist of means only.
    """
    lengths = [w[1] - w[0] for w in session.windows if w is not None]
    if not lengths or session.about.means_only:
        return None
    longest = min(lengths)
    found = [
        (t, *both)
        for t in [*(t for t in TIMES if t < SHORTER * longest), longest]
        if (both := _solve_first_seconds(session, t)) is not None
    ]
    while found and set(found[0][1].names) < set(found[-1][1].names):
        found.pop(0)
    if len(found) < 2:
        return None
    last = found[-1][1]
    names = [n for n in last.names if all(n in c.names for _, *cs in found for c in cs)]
    return NestedWindows(
        tuple(names),
        tuple(last.units[last.names.index(n)] for n in names),
        np.array([t for t, _, _ in found], dtype=float),
        np.array([_values(c, names) for _, c, _ in found]),
        np.array([_sigmas(c, names) for _, c, _ in found]),
        np.array([_sigmas(c, names) for _, _, c in found]),
    )


def _solve_first_seconds(
    session: Session, seconds: float
) -> tuple[Calibration, Calibration] | None:
    """Solve with the first seconds of each window: with all errors, and noise alone.

    None if any window is too short to be used.
    """
    about = session.about
    windows = tuple(w and (w[0], min(w[1], w[0] + seconds)) for w in about.windows)
    try:
        taken = usable_windows(session.with_windows(windows))
        seen = build_observations(about, taken.averages, taken.position_numbers)
        whole = solve(
            seen,
            level_sigma_deg=about.level_deg,
            angle_sigma_deg=angle_setting(about),
            beside_tilt_sigma_deg=priors.BESIDE_TILT_DEG,
            factory=factory_errors(about),
        )
        level = None if about.level_deg is None else EXACT_DEG
        noise_only = solve(
            seen,
            level_sigma_deg=level,
            heading_sigma_deg=EXACT_DEG,
            angle_sigma_deg=EXACT_DEG,
            factory=FactoryErrors(),
        )
    except FieldcalError:
        return None
    return (
        (whole, noise_only)
        if len(taken.position_numbers) == len(about.positions)
        else None
    )


def _values(found: Calibration, names: Sequence[str]) -> Array:
    return np.array([found.value(name) for name in names])


def _sigmas(found: Calibration, names: Sequence[str]) -> Array:
    return np.array([found.uncertainty(name) for name in names])
