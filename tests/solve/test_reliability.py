"""What wrong angles move, and whether they show: against sessions that have them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from observed import observe

from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.core.samples import Array
from fieldcal.model.priors import GAUGE_ERROR, REPEATED_MISTAKE_DEG
from fieldcal.solve import solve
from fieldcal.solve.reliability import WrongAngles, wrong_angles

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


def dense_case() -> tuple[Any, Any, Array, Array, Array, Array]:
    """A set and its posterior, y = A t + B a + e, and its matrices A, B, prior V.

    Positions 0, 2 and 5 have angles, and position 5 repeats the alpha of 0.
    """
    rng = np.random.default_rng(8)
    a, b = rng.standard_normal((10, 2)), rng.standard_normal((10, 6))
    prior = np.array([4.0, 9.0, *rng.uniform(0.1, 1.0, 6)])
    told = np.hstack([a, b])
    covariance = np.linalg.inv(told.T @ told + np.diag(1 / prior))
    places = np.array([0, 2, 5])
    columns = np.array([0, 1, *(20 + 2 * np.repeat(places, 2) + [0, 1] * 3)])
    order = rng.permutation(8)
    found: Any = SimpleNamespace(
        columns=columns[order], covariance=covariance[np.ix_(order, order)],
        prior_sigma=np.sqrt(prior)[order],
    )  # fmt: skip
    x = SimpleNamespace(
        position=np.array([0, 0, 2, 5]), alpha=np.array([0.5, 0.5, -0.2, 0.5]),
        beta=np.array([0.0, 0.0, 0.1, 0.3]),
    )  # fmt: skip
    groups = [
        SimpleNamespace(cause="angle_setting", part="repeated", columns=np.arange(3)),
        SimpleNamespace(cause="tilt", part="own", columns=np.arange(2)),
        SimpleNamespace(cause="angle_setting", part="own", columns=columns[2:]),
    ]
    there: Any = SimpleNamespace(
        base_members=[(None, g) for g in groups], small_rotation=20, x=x
    )
    return there, found, np.eye(8)[:2][:, order], a, b, prior


def test_shifts_and_how_they_show_are_those_of_generalised_least_squares() -> None:
    """Outputs B u of angles that are off by u, in a fit that takes them for noise."""
    there, found, picked, a, b, prior = dense_case()
    angles = {0: [0.5, -0.2, 0.5], 1: [0.0, 0.1, 0.3]}
    noise = np.eye(10) + b @ np.diag(prior[2:]) @ b.T
    inner = a.T @ np.linalg.solve(noise, a) + np.diag(1 / prior[:2])
    gain = np.linalg.solve(inner, a.T @ np.linalg.inv(noise))
    whole = noise + a @ np.diag(prior[:2]) @ a.T
    listed = wrong_angles(there, found, ("p", "q"), picked)
    kinds = [
        (w.joint, w.position, None if w.angle_deg is None else round(w.angle_deg, 3))
        for w in listed
    ]
    assert kinds == [
        (0, 0, None), (0, 2, None), (0, 5, None), (0, None, -11.459),
        (0, None, 28.648), (0, None, None),
        (1, 0, None), (1, 2, None), (1, 5, None), (1, None, 0.0), (1, None, 5.73),
        (1, None, 17.189), (1, None, None),
    ]  # fmt: skip
    for wrong in listed:
        own = np.array(angles[wrong.joint])
        off = np.zeros((3, 2))
        if wrong.position is not None:
            off[[0, 2, 5].index(wrong.position), wrong.joint] = np.deg2rad(10.0)
        elif wrong.angle_deg is not None:
            same = np.abs(own - np.deg2rad(wrong.angle_deg)) < 1e-6
            off[same, wrong.joint] = np.deg2rad(REPEATED_MISTAKE_DEG)
        else:
            off[:, wrong.joint] = GAUGE_ERROR * own
        outputs = b @ off.ravel()
        moved = gain @ outputs
        assert wrong.moves == pytest.approx({"p": moved[0], "q": moved[1]})
        shows = np.sqrt(outputs @ np.linalg.solve(whole, outputs))
        assert wrong.shows == pytest.approx(shows)


def test_angles_that_are_exact_have_no_mistakes() -> None:
    there, found, picked, *_ = dense_case()
    there.base_members = there.base_members[:2]
    assert wrong_angles(there, found, ("p", "q"), picked) == []


def test_a_joint_that_is_never_turned_has_no_gauge() -> None:
    there, found, picked, *_ = dense_case()
    there.x.beta[:] = 0.0
    listed = wrong_angles(there, found, ("p", "q"), picked)
    gauges = [w.joint for w in listed if w.position is None and w.angle_deg is None]
    assert gauges == [0]


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
