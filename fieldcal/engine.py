"""Carries out plans: the one place where a procedure meets a device and a person.

Every sample that comes is recorded, whatever else happens; all waiting is counted in
device time, so a virtual device may run faster than the wall clock and nothing changes.

A hold goes through three phases. *Turning*: until the device has come to rest where it
was asked to be; a wrong place is said, and nothing is averaged there. *Averaging*:
until the window is long enough; a disturbance rejects it. *Taken*: the window is marked
and its average goes back to the plan.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TypeVar

import numpy as np

from fieldcal.arrival import Arrival, Held, judge
from fieldcal.description import Description
from fieldcal.driver import Driver
from fieldcal.errors import FieldcalError, Moved, WrongPosition
from fieldcal.link_marks import LinkMarks, Recording
from fieldcal.plan import Hold, Note, Plan, Step
from fieldcal.samples import Array, Block, concat
from fieldcal.view import Operator, Phase, View
from fieldcal.windows import Average, Noise, Stillness, Window

R = TypeVar("R")

SETTLE = 1.5
"""Rest before a window begins, s: a joint that was just let go of still creeps."""

PATIENCE = 3.0
"""Rest at a wrong place before that is said, s: a person stops in between."""

PIECE = 0.1
"""Longest stretch of samples that is looked at as one, s."""

GAP = 0.5
"""Longest time without samples inside a window, s."""


class Engine:
    """One device, one operator, one session on disk.

    Parameters
    ----------
    driver : the device
    operator : who turns it
    about : the session's description; site, mounting and nominal calibration serve to
        judge where the device is
    recorder : the session folder being written
    give_up : s of device time at a wrong place after which the hold is given up; None
        waits for ever, as for a person

    """

    def __init__(
        self,
        driver: Driver,
        operator: Operator,
        about: Description,
        recorder: Recording,
        give_up: float | None = None,
    ) -> None:
        self._driver = driver
        self._operator = operator
        self._about = about
        self._recorder = recorder
        self._give_up = give_up
        self._held: Held | None = None
        self._noise: Noise | None = None
        self._link = LinkMarks(driver, recorder)
        self._stream = self._record(driver)
        self._rate = np.nan

    def run(self, plan: Plan[R]) -> R:
        """Carry out a plan and return its result.

        An error of ours while doing a step is thrown into the plan at that step, which
        may catch it and go on; anything else ends the run.
        """
        reply: object = None
        error: FieldcalError | None = None
        try:
            while True:
                step = plan.throw(error) if error else plan.send(reply)
                reply, error = None, None
                try:
                    reply = self._do(step)
                except (Moved, WrongPosition) as failed:
                    error = failed
        except StopIteration as done:
            result: R = done.value
            return result
        finally:
            self._link.end()

    def _do(self, step: Step) -> object:
        match step:
            case Hold():
                self._recorder.mark(
                    "asked", position=step.index, name=step.position.name
                )
                self._operator.place(step)
                f = self._arrive(step)
                average = self._average(step)
                if step.position.oriented:
                    self._held = Held(step.position, f)
                return average
            case Note(text):
                self._recorder.mark("told", text=text)
                self._operator.tell(text)
                return None

    def _record(self, driver: Driver) -> Iterator[Block]:
        for block in driver.blocks():
            self._recorder.append(block)
            self._link.take(block)
            if len(block) > 1:
                self._rate = (len(block) - 1) / (block.t[-1] - block.t[0])
            yield from _pieces(block)

    def _force(self, block: Block) -> Array:
        """Mean specific force in procedure axes by the nominal calibration, (3,)."""
        nominal = self._about.nominal
        f = (np.nanmean(block.acc, axis=0) - nominal["acc_bias"]) / nominal["acc_scale"]
        force: Array = self._about.mounting @ f
        return force

    def _arrive(self, hold: Hold) -> Array:
        """Wait until the device rests where it should; specific force there, (3,)."""
        stillness, resting = Stillness(), _Resting()
        began: float | None = None
        told = False
        asked = self._driver.host_time()
        for block in self._stream:
            if block.t_host[-1] < asked:
                continue  # it waited in the link: where the device was before
            began = block.t[0] if began is None else began
            stillness.add(block)
            resting.add(block, stillness.since)
            arrival, f = None, None
            if resting.seconds > 0:
                f = self._force(resting.block)
                arrival = judge(hold.position, f, self._about.gravity, self._held)
            reason = _reason(stillness.since, arrival, resting.seconds)
            self._show("turning", hold, block, arrival, stillness.meter, reason)
            if arrival is None or f is None:
                told = False
                continue
            if arrival.ok and resting.seconds >= SETTLE:
                return f
            if not arrival.ok and resting.seconds >= PATIENCE and not told:
                self._complain(hold, arrival)
                told = True
            waited = float(block.t[-1] - began)
            if not arrival.ok and self._give_up and waited > self._give_up:
                raise WrongPosition(f"{hold.position.name}: {arrival.problem}")
        raise AssertionError("blocks() ends in an exception only")

    def _complain(self, hold: Hold, arrival: Arrival) -> None:
        """Say that it rests at a wrong place: once for each rest."""
        self._recorder.mark("wrong", position=hold.index, text=arrival.problem)
        self._operator.tell(arrival.problem)

    def _average(self, hold: Hold) -> Average:
        window = Window(noise=self._noise, grain=self._driver.grain)
        last = np.nan
        try:
            for block in self._stream:
                if block.t[0] - last > GAP:
                    raise _gap(last, float(block.t[0]))
                last = float(block.t[-1])
                window.add(block)
                if window.moved:
                    raise window.moved
                self._show_window(hold, block, window)
                if window.elapsed >= hold.seconds or window.done(hold.sigma):
                    break
            average = window.average()
        except Moved as moved:
            self._recorder.mark(
                "rejected",
                position=hold.index,
                at_s=moved.at,
                axis=moved.axis,
                text=str(moved),
            )
            raise
        self._recorder.mark(
            "window",
            position=hold.index,
            start_s=average.start,
            end_s=float(np.nextafter(average.end, np.inf)),
        )
        self._noise = window.noise and window.noise.spectrum
        self._show_window(hold, block, window, "taken")
        return average

    def _show(
        self,
        phase: Phase,
        hold: Hold,
        block: Block,
        arrival: Arrival | None,
        stillness: float,
        reason: str,
    ) -> None:
        view = View(
            phase,
            hold,
            arrival,
            stillness,
            0.0,
            np.full(6, np.nan),
            reason,
            self._rate,
            float(block.temperature[-1]),
            self._driver.health,
        )
        self._operator.show(view)

    def _show_window(
        self, hold: Hold, block: Block, window: Window, phase: Phase = "averaging"
    ) -> None:
        view = View(
            phase,
            hold,
            None,
            window.meter,
            window.elapsed,
            window.sigma,
            "",
            self._rate,
            float(block.temperature[-1]),
            self._driver.health,
        )
        self._operator.show(view)


def _pieces(block: Block) -> Iterator[Block]:
    """Cut a block, so that what the engine does is independent of how samples come."""
    edges = np.arange(block.t[0] + PIECE, block.t[-1], PIECE)
    rows = [0, *np.searchsorted(block.t, edges).tolist(), len(block)]
    for first, last in pairwise(rows):
        if last > first:
            yield block[first:last]


class _Resting:
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


def _reason(still_since: float | None, arrival: Arrival | None, resting: float) -> str:
    if still_since is None:
        return "moving: waiting for it to rest"
    if arrival is not None and not arrival.ok:
        return arrival.problem if resting >= PATIENCE else "waiting for the turn"
    return "settling"


def _gap(last: float, now: float) -> Moved:
    return Moved(
        f"no samples came between {last:.2f} s and {now:.2f} s: the window starts"
        " again; check the cable if it happens once more",
        last,
        "t",
    )
