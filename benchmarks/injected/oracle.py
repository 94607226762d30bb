"""The smallest change that anybody could see in a recording.

Weighted least squares on the means of the windows' parts, told what the effect looks
like, where it is, and everything else that the untouched diagnosis named; the weights
are the scatter that the untouched recording shows (`scatter`). A change d of the rows,
X the columns of all else and V = L L' the covariance of the rows, is seen with

    sigma = 1 / |P L^-1 d|,   P = 1 - projection on L^-1 X

Where the angles are known, the rows are the six outputs. Where they are not, the force
is seen by its length, and across it by what changes within a window: how the device
lies is free in each, and the force of all columns is the mean of the window.

The scatter is not known, but found from few means. Of an effect of k sigma, found with
n degrees of freedom, a likelihood ratio of no more than (n / 2) ln(1 + k^2 / n) tells;
n is Welch and Satterthwaite's, of what white noise and the rest make of sigma^2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from benchmarks.injected import columns
from benchmarks.injected.parts import cut
from benchmarks.injected.scatter import Scatter, scatter, span
from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis import Diagnosis
from fieldcal.session.description import Description

TIMES = 4
"""How often a calibration is found again from the forces that it gave."""

UNSEEN = 1e-4
"""Part of a change that bias, scale and the rest must leave for it to be seen."""

ALWAYS = ""
"""Under which bias, scale factor and how the device lies are kept."""


class Seen(NamedTuple):
    """How well an effect is seen.

    Attributes
    ----------
    sigma : standard deviation of its size; inf where it is not seen
    freedom : degrees of freedom that tell this sigma

    """

    sigma: float
    freedom: float

    def evidence(self, sigmas: float) -> float:
        """Logarithm of the likelihood ratio that an effect of a size can have."""
        n = max(self.freedom, 1e-9)
        return float(n / 2 * np.log1p(sigmas**2 / n))


class Oracle:
    """What is known of an untouched recording."""

    def __init__(
        self, block: Block, about: Description, told: Diagnosis, noise: Array
    ) -> None:
        self.parts = cut(block, about)
        self._held = self.parts.window[:, None] == np.unique(self.parts.window)
        finite = np.isfinite(self.parts.mean).all(axis=0)
        self._seen = tuple(np.flatnonzero(finite).tolist())
        said = columns.force_said(self.parts, about)
        self._oriented = bool(np.isfinite(said).all())
        mean = np.nan_to_num(self.parts.mean)
        force = said if self._oriented else self._whole(mean[:, :3])
        freed = not self._oriented and 0 in self._seen
        made = np.zeros_like(mean)
        for _ in range(TIMES if freed else 1):
            known = {ALWAYS: columns.plain(force)}
            for effect in told.effects:
                table = columns.named(effect, self.parts, force, about)
                known.setdefault(effect.id, []).extend(table)
            self._bases(force, freed)
            if freed:
                lies = self._off(mean, made, about.gravity)
                made = self._made(lies[:, 0], known)
                force = self._whole(mean[:, :3] - made[:, :3])
            else:
                lies = np.hstack([mean[:, :3] - force, mean[:, 3:]])
        self._weigh(lies, known, noise)

    def _whole(self, values: Array) -> Array:
        """Means of the windows instead of those of the parts."""
        weight = self._held * self.parts.count[:, None]
        means = weight.T @ values / weight.sum(axis=0)[:, None]
        out: Array = self._held @ means
        return out

    def _bases(self, force: Array, freed: bool) -> None:
        """Directions in which the outputs are looked at, (m, 3, 3)."""
        self._basis = np.tile(np.eye(3), (len(force), 1, 1))
        for window in self._held.T if freed else ():
            along = force[window][0]
            self._basis[window, 1:] = np.linalg.svd(along[None, :])[2][1:]
            self._basis[window, 0] = along / np.linalg.norm(along)

    def _turned(self, six: Array) -> Array:
        """Outputs of the parts in those directions, (m, 6)."""
        return np.hstack([np.einsum("mij,mj->mi", self._basis, six[:, :3]), six[:, 3:]])

    def _off(self, mean: Array, made: Array, gravity: float) -> Array:
        """What turned outputs (m, 6) are off by, linear about what is made of them."""
        off = self._turned(mean)
        left = np.linalg.norm(mean[:, :3] - made[:, :3], axis=1) - gravity
        off[:, 0] = left + self._turned(made)[:, 0]
        return off

    def _made(self, along: Array, known: dict[str, columns.Columns]) -> Array:
        """What bias, scale factor and the rest make of the outputs, (m, 6)."""
        every = [c for table in known.values() for c in table]
        weight = np.sqrt(self.parts.count)
        design = np.column_stack([self._turned(c)[:, 0] for c in every])
        found = np.linalg.lstsq(design * weight[:, None], along * weight, 1e-6)[0]
        made: Array = np.einsum("p,pmc->mc", found, np.array(every))
        return made

    def _weigh(
        self, lies: Array, known: dict[str, columns.Columns], noise: Array
    ) -> None:
        """Factor of each output's covariance; what all else does to the rows."""
        every = [c for table in known.values() for c in table]
        design = np.array([self._turned(c) for c in every])
        lie = [] if self._oriented else [1, 2]
        self._factor: dict[int, Array] = {}
        self._scatter: dict[int, Scatter] = {}
        for c in self._seen:
            free = self._held.astype(float) if c in lie else self._held[:, :0]
            own = np.hstack([design[:, :, c].T, free])
            self._scatter[c] = scatter(lies[:, c], own, self.parts, float(noise[c]))
            self._factor[c] = cholesky(self._scatter[c].cov, lower=True)
        self._known = {
            name: [self._rows(self._turned(c)) for c in table]
            for name, table in known.items()
        }
        for c in lie:
            for window in self._held.T.astype(float):
                self._known[ALWAYS].append(self._rows(columns.at_channel(window, c)))

    def _rows(self, turned: Array) -> Array:
        """Outputs of the parts as rows of unit variance, one after another."""
        some = [
            solve_triangular(f, turned[:, c], lower=True)
            for c, f in self._factor.items()
        ]
        return np.concatenate(some)

    def sees(self, effect: str, change: Array) -> Seen:
        """How well it is known how much of a change (n, 6) is there."""
        rows = self._rows(self._turned(np.nan_to_num(self.parts.of(change))))
        each = self._known.items()
        others = [row for name, some in each if name != effect for row in some]
        reached, _ = span(np.column_stack(others))
        left = rows - reached @ (reached.T @ rows)
        size, whole = float(np.linalg.norm(left)), float(np.linalg.norm(rows))
        if size <= UNSEEN * whole:
            return Seen(np.inf, 0.0)
        return Seen(1 / size, self._freedom(left / size))

    def _freedom(self, unit: Array) -> float:
        """Degrees of freedom of the variance of a sum of rows, of unit variance."""
        total = 0.0
        for part, c in zip(np.split(unit, len(self._seen)), self._seen, strict=True):
            found = self._scatter[c]
            weights = solve_triangular(self._factor[c], part, lower=True, trans=1)
            white = float((weights**2 * found.white).sum())
            rest = max(float(part @ part) - white, 0.0)
            total += white**2 / found.white_dof + rest**2 / found.other_dof
        return 1 / max(total, 1e-9)
