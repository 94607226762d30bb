"""A run from its first position to its last, across losses of the link.

If the link breaks, the process is killed, or the operator repeats a position, the plan
starts again from its beginning and gets the averages of earlier windows at once. So a
run is resumed in the same way after a second and after a reboot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from time import monotonic
from typing import Any

from fieldcal import procedures
from fieldcal.acceptance.verification import planned_verification
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.errors import (
    DeviceError,
    MoverFailed,
    RecordingEnded,
    Skipped,
)
from fieldcal.core.positions import Position
from fieldcal.drivers.driver import Driver
from fieldcal.evaluation.interim_result import InterimResult
from fieldcal.planning.holding import hold_until_still, with_own_lengths
from fieldcal.planning.steps import Judge, Plan, Repeat, add, note
from fieldcal.run.companions import LeadRecorder
from fieldcal.run.engine import Engine
from fieldcal.run.interruptions import RepeatPosition
from fieldcal.run.judging import judge_session
from fieldcal.run.operator.protocol import Operator
from fieldcal.run.plan_file import WARM_UP, PlanTask
from fieldcal.run.reconnection import Reconnection
from fieldcal.run.warm_up import WarmUpWatch
from fieldcal.session.description_file import with_added_positions
from fieldcal.session.marks import (
    MARKS,
    POSITION_ADDED,
    insisted_positions,
    read_marks,
)
from fieldcal.session.recorder import Recorder
from fieldcal.windows import Average

MOST_REMEDIES = 3
"""Most remedies of a NO-GO in one run."""


class SessionRun:
    """One task on one device.

    Parameters
    ----------
    task : what is to be done
    operator : who turns the device
    recorder : the session folder
    opened : opens the device
    limits : of its grade
    patience : how long to try to open a device that is gone, s
    give_up : as of `Engine`
    taken : averages of positions taken before, by number
    until_go : whether what a NO-GO wants is asked for at once

    """

    def __init__(
        self,
        task: PlanTask,
        operator: Operator,
        recorder: Recorder | LeadRecorder,
        opened: Callable[[], Driver],
        limits: GradeLimits,
        patience: float,
        give_up: float | None,
        taken: dict[int, Average] | None = None,
        until_go: bool = False,
    ) -> None:
        self._task, self._operator, self._recorder = task, operator, recorder
        self._opened, self._patience, self._give_up = opened, patience, give_up
        self._taken = {} if taken is None else taken
        self._lost: tuple[float, DeviceError] | None = None
        wait = float(task.run.get("warm_up_s", WARM_UP))
        self._limits, self._until_go = limits, until_go
        self._added: list[Position] = []
        self._left_out: set[int] = set()
        self._so_far: InterimResult | None = None
        self._judged_changes = 0
        self._remedies = 0
        self._wanted_again: int | None = None
        self._warm_up = WarmUpWatch(limits.temperature_rate_k_min, wait)

    def run(self, driver: Driver) -> Calibration:
        """Carry the task out, beginning with a device that is open; it is closed.

        Raises
        ------
        FieldcalError
            If it cannot be done; what was recorded is kept.

        """
        while True:
            try:
                with driver:
                    return self._run_with_device(driver)
            except (MoverFailed, RecordingEnded):
                raise  # neither comes back by itself
            except DeviceError as error:
                if driver.health.samples:
                    self._lost = (monotonic(), error)
                if self._lost is None:
                    raise  # it never said anything: nothing to wait for
                # what befalls a device that has not come back since is no news
                since, first = self._lost
                back = Reconnection(self._opened, self._operator, self._recorder)
                driver = back.wait(first, since + self._patience)

    def _run_with_device(self, driver: Driver) -> Calibration:
        recorder, task = self._recorder, self._task
        if driver.notes:
            recorder.mark("device", **driver.notes)
            for text in driver.notes.get("says", ()):
                self._operator.tell(text)
        engine = Engine(
            driver,
            self._operator,
            task.about,
            recorder,
            self._give_up,
            self._taken,
            self._warm_up,
            self._limits.lost_share,
            self._judge,
            self._added,
            self._left_out,
            {*insisted_positions(read_marks(recorder.folder / MARKS))},
        )
        while True:
            try:
                return engine.run(self._plan())
            except RepeatPosition as again:
                self._taken.pop(again.index, None)
                self._left_out.discard(again.index)

    def _judge(self, quick: bool) -> InterimResult:
        """Judge the windows taken so far."""
        folder, so_far = self._recorder.folder, self._so_far
        events = [m.get("event") for m in read_marks(folder / MARKS)]
        changes = events.count("window") + events.count("repeated")
        known = changes == self._judged_changes
        if not so_far or not known or (so_far.incremental and not quick):
            so_far = judge_session(folder, self._limits, so_far if quick else None)
        self._so_far, self._judged_changes = so_far, changes
        return so_far

    def _plan(self) -> Plan[Calibration]:
        task, about = self._task, with_added_positions(self._task.about, self._added)
        name = task.procedure
        if self._added and procedures.max_positions(about, name) is None:
            name = "positions"  # whatever set it was, it has more now
        plan = procedures.load_procedure(name).plan
        steps = plan(about, task.seconds, task.sigma)
        found = yield from with_own_lengths(steps, self._own_lengths())
        about = with_added_positions(task.about, self._added)
        verification = planned_verification(about)
        if verification is not None:
            yield from self._hold_verification(len(about.positions), verification)
        elif self._until_go:
            yield from self._take_remedies()
        return found

    def _own_lengths(self) -> dict[int, float]:
        """Length of the window of each added position that has its own, s.

        What a remedy promises holds for that length, also behind a break.
        """
        marks = read_marks(self._recorder.folder / MARKS)
        added = [m for m in marks if m.get("event") == POSITION_ADDED]
        return {
            int(m["position"]): float(m["seconds"]) for m in added if "seconds" in m
        }

    def _hold_verification(self, number: int, position: Position) -> Plan[None]:
        """Hold the verification position, which is not fitted."""
        task = self._task
        if procedures.max_positions(task.about, task.procedure) is not None:
            yield from note("one more position, which is not fitted but predicted")
        try:
            yield from hold_until_still(number, position, task.seconds, task.sigma)
        except Skipped as skipped:
            yield from note(str(skipped))

    def _take_remedies(self) -> Plan[None]:
        """Take the positions that would turn a NO-GO into GO, while there are any."""
        if self._wanted_again is not None and self._wanted_again not in self._taken:
            return  # the operator left it out
        while self._remedies < MOST_REMEDIES:
            so_far: InterimResult = yield Judge()
            remedy = so_far.remedy
            if remedy is None or self._was_left_out(remedy["positions"]):
                return
            self._remedies += 1
            yield from note(f"NO-GO so far: {so_far.reasons[0]}; {remedy['says']}")
            for number in remedy["again"]:
                self._wanted_again = int(number)
                yield Repeat(number)
            places, seconds = remedy["positions"], remedy["seconds"]
            for behind, place in zip(range(len(places))[::-1], places, strict=True):
                one = Position.deg(place["alpha_deg"], place["beta_deg"])
                number = yield from add(one, seconds)
                try:
                    yield from hold_until_still(number, one, seconds, None, behind)
                except Skipped as skipped:
                    yield from note(str(skipped))
                    return

    def _was_left_out(self, places: Sequence[Mapping[str, Any]]) -> bool:
        """Whether the operator left out one of these places, by whatever number."""
        known = with_added_positions(self._task.about, self._added).positions
        out = {known[i].degrees for i in self._left_out if i < len(known)}
        wanted = {Position.deg(p["alpha_deg"], p["beta_deg"]).degrees for p in places}
        return bool(wanted & out)
