"""Sensors that begin late or stop early: the rests are all found, and it is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laid_about import SIDES, turned, write
from written_logs import imported

from fieldcal.core.samples import Block
from fieldcal.importing.session.stream_facts import StreamFacts
from fieldcal.session.folder import Session

ROWS = turned(61, 50.0, 3.0, sides=7)
NAMES = "t,ax,ay,az,gx,gy,gz"
TURNING = 1 + int(50 * (3 * 4.5 + 3.6))
"""A row amid the fourth turn."""


@pytest.mark.parametrize("late", [False, True])
def test_rests_are_found_where_the_gyroscopes_are_silent(
    late: bool, tmp_path: Path
) -> None:
    """What they last read, in a turn, was taken for their bias at rest."""
    rows = ROWS.copy()
    assert np.linalg.norm(rows[TURNING, 4:]) > 1
    rows[slice(None, TURNING) if late else slice(TURNING, None), 4:] = np.nan
    session = Session.open(imported(write(tmp_path, rows, heading=NAMES)))
    assert len(session.about.raw["position"]) == len(SIDES)


def test_a_silence_is_said_with_its_times() -> None:
    rows = ROWS.copy()
    rows[TURNING:, 4:] = np.nan
    rows[:200, 1:4] = np.nan
    facts = StreamFacts()
    for first in range(0, len(rows), 100):
        some = rows[first : first + 100]
        facts.add(Block.of(some[:, 0], some[:, 1:4], some[:, 4:]))
    assert [said.partition(":")[0] for said in facts.silences()] == [
        "its gyroscopes have no values after 17.1 s",
        "its accelerometers have no values before 4.0 s",
    ]
    assert facts.measured == "ga"
