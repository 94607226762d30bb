"""The joints of the fixture creep: each overshoots in a turn, and relaxes.

    theta_j(t) = A_j sum_k d_jk h(t - t_k),    h(s) = exp(-s / tau)  (s >= 0)

t_k, s, the end of each turn so far, d_jk = 1, -1, 0 if the angle of joint j rose, fell
or stayed in it; A in degrees, tau 1 to 60 s; on the way, h goes smoothly from 0 to 1. A
device that is turned by a small theta about e reads

    f' = f - theta e x f,    w' = w - theta e x w + theta' e              (1)

with e the axis of the joint; while beta is turned, alpha carries its axis along, and
the second term is none of its own. So the axes across gravity creep together,
gyroscopes see it go, and the length of the force stays: no bias that settles does that.
Source: kinematics of a small rotation (Titterton and Weston 2004, 3.6); belts, gears,
rubber and plastic creep back after a load (standard linear solid).

>>> import numpy as np
>>> from fieldcal.physics.joint_turns import JointTurns
>>> angles = np.array([[0, 0, 0], [np.pi / 2, 0, 0]])
>>> turned = JointTurns.of(np.array([0.0, 10.0]), angles)
>>> x = Experience.at_rest(
...     angles[:, 0], np.zeros(2), 10.0, t=np.array([5.0, 14.0]), joint_turns=turned)
>>> by = JointCreep().design(x, {"tau_s": 4.0})  # of one degree of alpha, of beta
>>> np.round(by[1, :, 0], 4) + 0.0
array([ 0.    ,  0.0642,  0.    ,  0.    ,  0.    , -0.0016])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.rotation import cross
from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience
from fieldcal.physics.shape import Shape

ONSET_S = 1.0
"""Time before the end of a turn in which a joint is taken to overshoot, s: about the
joint's own axis it does not matter when."""


class JointCreep(Sensor):
    """Angles of the joints that relax after each turn."""

    of_inputs = True
    params = (Param("alpha_deg", "deg", 0.1), Param("beta_deg", "deg", 0.1))
    shapes = (Shape("tau_s", "s", 0.7, 60.0, "joint"),)
    covariate = "time since the turn, along what each joint turns"
    seen_in = "transient"
    decided_by = "a longer wait between the turn and the window"
    cure = (
        "Wait longer after each turn before the window begins, or lock the joints; "
        "come to every position from the same side."
    )
    source = "creep of belts, gears and rubber after a load; 0.01 to 0.5 deg, 1 to 60 s"

    def applies(self, x: Experience) -> bool:
        """Where it is known when a joint was turned, and from which side."""
        turned = bool(x.joint_turns.side.any())
        return turned and not bool(x.rate.any())

    def chance(self, x: Experience) -> float:
        """Of two hundred sessions one has joints that creep so that it shows."""
        return 5e-3

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Change of the outputs for a degree of each joint, (1), (n, 6, 2)."""
        turns, out = x.joint_turns, np.zeros((len(x), 6, 2))
        if not len(turns.at):
            return out
        axes = turns.axes(x.t, ONSET_S, x.mounting)
        followed = np.isfinite(x.alpha_axis).all(axis=1)
        axes[followed, :, 0] = x.alpha_axis[followed]
        angle, rate = self._course(x, shape["tau_s"])
        # in a turn beta carries the device as it has crept; alpha carries beta's axis
        carried = angle * np.column_stack([x.position >= 0, np.ones(len(x), bool)])
        for j in (0, 1):
            axis = axes[:, :, j]
            out[:, :3, j] = cross(x.f, axis) * angle[:, j, None]
            out[:, 3:, j] = axis * rate[:, j, None]
            out[:, 3:, j] += cross(x.w, axis) * carried[:, j, None]
        out *= np.deg2rad(1.0)
        return out

    @staticmethod
    def _course(x: Experience, tau: float) -> tuple[Array, Array]:
        """Sum of all turns so far, (n, 2), and its rate of change, 1/s."""
        turns = x.joint_turns
        since = np.subtract.outer(x.t, turns.at)
        over, on_way = since >= 0, (since > -ONSET_S) & (since < 0)
        h, speed = np.zeros_like(since), np.zeros_like(since)
        phase = 2 * np.pi * (1 + since[on_way] / ONSET_S)
        h[on_way] = (phase - np.sin(phase)) / (2 * np.pi)
        speed[on_way] = (1 - np.cos(phase)) / ONSET_S
        half = x.lasts / (2 * tau)  # a row is a mean over some time
        mean = np.where(half > 0, np.sinh(half) / np.maximum(half, 1e-300), 1.0)
        row = np.nonzero(over)[0]
        h[over] = mean[row] * np.exp(-since[over] / tau)
        speed[over] = -h[over] / tau
        angle: Array = h @ turns.side
        rate: Array = speed @ turns.side
        return angle, rate
