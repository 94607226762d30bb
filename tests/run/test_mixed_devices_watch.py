"""Two devices on one port, while a run listens to them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from engine_bench import hold_all, make

from fieldcal.core.errors import InputError
from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.core.samples import Block
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session
from fieldcal.session.position_tables import position_table
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.in_process import InProcess


class TwoDevices(InProcess):
    """A device, and every other sample another one with other biases."""

    def receive(self, timeout: float) -> Block | None:
        block = super().receive(timeout)
        if block is None:
            return None
        other = np.round(100 * block.t).astype(int) % 2 == 1
        return replace(block, acc=block.acc + other[:, None] * [0.5, 0.4, -0.3])


def test_a_run_says_so_at_once_and_its_session_is_refused(tmp_path: Path) -> None:
    held = FIVE_POSITIONS[:2]
    about = {"format": 1, "position": [position_table(p) for p in held]}
    with Recorder(tmp_path / "s", about) as recorder:
        made = make(recorder, TwoDevices(VirtualDevice(seed=3)))
        made.engine.run(hold_all(held, 10.0))
    said = [text for text in made.turner.told if "two devices seem to send" in text]
    assert len(said) >= 2, "in each position"
    assert "ax by 0.5 m/s²" in said[0] and "give each a port" in said[0]
    with pytest.raises(InputError, match="the samples of two devices come by turns"):
        usable_windows(Session.open(tmp_path / "s"))
