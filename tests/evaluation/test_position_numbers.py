"""What is said of a single position is said of that one of session.toml."""

from __future__ import annotations

from pathlib import Path

from session_folders import CALM, places, recorded, write_session

from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session

LADDER = [(0.0, 0.0), (45.0, 0.0), (-45.0, 0.0), (0.0, 5.0), (0.0, -5.0)]


def test_a_wrong_angle_is_one_of_the_position_that_is_meant(tmp_path: Path) -> None:
    """Positions are listed backwards, after one that was never held."""
    held = places(LADDER, seconds=5.0)
    listed = [{"alpha_deg": 20.0, "beta_deg": 2.0}, *held[::-1]]
    block = recorded(CALM, held)
    session = Session.open(write_session(tmp_path / "s", block, listed))
    found = solve_session(session, usable_windows(session), turns="no")
    wrong = [w for w in found.info["wrong_angles"] if w["position"] is not None]
    assert {w["position"] for w in wrong} == {1, 2, 3, 4, 5}
    alpha = {w["position"]: w["shows"] for w in wrong if w["joint"] == 0}
    few = sorted(alpha, key=lambda p: alpha[p])[:2]
    assert {listed[p]["alpha_deg"] for p in few} == {45.0, -45.0}  # shows least there
    assert len(found.info["bad_position"]) == len(LADDER)
