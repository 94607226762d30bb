"""Effects that only turns show, fitted to all turns at once.

The windows' fit stands in as the prior of biases and scale factors, so that windows and
turns together are one fit. White noise of the gyroscopes of density N makes phi_T a sum
with covariance N^2 T, and phi_k - u phi_T on the way a bridge with

    N^2 (min(t, t') - u' t - u t' + u u' T)

for which the accelerometers' rows are whitened. Biases that wander from one window to
the next may be off by as much on the way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.attitude import geometry
from fieldcal.diagnosis.fit import DETERMINED, Bench, Fit
from fieldcal.diagnosis.model import State, Term
from fieldcal.diagnosis.step import ahead
from fieldcal.diagnosis.turns import NOTHING, Turn, Undo, errors_of
from fieldcal.diagnosis.whiten import factor
from fieldcal.effects import Motion, Sensor, catalogue, columns
from fieldcal.samples import CHANNELS, Array

CANDIDATES = ("gyro_cross_coupling", "gyro_scale", "lever_arm", "time_delay")

ON_THE_WAY = ("lever_arm", "time_delay")
"""Seen by the accelerometers on the way, if nothing else shakes them there."""

WIDE = 20.0
"""Priors of what is reported, in typical sizes."""

STEP = 1.0
"""Of the differences that the design is made of, in standard deviations."""

SHAPE_STEP = 0.1
"""And for a time constant at most this part of it."""

PART = 0.1
"""Of what the most affected channel shows, from which another one shows it too."""

STEADY = 3.0
"""Squares a row that the accelerometers may leave on the way and still be used."""


@dataclass(frozen=True, slots=True)
class Turning:
    """A fit to the turns.

    Attributes
    ----------
    terms : effects in it
    names : of the columns; the windows' biases and scale factors first
    values, covariance : of the columns; the windows' ones as changes
    determined : columns that the turns say something about
    white : (r,) residual, whitened, of the rows used
    rows : rows used, of all
    chi2, dof : of the turns' rows
    score : ln Z but for a constant

    """

    terms: tuple[Term, ...]
    names: tuple[str, ...]
    values: Array
    covariance: Array
    determined: NDArray[np.bool_]
    white: Array
    rows: NDArray[np.bool_]
    chi2: float
    dof: int
    score: float

    @property
    def steady(self) -> bool:
        """Whether it leaves no more than a device that is only turned does.

        A hand that carries the device shakes it as well; then the accelerometers on the
        way say nothing.
        """
        return self.chi2 <= STEADY * max(self.dof, 1)

    @property
    def ids(self) -> tuple[str, ...]:
        """Effects in it."""
        return tuple(t.effect.id for t in self.terms)


class Turntable:
    """All turns of a recording, whitened, ready to be fitted.

    Parameters
    ----------
    bench, fit : the windows' rows, and a model of them near its optimum
    made : the turns
    interval : s between samples
    undo : what the turns were rid of

    Attributes
    ----------
    turn : (r,) number of the turn of each row
    closing : (r,) rows that are closures

    """

    def __init__(
        self,
        bench: Bench,
        fit: Fit,
        made: Sequence[Turn],
        interval: float,
        undo: Undo = NOTHING,
    ) -> None:
        self._bench, self._fit, self._made = bench, fit, list(made)
        self._density = bench.rows.noise[3:] * np.sqrt(interval)
        self.pool = tuple(self._pool())
        self._undone = undo
        self._ahead = ahead(bench, fit)
        blocks = [self._block(t) for t in made]
        self._z = np.concatenate([z for z, _, _ in blocks])
        self._a = np.vstack([a for _, a, _ in blocks])
        self.closing = np.concatenate([c for _, _, c in blocks])
        self.turn = np.repeat(np.arange(len(made)), [len(z) for z, _, _ in blocks])
        self._rank = sum(int(round(np.trace(t.across))) for t in made)

    def _pool(self) -> Iterator[Term]:
        for name in CANDIDATES:
            if name != "gyro_scale" or not self._bench.rated:
                effect = catalogue()[name]
                yield Term(effect, tuple(range(len(effect.params))))

    def seen(self, closures: bool) -> NDArray[np.bool_]:
        """The rows that are used: the closures alone, or all."""
        return self.closing if closures else np.ones(len(self._z), dtype=bool)

    def better(self, terms: tuple[Term, ...], price: float, closures: bool) -> Turning:
        """The fit with the terms, or with the one more that is worth its price.

        `closures` leaves out what the accelerometers see on the way.
        """
        rows = self.seen(closures)
        best = self.fit(terms, rows)
        objective = best.score
        for term in self.pool:
            if term in terms or (closures and term.effect.id in ON_THE_WAY):
                continue
            tried = self.fit((*terms, term), rows)
            if tried.score - price > objective:
                best, objective = tried, tried.score - price
        return best

    def fit(
        self, terms: Sequence[Term], rows: NDArray[np.bool_], relax: float = 1.0
    ) -> Turning:
        """Fit some of the pool's effects to some of the rows."""
        width, columns = len(self._ahead), self._columns(terms)
        names = list(self._fit.names)
        sizes: list[float] = []
        for term in (t for t in self.pool if t in terms):
            names += [f"{term.effect.id}.{n}" for n in term.names]
            sizes += list(relax * term.prior)
        a, z = self._a[rows][:, columns], self._z[rows] - self._kept_out(terms, rows)
        precision = np.zeros((len(columns), len(columns)))
        precision[:width, :width] = np.linalg.inv(self._fit.covariance)
        precision[range(width, len(columns)), range(width, len(columns))] = (
            1 / np.array(sizes) ** 2
        )
        normal = a.T @ a + precision
        undone = [-self._undone.of(n) for n in names[width:]]
        centre = np.concatenate([self._ahead, undone])
        values = np.linalg.solve(normal, a.T @ z + precision @ centre)
        off = values - centre
        white = z - a @ values
        covariance = np.linalg.inv(normal)
        prior = np.concatenate([np.full(width, np.inf), sizes])
        determined = np.diag(covariance) < DETERMINED * prior**2
        chi2 = float(white @ white)
        missing = int(self.closing[rows].sum()) - self._rank
        dof = int(rows.sum()) - missing - int(determined[width:].sum())
        score = -0.5 * (chi2 + float(off @ precision @ off))
        score -= 0.5 * float(
            np.linalg.slogdet(normal)[1] - np.linalg.slogdet(precision)[1]
        )
        return Turning(
            tuple(terms), tuple(names), values, covariance, determined, white, rows,
            chi2, dof, score,
        )  # fmt: skip

    def left_out(self, terms: Sequence[Term], rows: NDArray[np.bool_]) -> float:
        """Rms of each turn predicted from the others, in standard deviations."""
        squares, count = 0.0, 0
        columns = self._columns(terms)
        for i in np.unique(self.turn):
            rest, here = rows & (self.turn != i), rows & (self.turn == i)
            seen = self.fit(terms, rest, WIDE)
            if rest.any():
                off = self._z[here] - self._kept_out(terms, here)
                off = off - self._a[here][:, columns] @ seen.values
                squares, count = squares + float(off @ off), count + len(off)
        return float(np.sqrt(squares / max(count, 1)))

    def _columns(self, terms: Sequence[Term]) -> list[int]:
        """Columns of the windows' parameters and of some of the pool's effects."""
        at = len(self._ahead)
        out = list(range(at))
        for term in self.pool:
            if term in terms:
                out += range(at, at + len(term.columns))
            at += len(term.columns)
        return out

    def _kept_out(self, terms: Sequence[Term], rows: NDArray[np.bool_]) -> Array:
        """What the turns were rid of that is not in the model, put back again."""
        at, total = len(self._ahead), np.zeros(int(rows.sum()))
        for term in self.pool:
            width = len(term.columns)
            if term not in terms:
                names = [f"{term.effect.id}.{n}" for n in term.names]
                back = np.array([-self._undone.of(n) for n in names])
                total = total + self._a[rows][:, at : at + width] @ back
            at += width
        return total

    def shown(
        self, term: Term, found: Turning, some: NDArray[np.intp]
    ) -> dict[str, float]:
        """What an effect does in some turns, by channel: rms m/s^2, or rad turned.

        An effect on the gyroscopes shows in the angle turned, or, if it leaves that
        alone, in the forces on the way; it is given for the gyroscopes then, rad/s.
        """
        out: dict[str, float] = {}
        gyro = term.effect.id != "lever_arm"
        for i in some:
            turn = self._made[i]
            if not isinstance(term.effect, Motion | Sensor):
                continue
            design = columns(term.effect, turn.x, scale=self._bench.scale)
            values = [found.values[found.names.index(f"{term.effect.id}.{n}")]
                      for n in term.names]  # fmt: skip
            course = design @ np.array(values)
            for c in range(3, 6) if gyro else range(3):
                size = float(np.sqrt(np.mean(course[:, c] ** 2)))
                out[CHANNELS[c]] = max(out.get(CHANNELS[c], 0.0), size)
        largest = max(out.values(), default=0.0)
        return {name: size for name, size in out.items() if size > PART * largest}

    def undo(self, found: Turning) -> Undo:
        """What the gyroscopes have to be rid of, as far as it was found."""
        matrix, delay = np.zeros((3, 3)), 0.0
        for name, value in zip(found.names, found.values, strict=True):
            group, _, part = name.partition(".")
            if group == "gyro_scale":
                matrix[int(part[1]) - 1, int(part[1]) - 1] = value
            elif group == "gyro_cross_coupling":
                matrix[int(part[1]) - 1, int(part[2]) - 1] = value
            elif group == "time_delay":
                delay = float(value)
        return Undo(matrix, delay)

    def _block(self, turn: Turn) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Whitened observations, design and which rows are closures, of one turn."""
        state = self._fit.state
        output = state.output(turn.x)
        off = (errors_of(self._fit, turn.x) - turn.rid) / state.scale[3:]
        phi, end = turn.carried(off[:, :, None])
        seen = turn.means(output[:, :3])
        seen = seen + turn.means(turn.swung(phi)[:, :, 0]) * state.scale[:3]
        design, moved = self._design(turn)
        path, close = turn.carried(design[:, 3:] / state.scale[3:, None])
        swung = turn.swung(path) * state.scale[:3, None]
        on_way = turn.means(design[:, :3] + swung)
        length = turn.t[-1] - turn.t[0]
        loose = self._loose(turn)[3:] / np.abs(state.scale[3:])
        spread = np.hypot(self._density * np.sqrt(length), loose * length)
        across = turn.across / np.hypot(spread, turn.blur)[:, None]
        whiten = self._whitener(turn)
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
        out = np.zeros((len(turn.x), 6, len(self._fit.names)))
        moved = np.zeros((3, len(self._fit.names)))
        shapes = {f"{t.effect.id}.{s}" for t in self._fit.terms for s in t.shape}
        for j, (name, sigma) in enumerate(
            zip(self._fit.names, self._fit.sigma, strict=True)
        ):
            step = STEP * max(float(sigma), 1e-9)
            if name in shapes:  # a time constant stays above zero
                step = min(step, SHAPE_STEP * abs(float(self._fit.values[j])))
            up, down = (
                self._there(turn, self._bench.shifted(self._fit, j, sign * step))
                for sign in (1, -1)
            )
            out[:, :, j] = (up[0] - down[0]) / (2 * step)
            moved[:, j] = (up[1] - down[1]) / (2 * step)
        more = [
            columns(t.effect, turn.x, scale=self._bench.scale)
            for t in self.pool
            if isinstance(t.effect, Motion | Sensor)
        ]
        width = sum(m.shape[2] for m in more)
        still = np.zeros((3, width))
        return np.concatenate([out, *more], axis=2), np.hstack([moved, still])

    def _there(self, turn: Turn, state: State) -> tuple[Array, Array]:
        """Outputs at the edges and the closure, with the windows' model at a state."""
        x = state.experienced(self._bench.rows.x)
        f, closure, _ = geometry(x, turn.positions, turn.attitude, turn.done)
        return state.output(replace(turn.x, f=f)), closure

    def _loose(self, turn: Turn) -> Array:
        """By how much each bias may have changed from one window to the next, (6,)."""
        x, out = self._bench.rows.x, np.zeros(6)
        p, q = turn.positions
        ends = [int(np.flatnonzero(x.position == p)[-1])]
        ends.append(int(np.flatnonzero(x.position == q)[0]))
        for part in self._bench.errors.parts:
            f = factor(part.kind, x, part.channel)[ends]
            out[part.channel] += part.size**2 * float(((f[1] - f[0]) ** 2).sum())
        return np.sqrt(out)

    def _whitener(self, turn: Turn) -> Array:
        """L^-1 of the accelerometers' rows on the way, (3 k, 3 k)."""
        middle = (turn.t[turn.cut[1:]] + turn.t[turn.cut[:-1]]) / 2 - turn.t[0]
        done = np.interp(middle, turn.t - turn.t[0], turn.done)
        length = turn.t[-1] - turn.t[0]
        bridge = np.minimum.outer(middle, middle) + np.outer(done, done) * length
        bridge -= np.outer(middle, done) + np.outer(done, middle)
        cov = np.diag((turn.sd**2).ravel())
        same = np.equal.outer(*[np.tile(np.arange(3), len(turn.sd))] * 2)
        cov += same * np.tile(self._loose(turn)[:3] ** 2, len(turn.sd))
        for axis in range(3):
            along = np.broadcast_to(np.eye(3)[axis][:, None], (len(turn.t), 3, 1))
            arm = turn.means(turn.swung(along)[:, :, 0]) * self._fit.state.scale[:3]
            arm = arm * self._density[axis]
            blocks = bridge[:, None, :, None] * np.multiply.outer(arm, arm)
            cov += blocks.reshape(cov.shape)
        return np.linalg.inv(np.linalg.cholesky(cov))
