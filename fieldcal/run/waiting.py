"""Waits for the device to rest in the requested position, block by block.

Nothing here reads a device or talks to an operator: the engine does both.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.positions import Position, specific_forces
from fieldcal.core.samples import CHANNELS, Array, Block, concat
from fieldcal.core.sentences import join_words
from fieldcal.planning.steps import Hold
from fieldcal.run.acc_unit import acc_unit_message, reads_gravity
from fieldcal.run.gyro_unit import GyroUnitWatch
from fieldcal.run.interruptions import MAX_GAP_S
from fieldcal.run.mounting_check import wrong_mounting_message
from fieldcal.run.position_check import (
    JOINT_TOLERANCE_RAD,
    AcceptedPosition,
    PositionCheck,
    check_position,
)
from fieldcal.run.wait_reason import WaitReason, WaitState
from fieldcal.session.description import Description
from fieldcal.windows import Stillness

SETTLE_S = 1.5
"""Rest before a window begins, s: a released joint still creeps."""

SWAY_SETTLE_S = 4.0
"""Time in position before a window on a base that sways, s: the end of a small turn is
as slow as the swaying."""

REPORT_AFTER_S = 3.0
"""Rest in a wrong position before it is reported, s: people pause during a turn."""

REMIND_EVERY_S = 60.0
"""Time in the same wrong position after which it is reported again, s."""

UNTURNED_ALARM_S = 20.0
"""Time without a turn after which the operator is called, s."""

LEAST_HOST_WAIT_S = 10.0
"""Least wait by the host's clock before a position is given up, s.

For a virtual device at 80 times the speed, 90 s of device time are 1.1 s for the mover.
"""


class PositionWait:
    """Waits for the device to rest in one position.

    Parameters
    ----------
    hold : what was asked for
    about : site, mounting and nominal calibration
    previous : the position that was accepted before, if any
    interrupted : whether a motion has just broken off a window in this position
    units : determines the gyroscopes' unit
    doubted : a later position that was accepted although it looked wrong

    Attributes
    ----------
    meter : present motion as part of what is allowed; below 1 is rest
    arrival : where the device rests, None while it moves
    where : where it is, also while it moves; None while that is unknown
    f : (3,) specific force at rest, procedure axes, m/s^2; None while it moves
    waited : s of samples since it was asked for, by the device's clock, in which nobody
        was turning it
    waited_host : the same by the host's clock

    """

    def __init__(
        self,
        hold: Hold,
        about: Description,
        previous: AcceptedPosition | None,
        interrupted: bool = False,
        units: GyroUnitWatch | None = None,
        doubted: AcceptedPosition | None = None,
    ) -> None:
        self._hold, self._about = hold, about
        self._previous, self._interrupted = previous, interrupted
        self._doubted = doubted
        self._units = units
        self._address = str(about.raw.get("run", {}).get("device", ""))
        self._others = _other_positions(hold, about)
        self._first: Array | None = None
        self._turned = False
        self._start()
        self._last = self._last_host = self._stirred = np.nan
        self._latest = self._latest_host = 0.0
        self.waited = self.waited_host = 0.0

    def _start(self) -> None:
        self._stillness = Stillness(self._about.base_sways)
        self._resting = _RestSamples()
        self._told = -np.inf
        self._told_of: Array | None = None
        self.arrival: PositionCheck | None = None
        self._there = np.nan
        self.where: PositionCheck | None = None
        self.f: Array | None = None

    @property
    def meter(self) -> float:
        """Present motion over the allowed motion."""
        return self._stillness.meter

    @property
    def seconds(self) -> float:
        """Rest so far, s."""
        return self._resting.seconds

    def add(self, block: Block, host: float) -> None:
        """Take in the block that follows; time without samples is not counted.

        `host` is the time by the host's clock, s.

        Raises
        ------
        InputError
            If an axis of the accelerometers gives no value, also at rest.

        """
        since = self._last_host if self._last_host < host else host
        self._latest_host = min(MAX_GAP_S, host - since)
        self._last_host = host
        gap = float(block.t[0]) - self._last > MAX_GAP_S
        if gap:
            self._start()
        began = float(block.t[0]) if gap or np.isnan(self._last) else self._last
        self._last = float(block.t[-1])
        self._latest = self._last - began
        self.waited += self._latest
        self.waited_host += self._latest_host
        self._stillness.add(block)
        self._resting.add(block, self._stillness.since)
        if self._stillness.since is not None or np.isnan(self._stirred):
            self._stirred = self._last
        if self._resting.seconds > 0:
            acc = self._resting.block.acc
            if self._resting.seconds > REPORT_AFTER_S:
                self._check_axes(acc)
            self.f = measured_force(acc, self._about)
            self.where = self.arrival = self._check_position(self.f)
            self._first = self.f if self._first is None else self._first
            self._turned |= self._has_moved_from(self._first)
        else:
            self.arrival, self.f = None, None
            now = self._check_position(measured_force(block.acc, self._about))
            self.where = replace(now, ok=False)
        if self.arrival is None or not self.arrival.ok:
            self._there = np.nan
        elif np.isnan(self._there):
            self._there = self._last

    def _check_axes(self, acc: Array) -> None:
        """Refuse accelerometers without an axis: no wait would show the position."""
        lacks = np.flatnonzero(~np.isfinite(acc).any(axis=0))
        if len(lacks):
            names = join_words([CHANNELS[axis] for axis in lacks])
            give = "give" if len(lacks) > 1 else "gives"
            raise InputError(
                f"{self._hold.position.name}: {names} {give} no value, so nobody can"
                " tell the position: name the columns of all three accelerometers, or"
                " repair the device"
            )

    def _check_position(self, f: Array) -> PositionCheck:
        """Compare a force with the position, by the change since an earlier one.

        Where the operator insisted, either the device stood wrong or the check was
        wrong, as if its mount had slipped: this position may go by either.
        """
        wanted, g = self._hold.position, self._about.gravity
        known, address = self._others, self._address
        check = check_position(wanted, f, g, self._previous, known, address)
        if check.ok or self._doubted is None:
            return check
        other = check_position(wanted, f, g, self._doubted, known, address)
        return other if other.ok else check

    @property
    def rates_at_rest(self) -> Array:
        """Rates of the last second at rest, (n, 3) rad/s; none while it moves."""
        return self._resting.block.gyr if self.seconds > 0 else np.zeros((0, 3))

    @property
    def arrived(self) -> bool:
        """Whether the device rests in the requested position."""
        there = self.arrival is not None and self.arrival.ok
        swung = not self._about.base_sways or self._last - self._there >= SWAY_SETTLE_S
        return there and swung and self.seconds >= SETTLE_S

    @property
    def may_insist(self) -> bool:
        """Whether the operator may insist on the position: at rest, about gravity."""
        if self.f is None or self.seconds < SETTLE_S:
            return False
        return reads_gravity(float(np.linalg.norm(self.f)), self._about.gravity)

    @property
    def reason(self) -> WaitReason:
        """The present reason for waiting."""
        if self._stillness.since is None:
            if wrong := self._wrong_unit():
                return WaitReason(WaitState.WRONG_UNIT, wrong)
            measured = np.isfinite(self.meter)
            return WaitReason(WaitState.MOVING if measured else WaitState.LISTENING)
        if self.arrival is not None and not self.arrival.ok:
            if self.seconds < REPORT_AFTER_S:
                return WaitReason(WaitState.TURNING)
            return WaitReason(WaitState.MISPLACED, self.problem)
        return WaitReason(WaitState.SETTLING)

    def _wrong_unit(self) -> str:
        """What shows a wrong unit while the device does not come to rest by it."""
        units, moving = self._units, self._last - self._stirred
        if units is None or units.notice:
            return units.notice if units else ""
        said, norm, g = [], units.steady_norm(moving), self._about.gravity
        if np.isfinite(norm) and not reads_gravity(norm, g):
            said.append(acc_unit_message(norm, g, self._address))
        return "; ".join(filter(None, [*said, units.question(moving)]))

    @property
    def problem(self) -> str:
        """What is wrong with the position, in one sentence; empty if nothing is."""
        if self.arrival is None or self.arrival.ok or self.f is None:
            return ""
        problem = self.arrival.problem
        if self._previous is None and self.may_insist:
            problem = self._wrong_mounting() or problem
        number = self._hold.index + 1
        if self._interrupted:
            problem = f"turned too early, position {number} is not done: {problem}"
        return problem

    def _wrong_mounting(self) -> str:
        """Notice for a device that rests on another face; empty if it does not."""
        if self.f is None or not self._hold.position.oriented:
            return ""
        wanted = specific_forces([self._hold.position], self._about.gravity)[0]
        device = self._about.mounting.T @ self.f
        said = wrong_mounting_message(device, wanted, self._about.axes)
        problem = self.arrival.problem if self.arrival else ""
        return said and f"{said}; else {problem}"

    def discount_latest(self) -> None:
        """Do not count the latest block as waiting: the device is still being turned.

        What was waited before counts: a mover that is told once more, and turns nothing
        again, must not be waited for without end.
        """
        self.waited -= self._latest
        self.waited_host -= self._latest_host
        self._latest = self._latest_host = 0.0

    def has_waited_enough(self, give_up: float) -> bool:
        """Whether the wait exceeds `give_up` s by device and by host time."""
        least = min(give_up, LEAST_HOST_WAIT_S)
        return self.waited > give_up and self.waited_host > least

    def alarm_due(self) -> float | None:
        """Whether to call the operator now: once per wrong position, then every minute.

        Returns the time waited, s, for a reminder; 0 for the first call; None for no
        call.
        """
        if self.reason.state is not WaitState.MISPLACED or self.f is None:
            return None
        again = not self._has_moved_from(self._told_of)
        if again and self.waited - self._told < REMIND_EVERY_S:
            return None
        if not self._turned and self.waited < UNTURNED_ALARM_S:
            return None
        self._told, self._told_of = self.waited, self.f
        return self.waited if again else 0.0

    def _has_moved_from(self, place: Array | None) -> bool:
        """Whether the force differs from `place` by more than a gust could cause."""
        if place is None or self.f is None:
            return True
        away = float(np.linalg.norm(self.f - place))
        return bool(away > JOINT_TOLERANCE_RAD * self._about.gravity)


def _other_positions(hold: Hold, about: Description) -> dict[str, Position]:
    """The plan's other positions, by the notice if the device is in one of them."""
    others = {}
    for i, position in enumerate(about.positions):
        if _same_angles(position, hold.position):
            continue
        comes = f", position {hold.index + 1} comes first" if i > hold.index else ""
        others[f"this is position {i + 1}{comes}"] = position
    return others


def _same_angles(one: Position, other: Position) -> bool:
    angles = [(p.alpha, p.beta, p.gamma) for p in (one, other)]
    return angles[0] == angles[1]


def measured_force(acc: Array, about: Description) -> Array:
    """Mean specific force in procedure axes by the nominal calibration, (3,).

    `acc` is (n, 3) m/s^2, device axes.
    """
    nominal = about.nominal
    known = np.isfinite(acc).any(axis=0)
    mean = np.full(3, np.nan)
    mean[known] = np.nanmean(acc[:, known], axis=0)
    f = (mean - nominal["acc_bias"]) / nominal["acc_scale"]
    turned: Array = about.mounting @ f
    return turned


class _RestSamples:
    """The last second of samples since the device came to rest."""

    def __init__(self) -> None:
        self._blocks: list[Block] = []
        self.seconds = 0.0

    def add(self, block: Block, still_since: float | None) -> None:
        if still_since is None:
            self._blocks, self.seconds = [], 0.0
            return
        self.seconds = float(block.t[-1] - still_since)
        self._blocks.append(block)
        while len(self._blocks) > 1 and block.t[-1] - self._blocks[1].t[0] > 1.0:
            self._blocks.pop(0)

    @property
    def block(self) -> Block:
        return concat(self._blocks)
