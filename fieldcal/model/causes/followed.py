"""Causes of a device in motion, whose motion a reference follows moment by moment.

Always included are bias and scale factor of both triads, the difference of the two
clocks, the rotation between the two sets of axes, and free values for channels that the
reference lacks. Effects that move positions do not exist here, and coloured noise is in
the weights of the rows.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.model import priors
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.columns import General, RowView
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.effect_causes import of_effects
from fieldcal.model.causes.unknown_causes import of_no_effect
from fieldcal.model.causes.wander import Wander
from fieldcal.model.rows.motion import MotionRows
from fieldcal.physics.effect import Motion


class Place:
    """Where the recording stands beside its reference now, for all columns.

    Attributes
    ----------
    rows : at that alignment
    change : (n, 6) of what the device goes through, per second

    """

    def __init__(self, rows: MotionRows) -> None:
        self.moved(rows)

    def moved(self, rows: MotionRows) -> None:
        """Take the same rows at another alignment."""
        self.rows = rows
        self.change = rows.motion(rows.gyr, 1)
        if rows.gyr is not rows.acc:
            self.change[:, ACC] = rows.motion(rows.acc, 1)[:, ACC]


class MotionDictionary(Dictionary):
    """All columns of rows in motion.

    Parameters
    ----------
    rows : of the recording
    unit : (6,) outputs per SI unit

    Attributes
    ----------
    place : where the recording stands beside its reference
    later : the inputs of the gyroscopes, where these are known to follow otherwise
    lost : channels that the reference lacks
    clock, turn, unseen : first column of delay and drift, of the turn about three axes,
        and of what is constant in the lost channels

    """

    def __init__(self, rows: MotionRows, unit: Array) -> None:
        self.place = Place(rows)
        self.later = x = rows.experience(rows.acc)
        since = np.full((1, len(x)), np.inf)
        common = np.zeros((len(np.unique(x.position)), 6))
        super().__init__(x, rows.used, since, common, unit, False, Wander.none())

    def moved(self, rows: MotionRows) -> None:
        """Take the same rows at another alignment; causes stay as they are."""
        self.place.moved(rows)
        self.x = self.later = rows.experience(rows.acc)
        if rows.gyr is not rows.acc:
            self.later = rows.experience(rows.gyr)

    def _calibration(self) -> Iterator[Group]:
        """Bias and scale factor, and where the two stand beside each other."""
        yield from super()._calibration()
        place, free = self.place, priors.FREE
        self.lost = lost = place.rows.reference.lost

        def clock(view: RowView) -> Array:
            change = place.change
            since = place.rows.middles - place.rows.alignment.middle
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
            both = np.zeros((6, 6))
            both[ACC, ACC] = both[GYR, GYR] = place.rows.alignment.rotation
            some = view.state.scale[:, None] * both[:, lost]
            return np.broadcast_to(some, (len(view.x), 6, len(lost)))

        self.clock = self.add(General("clock", clock), 2)
        sizes = np.array([priors.CLOCK_S, priors.CLOCK_RATE])
        yield Group("clock", "", self.clock + np.arange(2), sizes, fixed=free)
        self.turn = self.add(General("turn", turn), 3)
        at = self.turn + np.arange(3)
        yield Group("turn", "", at, np.full(3, priors.AXES_TURNED), fixed=free)
        if len(lost):
            self.unseen = self.add(General("unseen", unseen), len(lost))
            at = self.unseen + np.arange(len(lost))
            wide = priors.UNSEEN.copy()
            wide[np.flatnonzero(place.rows.alignment.unseen)] = priors.UPRIGHT
            yield Group("unseen", "", at, wide[lost], fixed=1.0)

    def _causes(self) -> Iterator[Cause]:
        """Effects that do not move positions, and functions without physics."""
        for cause in of_effects(self):
            effect = cause.variants[0].effect
            if not isinstance(effect, Motion) or effect.on_the_way:
                yield cause
        yield from of_no_effect(self)

    def _unoriented_earth(self) -> Iterator[Group]:
        """The reference says whether it feels the Earth turn."""
        yield from ()

    def _is_free(self, p: int) -> bool:
        """The reference says where the force points."""
        return False

    def _instability(self) -> None:
        """What a stretch is off by is in the power of its slowest coefficients."""
        self.unstable = np.zeros(7)
