"""What a unit with few positions has from its lot.

    python -m benchmarks borrow 200         so many units, and as many at each figure

Units, tilted bases, angles that are set by hand and noise are drawn here, by formulas
of this file's own. Units of the lot were measured in eight positions as well.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from fieldcal.calibration import Calibration
from fieldcal.calibration.lot_prior import LotPrior
from fieldcal.core.positions import Position
from fieldcal.core.samples import Array
from fieldcal.fleet.lot_prior import estimate_lot_prior
from fieldcal.history.sessions import StoredSession
from fieldcal.solve import Observations, solve

GRAVITY = 9.81
ANGLES = [
    (0, 0), (45, 5), (-45, -5), (45, -5), (-45, 5), (0, 5), (0, -5), (22, 0),
    (-22, 0), (45, 0), (-45, 0), (22, 5), (-22, -5), (22, -5), (-22, 5), (0, 0),
    (45, 5), (-45, -5), (45, -5), (-45, 5),
]  # fmt: skip
"""Alpha and beta of twenty positions of a fixture in a vehicle, deg; few are the first
eight."""

FEW, MANY = 8, 20
SET_DEG, LEVEL_DEG, NOISE = 0.3, 0.2, 2e-3
"""How angles are set, half of its variance alike wherever an angle is repeated, and
bases levelled, deg; noise of a window's mean, m/s^2."""

NAMES = tuple(f"acc_{g}.{x}" for g in ("bias", "scale") for x in "xyz")
MIDDLE = np.array([0.03, -0.01, 0.05, 1.001, 0.9985, 1.0])
WIDE = np.repeat([0.02, 1e-3], 3)
"""Mean and spread of the lot: 2 mg, 0.1 %, what factories calibrate industrial units
to."""


@dataclass
class Made:
    """A lot.

    Attributes
    ----------
    wide : in `WIDE_POSITIONS`
    together : correlation of x with y, bias by bias and scale by scale
    rng : what draws

    """

    wide: float = 1.0
    together: float = 0.0
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(7))

    def unit(self) -> Array:
        """Bias and scale factors of a unit, (6,)."""
        off = self.rng.standard_normal(6)
        for x, y in ((0, 1), (3, 4)):
            alone = (1 - self.together**2) ** 0.5
            off[y] = self.together * off[x] + alone * off[y]
        return MIDDLE + self.wide * WIDE * off

    def session(self, unit: Array, count: int) -> Observations:
        """Means of a unit in so many positions, the first of `ANGLES`."""
        fixture = {a: self.rng.standard_normal() for a in sorted({*sum(ANGLES, ())})}
        base = np.deg2rad(LEVEL_DEG) * self.rng.standard_normal(2)
        home = Rotation.from_euler("xz", base).apply([0.0, -GRAVITY, 0.0])
        means = np.full((count, 6), np.nan)
        for row, asked in zip(means, ANGLES[:count], strict=True):
            off = np.array([fixture[a] for a in asked]) + self.rng.standard_normal(2)
            alpha, beta = asked + SET_DEG / np.sqrt(2) * off
            at = Rotation.from_euler("z", -alpha, degrees=True).apply(home)
            force = Rotation.from_euler("x", -beta, degrees=True).apply(at)
            row[:3] = unit[:3] + unit[3:] * force
            row[:3] += NOISE * self.rng.standard_normal(3)
        return Observations(
            tuple(Position.deg(a, b) for a, b in ANGLES[:count]), means,
            np.tile(NOISE**2 * np.eye(6), (count, 1, 1)), GRAVITY,
        )  # fmt: skip

    def solved(self, unit: Array, count: int, lot: LotPrior | None) -> Calibration:
        """What is made of a session."""
        seen = self.session(unit, count)
        return solve(seen, angle_sigma_deg=SET_DEG, lot=lot)

    def prior(self, count: int) -> LotPrior:
        """What so many units say of the next."""
        return estimate_lot_prior("a lot", list(self._stored(count)))

    def _stored(self, count: int) -> Iterator[StoredSession]:
        for i in range(count):
            found = self.solved(self.unit(), FEW, None)
            rows = zip(found.values.tolist(), found.sigma.tolist(), found.units,
                       strict=True)  # fmt: skip
            known = {"conditions": {"latitude_deg": 50.0}, "site": {"height_m": 1.0}}
            yield StoredSession(
                f"/s/{i}", f"{i}", good=True, result={**found.to_json(), **known},
                parameters=dict(zip(found.names, rows, strict=True)),
            )  # fmt: skip


@dataclass
class Score:
    """Errors and their stated uncertainties, (n, 6) when all are in."""

    off: list[Array] = field(default_factory=list)
    sigma: list[Array] = field(default_factory=list)

    def add(self, found: Calibration, unit: Array) -> None:
        """Take in a result."""
        self.off.append(np.array([found.value(n) for n in NAMES]) - unit)
        self.sigma.append(np.array([found.uncertainty(n) for n in NAMES]))

    def said(self) -> str:
        """Rms of biases and scale factors, and how many 95 % intervals hold."""
        off, sigma = np.array(self.off), np.array(self.sigma)
        rms = [float(np.sqrt(np.mean(off[:, k] ** 2))) for k in (slice(3), slice(3, 6))]
        held = float(np.mean(np.abs(off) < 1.96 * sigma))
        return f"rms {1e3 * rms[0]:.1f} mm/s^2, {rms[1]:.1e}, {held:.1%} in 95 %"


def compared(made: Made, units: int, trials: int) -> None:
    """The three ways for as many new units."""
    lots = [made.prior(units) for _ in range(max(1, trials // 20))]
    scores = {"8 with": Score(), "8": Score(), "20": Score()}
    refused = 0
    for i in range(trials):
        unit = made.unit()
        beside = made.solved(unit, FEW, lots[i % len(lots)])
        refused += beside.info["borrowed"]["refused"]
        scores["8 with"].add(beside, unit)
        scores["8"].add(made.solved(unit, FEW, None), unit)
        scores["20"].add(made.solved(unit, MANY, None), unit)
    told = "; ".join(f"{name}: {score.said()}" for name, score in scores.items())
    print(
        f"lot of {units}, {made.wide:g} of its spread, correlation"
        f" {made.together:g}: {told}; {refused} of {trials} called odd"
    )


def odd(made: Made, units: int, trials: int) -> None:
    """Units of which one parameter is far off."""
    lot = made.prior(units)
    for far in (3, 5, 8, 12):
        score, named = Score(), 0
        for _ in range(trials):
            unit = made.unit()
            j = int(made.rng.integers(6))
            unit[j] += far * WIDE[j]
            found = made.solved(unit, FEW, lot)
            named += found.info["borrowed"]["odd_parameter"] == NAMES[j]
            score.off.append((np.array([found.value(NAMES[j])]) - unit[j]).repeat(6))
            score.sigma.append(np.array([found.uncertainty(NAMES[j])]).repeat(6))
        off, sigma = np.array(score.off)[:, 0], np.array(score.sigma)[:, 0]
        held = float(np.mean(np.abs(off) < 1.96 * sigma))
        print(f"{far} spreads off: {named} of {trials} named, {held:.0%} in 95 %")


def main() -> None:
    """Print what is measured."""
    trials = next((int(word) for word in sys.argv[1:] if word.isdigit()), 100)
    for units in (6, 12, 40):
        compared(Made(), units, trials)
    for wide, together in ((0.3, 0.0), (3.0, 0.0), (1.0, 0.9), (1.0, -0.9)):
        compared(Made(wide, together), 40, trials)
    odd(Made(), 40, trials // 4)
