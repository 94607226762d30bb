"""A recording behind a high-pass filter: it is named, undone, and no calibration."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import strapdown
from scipy.signal import lfilter
from session_folders import write_session

from fieldcal.calibration import Calibration
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.diagnosis import diagnose
from fieldcal.diagnosis.explain import Explanation
from fieldcal.effects.high_pass import HighPass
from fieldcal.evaluation.omitted_effects import with_impossible_explanation
from fieldcal.evaluation.prepared_session import PreparedSession
from fieldcal.evaluation.solution import solve_prepared
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.physics.experience import Experience
from fieldcal.session.folder import Session

NOISE = {"noise": {"acc": [0.02] * 3, "gyr": [1e-3] * 3}, "seed": 3}


def recorded(folder: Path, tau: float) -> Session:
    """Nine positions of a device behind a high-pass of its accelerometers."""
    table = strapdown.outputs(NOISE)
    if np.isfinite(tau):
        kept = np.exp(-np.median(np.diff(table[:, 0])) / tau)
        begin = (1 - kept) * table[:1, 1:4]
        table[:, 1:4], _ = lfilter(
            [kept, -kept], [1.0, -kept], table[:, 1:4], axis=0, zi=begin
        )
    unknown = np.full(len(table), np.nan)
    block = Block.of(
        table[:, 0], table[:, 1:4], table[:, 4:7], unknown, unknown, unknown
    )
    site = {"gravity": strapdown.GRAVITY}
    return Session.open(write_session(folder, block, strapdown.schedule(), site=site))


@pytest.mark.parametrize("tau", [pytest.param(700.0, marks=pytest.mark.thorough), 2e4])
def test_it_is_named_and_refused(tmp_path: Path, tau: float) -> None:
    session = recorded(tmp_path / "s", tau)
    found = diagnose(session.block, session.about)
    (effect,) = (e for e in found.effects if e.id == "high_pass")
    told = effect.parameters["acc"]
    assert set(effect.parameters) == {"acc"}
    assert abs(float(told.value) - 1 / tau) < 4 * float(told.sigma or 0)
    assert float(told.sigma or 1) < 0.04 / tau
    assert {e.id for e in found.effects} <= {"high_pass", "earth_rate"}
    made = solve_prepared(PreparedSession(session, usable_windows(session)))
    assert not made.good
    assert "high_pass" in made.warnings[0] and "switch it off" in made.warnings[0]


@pytest.mark.parametrize(("own", "good"), [(0.4, True), (0.6, False)])
def test_what_may_be_a_drift_as_well_ruins_nothing(
    tmp_path: Path, own: float, good: bool
) -> None:
    """The probability of a cause that was named is that of its aliases, too."""
    session = recorded(tmp_path / "s", 2000.0)
    prepared = PreparedSession(session, usable_windows(session))
    found = prepared.explanation
    assert found is not None
    unsure = SimpleNamespace(
        probable_causes=found.probable_causes,
        posterior=SimpleNamespace(probability=lambda names: own),
        best=found.best,
        inferred=found.inferred,
        source=found.source,
    )
    plain = Calibration(
        "joint", ("acc_bias.x",), np.zeros(1), np.eye(1), ("m/s^2",), 1.0, 1, 0.0
    )
    judged = with_impossible_explanation(cast(Explanation, unsure), plain)
    assert judged.good is good
    assert ("(probability 0.60)" in " ".join(judged.warnings)) is not good


def test_in_one_position_it_is_a_drift() -> None:
    x = Experience.at_rest(np.zeros(4), np.zeros(4), 9.8, passed=np.ones((4, 6)))
    assert HighPass().applies(x)
    assert not HighPass().applies(replace(x, position=np.array([2, 2, -1, 2])))


def test_behind_a_quick_one_no_window_is_a_rest(tmp_path: Path) -> None:
    session = recorded(tmp_path / "s", 12.0)
    with pytest.raises(
        InputError, match=r"decays toward 0, .* 12.1 s: .* switch it off"
    ):
        usable_windows(session)


def test_without_one_nothing_is_named(tmp_path: Path) -> None:
    session = recorded(tmp_path / "s", np.inf)
    found = diagnose(session.block, session.about)
    assert "high_pass" not in {e.id for e in found.effects}
    assert solve_prepared(PreparedSession(session, usable_windows(session))).good
