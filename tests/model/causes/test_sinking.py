"""A base that sinks, of forces that are worked out apart from the model."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from observed import force
from session_folders import places, write_session
from small_sessions import dictionary, ladder, nominal

from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis.explain import explain
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.diagnosis.wording.paragraph import notes
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.sinking import NAME, sinking
from fieldcal.session.description_file import parse_description
from fieldcal.session.folder import Session

ANGLES = [(0.0, 0.0), (90.0, 0.0), (0.0, 90.0), (180.0, 0.0), (-90.0, 0.0),
          (0.0, -90.0), (45.0, 35.0), (-45.0, 35.0)]  # fmt: skip
PLACES = places(ANGLES, seconds=20.0, gap=5.0)
RATE, G = 50.0, 9.81
ACC, GYR = np.array([0.12, -0.08, 0.21]), np.array([1e-3, -2e-3, 5e-4])
SITE = {"gravity": G, "angle_setting_deg": 0.005}


@cache
def sunk(seed: int, by: float, count: int = len(ANGLES)) -> Block:
    """Stops on a base that gives way by an angle about an axis, rad, in minutes."""
    rng, parts = np.random.default_rng(seed), []
    for (alpha, beta), place in zip(ANGLES[:count], PLACES, strict=False):
        t = np.arange(place["start_s"] - 0.5, place["end_s"] + 0.5, 1 / RATE)
        tilt = by * (1 - np.exp(-t / 150.0)) * np.array([[0.8], [-0.6]])
        a, b = np.deg2rad([alpha, beta]).tolist()
        f = force(a, b, base=tilt, g=G)
        acc = ACC + f + 2e-3 * rng.standard_normal(f.shape)
        parts.append(np.column_stack(
            [t, acc, GYR + 2e-4 * rng.standard_normal(f.shape)]
        ))  # fmt: skip
    t, six = np.split(np.concatenate(parts), [1], axis=1)
    return Block.of(t[:, 0], six[:, :3], six[:, 3:])


@pytest.mark.parametrize(
    ("seed", "by", "count"),
    [(1, 4e-3, 6), pytest.param(2, 0.0, 8, marks=pytest.mark.thorough)],
)
def test_a_base_that_gives_way_is_told_and_is_no_effect(
    seed: int, by: float, count: int
) -> None:
    tables = {"format": 1, "site": SITE, "position": PLACES[:count]}
    block = sunk(seed, by, count)
    one = explain(prepare_recording(block, parse_description(tables)))
    assert one.base_sinks == (by > 0)
    assert {s.name for s in one.probable_causes} == ({"base_tilt"} if by else set())
    said = [text for text in notes(one, []) if "The base turned slowly" in text]
    assert len(said) == one.base_sinks


@pytest.mark.thorough
def test_biases_are_right_and_as_uncertain_as_is_said(tmp_path: Path) -> None:
    pulls = []
    for seed in range(3, 5):
        folder = write_session(tmp_path / str(seed), sunk(seed, 6e-3), PLACES,
                               site=SITE)  # fmt: skip
        session = Session.open(folder)
        found = solve_session(session, usable_windows(session))
        value, sigma = found.vector("acc_bias")
        pulls.append((value - ACC) / sigma)
        assert any("The base turned slowly" in text for text in found.warnings)
    assert np.sqrt(np.mean(np.square(pulls))) < 1.45  # chi2 of 6


def test_columns_are_what_a_small_tilt_makes_times_a_polynomial() -> None:
    x = ladder(rows=4)
    table = dictionary(x)
    group = sinking(table)
    assert group is not None and group.cause == NAME
    _, basis = table.bases[-1]
    assert isinstance(basis, General)
    found = basis.evaluate(RowView.of(x, np.zeros((1, len(x))), nominal()))
    u = 2 * (x.t - x.t.min()) / np.ptp(x.t) - 1
    legendre = np.column_stack([u, (3 * u**2 - 1) / 2, (5 * u**3 - 3 * u) / 2,
                                (35 * u**4 - 30 * u**2 + 3) / 8])  # fmt: skip
    eps = 1e-5
    g = float(np.linalg.norm(x.f[0]))
    for row in range(0, len(x), 5):
        a, b = float(x.alpha[row]), float(x.beta[row])
        for axis in range(2):
            sides: list[Array] = []
            for sign in (eps, -eps):
                base = [0.0, 0.0]
                base[axis] = sign
                sides.append(force(a, b, base=base, g=g))
            slope = np.deg2rad(1.0) * (sides[0] - sides[1]) / (2 * eps)
            expected = np.outer(slope, legendre[row])
            own = found[row, :3, 4 * axis : 4 * axis + 4]
            np.testing.assert_allclose(own, expected, atol=1e-5)


def test_positions_that_nobody_set_are_left_to_lean() -> None:
    assert sinking(dictionary(ladder(free=range(6)))) is None


def test_means_that_nobody_timed_do_not_tell_what_sinks(tmp_path: Path) -> None:
    x = ladder(rows=1)
    assert sinking(dictionary(x)) is not None
    assert sinking(dictionary(replace(x, t=np.zeros(len(x))))) is None
    held = [{**p, "sigma": [2e-3] * 3, "start_s": i - 0.5, "end_s": i + 0.5}
            for i, p in enumerate(PLACES)]  # fmt: skip
    angles = np.deg2rad(ANGLES).tolist()
    forces = [force(alpha, beta, g=G) for alpha, beta in angles]
    block = Block.of(np.arange(len(held)) * 1.0, ACC + np.array(forces))
    folder = write_session(
        tmp_path / "s", block, held, site=SITE, means={"timed": False}
    )
    session = Session.open(folder)
    found = solve_session(session, usable_windows(session))
    np.testing.assert_allclose(found.vector("acc_bias")[0], ACC, atol=1e-3)
