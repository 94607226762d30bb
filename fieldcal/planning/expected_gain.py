"""Expected information gain of a further position, before it is recorded.

The requested quantities q are each parameter over its allowed uncertainty, and for each
cause whether it is present (0 or 2, so that even odds have a variance of 1). An
explanation E of the recording, of probability P(E), has its own mean and covariance of
q, and of the mean y of a window in a further position c,

    y_E = h(s, c) + T (u_E - u_s),   Cov_E(y) = T C_E T^T + R                       (1)

with h what the model predicts in state s, T its columns in c, u_E and C_E the columns'
values with their covariance, R noise, instability and how well angles are set. y
includes the closure of the turn to c: a turn phi counts as a rate phi for one second.
Over all explanations

    C_qy = sum_E P(E) [Cov_E(q, y) + (q_E - q) (y_E - y)^T],   C_qq, C_yy likewise  (2)
    C_qq' = C_qq - C_qy C_yy^-1 C_yq                                                (3)
    gain = 1/2 sum_i ln (1 + C_qq,ii) / (1 + C_qq',ii)                              (4)

so that bringing a parameter within its limit counts as much as distinguishing causes,
and quantities that are known well enough count no more. Causes that the recording does
not show are explanations as well, with their prior probability and the sizes that the
recording allows. Every explanation contains the factory errors, as each uncertainty
does.
Source: Lindley 1956 for the gain; Goldstein and Wooff, Bayes Linear Statistics, 2007,
3.1, for (3).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.calibration.names import ParameterName
from fieldcal.core.frames import direction_cosines, shortest_rotation
from fieldcal.core.positions import Position, alpha_beta_angles
from fieldcal.core.samples import GYR, Array, Index
from fieldcal.model import priors
from fieldcal.model.causes.basis import Course, RowView
from fieldcal.model.causes.cause import CLOSURE, Cause
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.planned import rows_at_session_end
from fieldcal.model.evidence.eliminated import Eliminated, evidence_gains
from fieldcal.model.evidence.gram import WeightedGram
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import LOG_DENSITY
from fieldcal.model.rows.averages import Rows
from fieldcal.model.search.inference import InferenceResult
from fieldcal.model.state import State

MIN_PROBABILITY = 1e-3
"""Probability below which an explanation is ignored."""

DERIVATIVE_STEP_RAD = 1e-4
"""Step of numerical derivatives by an angle, rad."""

COMMON = {"base_tilt": 30.0, "gyro_scale": 1.0, "gyro_cross_coupling": 1.0}
"""Causes in every explanation, since a calibration estimates them, with their size in
typical sizes; the tilt of the base is arbitrary."""


@dataclass(frozen=True, slots=True)
class EliminatedExplanation:
    """One explanation with its eliminated columns.

    Attributes
    ----------
    names : names of its causes
    chance : its probability
    state : its columns, eliminated; the common ones come first

    """

    names: frozenset[str]
    chance: float
    state: Eliminated


@dataclass(frozen=True, slots=True)
class PositionGains:
    """Expected gains of further windows in n positions.

    Attributes
    ----------
    quantities : requested quantities: parameters by full name, causes by id
    variance : (q,) present variance of each
    expected_variance : (n, q) variance expected after a window in each position
    gain : (n,) by (4)

    """

    quantities: tuple[str, ...]
    variance: Array
    expected_variance: Array
    gain: Array

    def most_improved(self, i: int) -> str:
        """Name of the quantity whose variance position i reduces most."""
        fall = np.log1p(self.variance) - np.log1p(self.expected_variance[i])
        return self.quantities[int(np.argmax(fall))]


class ExpectedGain:
    """Calculates the expected gain of further positions.

    Parameters
    ----------
    rows : rows of the windows
    found : result of the inference from these rows
    likely : sets found by the search, with their probabilities
    allowed : allowed uncertainty of each parameter, SI, by full name
    angles : uncertainty of set angles, rad

    """

    def __init__(
        self,
        rows: Rows,
        found: InferenceResult,
        likely: Iterable[tuple[Set, float]],
        allowed: Mapping[str, float],
        angles: float,
    ) -> None:
        self.rows, self.found, self.angles = rows, found, angles
        self.dictionary: Dictionary = found.fit.dictionary
        self.quantities = dict(self._requested_quantities(allowed))
        self.explanations = self._eliminated_explanations(likely)

    def of(self, positions: Sequence[Position]) -> PositionGains:
        """Expected gains of positions with known angles."""
        limit = np.array([s for s, _ in self.quantities.values()])
        at = np.array([c for _, c in self.quantities.values()])
        names = sorted(set().union(*(e.names for e in self.explanations)))
        chance = np.array([e.chance for e in self.explanations])
        there = np.array(
            [[2.0 * (n in e.names) for n in names] for e in self.explanations]
        )
        table, off, noise = self._predicted_windows(positions)
        q_mean, y_mean, q_cov, qy_cov, y_cov = [], [], [], [], []
        for one, causes in zip(self.explanations, there, strict=True):
            columns, cov = one.state.columns, one.state.inverse
            picked = (columns == at[:, None]) / limit[:, None]
            design = table[:, :, columns]
            moved = cov @ np.swapaxes(design, 1, 2)
            y_mean.append(design @ one.state.estimate + off)  # (1)
            y_cov.append(design @ moved + noise)
            own = np.zeros((len(positions), len(names), y_cov[-1].shape[1]))
            qy_cov.append(np.concatenate([picked @ moved, own], axis=1))
            q_mean.append(np.append(picked @ one.state.estimate, causes))
            inner = np.einsum("qi,ij,qj->q", picked, cov, picked)
            q_cov.append(np.append(inner, np.zeros(len(names))))
        q_off = np.array(q_mean) - chance @ np.array(q_mean)
        y_off = np.array(y_mean) - np.einsum("e,enc->nc", chance, np.array(y_mean))
        c_qq = chance @ (np.array(q_cov) + q_off**2)  # (2)
        c_qy = np.einsum("e,enqc->nqc", chance, np.array(qy_cov))
        c_qy += np.einsum("e,eq,enc->nqc", chance, q_off, y_off)
        c_yy = np.einsum("e,encd->ncd", chance, np.array(y_cov))
        c_yy += np.einsum("e,enc,end->ncd", chance, y_off, y_off)
        told = np.linalg.solve(c_yy, np.swapaxes(c_qy, 1, 2))
        left = np.maximum(c_qq - np.einsum("nqc,ncq->nq", c_qy, told), 0.0)  # (3)
        gain = 0.5 * (np.log1p(c_qq) - np.log1p(left)).sum(axis=1)  # (4)
        return PositionGains((*self.quantities, *names), c_qq, left, gain)

    # -- explanations

    def _eliminated_explanations(
        self, likely: Iterable[tuple[Set, float]]
    ) -> list[EliminatedExplanation]:
        """Sets of the search, and the best one with each cause that is not shown."""
        out = [self._with_common_causes(s, p) for s, p in likely if p > MIN_PROBABILITY]
        best = max(out, key=lambda pair: pair[1])
        known = set().union(*(one.names for one, _ in out))
        for cause in self.dictionary.causes:
            if cause.kind == "effect" and cause.name not in {*known, *COMMON}:
                out.append(self._with_one_more_cause(best, cause))
        score = np.array([s for _, s in out])
        share = np.exp(score - np.logaddexp.reduce(score))
        kept = np.flatnonzero(share > MIN_PROBABILITY)
        # they add up to 1, or every mean would be off by a part of the value itself
        share /= share[kept].sum()
        return [replace(out[i][0], chance=float(share[i])) for i in kept]

    def _with_common_causes(
        self, one: Set, chance: float
    ) -> tuple[EliminatedExplanation, float]:
        """A set with the common columns, and its log weight."""
        members = {cause.name for cause, _ in one.members}
        left = [g for g in self.dictionary.unfitted if g.part not in members]
        columns, sizes = self._common_columns()
        at = np.concatenate([columns, one.state.columns, *(g.columns for g in left)])
        wide = np.concatenate(
            [sizes, one.state.prior_sigma, *(g.typical for g in left)]
        )
        state = Eliminated.of(self._weighed_rows(one), at, wide)
        names = frozenset(c.name for c, _ in one.members) - COMMON.keys()
        weight = float(np.log(chance)) - one.state.score + state.score
        return EliminatedExplanation(names, 0.0, state), weight

    def _with_one_more_cause(
        self, best: tuple[EliminatedExplanation, float], cause: Cause
    ) -> tuple[EliminatedExplanation, float]:
        """The best explanation with one more cause, and its log weight."""
        one, score = best
        group = cause.variants[0]
        inner, rhs = one.state.schur_complement(group.columns, group.typical)
        rows = one.state.rows
        own = float((np.diag(rows.matrix(group.columns, group.columns))
                     * group.typical**2).max())  # fmt: skip
        profile = (
            evidence_gains(inner[None], rhs[None], np.array([own]))[0] + LOG_DENSITY
        )
        evidence = float(np.logaddexp.reduce(profile))
        v = float(np.sqrt(np.exp(profile - evidence) @ priors.SIZES**2))
        state = Eliminated.of(
            rows,
            np.concatenate([one.state.columns, group.columns]),
            np.concatenate([one.state.prior_sigma, group.prior_sigma(v)]),
        )
        more = score + evidence + float(np.log(cause.chance))
        return EliminatedExplanation(one.names | {cause.name}, 0.0, state), more

    def _common_columns(self) -> tuple[Index, Array]:
        """Columns that every explanation has, including angles, with their sizes."""
        d = self.dictionary
        at = [d.rotations_of(d.window_positions)]
        wide = [np.full(len(at[0]), max(self.angles, 1e-9))]
        for cause in d.causes:
            if cause.name in COMMON:
                at.append(cause.variants[0].columns)
                wide.append(cause.variants[0].prior_sigma(COMMON[cause.name]))
        return np.concatenate(at), np.concatenate(wide)

    def _weighed_rows(self, one: Set) -> WeightedGram:
        return self.found.search.sets.gram_at(one.sizes.instability)

    # -- requested quantities and further windows

    def _requested_quantities(
        self, allowed: Mapping[str, float]
    ) -> Iterator[tuple[str, tuple[float, int]]]:
        """Full name, allowed uncertainty and column of each parameter."""
        d = self.dictionary
        turned = [c for c in d.causes if c.name == "gyro_scale"]
        for name, limit in allowed.items():
            parameter = ParameterName.of(name)
            c = parameter.channel
            if c not in d.observed or not limit < np.inf:
                continue
            if not parameter.is_scale:
                yield name, (limit, d.bias + c)
            elif c < GYR.start:
                yield name, (limit, d.scale + c)
            elif turned:
                yield name, (limit, int(turned[0].variants[0].columns[c - GYR.start]))

    def _predicted_windows(
        self, positions: Sequence[Position]
    ) -> tuple[Array, Array, Array]:
        """T (n, m, k), h(s) - T u_s (n, m) and R (n, m, m) of windows and turns."""
        d, seen = self.dictionary, self.dictionary.observed
        values = self.found.fit.pad(self.found.values)
        state = replace(
            self.found.state,
            small_rotation=np.zeros_like(self.found.state.small_rotation),
        )
        alpha, beta = alpha_beta_angles(positions)
        since = np.repeat(d.since[:, -1:], len(positions), axis=1)
        view = RowView.of(rows_at_session_end(self.rows.x, alpha, beta), since, state)
        used = values != 0
        for one in self.explanations:
            used[one.state.columns] = True
        table = _column_table(d, view, used)
        off = state.output(view.x, since) - table @ values
        noise = self._noise_covariance(state, since, alpha, beta)
        table, off, noise = table[:, seen], off[:, seen], noise[:, seen][:, :, seen]
        info = np.concatenate([np.zeros(0), *(t.info for t in self.found.turn_rows)])
        if not (info > 0).any():
            return table, off, noise
        felt = replace(
            view, x=replace(view.x, w=view.x.w + self._turns_to(alpha, beta))
        )
        turned = (_column_table(d, felt, used) - _column_table(d, view, used))[:, GYR]
        tau = d.instability_sigma(self.found.best.sizes.instability)
        miss = 1 / np.median(info[info > 0]) + tau[CLOSURE] ** 2
        both = np.zeros((len(positions), len(seen) + 3, len(seen) + 3))
        both[:, : len(seen), : len(seen)] = noise
        both[:, len(seen) :, len(seen) :] = (miss + 2 * self.angles**2) * np.eye(3)
        return (
            np.concatenate([table, turned], axis=1),
            np.concatenate([off, -turned @ values], axis=1),
            both,
        )

    def _turns_to(self, alpha: Array, beta: Array) -> Array:
        """Turn from the last position to each of some, (n, 3) rad in device axes."""
        x = self.rows.x
        last = direction_cosines(x.alpha[-1], x.beta[-1], x.gamma[-1])
        phi: Array = shortest_rotation(last, alpha, beta) @ x.mounting
        return phi

    def _noise_covariance(
        self, state: State, since: Array, alpha: Array, beta: Array
    ) -> Array:
        """R of windows, (n, 6, 6): noise of a mean, instability, and angles."""
        rows, d = self.rows, self.dictionary
        sd = np.nanmedian(rows.sd, axis=0) / np.sqrt(
            len(rows.x) / len(d.window_positions)
        )
        tau = d.instability_sigma(self.found.best.sizes.instability)
        own = sd**2 + np.nanmedian(rows.window_error, axis=0) ** 2 + tau[:6] ** 2

        def output(a: float, b: float) -> Array:
            x = state.experienced(rows_at_session_end(rows.x, alpha + a, beta + b))
            return state.output(x, since)

        moved = [
            output(a, b) - output(-a, -b)
            for a, b in ((DERIVATIVE_STEP_RAD, 0.0), (0.0, DERIVATIVE_STEP_RAD))
        ]
        t = np.stack(moved, axis=2) / (2 * DERIVATIVE_STEP_RAD)
        out: Array = np.diag(own) + self.angles**2 * t @ np.swapaxes(t, 1, 2)
        return out


def _column_table(d: Dictionary, view: RowView, used: Array) -> Array:
    """The columns that are used in some rows, (n, 6, k); zero elsewhere."""
    n = len(view.x)
    out = np.zeros((n, 6, d.width))
    for first, end, basis in d.basis_ranges():
        if not used[first:end].any():
            continue
        row = basis.evaluate(view)
        if isinstance(basis, Course):
            width = row.shape[1]
            for c in range(6):
                out[:, c, first + c * width : first + (c + 1) * width] = row
        else:
            out[:, :, first:end] = row
    return np.where(used, out, 0.0)
