"""The ways between windows: as the gyroscopes tell them, and how they come out again.

The course of a turn was the hand's. The virtual device is carried along it by the
angles that a model of the device reads from the recorded gyroscopes, taken straight to
where the next window holds it:

    a_k = log(R_k R_{k-1}^T) - R_k phi (u_k - u_{k-1})

with attitude R, closure phi and the part u of the turn that is done, as in
`model.turn`. What the sensors put out on it is the virtual device's own physics,
and is compared with what they did put out: the accelerometers' means over parts of the
way, and the gyroscopes' integrals from its start to its end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.model.turns.attitude import vee
from fieldcal.model.turns.turn import Turn
from fieldcal.sim_device.way import Manoeuvre


@dataclass(frozen=True, slots=True)
class WayDifference:
    """Recorded less replayed on the ways.

    Attributes
    ----------
    force : rms of the accelerometers' means, m/s^2; nan without a way
    angle : rms of the gyroscopes' integrals, rad; nan without a way

    """

    force: float
    angle: float


def way_of(turn: Turn, start: float) -> Manoeuvre:
    """The way of a turn, in procedure axes and s since `start`."""
    steps = turn.attitude[1:] @ np.swapaxes(turn.attitude[:-1], 1, 2)
    sine = -vee(steps)
    size = np.linalg.norm(sine, axis=1)
    longer = np.arcsin(np.minimum(size, 1.0)) / np.where(size > 0, size, 1.0)
    small = sine * np.where(size > 0, longer, 1.0)[:, None]
    small = small - np.diff(turn.done)[:, None] * (turn.attitude[1:] @ turn.closure)
    total = np.vstack([np.zeros(3), np.cumsum(small, axis=0)])
    return Manoeuvre(turn.t - start, turn.x.mounting @ total.T)


def apart(turns: Sequence[Turn], recorded: Block, replayed: Block) -> WayDifference:
    """How far a replay is from the recording on the ways.

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
        return WayDifference(np.nan, np.nan)
    return WayDifference(_rms(np.concatenate(forces)), _rms(np.concatenate(angles)))


def trapezoid(values: Array, t: Array) -> Array:
    """Integral of a course (n, 3) by the trapezoid rule, (3,)."""
    middle = (values[1:] + values[:-1]) / 2
    out: Array = np.diff(t) @ middle
    return out


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
