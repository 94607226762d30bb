"""What the accelerometers say of the force at both ends of each window.

A turn begins where a window ends. Without known angles the force there is that of the
window's mean, less what the columns put on it. Where an effect turns the device itself
amid a window, as a base that is knocked does, the force at the end is that of the last
row, and at the beginning that of the first: it goes with the turn, and is not taken
off. (p,) are windows, (k,) columns of the dictionary.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import tolerances
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.state import State
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.turns.attitude import closures, first_row_of_each
from fieldcal.model.turns.turn import Turn
from fieldcal.physics.attitude_step import AttitudeStep
from fieldcal.physics.experience import Experience


@dataclass(frozen=True)
class WindowEnds:
    """Accelerometers in the windows.

    Attributes
    ----------
    means : (p, 3, k) columns in the mean of each window
    residuals : (p, 3) recorded less calculated mean
    variances : (p, 3) of the mean
    turning : (t,) columns of effects that turn the device itself
    ends : (2, p, 3, t) these in the first and in the last row of each window

    """

    means: Array
    residuals: Array
    variances: Array
    turning: Index
    ends: Array

    @classmethod
    def of(cls, windows: Sequence[LinearRows], d: Dictionary) -> WindowEnds:
        """From the rows of the windows, linearised."""
        count = len(d.window_positions)
        turning = _columns_that_turn_the_device(d)
        means, residuals = np.zeros((count, 3, d.width)), np.zeros((count, 3))
        variances = d.window_error[:, :3] ** 2
        ends = np.zeros((2, count, 3, len(turning)))
        for part in windows:
            if part.channel >= 3:
                continue
            there, c = part.windows, part.channel
            means[there[:, None], c, part.columns] = part.means
            residuals[there, c] = part.window_means(part.white)
            variances[there, c] += 1 / part.info
            at = np.flatnonzero(np.isin(turning, part.columns))
            own = np.searchsorted(part.columns, turning[at])
            last = np.append(part.starts[1:], len(part.window)) - 1
            for end, row in zip(ends, (part.starts, last), strict=True):
                rows = part.design[np.ix_(row, own)] / part.weight[row, None]
                end[there[:, None], c, at] = rows
        return cls(means, residuals, variances, turning, ends)

    def columns_at(self, p: int, last: bool) -> Array:
        """Columns that are taken off a mean for the force at an end, (3, k)."""
        out: Array = self.means[p].copy()
        out[:, self.turning] -= self.ends[int(last), p]
        return out

    def residual_at(self, p: int, last: bool, values: Array) -> Array:
        """Measured less calculated output at an end of a window, (3,)."""
        at_end: Array = self.residuals[p] + (
            self.ends[int(last), p] @ values[self.turning]
        )
        return at_end


def _columns_that_turn_the_device(d: Dictionary) -> Index:
    """Columns of effects that turn the device itself, ascending."""
    found = [
        group.columns
        for cause in d.causes
        for group in cause.variants
        if isinstance(group.effect, AttitudeStep) and group.effect.turns_device
    ]
    return np.unique(np.concatenate([np.zeros(0, dtype=np.intp), *found]))


def output_slopes(state: State, x: Experience, since: Array) -> Array:
    """Derivative of the accelerometers' outputs by the force in each row, (p, 3, 3).

    It contains cross-coupling and nonlinearity.
    """
    inputs, out = state.experienced(x), np.zeros((len(x), 3, 3))
    for c in range(3):
        step = tolerances.DERIVATIVE_STEP * np.eye(3)[c]
        up, down = (
            state.output(replace(inputs, f=inputs.f + s * step), since)[:, :3]
            for s in (1.0, -1.0)
        )
        out[:, :, c] = (up - down) / (2 * tolerances.DERIVATIVE_STEP)
    return out


def closure_slopes(
    turn: Turn, positions: Index, slopes: Array
) -> Iterator[tuple[int, Array]]:
    """Derivatives of a closure by accelerometer errors at the turn's ends, (3, 3) each.

    In a position of unknown orientation such an error rotates the force that is derived
    from them: df = -(1 - n n^T) (dU/df)^-1 dU. `slopes` (p, 3, 3) are those of
    `output_slopes` for the windows' `positions` (p,). With the numbers of the windows.
    """
    ends = turn.ends
    rows = first_row_of_each(ends, turn.positions)
    forces, held = ends.f[rows], np.repeat(ends.to_device_in(rows)[None], 3, axis=0)
    for i, p in enumerate(turn.positions):
        j = int(np.searchsorted(positions, p))
        up = forces[i] / np.linalg.norm(forces[i])
        across = (np.eye(3) - np.outer(up, up)) @ np.linalg.inv(slopes[j])
        step = 1e-4 * float(np.linalg.norm(forces[i]))
        sides = []
        for sign in (1.0, -1.0):
            f = np.repeat(forces[None], 3, axis=0)
            f[:, i] += sign * step * np.eye(3)
            sides.append(closures(f, held, turn.attitude[-1])[0])
        bent = (sides[0] - sides[1]).T / (2 * step)
        yield j, -bent @ across
