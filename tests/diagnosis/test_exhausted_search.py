"""Rows that take more causes than any device has: none of them is named."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.calibration import Calibration
from fieldcal.core.samples import Block
from fieldcal.diagnosis.explain import explain
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.diagnosis.verdict import make_diagnosis
from fieldcal.effects import catalogue
from fieldcal.evaluation.omitted_effects import with_impossible_explanation
from fieldcal.model import thresholds
from fieldcal.model.evidence.sets import Set
from fieldcal.model.search.selection import is_exhausted
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import Profile

HELD = places([(a, b) for a in (0, -45, 45) for b in (0, -5, 5)], seconds=20.0, gap=4.0)
LATE = 6.0
"""Seconds by which the windows are listed too late: more than half of each is of the
position before, the rest of the next."""


@pytest.fixture(scope="module")
def block() -> Block:
    return recorded(Profile(), HELD)


@pytest.mark.parametrize("late", [0.0, pytest.param(LATE, marks=pytest.mark.thorough)])
def test_windows_full_of_turns_are_no_sum_of_effects(
    block: Block, tmp_path: Path, late: float
) -> None:
    listed = [
        p | {"start_s": p["start_s"] + late, "end_s": p["end_s"] + late}
        for p in HELD[:-1]
    ]
    session = Session.open(write_session(tmp_path, block, listed))
    explanation = explain(prepare_recording(session.block, session.about))
    diagnosis = make_diagnosis(session.block, explanation)
    assert explanation.inferred.exhausted == bool(late)
    assert (diagnosis.verdict == "unexplained") == bool(late)
    told = f"{thresholds.MAX_CAUSES} causes together do not explain it"
    assert (told in " ".join(diagnosis.warnings)) == bool(late)
    calibration = Calibration(
        "joint", ("acc_bias.x",), np.zeros(1), np.eye(1), ("m/s^2",), 1.0, 1, 0.0
    )
    judged = with_impossible_explanation(explanation, calibration)
    assert judged.good == (not late), "and so it is NO-GO"
    assert (told in " ".join(judged.warnings)) == bool(late)
    # faults of samples were found before the search
    faults = explanation.prepared.checked.ids
    assert {e.id for e in diagnosis.effects} <= {*faults, "earth_rate"}
    assert not {c.name for c in explanation.probable_causes} & {*catalogue()}


def test_a_search_ends_at_as_many_causes() -> None:
    def of(count: int) -> Set:
        return cast(Set, SimpleNamespace(members=(None,) * count))

    assert not is_exhausted(of(thresholds.MAX_CAUSES - 1))
    assert is_exhausted(of(thresholds.MAX_CAUSES))
