"""A Ctrl-C at any instruction of the recorder: no sample is doubled or lost."""

from __future__ import annotations

import contextlib
import itertools
import sys
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest
from recorded import block

from fieldcal.session import arrow_encoder, recorder
from fieldcal.session.folder import Session
from fieldcal.session.integrity import file_faults
from fieldcal.session.lock import SessionLock
from fieldcal.session.recorder import Recorder

WATCHED = {recorder.__file__, arrow_encoder.__file__}


class CtrlC:
    """Interrupts this thread in front of one line of the recorder, counted from 0."""

    def __init__(self, line: int) -> None:
        self.left, self.struck = line, False

    def __enter__(self) -> None:
        self._before = sys.gettrace()
        sys.settrace(self._trace)

    def __exit__(self, *exc: object) -> None:
        sys.settrace(self._before)

    def _trace(self, frame: FrameType, event: str, argument: Any) -> Any:
        if frame.f_code.co_filename not in WATCHED or self.struck:
            return None
        if event == "line":
            if not self.left:
                self.struck = True
                raise KeyboardInterrupt
            self.left -= 1
        return self._trace


def interrupted(folder: Path, line: int) -> bool:
    """Record a batch and a window, interrupted at a line; whether it was."""
    ctrl_c = CtrlC(line)
    with Recorder(folder, {"format": 1}) as made:
        made.append(block(0))
        try:
            with ctrl_c:
                made.flush()
                made.mark("window", position=0, start_s=0.0, end_s=0.1)
        except KeyboardInterrupt:
            made.append(block(50))
            made.mark("failed", text="interrupted")
    return ctrl_c.struck


def test_whatever_ctrl_c_interrupts_each_sample_is_there_once(tmp_path: Path) -> None:
    for line in itertools.count():
        folder = tmp_path / str(line)
        struck = interrupted(folder, line)
        assert not list(file_faults(folder))
        with Recorder(folder, None) as resumed:
            resumed.append(block(5000))
        found = Session.open(folder)
        expected = [*range(100 if struck else 50), *range(5000, 5050)]
        np.testing.assert_array_equal(found.block.seq, expected)
        assert [m["event"] for m in found.marks()][-1:] == (
            ["failed"] if struck else ["window"]
        )
        if not struck:
            break
    assert line > 3


def closed(folder: Path, line: int) -> bool:
    """Record a batch and close, interrupted at a line; whether it was."""
    ctrl_c = CtrlC(line)
    made = Recorder(folder, {"format": 1})
    made.append(block(0))
    with contextlib.suppress(KeyboardInterrupt), ctrl_c:
        made.close()
    made.close()  # as whoever opened it does, if the first close had not begun yet
    return ctrl_c.struck


def test_ctrl_c_at_any_line_of_the_closing_loses_nothing(tmp_path: Path) -> None:
    for line in itertools.count():
        folder = tmp_path / str(line)
        struck = closed(folder, line)
        assert not list(file_faults(folder))
        np.testing.assert_array_equal(Session.open(folder).block.seq, range(50))
        SessionLock(folder).release()
        if not struck:
            break
    assert line > 8


def test_ctrl_c_while_closing_waits_is_raised_once_all_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = Recorder(tmp_path / "s", {"format": 1})
    made.append(block(0))
    join, pressed = made._watch.join, [KeyboardInterrupt(), KeyboardInterrupt()]

    def interrupted_join() -> None:
        if pressed:
            raise pressed.pop()
        join()

    monkeypatch.setattr(made._watch, "join", interrupted_join)
    with pytest.raises(KeyboardInterrupt):
        made.close()
    np.testing.assert_array_equal(Session.open(tmp_path / "s").block.seq, range(50))
