"""What must not matter to a result: order in the list, names of axes, time's origin."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from session_folders import SITE, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.diagnosis import Diagnosis, diagnose
from fieldcal.session.description import Description
from fieldcal.session.description_file import parse_description as description
from fieldcal.sim_device.profile import NoiseFigures, Profile, Sampling
from fieldcal.sim_device.vocabulary import parse

QUIET = NoiseFigures(acc_instability=(0, 0, 0), gyr_instability=(0, 0, 0))
COUPLED = Profile(
    noise=QUIET,
    sampling=Sampling(50.0),
    effects=(parse("cross_coupling:k12=0.02,k31=-0.02"),),
)
POSITIONS = places(seconds=12.0)
ORDER = [4, 0, 7, 2, 8, 1, 6, 3, 5]
ORDER_OF_FIVE = [4, 0, 2, 1, 3]
AXES = ("+x", "+y", "+z")

Table = dict[str, Any]


@pytest.fixture(scope="module")
def coupled() -> Block:
    """Nine positions of a device whose axes are not square."""
    return recorded(COUPLED, POSITIONS)


def about(positions: list[Table], axes: tuple[str, ...] = AXES) -> Description:
    frame = {"mounting": list(axes)}
    return description({"site": SITE, "frame": frame, "position": positions})


@pytest.fixture(scope="module")
def plain(coupled: Block) -> Diagnosis:
    return diagnose(coupled, about(POSITIONS))


@pytest.mark.parametrize(
    ("later", "axes", "turned", "signs"),
    [
        pytest.param(1.7e9, AXES, [0, 1, 2], (1, 1, 1), marks=pytest.mark.thorough),
        (-500.0, ("+z", "+x", "+y"), [1, 2, 0], (1, 1, 1)),
        pytest.param(
            0.0, ("-x", "-y", "+z"), [0, 1, 2], (-1, -1, 1), marks=pytest.mark.thorough
        ),
    ],
    ids=["later", "axes by other names", "axes the other way"],
)
@pytest.mark.thorough
def test_neither_the_names_of_axes_nor_the_origin_of_time_matter(
    later: float,
    axes: tuple[str, ...],
    turned: list[int],
    signs: tuple[int, ...],
    coupled: Block,
    plain: Diagnosis,
) -> None:
    moved = [p | {k: p[k] + later for k in ("start_s", "end_s")} for p in POSITIONS]
    block = replace(
        coupled,
        t=coupled.t + later,
        acc=coupled.acc[:, turned] * signs,
        gyr=coupled.gyr[:, turned] * signs,
    )
    said = diagnose(block, about(moved, axes))
    assert said.verdict == plain.verdict == "left_out"
    assert said.after.chi2_per_dof == pytest.approx(plain.after.chi2_per_dof, rel=3e-3)
    (one,), (other,) = said.effects, plain.effects
    assert one.id == other.id == "cross_coupling"
    there = [
        (i, j)
        for i, j in permutations(range(3), 2)
        if f"k{turned[i] + 1}{turned[j] + 1}" in other.parameters
    ]
    assert len(there) == len(one.parameters) == len(other.parameters) > 0
    for i, j in there:
        found = one.parameters[f"k{i + 1}{j + 1}"]
        same = other.parameters[f"k{turned[i] + 1}{turned[j] + 1}"]
        assert isinstance(found.value, float) and isinstance(same.value, float)
        assert same.sigma
        # a sample at a window's edge may fall on its other side
        assert abs(found.value - signs[i] * signs[j] * same.value) < 0.1 * same.sigma


def test_positions_may_be_listed_in_any_order(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    touched = replace(
        COUPLED, effects=(*COUPLED.effects, parse("bump:at_s=54,for_s=2"))
    )
    five = places(seconds=8.0)[:5]
    block = recorded(touched, five)
    shuffled = [five[i] for i in ORDER_OF_FIVE]
    said = []
    for name, positions in (("held", five), ("listed", shuffled)):
        folder = write_session(tmp_path / name, block, positions)
        call = ["diagnose", str(folder), "--json", "--twin", str(folder / "twin.toml")]
        assert main(call) == 1
        said.append(json.loads(capsys.readouterr().out))
    held, listed = said
    assert {e["id"] for e in held["effects"]} == {"cross_coupling", "bump"}
    for key in ("verdict", "effects", "fit", "calibration"):
        assert listed[key] == held[key], key
    for one, other in zip(held["mismatch"], listed["mismatch"], strict=True):
        assert sorted(ORDER_OF_FIVE[p] for p in other["positions"]) == one["positions"]
    there = [ORDER_OF_FIVE[p["position"]] for p in listed["twin"]["positions"]]
    assert there == list(range(5))
    for one, other in zip(held["curves"], listed["curves"], strict=True):
        assert [ORDER_OF_FIVE[p] for p in other["position"]] == one["position"]


@pytest.mark.thorough
def test_a_solution_does_not_hang_on_the_order_of_the_list(
    coupled: Block, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    never = {"alpha_deg": 90.0, "beta_deg": 0.0}
    found = []
    for i, order in enumerate((range(9), ORDER)):
        positions = [POSITIONS[k] for k in order]
        positions.insert(4, never)
        folder = write_session(tmp_path / str(i), coupled, positions)
        assert main(["solve", str(folder), "--json"]) == 0, "the coupling is carried"
        out, err = capsys.readouterr()
        assert "position 5" in err and "is left out" in err
        found.append(json.loads(out))
    held, listed = found
    assert listed["parameters"].keys() == held["parameters"].keys()
    for group, said in held["parameters"].items():
        sigma = np.array(said["sigma"], dtype=float)
        value = np.array(said["value"], dtype=float)
        again = listed["parameters"][group]
        np.testing.assert_allclose(
            np.array(again["value"], dtype=float) / sigma, value / sigma, atol=1e-3
        )
        np.testing.assert_allclose(np.array(again["sigma"], float), sigma, rtol=1e-4)
