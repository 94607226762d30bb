"""Rows of the accelerometers during a turn from one window to the next.

They determine only columns that no window shows. Columns that windows show keep the
estimates and uncertainties of the windows, because during a turn the attitude is known
by interpolation only, (2) of `turn`. The windows' set has what a factory leaves of
other effects in its state (`Turns`). White noise of the gyroscopes with the density N,
rad/s/sqrt(Hz), makes phi_k - u phi_T a Brownian bridge with the covariance, rad^2,

    N^2 (min(t, t') - u' t - u t' + u u' T)                                         (1)
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model import priors
from fieldcal.model.causes.basis import Course, RowView
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.cholesky import cholesky_root, triangular_inverse
from fieldcal.model.evidence.sets import Set
from fieldcal.model.state import State
from fieldcal.model.turns.turn import Turn
from fieldcal.physics.experience import Experience


class TurnForceRows:
    """Rows of the accelerometers of one turn.

    Parameters
    ----------
    turn, view : the turn, and its edges
    dictionary : columns
    known : set fitted to windows and closures
    noise : (6,) standard deviation of one sample

    """

    def __init__(
        self,
        turn: Turn,
        view: RowView,
        dictionary: Dictionary,
        known: Set,
        noise: Array,
    ) -> None:
        self.turn, self.view, self.dictionary = turn, view, dictionary
        self.known, self.noise, self.state = known, noise, view.state

    def rows(
        self, general: Sequence[tuple[Index, Array]], values: Array, index: Index
    ) -> tuple[Array, Array]:
        """Whitened rows (r,), and their design by some columns, (r, k).

        `general` are columns with their outputs at the edges, `values` (all,) those in
        the state, `index` (k,) the columns wanted.
        """
        d, posterior, turn = self.dictionary, self.known.state, self.turn
        columns = np.concatenate([c for c, _ in general])
        design = self._output_means(np.concatenate([o for _, o in general], axis=2))
        flat = design.reshape(-1, len(columns))
        own = ~d.shown[columns] & np.isin(columns, index)
        output = self.state.output(turn.x, self.view.since)
        off = turn.acc - turn.means(output[:, :3])
        z = off.ravel() + flat[:, own] @ values[columns[own]]
        held, at = self._window_columns(columns, flat)
        # the state may lack what windows say, as it does of what the factory left
        z = z - held @ (posterior.estimate - self._in_state(values))[at]
        cov = self._covariance()
        cov += held @ posterior.inverse[np.ix_(at, at)] @ held.T
        sd = self.turn.sd.ravel()
        whiten = triangular_inverse(cholesky_root(cov / np.outer(sd, sd))) / sd
        whole = np.zeros((len(z), len(index)))
        order = np.argsort(index)
        place = order[np.searchsorted(index[order], columns[own])]
        whole[:, place] = whiten @ flat[:, own]
        return whiten @ z, whole

    def _in_state(self, values: Array) -> Array:
        """Values in the state of the columns of the windows' set, (a,).

        A column of two groups has a part of its value in each.
        """
        columns = self.known.state.columns
        count = np.bincount(columns, minlength=len(values))
        return (values / np.maximum(count, 1))[columns]

    def _output_means(self, outputs: Array) -> Array:
        """Means over the pieces, by outputs at their edges, (k, 3, columns), (2)."""
        scale = self.state.scale
        path = self.turn.attitude_error(outputs[:, 3:] / scale[3:, None])
        swung = self.turn.force_error(path) * scale[:3, None]
        return self.turn.means(outputs[:, :3] + swung)

    def _window_columns(self, columns: Index, flat: Array) -> tuple[Array, Index]:
        """Values of the columns of the windows' set, and their indices in it."""
        d, posterior = self.dictionary, self.known.state
        out, at = [], []
        order = np.argsort(columns)
        for i, column in enumerate(posterior.columns.tolist()):
            j = int(np.searchsorted(columns[order], column))
            if j < len(columns) and columns[order[j]] == column and d.shown[column]:
                out.append(flat[:, order[j]])
                at.append(i)
        for first, one in d.bases:
            if isinstance(one, Course) and one.timed:
                for i, course in self._of_course(first, one):
                    out.append(course)
                    at.append(i)
        return np.stack(out, axis=1), np.array(at, dtype=np.intp)

    def _of_course(self, first: int, one: Course) -> Iterator[tuple[int, Array]]:
        """A course's columns on the accelerometers, as far as the set holds them."""
        held = self.known.state.columns
        inside = np.flatnonzero((held >= first) & (held < first + 3 * one.width))
        if not len(inside):
            return
        table = self.turn.means(one.evaluate(self.view))
        for i in inside.tolist():
            c, m = divmod(int(held[i]) - first, one.width)
            seen = np.zeros((len(table), 3))
            seen[:, c] = table[:, m]
            yield i, seen.ravel()

    def _covariance(self) -> Array:
        """Covariance of the rows, (3 k, 3 k)."""
        turn, x, state = self.turn, self.turn.x, self.state
        middle = (x.t[turn.cut[1:]] + x.t[turn.cut[:-1]]) / 2 - x.t[0]
        done = np.interp(middle, x.t - x.t[0], turn.done)
        length = float(x.t[-1] - x.t[0])
        bridge = np.minimum.outer(middle, middle) + np.outer(done, done) * length
        bridge -= np.outer(middle, done) + np.outer(done, middle)  # (1)
        fading = settling_amplitudes(state, x, self.view.since)
        cov = np.diag((turn.sd**2).ravel())
        built = _settling_covariance(x, self.view.since, middle)
        cov += np.kron(built, np.outer(fading[:3], fading[:3]))
        density = self.noise[3:] / np.abs(state.scale[3:]) * np.sqrt(turn.interval)
        building = (
            priors.BUILD_UP_ON_WAY * np.sqrt(length) * fading[3:] / state.scale[3:]
        )
        density = np.hypot(density, building)
        for axis in range(3):
            along = np.broadcast_to(np.eye(3)[axis][:, None], (len(x.t), 3, 1))
            arm = turn.means(turn.force_error(along)[:, :, 0]) * state.scale[:3]
            arm = arm * density[axis]
            blocks = bridge[:, None, :, None] * np.multiply.outer(arm, arm)
            cov += blocks.reshape(cov.shape)
        sigma = self.dictionary.instability_sigma(self.known.sizes.instability)
        loose = sigma[:3]
        # the instability of windows may change with the attitude during a turn
        apart = np.subtract.outer(middle, middle) / priors.BUILD_UP_S
        course = 1.0 + np.exp(-(apart**2) / 2)
        walks = self.dictionary.wander.residual_covariance(
            middle, np.diff(x.t[turn.cut]), range(3)
        )
        for c in range(3):
            cov[c::3, c::3] += walks[c]
        return cov + np.kron(course, np.diag(loose**2))


def turn_force_columns(dictionary: Dictionary, known: Set) -> Mask:
    """Columns used during turns, (all,).

    No window shows them, or the windows' set has them.
    """
    used = ~dictionary.shown
    used[known.state.columns] = True
    return used


def settling_amplitudes(state: State, x: Experience, since: Array) -> Array:
    """Amplitudes, (6,), of the effects that decay from the end of a turn on."""
    never = state.output(x, np.full_like(since, np.inf))[-1]
    then = state.output(x, np.zeros_like(since))[-1]
    sizes: Array = then - never
    return sizes


def _settling_covariance(x: Experience, since: Array, middle: Array) -> Array:
    """Covariance between pieces of the error from settling effects, for amplitude one.

    How they build up during a turn is not known: smoothly, between zero and the full
    amplitude. Afterwards they decay from an instant with a known uncertainty.
    """
    rest = np.isfinite(since[0])
    k = int(np.argmax(rest)) if rest.any() else len(x.t) - 1
    arrived = x.t[k] - (since[0, k] if rest.any() else 0.0) - x.t[0]
    unsure = np.where(
        middle < arrived + priors.ARRIVAL_S,
        priors.BUILD_UP_ON_WAY,
        priors.BUILD_UP_AT_END,
    )
    apart = np.subtract.outer(middle, middle) / priors.BUILD_UP_S
    return np.outer(unsure, unsure) * np.exp(-(apart**2) / 2)
