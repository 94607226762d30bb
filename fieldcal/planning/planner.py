"""Chooses positions, and predicts the uncertainty that they give.

The design of n positions, J (3n, p) about a perfect device, determines the uncertainty
of a joint estimate before anything is measured:

    C = s^2 (J^T J)^-1                             Cramer-Rao bound
    s^2 = N^2 / T + B^2                            standard error of one mean

p holds biases b, m/s^2, scale factors k, 1, and the tilt of the base, deg; N is the
white noise density, m/s^2/sqrt(Hz), B the bias instability, m/s^2, T the window, s.
Positions are chosen for the smallest error of a calibrated specific force up to 1 g,

    c^2 = trace C_b + g^2 trace C_k

by exchange: one position after the other is replaced by the best candidate until none
gets better (Fedorov, Theory of Optimal Experiments, 1972), from several starts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

from fieldcal.core.errors import PlanError
from fieldcal.core.positions import Position, specific_forces
from fieldcal.core.samples import Array
from fieldcal.model.causes.planned import design_matrix, parameters

STARTS = 12
"""Number of random sets from which the exchange starts; fewer give the same result."""

ANGLES_PER_JOINT = 7
"""Number of angles between the limits of each joint."""

SINGULAR = 1e-9
"""Smallest relative singular value of scaled columns that counts as determined."""


@dataclass(frozen=True, slots=True)
class GradeNoise:
    """Noise of devices of one grade.

    Attributes
    ----------
    acc_white : m/s^2/sqrt(Hz); acc_floor : bias instability, m/s^2
    gyr_white : rad/s/sqrt(Hz); gyr_floor : bias instability, rad/s

    """

    acc_white: float
    acc_floor: float
    gyr_white: float
    gyr_floor: float

    def acc(self, seconds: float) -> float:
        """Standard error of an accelerometer's mean over `seconds`, m/s^2."""
        return float(np.hypot(self.acc_white / np.sqrt(seconds), self.acc_floor))

    def gyr(self, seconds: float) -> float:
        """Standard error of a gyroscope's mean over `seconds`, rad/s."""
        return float(np.hypot(self.gyr_white / np.sqrt(seconds), self.gyr_floor))

    @property
    def acc_seconds(self) -> float:
        """Window beyond which flicker dominates an accelerometer's mean, s."""
        return (self.acc_white / self.acc_floor) ** 2

    @property
    def gyr_seconds(self) -> float:
        """Window beyond which flicker dominates a gyroscope's mean, s."""
        return (self.gyr_white / self.gyr_floor) ** 2

    def to_json(self) -> dict[str, float]:
        """Return both averaging times, s."""
        return {"acc_best_s": self.acc_seconds, "gyr_best_s": self.gyr_seconds}


GRADES = {
    "consumer": GradeNoise(3e-3, 5e-4, 2e-4, 5e-5),
    "tactical": GradeNoise(1e-3, 1e-4, 5e-5, 5e-6),
    "navigation": GradeNoise(1e-4, 2e-5, 3e-7, 5e-8),
}
"""Typical noise: 300, 100 and 10 micro-g/sqrt(Hz); 0.7, 0.17 and 0.001 deg/sqrt(h)."""


@dataclass(frozen=True, slots=True)
class Ladder:
    """Range of the joints, rad: largest |alpha| and |beta|."""

    alpha: float = float(np.deg2rad(45.0))
    beta: float = float(np.deg2rad(5.0))

    def candidates(self) -> list[Position]:
        """A grid of positions within the limits, home among them.

        Of a joint that turns all round, both ends are the same angle, and one is left.
        """
        steps = np.linspace(-1, 1, ANGLES_PER_JOINT)
        alphas, betas = (
            np.round(np.rad2deg(most) * steps, 3) + 0.0
            for most in (self.alpha, self.beta)
        )
        if alphas[-1] - alphas[0] >= 360:
            alphas = alphas[1:]
        return [Position.deg(a, b) for a, b in product(alphas, betas)]


def required_parameters(n: int) -> tuple[str, ...]:
    """Parameters that n positions must determine; three or more also the tilt."""
    return parameters(*(["angle_offset"] if n >= 3 else []))


def expected(
    positions: Sequence[Position],
    grade: GradeNoise,
    seconds: float,
    gravity: float,
    mounting: Array | None = None,
) -> dict[str, float]:
    """Standard uncertainty of every parameter that the positions determine.

    Parameters
    ----------
    positions : with known angles
    grade : noise of the device
    seconds : averaging time of each
    gravity : m/s^2
    mounting : (3, 3), procedure = mounting @ device; parameters are of device axes

    Returns
    -------
    by full name, in the units of a calibration; what is not determined is absent

    """
    names = required_parameters(len(positions))
    design = design_matrix(names, positions, gravity, mounting)
    jacobian = design.reshape(-1, len(names))
    sigma = grade.acc(seconds) * parameter_sigma(jacobian)
    found = {n: float(s) for n, s in zip(names, sigma, strict=True)}
    gyr = grade.gyr(seconds) / np.sqrt(len(positions))
    found |= {f"gyr_bias.{axis}": float(gyr) for axis in "xyz"}
    return {name: s for name, s in found.items() if np.isfinite(s)}


def parameter_sigma(jacobian: Array) -> Array:
    """Sigma of each parameter for unit noise, (p,); infinite where not determined."""
    size = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian / np.where(size > 0, size, 1.0)
    _, s, vt = np.linalg.svd(scaled, full_matrices=True)
    s = np.concatenate([s, np.zeros(len(vt) - len(s))])
    good = s > SINGULAR * s[0]
    variance = ((vt[good] / s[good, None]) ** 2).sum(axis=0)
    loose = (vt[~good] ** 2).sum(axis=0) > SINGULAR
    sigma = np.sqrt(variance) / np.where(size > 0, size, 1.0)
    return np.where(loose | (size == 0), np.inf, sigma)


def best_positions(
    n: int, ladder: Ladder, gravity: float, fixed: Sequence[Position] = ()
) -> tuple[Position, ...]:
    """The n positions of a ladder that determine bias and scale factor best.

    Parameters
    ----------
    n : number of positions, 2 or more
    ladder : limits of the joints
    gravity : m/s^2
    fixed : positions that are taken in any case, in addition to the n

    Raises
    ------
    PlanError
        If no n positions within the limits determine the parameters.

    """
    if n + len(fixed) < 2:
        raise PlanError(f"{n} positions determine nothing: ask for two or more")
    within = (
        f"within |α| ≤ {np.rad2deg(ladder.alpha):g}° and"
        f" |β| ≤ {np.rad2deg(ladder.beta):g}°"
    )
    if n > (most := len(ladder.candidates())):
        raise PlanError(
            f"{n} positions: {most} are distinguished {within}; ask for no more"
        )
    found = _best_of_candidates(n, ladder, gravity, fixed)
    if found is None:
        raise PlanError(
            f"no {n} positions {within} determine the calibration; allow more positions"
            " or wider angles"
        )
    return found


def _best_of_candidates(
    n: int, ladder: Ladder, gravity: float, fixed: Sequence[Position]
) -> tuple[Position, ...] | None:
    """The best n candidates, as `best_positions`; None if they determine too little."""
    names = required_parameters(n + len(fixed))
    held = {p.degrees for p in fixed}
    candidates = [p for p in ladder.candidates() if p.degrees not in held]
    if len(candidates) < n:
        return None
    rows = design_matrix(names, candidates, gravity)
    information = np.einsum("nip,niq->npq", rows, rows)
    given = np.zeros(information.shape[1:])
    if fixed:
        taken = design_matrix(names, fixed, gravity)
        given = np.einsum("nip,niq->pq", taken, taken)
    rng = np.random.default_rng(0)
    starts = [rng.permutation(len(candidates))[:n] for _ in range(STARTS)]
    ends = [_exchange(list(start), information, given, gravity) for start in starts]
    cost, chosen = min(ends)
    if not np.isfinite(cost):
        return None
    return _shortest_way([candidates[i] for i in chosen])


def _exchange(
    chosen: list[int], information: Array, given: Array, gravity: float
) -> tuple[float, list[int]]:
    """Replace positions by better ones until there are none; each is used once."""
    cost = np.inf
    while True:
        best = (cost, -1, -1)
        total = information[chosen].sum(axis=0) + given
        for place, i in enumerate(chosen):
            costs = _cost(total - information[i] + information, gravity)
            costs[[j for j in chosen if j != i]] = np.inf
            j = int(np.argmin(costs))
            if costs[j] < best[0] * (1 - 1e-9):
                best = (float(costs[j]), place, j)
        if best[1] < 0:
            return cost, sorted(chosen)
        cost, chosen[best[1]] = best[0], best[2]


def _cost(information: Array, gravity: float) -> Array:
    """Mean square error of a calibrated specific force for each information matrix."""
    size = np.sqrt(np.diagonal(information, axis1=-2, axis2=-1))
    size = np.where(size > 0, size, 1.0)
    scaled = information / size[:, :, None] / size[:, None, :]
    eigenvalues, vectors = np.linalg.eigh(scaled)
    good = eigenvalues[:, 0] > SINGULAR
    inverse = 1 / np.where(good[:, None], eigenvalues, 1.0)
    variance = np.einsum("npk,nk->np", vectors**2, inverse) / size**2
    cost = variance[:, :3].sum(axis=1) + gravity**2 * variance[:, 3:6].sum(axis=1)
    return np.where(good, cost, np.inf)


def _shortest_way(positions: list[Position]) -> tuple[Position, ...]:
    """Order the positions so that the operator turns least, the first nearest home."""
    f = specific_forces([Position.deg(0, 0), *positions], 1.0)
    steps = np.linalg.norm(f[:, None] - f[None], axis=2)
    n = len(positions)
    if n <= 7:
        ways = permutations(range(1, n + 1))
        best = min(ways, key=lambda way: steps[[0, *way[:-1]], list(way)].sum())
        return tuple(positions[i - 1] for i in best)
    way, left = [0], set(range(1, n + 1))
    while left:
        way.append(min(left, key=lambda i: (steps[way[-1], i], i)))
        left.remove(way[-1])
    return tuple(positions[i - 1] for i in way[1:])


def extra_position(
    positions: Sequence[Position], ladder: Ladder, gravity: float
) -> Position | None:
    """The further position that reduces the error most.

    None if all within the limits are taken, or none completes the calibration.
    """
    found = _best_of_candidates(1, ladder, gravity, positions)
    return found[0] if found else None
