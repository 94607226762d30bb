"""Takes the windows of a run: samples while the device rests, until they are enough."""

from __future__ import annotations

import numpy as np

from fieldcal.core.errors import Moved
from fieldcal.drivers.driver import Driver
from fieldcal.planning.steps import Hold
from fieldcal.run.incoming import IncomingSamples
from fieldcal.run.interruptions import (
    MOST_LOSS_RESTARTS,
    DeviceChanged,
    SamplesLost,
    WindowDisturbed,
    WindowWatch,
    kept_notice,
)
from fieldcal.run.link_marks import MarkedRecorder
from fieldcal.run.operator.desk import OperatorDesk
from fieldcal.run.operator.protocol import Display
from fieldcal.session.description import Description
from fieldcal.windows import Average, LearnedNoise, PiecedWindow, StillnessLimits

LOOK = 0.5
"""Device time between two tests of a window that fills, s."""


class WindowTaker:
    """Windows of one device, one after another.

    Parameters
    ----------
    driver : the device
    about : whether the base sways
    recorder : where windows are marked
    desk, display : the operator's
    incoming : samples that have been recorded
    lost_share : share of a window's samples that may be missing; with more it is taken
        again, if that helps

    Attributes
    ----------
    disturbed_index : index of the position whose window was disturbed last, or None

    """

    def __init__(
        self,
        driver: Driver,
        about: Description,
        recorder: MarkedRecorder,
        desk: OperatorDesk,
        display: Display,
        incoming: IncomingSamples,
        lost_share: float = np.inf,
    ) -> None:
        self._driver, self._about, self._recorder = driver, about, recorder
        self._desk, self._display, self._incoming = desk, display, incoming
        self._lost_share = lost_share
        self._thin: dict[int, int] = {}
        self._noise: LearnedNoise | None = None
        self.disturbed_index: int | None = None

    def new_window(self) -> PiecedWindow:
        """An empty window, which is judged with the noise of the one before."""
        limits = StillnessLimits.swaying() if self._about.base_sways else None
        return PiecedWindow(self._noise, self._driver.grain, limits)

    def average(self, hold: Hold, pieces: PiecedWindow) -> Average | None:
        """Fill a window and mark it.

        Parameters
        ----------
        hold : the position, where the device rests
        pieces : window to fill, with the part kept before a disturbance

        Returns
        -------
        None if the operator wants to begin the window again.

        Raises
        ------
        WindowDisturbed
            If the device moved, and the undisturbed part is kept.
        Moved
            If it moved, and nothing is kept.

        """
        try:
            while True:
                if not self._fill(hold, pieces):
                    return None
                average = pieces.average()
                if average is not None:
                    break
                self._desk.tell(kept_notice(None, 0.0, hold.seconds, pieces.dropped))
        except Moved as moved:
            self.disturbed_index = hold.index
            if isinstance(moved, SamplesLost):
                self._thin[hold.index] = self._thin.get(hold.index, 0) + 1
            what = {"at_s": moved.at, "axis": moved.axis, "text": str(moved)}
            kept = (
                0.0
                if isinstance(moved, DeviceChanged)
                else pieces.keep_undisturbed(moved)
            )
            if kept:
                self._recorder.mark("kept", position=hold.index, kept_s=kept, **what)
                raise WindowDisturbed(moved, kept) from moved
            self._recorder.mark("rejected", position=hold.index, **what)
            raise
        end = float(np.nextafter(average.end, np.inf))
        where: dict[str, object] = {"start_s": average.start, "end_s": end}
        if pieces.gaps:
            where["without_s"] = pieces.gaps
        self._recorder.mark("window", position=hold.index, **where)
        self._noise = pieces.noise and pieces.noise.spectrum_shape_only
        self._display.show_taken(hold, pieces)
        return average

    def _fill(self, hold: Hold, pieces: PiecedWindow) -> bool:
        """Take samples until a window is long enough; False to begin it again."""
        share = (
            self._lost_share
            if self._thin.get(hold.index, 0) < MOST_LOSS_RESTARTS
            else np.inf
        )
        watch = WindowWatch(self._driver, hold.seconds, share)
        looked = -np.inf
        for block in self._incoming.pieces:
            watch.check(block)
            pieces.add(block)
            if self._desk.wish(hold) == "repeat":
                self._recorder.mark("repeated", position=hold.index)
                return False
            full, now = pieces.is_full(hold.seconds), float(block.t[-1])
            if not full and now < looked + LOOK:
                continue
            looked = now
            if moved := pieces.disturbance:
                raise moved
            self._display.show_averaging(hold, pieces)
            early = not self._about.base_sways and pieces.reason_to_stop(hold.sigma)
            if full or early:
                break
        self._confirm(watch)
        return True

    def _confirm(self, watch: WindowWatch) -> None:
        """Check that the device did not change its settings during a window."""
        self._driver.read_again()
        if self._driver.read_back.pending:
            for block in self._incoming.pieces:
                watch.check_device_unchanged(float(block.t[-1]))
                if not self._driver.read_back.pending:
                    return
