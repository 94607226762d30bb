"""Causes of a device in motion that is compared with a reference.

Always included are bias and scale factor of both triads, the difference of the two
clocks, the rotation between the two sets of axes, and free values for channels that the
reference lacks. Effects that change positions do not apply. Coloured noise is included
in the weights of the rows, so it needs no columns.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.model import priors
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.cause import TRIADS, Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.effect_causes import effect_causes
from fieldcal.model.causes.unknown_causes import unknown_causes
from fieldcal.model.causes.wander import Wander
from fieldcal.model.rows.motion import MotionRows
from fieldcal.physics.effect import Motion

REFERENCE_NOISE = "reference_noise"
"""Cause that a reference has noise of its own."""


class CurrentAlignment:
    """Rows at the current alignment with the reference, as all columns use them.

    Attributes
    ----------
    rows : rows at that alignment
    change : (n, 6) time derivatives of force, m/s^3, and rate, rad/s^2

    """

    def __init__(self, rows: MotionRows) -> None:
        self.realign(rows)

    def realign(self, rows: MotionRows) -> None:
        """Take the same rows at another alignment."""
        self.rows = rows
        self.change = rows.motion(rows.gyr, 1)
        if rows.gyr is not rows.acc:
            self.change[:, ACC] = rows.motion(rows.acc, 1)[:, ACC]
        self.__dict__.pop("hidden", None)

    @cached_property
    def hidden(self) -> Array:
        """What noise of the reference hides of the rows, (n, 6), if it is asked for."""
        return self.rows.hidden()


class MotionDictionary(Dictionary):
    """All columns of rows in motion.

    Parameters
    ----------
    rows : of the recording
    unit : (6,) outputs per SI unit

    Attributes
    ----------
    current : rows at the current alignment
    gyro_inputs : inputs of the gyroscopes; those of the accelerometers unless the
        responses of the two triads differ
    missing_channels : channels that the reference lacks
    clock, turn, unseen : first column of delay and drift, of the rotation about three
        axes, and of the constant values of missing channels

    """

    def __init__(self, rows: MotionRows, unit: Array) -> None:
        self.current = CurrentAlignment(rows)
        self.gyro_inputs = x = rows.experience(rows.acc)
        since = np.full((1, len(x)), np.inf)
        common = np.zeros((len(np.unique(x.position)), 6))
        super().__init__(x, rows.used, since, common, unit, False, Wander.none())

    def realign(self, rows: MotionRows) -> None:
        """Take the same rows at another alignment; causes stay as they are."""
        self.current.realign(rows)
        self.x = self.gyro_inputs = rows.experience(rows.acc)
        if rows.gyr is not rows.acc:
            self.gyro_inputs = rows.experience(rows.gyr)

    def _calibration(self) -> Iterator[Group]:
        """Groups of bias, scale factor, clocks, rotation and missing channels."""
        yield from super()._calibration()
        current, free = self.current, priors.FREE_SIZE
        self.missing_channels = missing = current.rows.reference.missing_channels

        def clock(view: RowView) -> Array:
            change = current.change
            since = current.rows.middles - current.rows.alignment.middle
            # of (1) of `rows.motion`
            by = np.stack([-change, change * since[:, None]], axis=2)
            out: Array = view.state.scale[:, None] * by
            return out

        def turn(view: RowView) -> Array:
            v = np.hstack([view.x.f, view.x.w])
            across = [
                np.hstack([np.cross(axis, v[:, ACC]), np.cross(axis, v[:, GYR])])
                for axis in np.eye(3)
            ]
            out: Array = view.state.scale[:, None] * np.stack(across, axis=2)
            return out

        def unseen(view: RowView) -> Array:
            rotation = np.zeros((6, 6))
            rotation[ACC, ACC] = rotation[GYR, GYR] = current.rows.alignment.rotation
            turned = view.state.scale[:, None] * rotation[:, missing]
            return np.broadcast_to(turned, (len(view.x), 6, len(missing)))

        at = self.add(General("clock", clock), 2)
        self.clock = int(at[0])
        sizes = np.array([priors.CLOCK_S, priors.CLOCK_RATE])
        yield Group("clock", "", at, sizes, fixed_size=free)
        at = self.add(General("turn", turn), 3)
        self.turn = int(at[0])
        yield Group("turn", "", at, np.full(3, priors.AXES_TURNED), fixed_size=free)
        if len(missing):
            at = self.add(General("unseen", unseen), len(missing))
            self.unseen = int(at[0])
            wide = priors.UNSEEN.copy()
            wide[np.flatnonzero(current.rows.alignment.unseen_gravity)] = priors.UPRIGHT
            yield Group("unseen", "", at, wide[missing], fixed_size=1.0)

    def _causes(self) -> Iterator[Cause]:
        """Effects that do not move positions, and functions without physics."""
        for cause in effect_causes(self):
            effect = cause.variants[0].effect
            if not isinstance(effect, Motion) or effect.on_the_way:
                yield cause
        yield from self._reference_noise()
        yield from unknown_causes(self)

    def _reference_noise(self) -> Iterator[Cause]:
        """What noise of the reference hides of the motion, by triad."""
        current = self.current

        def hidden(view: RowView) -> Array:
            out = np.zeros((*current.hidden.shape, 2))
            for i, triad in enumerate((ACC, GYR)):
                out[:, triad, i] = -view.state.scale[triad] * current.hidden[:, triad]
            return out

        at = self.add(General(REFERENCE_NOISE, hidden), 2)
        for i, (part, channels) in enumerate(TRIADS):
            if self.used[:, channels].any():
                group = Group(REFERENCE_NOISE, part, at[i : i + 1], np.ones(1))
                yield Cause(
                    REFERENCE_NOISE, part, priors.REFERENCE_NOISE_CHANCE, (group,),
                    "noise",
                )  # fmt: skip

    def _unoriented_earth(self) -> Iterator[Group]:
        """None: the reference contains the Earth's rate if it measures it."""
        yield from ()

    def _is_unoriented(self, p: int) -> bool:
        """False: the reference gives the direction of the force."""
        return False

    def _instability(self) -> None:
        """None: offsets of stretches are in the noise of the slowest coefficients."""
        self.typical_instability = np.zeros(7)
