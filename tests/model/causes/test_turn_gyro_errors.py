"""A turn of which samples are lost while time is counted by them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from session_folders import places, recorded, write_session
from small_sessions import dictionary, ladder, nominal

from fieldcal.calibration import Calibration
from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis.explain import Explanation, explain
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.diagnosis.wording.paragraph import notes
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.turn_gyro_errors import turn_gyro_errors
from fieldcal.physics.experience_rows import select_rows
from fieldcal.session.description_file import parse_description
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import Profile, Sampling, Truth

ANGLES = [(0, 0), (90, 0), (0, 90), (0, 0), (-90, 0), (0, -90), (180, 0), (45, 35)]
PLACES = places([(float(a), float(b)) for a, b in ANGLES], seconds=15.0, gap=6.0)
LOST_S = 0.12
SCALE = (1.003, 0.996, 1.002)
DEVICE = Profile(sampling=Sampling(100.0), truth=Truth(gyr_scale=SCALE))


def about() -> dict[str, object]:
    return {"site": {"latitude_deg": 50.0, "height_m": 0.0, "angle_setting_deg": 0.02}}


@cache
def lossy(seed: int, way: int | None, seconds: float = LOST_S) -> Block:
    """A recording without some samples of a way, whose time does not show it."""
    block = recorded(DEVICE, PLACES, seed)
    if way is None:
        return block
    middle = (PLACES[way]["end_s"] + PLACES[way + 1]["start_s"]) / 2
    lost = (block.t >= middle) & (block.t < middle + seconds)
    t = block.t[: np.count_nonzero(~lost)]
    return replace(block[~lost], t=t)


def held(way: int | None, seconds: float = LOST_S) -> list[dict[str, float]]:
    """Positions as the counted time has them."""
    shift = [0.0 if way is None or i <= way else seconds for i in range(len(PLACES))]
    return [p | {k: p[k] - s for k in ("start_s", "end_s")}
            for p, s in zip(PLACES, shift, strict=True)]  # fmt: skip


@cache
def explained(seed: int, way: int | None) -> Explanation:
    tables = {"format": 1, **about(), "position": held(way)}
    return explain(prepare_recording(lossy(seed, way), parse_description(tables)))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("seed", "way"),
    [
        (1, 0),
        pytest.param(2, 4, marks=pytest.mark.thorough),
        pytest.param(3, None, marks=pytest.mark.thorough),
    ],
)
def test_the_turn_that_was_not_followed_is_told_and_no_other(
    seed: int, way: int | None
) -> None:
    one = explained(seed, way)
    assert one.untracked_turns == (() if way is None else ((way, way + 1),))
    said = [text for text in notes(one, []) if "gyroscopes measured" in text]
    assert len(said) == len(one.untracked_turns)
    assert way is None or f"from position {way + 1} to {way + 2} is not" in said[0]
    assert "gyro_scale" in one.posterior.cause_names(one.best.set)


def calibrated(folder: Path, seed: int, way: int | None) -> Calibration:
    tables = about()
    write_session(folder, lossy(seed, way), held(way), **tables)
    session = Session.open(folder)
    return solve_session(session, usable_windows(session))


@pytest.mark.thorough
@pytest.mark.parametrize("way", [0, 4])
def test_scale_factors_are_those_of_the_turns_that_were_followed(
    tmp_path: Path, way: int
) -> None:
    found, whole = (
        calibrated(tmp_path / str(w), 5, w) for w in (way, None)
    )  # fmt: skip
    value, sigma = found.vector("gyr_scale")
    pulls: Array = (value - SCALE) / sigma
    assert np.abs(pulls).max() < 3.5
    assert (sigma < 5 * whole.vector("gyr_scale")[1]).all()
    assert any(f"position {way + 1} to {way + 2}" in text for text in found.warnings)
    assert not any("gyroscopes measured" in text for text in whole.warnings)


def test_the_columns_are_rates_on_one_way_each() -> None:
    x = ladder(rows=3)
    table = dictionary(x)
    causes = list(turn_gyro_errors(table))
    assert len(causes) == len(table.window_positions) - 1
    _, basis = table.bases[-1]
    assert isinstance(basis, General)
    assert not basis.evaluate(RowView.of(x, np.zeros((1, len(x))), nominal())).any()
    ends = (x.t[x.position == 2].max(), x.t[x.position == 3].min())
    edges = replace(
        select_rows(x, [0] * 4), t=np.linspace(*ends, 6)[1:-1], position=np.full(4, -1)
    )  # fmt: skip
    found = basis.evaluate(RowView.of(edges, np.zeros((1, 4)), nominal()))
    (group,) = causes[2].variants
    own = group.columns - group.columns[0] + 6
    np.testing.assert_array_equal(found[:, 3:, own], np.tile(np.eye(3), (4, 1, 1)))
    assert not np.delete(found, own, axis=2).any() and not found[:, :3].any()
    assert group.moved_positions == (2, 3) and group.random
