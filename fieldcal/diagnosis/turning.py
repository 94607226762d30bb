"""Effects that only turns show, fitted to all turns at once.

The windows' fit stands in as the prior of biases and scale factors, so that windows and
turns together are one fit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.bench import DETERMINED, Bench
from fieldcal.diagnosis.course import NOTHING, Undo
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.step import ahead
from fieldcal.diagnosis.turn_rows import TurnRows
from fieldcal.diagnosis.turns import Turn
from fieldcal.effects import Motion, Sensor, catalogue, columns
from fieldcal.samples import CHANNELS, Array

CANDIDATES = ("gyro_cross_coupling", "gyro_scale", "lever_arm", "time_delay")

SQUARE = 0.02
"""By how much triads on one board are turned against each other, rad."""

ON_THE_WAY = ("lever_arm", "time_delay")
"""Seen by the accelerometers on the way, if nothing else shakes them there."""

WIDE = 20.0
"""Priors of what is reported, in typical sizes."""

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
        self.pool = tuple(self._pool())
        self._undone = undo
        self._ahead = ahead(bench, fit)
        density = bench.rows.noise[3:] * np.sqrt(interval)
        rows = TurnRows(bench, fit, self.pool, density)
        blocks = [rows.of(t) for t in made]
        self._z = np.concatenate([z for z, _, _ in blocks])
        self._a = np.vstack([a for _, a, _ in blocks])
        self._names, self._known = list(fit.names), np.linalg.inv(fit.covariance)
        coupled = any(t.effect.id == "cross_coupling" for t in fit.terms)
        if bench.free and coupled and self.pool[0].effect.id == CANDIDATES[0]:
            self._turn_triads(len(fit.names))
        self.closing = np.concatenate([c for _, _, c in blocks])
        self.turn = np.repeat(np.arange(len(made)), [len(z) for z, _, _ in blocks])
        self._rank = sum(int(round(np.trace(t.across))) for t in made)

    def _turn_triads(self, count: int) -> None:
        """Let the triads be turned against each other, at no cost.

        Where orientations are not known, cross-coupling of the accelerometers is known
        but for a turn of their axes; against the gyroscopes it shows.
        """
        names = self.pool[0].names  # of gyro_cross_coupling, which turns axes as well
        turned = np.zeros((len(names), 3))
        for axis, (one, other) in enumerate(
            (("s32", "s23"), ("s13", "s31"), ("s21", "s12"))
        ):
            turned[names.index(one), axis], turned[names.index(other), axis] = 1.0, -1.0
        new = self._a[:, count : count + len(names)] @ turned
        self._a = np.hstack([self._a[:, :count], new, self._a[:, count:]])
        self._ahead = np.concatenate([self._ahead, np.zeros(3)])
        self._names += [f"triads.{axis}" for axis in "xyz"]
        whole = np.eye(count + 3) / SQUARE**2
        whole[:count, :count] = self._known
        self._known = whole

    def _pool(self) -> Iterator[Term]:
        told = {t.effect.id for t in self._fit.terms if t.columns}
        told |= {"gyro_scale"} if self._bench.rated else set()
        for name in CANDIDATES:
            if name not in told:  # by windows on a table
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
        names = list(self._names)
        sizes: list[float] = []
        for term in (t for t in self.pool if t in terms):
            names += [f"{term.effect.id}.{n}" for n in term.names]
            sizes += list(relax * term.prior)
        a, z = self._a[rows][:, columns], self._z[rows] - self._kept_out(terms, rows)
        precision = np.zeros((len(columns), len(columns)))
        precision[:width, :width] = self._known
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
