"""What wrong angles move, and whether they show: against sessions that have them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from observed import observe

from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.core.samples import Array
from fieldcal.model.priors import GAUGE_ERROR, REPEATED_MISTAKE_DEG
from fieldcal.solve import solve
from fieldcal.solve.reliability import WrongAngles

G, SIGMA, ANGLES = 9.81, 1e-4, 0.003
SIX = tuple(
    Position.deg(a, b)
    for a, b in ((0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90))
)


def read(places: Any, off: Array) -> Array:
    """What perfect accelerometers read in places whose angles are off, (n, 3)."""
    angles = np.array([[p.alpha or 0.0, p.beta or 0.0] for p in places]) + off
    a, b = angles.T
    return G * np.column_stack(
        [-np.sin(a), -np.cos(a) * np.cos(b), np.cos(a) * np.sin(b)]
    )


def solved(places: Any, off: Array) -> Any:
    return solve(
        observe(places, read(places, off), sigma=SIGMA, gravity=G),
        tilt="base_tilt", angle_sigma_deg=ANGLES,
    )  # fmt: skip


def listed(found: Any) -> list[WrongAngles]:
    return [WrongAngles.from_json(w) for w in found.info.get("wrong_angles", ())]


def test_what_is_foretold_of_a_gauge_is_what_it_does() -> None:
    straight = np.zeros((5, 2))
    found = solved(FIVE_POSITIONS, straight)
    part = 0.02  # of the size that is foretold: linear, and nothing is thrown out
    for wrong in listed(found):
        if wrong.position is not None or wrong.angle_deg is not None:
            continue
        off = straight.copy()
        stated = [(p.alpha, p.beta)[wrong.joint] or 0.0 for p in FIVE_POSITIONS]
        off[:, wrong.joint] = part * GAUGE_ERROR * np.array(stated)
        moved = solved(FIVE_POSITIONS, off)
        for name, by in wrong.moves.items():
            there = moved.value(name) - found.value(name)
            assert there == pytest.approx(part * by, abs=0.1 * found.uncertainty(name))


def test_five_small_turns_have_no_witness_of_a_gauge_and_six_faces_need_none() -> None:
    five = listed(solved(FIVE_POSITIONS, np.zeros((5, 2))))
    gauges = [w for w in five if w.position is None and w.angle_deg is None]
    assert {w.joint for w in gauges} == {0, 1}
    sigma = solved(FIVE_POSITIONS, np.zeros((5, 2))).uncertainty
    assert any(
        abs(w.moves["acc_scale.z"]) > w.shows * sigma("acc_scale.z") for w in gauges
    )
    for wrong in listed(solved(SIX, np.zeros((6, 2)))):
        assert wrong.shows > 50


def test_a_mistake_is_carried_to_another_position() -> None:
    gauge = WrongAngles(1, None, None, 0.0, {})
    assert gauge.error_at(0.3, 0.5) == pytest.approx((0.0, GAUGE_ERROR * 0.5))
    detent = WrongAngles(0, 45.0, None, 0.0, {})
    wide = np.deg2rad(REPEATED_MISTAKE_DEG)
    assert detent.error_at(np.pi / 4, 0.1) == pytest.approx((wide, 0.0))
    assert detent.error_at(0.1, np.pi / 4) == (0.0, 0.0)
    assert WrongAngles(0, None, 2, 0.0, {}).error_at(0.1, 0.1) == (0.0, 0.0)
    assert WrongAngles.from_json(detent.to_json()) == detent
    said = [w.description for w in (gauge, detent, WrongAngles(0, None, 2, 0.0, {}))]
    assert said == [
        "every β set 0.5% too far",
        "α = 45° set 0.2° off each time",
        "position 3 with a wrong α",
    ]
