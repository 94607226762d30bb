"""Carries out plans on a device, with an operator.

All received samples are recorded, whatever else happens. All waiting is counted in
device time, so a virtual device may run faster than the wall clock.

A hold goes through three phases. *Turning*: until the device has come to rest in the
position; a wrong position is reported, and nothing is averaged there. *Averaging*:
until the window is long enough; after a disturbance the part before it is kept if the
attitude is unchanged, otherwise the window begins again. *Taken*: the window is marked
and its average returns to the plan. The average of a position that was taken before the
link broke or the process was killed is returned at once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from fieldcal.core.errors import FieldcalError, Moved, Skipped, WrongPosition
from fieldcal.core.positions import Position
from fieldcal.core.samples import Block
from fieldcal.drivers.driver import Driver
from fieldcal.planning.steps import Add, Hold, Judge, Note, Plan, Repeat, Step
from fieldcal.run.incoming import SILENCES_UNTIL_TOLD, IncomingSamples
from fieldcal.run.interruptions import (
    WindowDisturbed,
    is_motion,
    kept_notice,
    restart_notice,
)
from fieldcal.run.link_marks import MarkedRecorder
from fieldcal.run.operator.desk import (
    OperatorDesk,
    confirmation_question,
    left_out_error,
)
from fieldcal.run.operator.protocol import Display, Operator
from fieldcal.run.position_check import AcceptedPosition
from fieldcal.run.sample_watches import SampleWatches
from fieldcal.run.wait_reason import WaitReason, WaitState, reminder
from fieldcal.run.waiting import PositionWait, measured_force
from fieldcal.run.warm_up import WarmUpWatch
from fieldcal.run.window_taking import WindowTaker
from fieldcal.session.description import Description
from fieldcal.session.marks import POSITION_ADDED
from fieldcal.session.position_tables import position_table
from fieldcal.windows import Average

R = TypeVar("R")


class Engine:
    """One device, one operator, one session on disk.

    Parameters
    ----------
    driver : the device
    operator : who turns it
    about : the session's description; site, mounting and nominal calibration serve to
        judge where the device is
    recorder : the session folder being written
    give_up : s of device time away from the position after which the hold is given up,
        if the host's clock has advanced as well; None, as for a person, waits for ever
        and repeats a disturbed window for ever
    taken : averages of positions taken before, by number; new ones are added
    warm_up : judges whether the device is still warming up; None does not ask
    lost_share : share of a window's samples that may be missing; with more it is taken
        again, if that helps
    judge : evaluates the windows taken so far, quickly or in full
    added : positions of the session beyond the planned ones; new ones are appended
    left_out : numbers of positions that the operator has left out, which are not asked
        for again; new ones are added
    insisted : numbers of positions that were taken although they looked wrong; new ones
        are added

    """

    def __init__(
        self,
        driver: Driver,
        operator: Operator,
        about: Description,
        recorder: MarkedRecorder,
        give_up: float | None = None,
        taken: dict[int, Average] | None = None,
        warm_up: WarmUpWatch | None = None,
        lost_share: float = np.inf,
        judge: Callable[[bool], object] = lambda quick: None,
        added: list[Position] | None = None,
        left_out: set[int] | None = None,
        insisted: set[int] | None = None,
    ) -> None:
        self._driver = driver
        self._operator = operator
        self._about = about
        self._recorder = recorder
        self._give_up = give_up
        self._taken = {} if taken is None else taken
        self._warm_up = warm_up
        self._judge = judge
        self._added = [] if added is None else added
        self._left_out = set[int]() if left_out is None else left_out
        self._insisted = set[int]() if insisted is None else insisted
        self._held: AcceptedPosition | None = None
        self._doubted: AcceptedPosition | None = None
        self._hold_now: Hold | None = None
        self._before: int | None = None
        self._restarts = driver.health.restarts
        self._watches = SampleWatches(driver, about)
        self._desk = OperatorDesk(operator, recorder)
        self._display = Display(operator, driver, self._left_out)
        self._incoming = IncomingSamples(
            driver, recorder, self._on_samples, self._on_piece
        )
        self._windows = WindowTaker(
            driver, about, recorder, self._desk, self._display, self._incoming,
            lost_share,
        )  # fmt: skip
        driver.on_silence = self._on_silence
        if warm_up:
            warm_up.forget()  # a link opened again: nobody knows whether it was off

    def run(self, plan: Plan[R]) -> R:
        """Carry out a plan and return its result.

        An error of ours while doing a step is thrown into the plan at that step, which
        may catch it and go on; anything else ends the run.

        Raises
        ------
        Again
            If the operator wants a position that was taken already once more.

        """
        reply: object = None
        error: FieldcalError | None = None
        if self._before not in self._taken:  # discarded: others are not judged by it
            self._held = self._doubted = self._before = None
        try:
            while True:
                step = plan.throw(error) if error else plan.send(reply)
                reply, error = None, None
                try:
                    reply = self._carry_out(step)
                except (Moved, WrongPosition, Skipped) as failed:
                    error = failed
        except StopIteration as done:
            result: R = done.value
            return result
        finally:
            self._incoming.end()

    def _carry_out(self, step: Step) -> object:
        match step:
            case Hold():
                average = self._taken.get(step.index)
                if average is None:
                    average = self._hold_unless_left_out(step)
                    self._taken[step.index] = average
                else:
                    self._display.show_taken_before(step, average)
                if step.position.oriented:
                    f = measured_force(average.mean[None, :3], self._about)
                    self._note_reference(step.index, AcceptedPosition(step.position, f))
                self._before = step.index
                return average
            case Note(text):
                self._desk.tell(text)
                return None
            case Add():
                return self._add_position(step)
            case Repeat(index):
                self._desk.repeat(index)
                return None
            case Judge(quick):
                return self._judge(quick)

    def _note_reference(self, index: int, here: AcceptedPosition) -> None:
        """Note the position by which the next one is judged."""
        if index in self._insisted:
            self._doubted = here
        else:
            self._held, self._doubted = here, None

    def _add_position(self, step: Add) -> int:
        """Add a position to the session; returns its number."""
        position = step.position
        number = len(self._about.positions) + len(self._added)
        self._left_out.discard(number)
        where = position_table(position)
        if step.seconds is not None:
            where["seconds"] = step.seconds
        if self._taken.pop(number, None) is not None:
            # what was to verify was held behind fewer positions, at other angles
            self._recorder.mark("repeated", position=number)
        self._recorder.mark(POSITION_ADDED, position=number, **where)
        self._added.append(position)
        return number

    def _hold_unless_left_out(self, hold: Hold) -> Average:
        """Hold a position, unless the operator has left it out before."""
        if hold.index in self._left_out:
            raise left_out_error(hold)
        try:
            return self._hold(hold)
        except Skipped:
            self._left_out.add(hold.index)
            raise

    def _hold(self, hold: Hold) -> Average:
        self._hold_now, tries = hold, 0
        while True:
            name = hold.position.name
            self._recorder.mark("asked", position=hold.index, name=name)
            self._insisted.discard(hold.index)
            self._operator.place(hold)
            try:
                average = self._average_position(hold)
            except Moved as moved:
                if self._give_up is not None:
                    raise
                tries += is_motion(moved)
                self._desk.tell(restart_notice(moved, tries))
                continue
            if average is not None:
                return average

    def _average_position(self, hold: Hold) -> Average | None:
        """Average a window, including the undisturbed part before a disturbance.

        None if the operator wants to begin it again.
        """
        pieces, same = self._windows.new_window(), self._incoming.source_state
        while True:
            self._wait_for_arrival(hold)
            if self._incoming.source_state != same:  # the device changed
                pieces, same = self._windows.new_window(), self._incoming.source_state
            away = self._incoming.breaks
            try:
                average = self._windows.average(hold, pieces)
                if average is not None:
                    self._watches.add_window(average)
                    self._warn_if_warming_up()
                    self._warn_of_samples(hold)
                return average
            except WindowDisturbed as disturbed:
                moved, kept = disturbed.moved, disturbed.kept
                self._desk.tell(kept_notice(moved, kept, hold.seconds, pieces.dropped))
            if self._incoming.breaks != away:  # it may have been turned meanwhile
                self._operator.place(hold)

    def _on_samples(self, block: Block) -> None:
        """Look at samples that have just been recorded."""
        self._display.note_samples(block)
        if self._restarts != self._driver.health.restarts:
            self._restarts = self._driver.health.restarts
            if self._warm_up:
                self._warm_up.forget()

    def _on_piece(self, piece: Block) -> None:
        """Look at a short stretch of samples, however long the block that it is of."""
        self._watches.add(piece)
        if self._warm_up:
            self._warm_up.add(piece)

    def _on_silence(self) -> None:
        """Report that no samples arrive, and why."""
        reason = self._incoming.note_silence()
        if reason:
            if self._hold_now:
                self._display.show_silence(self._hold_now, reason)
            if self._incoming.silence == SILENCES_UNTIL_TOLD:
                self._desk.alarm(reason)
        self._desk.stop_if_wanted()

    def _wait_for_arrival(self, hold: Hold) -> None:
        """Wait until the device rests where it should."""
        left = self._windows.disturbed_index == hold.index
        waiting = PositionWait(
            hold, self._about, self._held, left, self._watches.units, self._doubted
        )
        asked = self._driver.host_time()
        insisted = warned = False
        shown = WaitState.NOTHING
        away = self._incoming.breaks
        for block in self._incoming.pieces:
            if self._incoming.breaks != away:  # its position is unknown now
                away = self._incoming.breaks
                self._operator.place(hold)
            if block.t_host[-1] < asked:
                continue  # it waited in the link: where the device was before
            waiting.add(block, self._driver.host_time())
            if not (waiting.may_insist and waiting.problem):
                insisted = False  # moved since: that place is not asked about
            wish = self._desk.wish(hold)
            if wish == "repeat":
                self._desk.repeat(self._before)
            if wish == "confirm" and shown is WaitState.WARMING_UP and self._warm_up:
                self._warm_up.waived = True  # only what was read can be waived
            elif wish == "confirm" and not waiting.arrived:
                if insisted:
                    self._desk.record_insistence(hold, waiting.problem)
                    self._insisted.add(hold.index)
                    return
                insisted = self._desk.ask_back(waiting)
            waits = self._warm_up is not None and self._warm_up.must_wait
            reason = confirmation_question(waiting) if insisted else waiting.reason
            if waiting.arrived and self._warm_up and self._warm_up.notice and waits:
                reason = WaitReason(WaitState.WARMING_UP, self._warm_up.notice)
            self._display.show_turning(hold, waiting, reason)
            shown = reason.state
            if waiting.arrived:
                self._watches.add_rest(waiting.rates_at_rest)
            self._warn_of_samples(hold)
            if reason.state is WaitState.WARMING_UP and not warned:
                warned = True
                self._desk.alarm(reason)
            if waiting.arrived and not waits and wish != "wait":
                return
            self._report_wrong_place(hold, waiting, quiet=wish == "wait")
        raise AssertionError("blocks() ends in an exception only")

    def _warn_of_samples(self, hold: Hold) -> None:
        """Say once a position what is wrong with the samples: a unit, two devices."""
        for notice in self._watches.new_notices(hold.index):
            self._desk.tell(notice)

    def _report_wrong_place(
        self, hold: Hold, waiting: PositionWait, quiet: bool
    ) -> None:
        """Report that the device rests in a wrong position, and finally give up."""
        if quiet:
            waiting.discount_latest()
        elif (waited := waiting.alarm_due()) is not None:
            text = reminder(waited) + waiting.problem
            self._recorder.mark("wrong", position=hold.index, text=text)
            self._operator.alarm(waiting.reason, waited)
            if waited and self._give_up:
                self._operator.place(hold)  # a mover can be told once more
        if waiting.arrived or not self._give_up:
            return
        if waiting.has_waited_enough(self._give_up):
            what = (
                waiting.problem
                or f"it has not come to rest in {waiting.waited:.0f} s"
                "; if it is the base that sways, say so with --sways"
            )
            raise WrongPosition(f"{hold.position.name}: {what}")

    def _warn_if_warming_up(self) -> None:
        if self._warm_up and (said := self._warm_up.notice):
            self._desk.tell(said)
