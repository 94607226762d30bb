"""What one turn says: rows of the accelerometers on the way and of its closure.

White noise of the gyroscopes of density N makes phi_T a sum with covariance N^2 T, and
phi_k - u phi_T on the way a bridge with

    N^2 (min(t, t') - u' t - u t' + u u' T)

for which the accelerometers' rows are whitened. Biases that wander from one window to
the next may be off by as much on the way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.attitude import geometry
from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.dwell import ARRIVAL_S
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.model import State, Term
from fieldcal.diagnosis.turns import Turn, errors_of
from fieldcal.diagnosis.whiten import factor
from fieldcal.effects import Motion, Sensor, columns
from fieldcal.samples import Array

STEP = 1.0
"""Of the differences that the design is made of, in standard deviations."""

BUILT_UP, AFTERWARDS, BUILDS_S = 0.5, 0.15, 2.0
"""How far what settles may be off on the way and at its end, in its size, and how
smoothly, s."""

SHAPE_STEP = 0.1
"""And for a time constant at most this part of it."""


@dataclass(frozen=True, slots=True)
class TurnRows:
    """What makes rows of turns.

    Attributes
    ----------
    bench, fit : the windows' rows, and their model
    pool : effects that have columns besides
    density : (3,) white noise of the gyroscopes, outputs' unit times sqrt(s)

    """

    bench: Bench
    fit: Fit
    pool: tuple[Term, ...]
    density: Array

    def of(self, turn: Turn) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Whitened observations, design and which rows are closures, of one turn."""
        state = self.fit.state
        output = state.output(turn.x)
        off = (errors_of(self.fit, turn.x) - turn.rid) / state.scale[3:]
        phi, end = turn.carried(off[:, :, None])
        seen = turn.means(output[:, :3])
        seen = seen + turn.means(turn.swung(phi)[:, :, 0]) * state.scale[:3]
        design, moved = self._design(turn)
        path, close = turn.carried(design[:, 3:] / state.scale[3:, None])
        swung = turn.swung(path) * state.scale[:3, None]
        on_way = turn.means(design[:, :3] + swung)
        length = turn.t[-1] - turn.t[0]
        loose = self._loose(turn)[3:] / np.abs(state.scale[3:])
        settling = self._settling(turn)
        density = np.hypot(self.density, BUILT_UP * np.sqrt(length) * settling[3:])
        spread = np.hypot(density * np.sqrt(length), loose * length)
        across = turn.across / np.hypot(spread, turn.blur)[:, None]
        whiten = self._whitener(turn, settling[:3], density)
        z = np.concatenate(
            [across @ (turn.closure - end[:, 0]), whiten @ (turn.acc - seen).ravel()]
        )
        width = design.shape[2]
        a = np.vstack([across @ (close - moved), whiten @ on_way.reshape(-1, width)])
        return z, a, np.arange(len(z)) < 3

    def _design(self, turn: Turn) -> tuple[Array, Array]:
        """Outputs at the edges and closure by the windows' columns and the pool's.

        Returns
        -------
        outputs : (m + 1, 6, k)
        closure : (3, k)

        """
        out = np.zeros((len(turn.x), 6, len(self.fit.names)))
        moved = np.zeros((3, len(self.fit.names)))
        shapes = {f"{t.effect.id}.{s}" for t in self.fit.terms for s in t.shape}
        for j, (name, sigma) in enumerate(
            zip(self.fit.names, self.fit.sigma, strict=True)
        ):
            step = STEP * max(float(sigma), 1e-9)
            if name in shapes:  # a time constant stays above zero
                step = min(step, SHAPE_STEP * abs(float(self.fit.values[j])))
            up, down = (
                self._there(turn, self.bench.shifted(self.fit, j, sign * step))
                for sign in (1, -1)
            )
            out[:, :, j] = (up[0] - down[0]) / (2 * step)
            moved[:, j] = (up[1] - down[1]) / (2 * step)
        more = [
            columns(t.effect, turn.x, scale=self.bench.scale)
            for t in self.pool
            if isinstance(t.effect, Motion | Sensor)
        ]
        width = sum(m.shape[2] for m in more)
        still = np.zeros((3, width))
        return np.concatenate([out, *more], axis=2), np.hstack([moved, still])

    def _there(self, turn: Turn, state: State) -> tuple[Array, Array]:
        """Outputs at the edges and the closure, with the windows' model at a state."""
        x = state.experienced(self.bench.rows.x)
        f, closure, _ = geometry(x, turn.positions, turn.attitude, turn.done)
        return state.output(replace(turn.x, f=f)), closure

    def _loose(self, turn: Turn) -> Array:
        """By how much each bias may have changed from one window to the next, (6,)."""
        x, out = self.bench.rows.x, np.zeros(6)
        p, q = turn.positions
        ends = [int(np.flatnonzero(x.position == p)[-1])]
        ends.append(int(np.flatnonzero(x.position == q)[0]))
        for part in self.bench.errors.parts:
            f = factor(part.kind, x, part.channel)[ends]
            out[part.channel] += part.size**2 * float(((f[1] - f[0]) ** 2).sum())
        return np.sqrt(out)

    def _settling(self, turn: Turn) -> Array:
        """What begins to fade at the end of a turn, by the windows' model, (6,)."""
        never, then = (
            self.fit.state.output(
                replace(turn.x, since_turn=np.full(len(turn.t), since))
            )[-1]
            for since in (np.inf, 0.0)
        )
        sizes: Array = then - never
        return sizes

    def _built_up(self, turn: Turn, middle: Array) -> Array:
        """Covariance between pieces of what settling adds to each, for a size of one.

        How it builds up in a turn is not known: smoothly, somewhere between none and
        all of it; afterwards it fades from an instant that is known so well.
        """
        rest = np.isfinite(turn.x.since_turn)
        k = int(np.argmax(rest)) if rest.any() else len(turn.t) - 1
        arrived = turn.t[k] - (turn.x.since_turn[k] if rest.any() else 0.0) - turn.t[0]
        unsure = np.where(middle < arrived + ARRIVAL_S, BUILT_UP, AFTERWARDS)
        apart = np.subtract.outer(middle, middle) / BUILDS_S
        out: Array = np.outer(unsure, unsure) * np.exp(-(apart**2) / 2)
        return out

    def _whitener(self, turn: Turn, settling: Array, density: Array) -> Array:
        """L^-1 of the accelerometers' rows on the way, (3 k, 3 k).

        `settling` (3,) is what they settle by, `density` (3,) the gyroscopes' noise.
        """
        middle = (turn.t[turn.cut[1:]] + turn.t[turn.cut[:-1]]) / 2 - turn.t[0]
        done = np.interp(middle, turn.t - turn.t[0], turn.done)
        length = turn.t[-1] - turn.t[0]
        bridge = np.minimum.outer(middle, middle) + np.outer(done, done) * length
        bridge -= np.outer(middle, done) + np.outer(done, middle)
        cov = np.diag((turn.sd**2).ravel())
        cov += np.kron(self._built_up(turn, middle), np.outer(settling, settling))
        same = np.equal.outer(*[np.tile(np.arange(3), len(turn.sd))] * 2)
        cov += same * np.tile(self._loose(turn)[:3] ** 2, len(turn.sd))
        for axis in range(3):
            along = np.broadcast_to(np.eye(3)[axis][:, None], (len(turn.t), 3, 1))
            arm = turn.means(turn.swung(along)[:, :, 0]) * self.fit.state.scale[:3]
            arm = arm * density[axis]
            blocks = bridge[:, None, :, None] * np.multiply.outer(arm, arm)
            cov += blocks.reshape(cov.shape)
        return np.linalg.inv(np.linalg.cholesky(cov))
