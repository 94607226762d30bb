"""What the turns between windows say: closures, and the accelerometers on the way.

At the end of a turn the attitude R must take the attitude (or, without known angles,
the force) of p to that of q: what it is off by is phi_T of `turn`, (1), the closure. On
the way the accelerometers see (2) there (`way_rows`). White noise of the gyroscopes of
density N makes phi_T a sum with covariance N^2 T.

Source: rotation kinematics to first order in phi.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array, Index
from fieldcal.model import priors
from fieldcal.model.causes.cause import triads_of
from fieldcal.model.causes.columns import General, RowView
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.sets import Set
from fieldcal.model.rows.hand_tremor import turned_force
from fieldcal.model.state import State, Term
from fieldcal.model.system.end_columns import EndColumns
from fieldcal.model.system.linear_rows import Linear
from fieldcal.model.system.met_columns import Met, met_columns
from fieldcal.model.system.way_rows import WayRows, settling
from fieldcal.model.turns.attitude import closures, geometry, rows_of
from fieldcal.model.turns.turn import Turn, Turning, moved, only
from fieldcal.physics.experience import Experience

SMALL = 1e-3
"""Step of the force for a derivative, m/s^2."""

STEADY = 3.0
"""Squares a row on the way, with everything fitted that shows there, from which a hand
shook the device and the way says nothing."""


@dataclass(frozen=True, slots=True)
class TurnRows:
    """Rows of one turn.

    Attributes
    ----------
    positions : from, to
    closure : (s,) what is seen of phi_T, rad, plus what the state has of the columns
    columns : (k,) of the dictionary
    design : (s, k) of the closure
    info : (s,) information, 1/rad^2
    bent : (s, 6) by what it is off for accelerometers that are each off at both ends,
        and for gyroscopes that are each off on the way
    way, way_design : (r,), (r, k) whitened rows of the accelerometers on the way

    """

    positions: tuple[int, int]
    closure: Array
    columns: Index
    design: Array
    info: Array
    bent: Array
    way: Array
    way_design: Array

    def copied(self, old: Index, new: Index) -> TurnRows:
        """With new columns that are as some old ones, of a shape next to theirs."""
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

    Parameters
    ----------
    turning : what follows the turns
    dictionary : columns
    way : whether the accelerometers are looked at on the way

    """

    def __init__(self, turning: Turning, dictionary: Dictionary, way: bool) -> None:
        self.turning, self.dictionary = turning, dictionary
        self.rows = turning.rows
        # of each window
        self.first = np.unique(self.rows.x.position, return_index=True)[1]
        self.wander = self.rows.wander[self.first]
        self.way = way and not dictionary.free.any()

    def linearised(
        self, state: State, values: Array, windows: Sequence[Linear], known: Set | None
    ) -> list[TurnRows]:
        """Rows of all turns about a state; `values` of the columns in it.

        `windows` are the rows of the windows about the same state, `known` is what they
        say; None where that is still to be sought, and the way is not looked at.
        """
        seen = self.way and known is not None and not _strange(known)
        self.known = known if seen else None
        self.at_ends = {
            first: EndColumns.of(first, one, self.rows.x, state)
            for first, one in self.dictionary.bases
            if isinstance(one, General) and one.sides is not None
        }
        if self.dictionary.free.any():
            self.means = _means(windows, self.dictionary)
            self.off = _off(windows, self.dictionary)
            self.spread = _spread(windows, self.dictionary)
            x, since = only(self.rows.x, self.first), self.dictionary.since
            self.slopes = _slopes(state, x, since[:, self.first])
        turns = list(self.turning.turns(state))
        views = [self._view(turn, state) for turn in turns]
        met = met_columns(turns, views, self.dictionary, self.at_ends, self.known)
        return _steadied(
            [self._rows(*one, values) for one in zip(turns, views, met, strict=True)]
        )

    def courses(
        self, turns: Sequence[Turn], state: State, terms: Sequence[Term]
    ) -> Iterator[Array]:
        """Outputs that some terms of a state make in turns, at edges, (m + 1, 6)."""
        rest = tuple(t for t in state.terms if t not in terms)
        less = replace(state, terms=rest)
        for turn in turns:
            since = self.turning.after(turn.t, turn.positions[1])
            x = moved(replace(turn.x, f=turn.felt), less)
            yield state.output(turn.x, since) - less.output(x, since)

    # -- rows

    def _view(self, turn: Turn, state: State) -> RowView:
        """A turn as columns see it."""
        since = self.turning.after(turn.x.t, turn.positions[1])
        return RowView(turn.x, turn.x, since, state)

    def _rows(self, turn: Turn, view: RowView, met: Met, values: Array) -> TurnRows:
        """Closure and way of one turn, by all columns that reach them."""
        d, state = self.dictionary, view.state
        _, seen, across = geometry(turn.ends, turn.positions, turn.attitude, turn.done)
        index, close, general = met.index, met.closing, met.general
        loose = dict(self._loose_ends(turn)) if d.free.any() else {}
        ends: Array = np.zeros((3, 3)) if turn.rounded is None else turn.rounded
        for p, bent in loose.items():
            # the force there is the one that is read, which the state may not meet
            seen = seen - bent @ self.off[p]
            close = close - bent @ self.means[p][:, index]
            ends = ends + bent @ self._unsure(p) @ bent.T
        there = np.abs(close).max(axis=0) > 0
        for columns, outputs in general:
            there[np.isin(index, columns)] |= np.any(outputs != 0.0, axis=(0, 1))
        index = index[there]
        basis, info = _plane(across, ends, self._closure_variance(turn, view))
        close = basis @ close[:, there]
        closure = basis @ seen + close @ values[index]
        off = [(basis @ bent) ** 2 for bent in loose.values()]
        bent = np.sqrt(sum(off, np.zeros((len(basis), 3))))
        drift = np.abs(basis @ turn.weights(state.scale[3:]).sum(axis=1))
        bent = np.hstack([bent, drift])
        way: Array = np.zeros(0)
        design: Array = np.zeros((0, len(index)))
        if self.known is not None:
            seen_by = WayRows(turn, view, d, self.known, self.rows.noise)
            way, design = seen_by.rows(general, values, index)
        return TurnRows(turn.positions, closure, index, close, info, bent, way, design)

    def _unsure(self, p: int) -> Array:
        """Covariance of the accelerometers of a window at the end of a turn, (3, 3)."""
        moved = turned_force(self.rows.x.f[self.first[p]], self.wander[p])
        slope = self.slopes[p]
        out: Array = np.diag(self.spread[p]) + slope @ moved @ slope.T
        return out

    def _closure_variance(self, turn: Turn, view: RowView) -> float:
        """Variance of a closure about every axis: noise, time steps and filters, rad^2.

        Between positions of unknown orientation the Earth's rate is not known either.
        """
        scale = np.abs(view.state.scale[3:])
        length = float(np.ptp(turn.x.t))
        white = self.rows.noise[3:] / scale * np.sqrt(turn.interval)
        fading = settling(view.state, turn.x, view.since)[3:] / scale
        built_up = priors.BUILT_UP * length * float(np.abs(fading).max())
        earth = EARTH_RATE / 3**0.5 * length if self.dictionary.free.any() else 0.0
        walked = float((white**2).mean()) * length
        return walked + turn.blur**2 + built_up**2 + earth**2 + self._swung(turn)

    def _swung(self, turn: Turn) -> float:
        """Variance of what a hand turns at both ends, whose angles are known, rad^2."""
        if self.dictionary.free.any():
            return 0.0
        ends = np.searchsorted(self.dictionary.held, turn.positions)
        return float((self.wander[ends] ** 2).mean(axis=1).sum())

    def _loose_ends(self, turn: Turn) -> Iterator[tuple[int, Array]]:
        """How the closure moves with what is added to the accelerometers at its ends.

        Of a position of unknown orientation, that turns the force that they are taken
        to see: df = -(1 - n n^T) (dU/df)^-1 dU. Of the two windows, (3, 3) each.
        """
        ends = turn.ends
        rows = rows_of(ends, turn.positions)
        both, held = ends.f[rows], np.repeat(ends.to_device[rows][None], 3, axis=0)
        for i, p in enumerate(turn.positions):
            j = int(np.searchsorted(self.dictionary.held, p))
            up = both[i] / np.linalg.norm(both[i])
            across = (np.eye(3) - np.outer(up, up)) @ np.linalg.inv(self.slopes[j])
            step = 1e-4 * float(np.linalg.norm(both[i]))
            sides = []
            for sign in (1.0, -1.0):
                f = np.repeat(both[None], 3, axis=0)
                f[:, i] += sign * step * np.eye(3)
                sides.append(closures(f, held, turn.attitude[-1])[0])
            bent = (sides[0] - sides[1]).T / (2 * step)
            yield j, -bent @ across


def _strange(known: Set) -> bool:
    """Whether something that no physics makes acts on accelerometers at rest.

    What it does while the device is turned, nobody can say.
    """
    return any(
        cause.kind == "unknown" and "acc" in triads_of(group.part)
        for cause, group in known.members
    )


def _plane(across: Array, ends: Array, alike: float) -> tuple[Array, Array]:
    """What is known of a closure: orthonormal rows, (2 or 3, 3), and information.

    Parameters
    ----------
    across : (3, 3) projection on it
    ends : (3, 3) covariance of what the forces at both ends leave of it, rad^2
    alike : variance besides, rad^2

    """
    values, axes = np.linalg.eigh(across)
    plane: Array = axes[:, values > 0.5].T
    spread, turned = np.linalg.eigh(plane @ ends @ plane.T)
    return turned.T @ plane, 1 / (np.maximum(spread, 0.0) + alike)


def _means(windows: Sequence[Linear], d: Dictionary) -> Array:
    """Columns of the accelerometers in the mean of each window, (p, 3, k)."""
    out = np.zeros((len(d.held), 3, d.width))
    for part in windows:
        if part.channel < 3:
            first = np.flatnonzero(np.diff(part.window, prepend=-1))
            weight = part.weight[:, None]
            table = np.add.reduceat(part.design * weight, first, axis=0)
            table /= np.add.reduceat(weight**2, first, axis=0)
            out[part.window[first][:, None], part.channel, part.columns] = table
    return out


def _off(windows: Sequence[Linear], d: Dictionary) -> Array:
    """Recorded less calculated of the accelerometers' mean in each window, (p, 3)."""
    out = np.zeros((len(d.held), 3))
    for part in windows:
        if part.channel < 3:
            first = np.flatnonzero(np.diff(part.window, prepend=-1))
            total = np.add.reduceat(part.white * part.weight, first)
            total /= np.add.reduceat(part.weight**2, first)
            out[part.window[first], part.channel] = total
    return out


def _spread(windows: Sequence[Linear], d: Dictionary) -> Array:
    """Variance of the accelerometers' mean in each window, (p, 3)."""
    out = d.common[:, :3] ** 2
    for part in windows:
        if part.channel < 3:
            first = np.flatnonzero(np.diff(part.window, prepend=-1))
            info = np.add.reduceat(part.weight**2, first)
            out[part.window[first], part.channel] += 1 / info
    return out


def _slopes(state: State, x: Experience, since: Array) -> Array:
    """Derivative of the accelerometers' outputs by the force in each row, (p, 3, 3).

    With what is seen of other axes, and with curvature.
    """
    seen, out = state.experienced(x), np.zeros((len(x), 3, 3))
    for c in range(3):
        step = SMALL * np.eye(3)[c]
        up, down = (
            state.output(replace(seen, f=seen.f + s * step), since)[:, :3]
            for s in (1.0, -1.0)
        )
        out[:, :, c] = (up - down) / (2 * SMALL)
    return out


def _steadied(rows: list[TurnRows]) -> list[TurnRows]:
    """Without the way, where a hand shook the device on it."""
    if not rows or not len(rows[0].way):
        return rows
    columns = np.unique(np.concatenate([r.columns for r in rows]))
    size = sum(len(r.way) for r in rows)
    design, white, at = np.zeros((size, len(columns))), np.zeros(size), 0
    for r in rows:
        there = slice(at, at := at + len(r.way))
        design[there, np.searchsorted(columns, r.columns)] = r.way_design
        white[there] = r.way
    some = design[:, np.abs(design).max(axis=0) > 0]
    rest = white - some @ np.linalg.lstsq(some, white, rcond=1e-9)[0]
    if float(rest @ rest) <= STEADY * max(size - some.shape[1], 1):
        return rows
    return [
        replace(r, way=np.zeros(0), way_design=np.zeros((0, len(r.columns))))
        for r in rows
    ]
