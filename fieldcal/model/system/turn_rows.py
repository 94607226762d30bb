"""Rows of the turns between windows: closures, and accelerometers during the turn.

At the end of a turn the attitude R must take the attitude (or, without known angles,
the force) of p to that of q. The remaining rotation is phi_T of `turn`, (1), the
closure. The accelerometers measure (2) during the turn (`turn_force_rows`). White noise
of the gyroscopes of density N gives phi_T the covariance N^2 T.

Source: rotation kinematics to first order in phi.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array, Index
from fieldcal.model import priors, thresholds, tolerances
from fieldcal.model.causes.basis import RowView
from fieldcal.model.causes.cause import triads_of
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.unfitted_groups import eliminate_with, parameters_not_in
from fieldcal.model.rows.hand_tremor import turned_force
from fieldcal.model.state import State, Term
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.turn_columns import ColumnsOfTurns, TurnColumns
from fieldcal.model.system.turn_force_rows import (
    TurnForceRows,
    settling_amplitudes,
    turn_force_columns,
)
from fieldcal.model.system.window_ends import WindowEnds, closure_slopes, output_slopes
from fieldcal.model.turns.attitude import turn_geometry
from fieldcal.model.turns.turn import Turn
from fieldcal.model.turns.turn_tracker import TurnTracker, apply_way_effects
from fieldcal.physics.experience_rows import select_rows


@dataclass(frozen=True, slots=True)
class TurnRows:
    """Rows of one turn.

    Attributes
    ----------
    positions : from, to
    closure : (s,) known components of phi_T, rad, plus the columns' values in the state
    columns : (k,) of the dictionary
    design : (s, k) of the closure
    info : (s,) information, 1/rad^2
    closure_errors : (s, 6) error of the closure per error of each accelerometer at both
        ends, and of each gyroscope during the turn
    way, way_design : (r,), (r, k) whitened rows of the accelerometers on the way

    """

    positions: tuple[int, int]
    closure: Array
    columns: Index
    design: Array
    info: Array
    closure_errors: Array
    way: Array
    way_design: Array

    def with_copied_columns(self, old: Index, new: Index) -> TurnRows:
        """The rows with new columns that copy old ones of a neighbouring shape."""
        at = [int(np.flatnonzero(self.columns == c)[0]) for c in old.tolist()
              if c in self.columns]  # fmt: skip
        kept = np.isin(old, self.columns)
        return replace(
            self,
            columns=np.concatenate([self.columns, new[kept]]),
            design=np.hstack([self.design, self.design[:, at]]),
            way_design=np.hstack([self.way_design, self.way_design[:, at]]),
        )


class Turns:
    """Makes rows of the turns of a recording.

    `way` states whether the accelerometers during turns are used.
    """

    def __init__(self, turning: TurnTracker, dictionary: Dictionary, way: bool) -> None:
        self.tracker, self.dictionary = turning, dictionary
        self.rows = turning.rows
        # of each window
        self.first = np.unique(self.rows.x.position, return_index=True)[1]
        self.wander = self.rows.hand_angle[self.first]
        self.way = way and not dictionary.unoriented.any()
        self._columns: ColumnsOfTurns | None = None

    def with_dictionary(self, dictionary: Dictionary) -> Turns:
        """The same turns with the columns of a copy of the dictionary."""
        return Turns(self.tracker, dictionary, self.way)

    def linearised(
        self,
        state: State,
        values: Array,
        windows: Sequence[LinearRows],
        known: Set | None,
    ) -> list[TurnRows]:
        """Rows of all turns about a state; `values` of the columns in it.

        `windows` are the rows of the windows about the same state, `known` is the set
        fitted to them. If `known` is None, accelerometers during turns are not used.
        """
        seen = self.way and known is not None and not _has_unknown_acc_cause(known)
        self.known = self._with_factory_errors(known) if known and seen else None
        if self.known is not None:
            self.used = turn_force_columns(self.dictionary, self.known)
        unoriented = bool(self.dictionary.unoriented.any())
        if unoriented:
            self.windows = WindowEnds.of(windows, self.dictionary)
            x, since = select_rows(self.rows.x, self.first), self.dictionary.since
            self.slopes = output_slopes(state, x, since[:, self.first])
        about = self._about(state)
        met = about.of_bases(self.dictionary.bases, self.rows.x, unoriented)
        each = zip(about.turns, about.views, met, strict=True)
        rows = _drop_shaken_way([self._rows(*one, values) for one in each])
        if self.known is not None:
            self._columns = None  # the outputs along all turns are large
        return rows

    def _about(self, state: State) -> ColumnsOfTurns:
        """The turns integrated with a state, with their columns.

        They are kept until the accelerometers were used, or another state is asked for.
        """
        if self._columns is None or self._columns.state is not state:
            turns = list(self.tracker.turns(state))
            views = [self._view(turn, state) for turn in turns]
            self._columns = ColumnsOfTurns(state, turns, views, self.way)
        return self._columns

    def outputs_of_terms(
        self, turns: Sequence[Turn], state: State, terms: Sequence[Term]
    ) -> Iterator[Array]:
        """Contribution of some terms of a state to the outputs of turns, (m + 1, 6)."""
        rest = tuple(t for t in state.terms if t not in terms)
        less = replace(state, terms=rest)
        for turn in turns:
            since = self.tracker.time_since_turn(turn.t, turn.positions[1])
            x = apply_way_effects(
                replace(turn.x, f=turn.force_without_way_effects), less
            )
            yield state.output(turn.x, since) - less.output(x, since)

    def _with_factory_errors(self, known: Set) -> Set:
        """A set with what the factory may have left of other effects in its state.

        Windows may hide it, as two of them hide cross-coupling behind bias and scale
        factor; forces on the way do not.
        """
        left = list(parameters_not_in(known, self.dictionary.unfitted))
        return replace(known, state=eliminate_with(known, left)) if left else known

    # -- rows

    def _view(self, turn: Turn, state: State) -> RowView:
        """The edges of a turn, at which columns are evaluated."""
        since = self.tracker.time_since_turn(turn.x.t, turn.positions[1])
        return RowView(turn.x, turn.x, since, state)

    def _rows(
        self, turn: Turn, view: RowView, met: TurnColumns, values: Array
    ) -> TurnRows:
        """Closure and way of one turn, with all columns that influence them."""
        d, state = self.dictionary, view.state
        _, residual, across = turn_geometry(
            turn.ends, turn.positions, turn.attitude, turn.done
        )
        index, close = met.index, met.closing
        general = met.during_turn(self.used) if self.known is not None else []
        loose: dict[int, Array] = {}
        if d.unoriented.any():
            loose = dict(closure_slopes(turn, d.window_positions, self.slopes))
        ends: Array = np.zeros((3, 3))
        if turn.rounding_covariance is not None:
            ends = turn.rounding_covariance
        for last, (p, bent) in zip((True, False), loose.items(), strict=False):
            # the force there is the measured one, which may differ from the state's
            off = self.windows.residual_at(p, last, values)
            residual = residual - bent @ off
            close = close - bent @ self.windows.columns_at(p, last)[:, index]
            ends = ends + bent @ self._force_covariance(p) @ bent.T
        touching = np.abs(close).max(axis=0) > 0
        if general:
            moved = [columns[np.any(outputs != 0.0, axis=(0, 1))]
                     for columns, outputs in general]  # fmt: skip
            touching |= np.isin(index, np.concatenate(moved))
        index = index[touching]
        basis, info = _known_axes(across, ends, self._closure_variance(turn, view))
        close = basis @ close[:, touching]
        closure = basis @ residual + close @ values[index]
        squares = [(basis @ bent) ** 2 for bent in loose.values()]
        bent = np.sqrt(sum(squares, np.zeros((len(basis), 3))))
        drift = np.abs(basis @ turn.weights(state.scale[3:]).sum(axis=1))
        bent = np.hstack([bent, drift])
        way: Array = np.zeros(0)
        design: Array = np.zeros((0, len(index)))
        if self.known is not None:
            seen_by = TurnForceRows(turn, view, d, self.known, self.rows.noise)
            way, design = seen_by.rows(general, values, index)
        return TurnRows(turn.positions, closure, index, close, info, bent, way, design)

    def _force_covariance(self, p: int) -> Array:
        """Covariance of the accelerometers of a window at the end of a turn, (3, 3)."""
        moved = turned_force(self.rows.x.f[self.first[p]], self.wander[p])
        slope = self.slopes[p]
        out: Array = np.diag(self.windows.variances[p]) + slope @ moved @ slope.T
        return out

    def _closure_variance(self, turn: Turn, view: RowView) -> float:
        """Variance of a closure about every axis: noise, time steps and filters, rad^2.

        Between positions of unknown orientation the Earth's rate is not known either.
        """
        scale = np.abs(view.state.scale[3:])
        length = float(np.ptp(turn.x.t))
        white = self.rows.noise[3:] / scale * np.sqrt(turn.interval)
        fading = settling_amplitudes(view.state, turn.x, view.since)[3:] / scale
        built_up = priors.BUILD_UP_ON_WAY * length * float(np.abs(fading).max())
        walked = float((white**2).mean()) * length
        known = walked + turn.closure_sigma**2 + built_up**2
        if self.dictionary.unoriented.any():
            return known + (EARTH_RATE / 3**0.5 * length) ** 2
        # what a hand turns the device by, at either end
        ends = np.searchsorted(self.dictionary.window_positions, turn.positions)
        return known + float((self.wander[ends] ** 2).mean(axis=1).sum())


def _has_unknown_acc_cause(known: Set) -> bool:
    """Whether an unknown function acts on the accelerometers at rest.

    Its value during turns is not known.
    """
    return any(
        cause.kind == "unknown" and "acc" in triads_of(group.part)
        for cause, group in known.members
    )


def _known_axes(across: Array, ends: Array, alike: float) -> tuple[Array, Array]:
    """Known axes of a closure: orthonormal rows, (2 or 3, 3), and their information.

    `across` (3, 3) projects on the known part; `ends` (3, 3) is the covariance from the
    forces at both ends, `alike` further variance about all axes, rad^2.
    """
    values, axes = np.linalg.eigh(across)
    plane: Array = axes[:, values > 0.5].T
    spread, turned = np.linalg.eigh(plane @ ends @ plane.T)
    return turned.T @ plane, 1 / (np.maximum(spread, 0.0) + alike)


def _drop_shaken_way(rows: list[TurnRows]) -> list[TurnRows]:
    """Remove the rows on the way if a hand shook the device."""
    if not rows or not len(rows[0].way):
        return rows
    columns = np.unique(np.concatenate([r.columns for r in rows]))
    size = sum(len(r.way) for r in rows)
    design, white, at = np.zeros((size, len(columns))), np.zeros(size), 0
    for r in rows:
        rows_of_turn = slice(at, at := at + len(r.way))
        design[rows_of_turn, np.searchsorted(columns, r.columns)] = r.way_design
        white[rows_of_turn] = r.way
    used = design[:, np.abs(design).max(axis=0) > 0]
    rest = white - used @ np.linalg.lstsq(used, white, rcond=tolerances.SINGULAR)[0]
    if float(rest @ rest) <= thresholds.MAX_WAY_CHI2 * max(size - used.shape[1], 1):
        return rows
    none = np.zeros(0)
    return [replace(r, way=none, way_design=r.way_design[:0]) for r in rows]
