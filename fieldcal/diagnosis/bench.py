"""One fit of bias, scale factor and any set of effects, with one covariance.

Gauss-Newton on

    S(p) = |L^-1 (y - h(p))|^2 + sum_j (p_j - p0_j)^2 / s_j^2

with h of `model` and L of `whiten`. The second sum is the prior: the typical size for
what an effect has, so wide for bias and scale factor that it only decides what no row
says anything about. The evidence of a set of effects is, in Laplace's approximation,

    ln Z = -S(p^)/2 - ln det(A)/2 - sum_j ln s_j,    A = J^T J + diag(1/s^2)

which pays for every parameter as much as the data narrow it down (Occam's factor).
Source: D. MacKay, Information Theory, Inference, and Learning Algorithms, chapter 28.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.layout import Layout
from fieldcal.diagnosis.model import State, Term
from fieldcal.diagnosis.reduce import Rows
from fieldcal.diagnosis.whiten import Errors, Whitener
from fieldcal.effects import Experience, Motion, Sensor
from fieldcal.samples import Array

ITERATIONS = 15

CONVERGED = 1e-2
"""Step, in standard deviations, from which the iteration has converged."""

BIAS_G, SCALE = 10.0, 3.0
"""Prior of biases, in gravities (accelerometers) and rad/s, and of scale factors."""

TURN = 1.0
"""Prior of the turns of unknown orientations, rad."""

OUTPUTS = np.arange(6)

DETERMINED = 0.1
"""A parameter is determined when its variance is less than this part of the prior's."""


class Bench:
    """Rows, and what all models of them have in common.

    Parameters
    ----------
    rows : the block means
    bias, scale : (6,) the calibration that the simulation starts from
    errors : what the rows' errors are made of
    relax : how much wider than typical the effects' priors are

    Attributes
    ----------
    leeway : (p,) rad, prior of each position's own small turns: none where its angles
        are known for sure

    """

    def __init__(
        self,
        rows: Rows,
        bias: Array,
        scale: Array,
        errors: Errors | None = None,
        relax: float = 1.0,
    ) -> None:
        self.rows, self.bias, self.scale = rows, bias, scale
        self.errors = errors or Errors()
        self.relax = relax
        self.whiten = Whitener(rows, self.errors)
        self._last: tuple[object, Experience] | None = None
        x = rows.x
        self.places = int(x.position.max()) + 1
        self.windows = len(np.unique(x.position))
        self.free = bool((~x.oriented).any())
        known = np.ones(self.places, dtype=bool)
        known[x.position[~x.oriented]] = False
        known[list(self.errors.loose)] = False
        self.leeway = np.where(known, self.errors.setting, TURN)
        self.rated = bool(x.rate.any())
        used: NDArray[np.bool_] = np.any(rows.used, axis=0)
        scaled = used & np.array([True] * 3 + [self.rated] * 3)
        base = np.concatenate([used, scaled])
        self._layout = Layout(base, np.flatnonzero(self.leeway))

    def but(self, **changes: object) -> Bench:
        """The same bench with something changed: rows, errors, relax."""
        now = {"rows": self.rows, "errors": self.errors, "relax": self.relax}
        new: dict[str, object] = {**now, **changes}
        return Bench(bias=self.bias, scale=self.scale, **new)  # type: ignore[arg-type]

    def fit(
        self, terms: Sequence[Term], near: Fit | None = None, *, rough: bool = False
    ) -> Fit:
        """Fit bias, scale factor and the effects.

        `near` is a fit to start from: of whatever terms the two have in common. A
        `rough` fit ends where the outputs are as the step before foretold, with the
        derivatives of that: a hundredth of a standard deviation may be amiss, for the
        half of the time.
        """
        state = self._start(tuple(terms), near)
        names, prior, centre, shape = self.about(state)
        p = self._layout.pack(state)
        for _ in range(ITERATIONS):
            prediction, columns = self._linearise(state)
            white = self.whiten(self.rows.y - prediction)
            jacobian = self.whiten(columns)
            flat = jacobian.reshape(-1, len(names))
            a = flat.T @ flat + np.diag(1 / prior**2)
            pull = np.where(shape, 0.0, (p - centre) / prior**2)
            step = np.linalg.solve(a, flat.T @ white.ravel() - pull)
            step[shape] = np.clip(step[shape], -0.5 * p[shape], p[shape])
            p = p + step
            state = self._layout.unpack(state, p)
            foreseen = prediction + columns @ step
            if step @ a @ step < CONVERGED**2:  # so small that it is linear
                seen = foreseen, columns, jacobian
                return self._result(state, names, prior, centre, shape, seen)
            if rough and not shape.any():
                found = state.output(self._experienced(state))
                if (self.whiten(found - foreseen) ** 2).sum() < CONVERGED**2:
                    seen = found, columns, jacobian
                    return self._result(state, names, prior, centre, shape, seen)
        return self._result(state, names, prior, centre, shape)

    def _result(
        self,
        state: State,
        names: tuple[str, ...],
        prior: Array,
        centre: Array,
        shape: NDArray[np.bool_],
        seen: tuple[Array, Array, Array] | None = None,
    ) -> Fit:
        """The fit at a state; `seen`: prediction, derivative, the same whitened."""
        p = self._layout.pack(state)
        if seen is None:
            prediction, columns = self._linearise(state)
            seen = prediction, columns, self.whiten(columns)
        prediction, columns, jacobian = seen
        residual = np.where(self.rows.used, self.rows.y - prediction, np.nan)
        white = self.whiten(self.rows.y - prediction)
        flat = jacobian.reshape(-1, len(names))
        a = flat.T @ flat + np.diag(1 / prior**2)
        covariance = np.linalg.inv(a)
        covariance = (covariance + covariance.T) / 2
        determined = np.diag(covariance) < DETERMINED * prior**2
        aside = np.repeat(self._aside < TURN, 2)
        scatter = np.pad(aside, (len(names) - len(aside), 0))
        pull = np.where(shape, 0.0, (p - centre) / prior) ** 2
        chi2 = float((white**2).sum() + pull[scatter].sum())
        dof = int(self.rows.used.sum() - (determined & ~scatter).sum())
        _, log_det = np.linalg.slogdet(a)
        score = -0.5 * float((white**2).sum() + pull.sum())
        score -= 0.5 * float(log_det) + float(np.log(prior).sum())
        score -= 0.5 * self.whiten.log_det
        return Fit(
            state,
            names,
            p,
            covariance,
            determined,
            residual,
            white,
            jacobian,
            columns,
            chi2,
            dof,
            score,
        )

    def at(self, fit: Fit, values: Array) -> Fit:
        """The same model where its columns have other values, (k,)."""
        state = self._layout.unpack(fit.state, values)
        return self._result(state, *self.about(state))

    def about(
        self, state: State
    ) -> tuple[tuple[str, ...], Array, Array, NDArray[np.bool_]]:
        """Names of the columns, their priors, and which are shapes."""
        names, terms = self._layout.names(state.terms), state.terms
        centre = self._layout.pack(self._start(terms, None))
        shape = np.array([n in _shape_names(terms) for n in names], dtype=bool)
        return names, self._prior(state), centre, shape

    def shifted(self, fit: Fit, column: int, step: float) -> State:
        """Where a fit would stand with one column changed."""
        p = fit.values.copy()
        p[column] += step
        return self._layout.unpack(fit.state, p)

    @property
    def _aside(self) -> Array:
        """Priors of the turns that are in the fit, one for each position."""
        return self.leeway[self._layout.loose]

    def prior_of(self, term: Term) -> Array:
        """Prior of a term's values, in outputs' units."""
        return self.relax * term.prior * self._unit(term)

    def _start(self, terms: tuple[Term, ...], near: Fit | None) -> State:
        aside: Array = np.zeros((self.places if self.leeway.any() else 1, 2))
        values = [np.zeros(len(t.names)) for t in terms]
        for t, v in zip(terms, values, strict=True):
            v[len(t.columns) :] = list(t.shape.values()) if t.free_shape else []
        if near is None:
            return State(self.bias, self.scale, terms, tuple(values), aside)
        old = dict(zip(near.names, near.values, strict=True))
        for t, v in zip(terms, values, strict=True):
            for j, name in enumerate(t.names):
                v[j] = old.get(f"{t.effect.id}.{name}", v[j])
        if near.state.aside.shape == aside.shape:
            aside = near.state.aside
        return State(near.state.bias, near.state.scale, terms, tuple(values), aside)

    def _prior(self, state: State) -> Array:
        gravity, acc = self.rows.x.gravity, np.abs(self.scale[:3])
        bias = np.concatenate([BIAS_G * gravity * acc, BIAS_G * np.abs(self.scale[3:])])
        base = np.concatenate([bias, SCALE * np.abs(self.scale)])[self._layout.base]
        sizes: list[Array] = [self.prior_of(t) for t in state.terms]
        return np.concatenate([base, *sizes, np.repeat(self._aside, 2)])

    def _unit(self, term: Term) -> Array:
        """Outputs per SI unit, for effects that add to outputs in counts or volts."""
        out = np.ones(len(term.names))
        if isinstance(term.effect, Sensor):
            gyro = self.scale[3:].mean() if term.gyro else self.scale[:3].mean()
            out[: len(term.columns)] = abs(gyro)
        return out

    def _linearise(self, state: State) -> tuple[Array, Array]:
        """Prediction (n, 6) and its derivative by every column, (n, 6, k)."""
        x = self._experienced(state)
        both = np.zeros((len(x), 6, 12))
        both[:, OUTPUTS, OUTPUTS] = 1.0
        both[:, OUTPUTS, OUTPUTS + 6] = np.hstack([x.f, x.w])
        parts: list[Array] = [both[:, :, self._layout.base]]
        for i, term in enumerate(state.terms):
            parts.append(self._of_term(state, x, i, term))
        if self.leeway.any():
            aside = self.aside(state).reshape(len(x), 6, -1, 2)
            parts.append(aside[:, :, self._layout.loose].reshape(len(x), 6, -1))
        return state.output(x), np.concatenate(parts, axis=2)

    def _experienced(self, state: State) -> Experience:
        """What the motion effects make of the rows; once for the same numbers."""
        moved = [
            (t.effect.id, t.start, t.columns, v.tobytes())
            for t, v in zip(state.terms, state.values, strict=True)
            if isinstance(t.effect, Motion)
        ]
        key = (tuple(moved), state.aside.tobytes())
        if self._last is None or self._last[0] != key:
            self._last = (key, state.experienced(self.rows.x))
        return self._last[1]

    def _of_term(self, state: State, x: Experience, i: int, term: Term) -> Array:
        out = np.zeros((len(x), 6, len(term.names)))
        k = len(term.columns)
        numeric = range(len(term.names))
        if isinstance(term.effect, Sensor):
            shape = term.shaped(state.values[i])
            out[:, :, :k] = term.effect.design(x, shape)[:, :, list(term.columns)]
            numeric = range(k, len(term.names))
        steps = 1e-3 * term.prior
        steps[k:] = 1e-3 * np.abs(state.values[i][k:])
        for j in numeric:
            values = [list(state.values), list(state.values)]
            for side, sign in zip(values, (1, -1), strict=True):
                side[i] = side[i].copy()
                side[i][j] += sign * steps[j]
            up, down = (replace(state, values=tuple(v)) for v in values)
            if isinstance(term.effect, Motion):
                difference = up.predict(self.rows.x) - down.predict(self.rows.x)
            else:
                difference = up.output(x) - down.output(x)
            out[:, :, j] = difference / (2 * steps[j])
        return out

    def aside(self, state: State) -> Array:
        """Derivative of the rows by the small turns of each position, (n, 6, 2 p)."""
        x = self.rows.x
        out = np.zeros((len(x), 6, self.places, 2))
        state = replace(state, aside=np.resize(state.aside, (self.places, 2)))
        for joint in range(2):
            step = np.zeros(2)
            step[joint] = 1e-5
            up = replace(state, aside=state.aside + step).predict(x)
            down = replace(state, aside=state.aside - step).predict(x)
            out[np.arange(len(x)), :, x.position, joint] = (up - down) / 2e-5
        return out.reshape(len(x), 6, -1)


def _shape_names(terms: Sequence[Term]) -> set[str]:
    return {f"{t.effect.id}.{s}" for t in terms if t.free_shape for s in t.shape}
