"""Turns between windows: as the gyroscopes measured them, and their replay.

A turn was made by hand. The virtual device is moved along the rotation that the model
of the device reads from the recorded gyroscopes, corrected linearly by the closure so
that it ends in the next position:

    a_k = log(R_k R_{k-1}^T) - R_k phi (u_k - u_{k-1})

with attitude R, closure phi and the completed part u of the turn, as in `model.turn`.
The outputs during the turn come from the virtual device's own physics. Compared with
the recording are the accelerometers' means over parts of the turn, and the gyroscopes'
integrals over the whole turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.model.turns.attitude import antisymmetric_vector
from fieldcal.model.turns.turn import Turn
from fieldcal.sim_device.way import Manoeuvre


@dataclass(frozen=True, slots=True)
class TurnDifference:
    """Recorded less replayed outputs in turns.

    Attributes
    ----------
    force : rms of the accelerometers' means, m/s^2; nan without a turn
    angle : rms of the gyroscopes' integrals, rad; nan without a turn

    """

    force: float
    angle: float


def manoeuvre_of_turn(turn: Turn, start: float) -> Manoeuvre:
    """The rotation of a turn, in procedure axes, as a function of s since `start`."""
    steps = turn.attitude[1:] @ np.swapaxes(turn.attitude[:-1], 1, 2)
    sine = -antisymmetric_vector(steps)
    size = np.linalg.norm(sine, axis=1)
    longer = np.arcsin(np.minimum(size, 1.0)) / np.where(size > 0, size, 1.0)
    small = sine * np.where(size > 0, longer, 1.0)[:, None]
    small = small - np.diff(turn.done)[:, None] * (turn.attitude[1:] @ turn.closure)
    total = np.vstack([np.zeros(3), np.cumsum(small, axis=0)])
    return Manoeuvre(turn.t - start, turn.x.mounting @ total.T)


def turn_difference(
    turns: Sequence[Turn], recorded: Block, replayed: Block
) -> TurnDifference:
    """Differences between replay and recording in turns.

    `replayed` has samples at the edges of every turn, `recorded` all there are.
    """
    forces, angles = [], []
    for turn in turns:
        first = int(np.searchsorted(replayed.t, turn.t[0]))
        again = replayed[first : first + len(turn.t)]
        ends = np.searchsorted(
            recorded.t, [turn.t[0], np.nextafter(turn.t[-1], np.inf)]
        )
        there = recorded[slice(*ends)]
        forces.append((turn.acc - turn.means(again.acc)).ravel())
        angles.append(trapezoid(there.gyr, there.t) - trapezoid(again.gyr, again.t))
    if not forces:
        return TurnDifference(np.nan, np.nan)
    return TurnDifference(_rms(np.concatenate(forces)), _rms(np.concatenate(angles)))


def trapezoid(values: Array, t: Array) -> Array:
    """Integral of values (n, 3) over t (n,) by the trapezoid rule, (3,)."""
    middle = (values[1:] + values[:-1]) / 2
    out: Array = np.diff(t) @ middle
    return out


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
