"""Wrong angles that would not be noticed, and checks that would show them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from observed import force, observe

from fieldcal.acceptance.angles import (
    ANGLES,
    unnoticed_angle_error,
    unstated_angles_warning,
)
from fieldcal.acceptance.decision import Circumstances, Decision, decide
from fieldcal.acceptance.verification import Verification, verify
from fieldcal.calibration import Calibration, limits
from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.core.samples import Array
from fieldcal.session.description import Description
from fieldcal.session.description_file import parse_description
from fieldcal.solve import solve
from fieldcal.windows import Average

G, SIGMA = 9.81, 1e-4
BOUNDS = limits.read("tactical")
FACES: list[tuple[float, float]] = [
    (0, 0),
    (180, 0),
    (90, 0),
    (-90, 0),
    (0, 90),
    (0, -90),
]


def about(**run: Any) -> Description:
    return parse_description({"site": {"gravity": G}, "run": run})


def read(angles: list[tuple[float, float]]) -> Array:
    joints = np.deg2rad(angles).tolist()
    return np.array([force(alpha, beta, g=G) for alpha, beta in joints])


def decided(found: Calibration, said: Description) -> Decision:
    return decide(found, said, BOUNDS, Circumstances())


def calibrated(
    angles: list[tuple[float, float]], unknown: int = 0, used: float = 0.003
) -> Calibration:
    """By positions of which the last ones have no angles."""
    places = [Position.deg(*pair) for pair in angles]
    known = len(places) - unknown
    free = [Position(f"face {i}") for i in range(unknown)]
    return solve(
        observe([*places[:known], *free], read(angles), sigma=SIGMA, gravity=G),
        angle_sigma_deg=used,
    )  # fmt: skip


def five() -> list[tuple[float, float]]:
    return [p.degrees for p in FIVE_POSITIONS if p.degrees is not None]


def held(found: Calibration, alpha: float, beta: float) -> Verification:
    mean = np.concatenate([read([(alpha, beta)])[0], np.zeros(3)])
    window = Average(mean, np.diag([SIGMA**2] * 6), 21.0, 3000, 0.0, 30.0)
    there = Position.deg(alpha, beta)
    return verify(found, about(), there, window, float(np.deg2rad(0.05)))


def test_a_small_ladder_has_no_witness_and_names_the_remedy() -> None:
    said = unnoticed_angle_error(calibrated(five()), about(), BOUNDS, None, None)
    assert said.startswith("wrong angles would not be noticed")
    two = calibrated([(0, 0), (45, 5)], used=BOUNDS.angle_setting_deg)
    made = decided(two, about())
    (check,) = [c for c in made.checks if c.name == ANGLES]
    assert check.ok is False and not made.go
    assert "three or more other faces" in check.says and "--verify" in check.says
    assert "--angles" in check.says


@pytest.mark.parametrize(
    ("places", "bare", "site", "warned"),
    [
        (five(), 0, {}, True),
        (five()[::4], 0, {}, True),  # what adaptive begins with
        ([(0, 0), (8, 8), (-8, -8)], 2, {}, True),
        (five(), 3, {}, False),
        (FACES, 0, {}, False),
        ([], 6, {}, False),
        (five(), 0, {"angle_setting_deg": 0.01}, False),
        (five(), 0, {"angles_from": "certificate 4711"}, False),
    ],
)
def test_who_is_told_before_a_run_that_nobody_vouches_for_the_angles(
    places: list[tuple[float, float]], bare: int, site: dict[str, Any], warned: bool
) -> None:
    known: list[dict[str, Any]] = [{"alpha_deg": a, "beta_deg": b} for a, b in places]
    known += [{"name": f"face {i}"} for i in range(bare)]
    said = unstated_angles_warning(
        parse_description({"site": {"gravity": G, **site}, "position": known})
    )
    assert ("--angles 0.01" in said and "± 0.05°" in said) == warned == bool(said)


@pytest.mark.parametrize("site", [{}, {"angle_setting_deg": 0.003}])
def test_a_word_on_the_angles_is_relied_on_and_repeated(site: dict[str, Any]) -> None:
    """Said to `solve` or in the session."""
    said = parse_description({"site": {"gravity": G, **site}})
    found = calibrated(five(), used=0.003)
    (check,) = [c for c in decided(found, said).checks if c.name == ANGLES]
    assert check.ok is None
    assert "relies on angles set to ± 0.003°, as stated" in check.says
    assert "could move" in check.says
    shown = replace(found, info={**found.info, "angles_stated_deg": 0.001})
    (check,) = [c for c in decided(shown, said).checks if c.name == ANGLES]
    assert "relies on angles set to ± 0.003°, as the recording shows" in check.says


@pytest.mark.parametrize("more", [FACES[1:4] + FACES[4:5], FACES[1:]])
def test_gravity_on_other_faces_bears_witness(more: list[tuple[float, float]]) -> None:
    found = calibrated([*five(), *more], unknown=len(more))
    assert unnoticed_angle_error(found, about(), BOUNDS, None, None) == ""


def test_faces_that_are_stated_need_no_witness() -> None:
    assert unnoticed_angle_error(calibrated(FACES), about(), BOUNDS, None, None) == ""


def test_a_position_to_verify_bears_witness_where_it_is_another_one() -> None:
    found = calibrated(five())
    same = held(found, 45.0, 0.0)
    assert unnoticed_angle_error(found, about(), BOUNDS, same, None)
    other = held(found, -135.0, 45.0)
    assert unnoticed_angle_error(found, about(), BOUNDS, other, None) == ""


def test_a_certificate_is_taken_at_its_word() -> None:
    site = {"gravity": G, "angles_from": "certificate 4711"}
    assert (
        unnoticed_angle_error(
            calibrated(five()), parse_description({"site": site}), BOUNDS, None, None
        )
        == ""
    )


def test_what_a_program_turned_is_nobodys_statement() -> None:
    found = calibrated(five())
    virtual = about(mover={"kind": "virtual"})
    assert unnoticed_angle_error(found, virtual, BOUNDS, None, None) == ""
    command = about(mover={"kind": "command", "command": ["turn"]})
    assert unnoticed_angle_error(found, command, BOUNDS, None, None)
