"""Windows that lack a channel which others have."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import CALM, FACES, places, recorded, write_session

from fieldcal.core.errors import SessionError
from fieldcal.evaluation.observations import observe
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session


@pytest.mark.parametrize(("channel", "name"), [(2, "az"), (4, "gy")])
def test_one_is_left_out_by_name_and_the_others_are_solved(
    channel: int, name: str, tmp_path: Path
) -> None:
    """The whole session was refused."""
    held = places(FACES, 4.0, 4.0)
    block = recorded(CALM, held)
    six, third = block.six.copy(), held[2]
    there = (block.t > third["start_s"] - 1) & (block.t < third["end_s"] + 1)
    six[there, channel] = np.nan
    some = replace(block, acc=six[:, :3], gyr=six[:, 3:])
    session = Session.open(write_session(tmp_path / "s", some, held))
    found = usable_windows(session)
    assert found.position_numbers == (0, 1, 3, 4, 5)
    (said,) = [w for w in found.warnings if "left out" in w]
    assert "position 3" in said and f"no {name}, which others have" in said
    assert np.isfinite(observe(session)[0].mean).all()
    # what no window has is no fault of one
    six[:, channel] = np.nan
    none = replace(block, acc=six[:, :3], gyr=six[:, 3:])
    session = Session.open(write_session(tmp_path / "n", none, held))
    assert usable_windows(session).position_numbers == tuple(range(6))


def test_sensors_that_no_window_shows_together_are_said_so(tmp_path: Path) -> None:
    """The last window's want was told of all, as if others had what it lacks."""
    held = places(FACES, 4.0, 4.0)
    block = recorded(CALM, held)
    six, middle = block.six.copy(), held[3]["start_s"] - 2
    six[block.t < middle, 3:] = six[block.t >= middle, :3] = np.nan
    some = replace(block, acc=six[:, :3], gyr=six[:, 3:])
    session = Session.open(write_session(tmp_path / "s", some, held))
    with pytest.raises(SessionError) as refused:
        usable_windows(session)
    said = str(refused.value)
    assert f"none of the {len(held)} windows can be used; each lacks a channel" in said
    assert "(gx, gy and gz or ax, ay and az): record all channels together" in said
