"""What passes in CI, and what does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import strapdown
from session_folders import write_session

from fieldcal.against.gate import check_match, parse_limits, write_junit
from fieldcal.against.result import (
    Difference,
    Direction,
    Facts,
    Match,
    RealAndSimulated,
    SimulatorPrediction,
)
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.diagnosis.result import Quantity

ONE = {"x": Quantity(1.0, 1e-3, "1")}
CALIBRATED = dict.fromkeys(("acc_bias", "acc_scale", "gyr_bias", "gyr_scale"), ONE)
FACTS = Facts(100.0, np.nan, np.nan, 0.0, np.nan, {"ax": ONE["x"]}, CALIBRATED)


def differing(
    name: str,
    real: float,
    sim: float,
    direction: Direction = "resized",
    unit: str = "1",
) -> Difference:
    one, two, off = (Quantity(v, 1e-3, unit) for v in (real, sim, real - sim))
    pairs = {"x": RealAndSimulated(one, two, off)}
    if name == "bias_step":
        pairs["at_s"] = RealAndSimulated(
            *(Quantity(v, 0.1, "s") for v in (60.0, 10.0, 50.0))
        )
    return Difference(name, direction, 1.0, pairs)


def match(*differences: Difference) -> Match:
    predicted = SimulatorPrediction(0.1, 0.1, 3.0)
    verdict: Any = "left_out" if differences else "consistent"
    return Match(
        verdict, 1.0, differences, ("quadratic",), predicted, predicted, FACTS, FACTS,
        (), "",
    )  # fmt: skip


def failed(found: Match, *given: str) -> list[str]:
    return [one.name for one in check_match(found, parse_limits(given)) if not one.ok]


def test_whatever_differs_fails_unless_it_is_within_its_limit() -> None:
    found = match(differing("acc_bias", 0.1, 0.08), differing("noise", 0.02, 0.021))
    assert failed(found) == ["acc_bias", "noise"]
    assert failed(found, "acc_bias=0.03") == ["noise"]
    assert failed(found, "acc_bias=0.01", "noise=10%") == ["acc_bias"]
    assert failed(found, "acc_bias=0.03", "noise = 1 %".replace(" ", "")) == ["noise"]
    assert failed(found, "acc_bias=0.03", "noise=10%", "chi2_per_dof=2") == [
        "chi2_per_dof"
    ]
    assert not failed(found, "acc_bias=0.03", "noise=10%", "chi2_per_dof=4")
    assert not failed(match())


def test_what_one_of_the_two_does_not_show_has_not_passed() -> None:
    """As a simulator without gyroscopes, or a recording without turns."""
    less = {k: v for k, v in CALIBRATED.items() if k.startswith("acc")}
    facts = replace(FACTS, calibration=less)
    for found in (replace(match(), real=facts), replace(match(), simulator=facts)):
        names = [one.name for one in check_match(found, {})]
        assert names == ["acc_bias", "acc_scale", "noise", "quadratic"]
        assert failed(found, "gyr_bias=0.01", "acc_bias=0.01") == ["gyr_bias"]
    quiet = replace(match(), simulator=replace(FACTS, noise={"gx": ONE["x"]}))
    assert failed(quiet, "noise=10%") == ["noise"] and not failed(quiet)


def test_when_something_happened_is_no_size() -> None:
    found = match(differing("bias_step", 0.02, 0.0, "left_out"))
    assert not failed(found, "bias_step=0.03")
    assert failed(found, "bias_step=0.01") == ["bias_step"]


def test_a_delay_has_a_limit_in_s_though_instants_have_none() -> None:
    delay = RealAndSimulated(*(Quantity(v, 1e-4, "s") for v in (0.02, 0.015, 0.005)))
    found = match(Difference("time_delay", "resized", 1.0, {"seconds": delay}))
    assert not failed(found, "time_delay=0.006")
    assert failed(found, "time_delay=0.004") == ["time_delay"]


@pytest.mark.parametrize("given", ["acc_bias", "acc_bias=", "acc_bias=-1", "speed=1"])
def test_limits_that_are_none_are_refused(given: str) -> None:
    with pytest.raises(InputError, match="--limit"):
        parse_limits([given])


def test_junit_has_a_case_for_everything_and_numbers_to_follow(tmp_path: Path) -> None:
    found = match(differing("acc_bias", 0.1, 0.08))
    path = tmp_path / "against.xml"
    write_junit(path, "bench", found, check_match(found, {}))
    suite = ElementTree.parse(path).getroot()
    cases = {c.get("name"): c.find("failure") for c in suite.iter("testcase")}
    assert set(cases) >= {"acc_bias", "gyr_scale", "noise", "quadratic"}
    assert [n for n, failure in cases.items() if failure is not None] == ["acc_bias"]
    assert (suite.get("tests"), suite.get("failures")) == (str(len(cases)), "1")
    values = {p.get("name"): p.get("value") for p in suite.iter("property")}
    assert values["acc_bias.x"] == "0.02" and values["chi2_per_dof"] == "3"


def test_the_fixture_fails_with_what_differs(
    tmp_path: Path,
    simulator_matches: Callable[..., Match],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is compared is what the files hold; how that differs is given here."""
    table = strapdown.outputs({})
    none = np.full(len(table), np.nan)
    block = Block.of(table[:, 0], table[:, 1:4], table[:, 4:], none, none, none)
    folders = [
        write_session(tmp_path / name, block, strapdown.schedule())
        for name in ("real", "simulated")
    ]
    given: list[tuple[Block, Any]] = []

    def compared(*two: Any) -> Match:
        given.extend(two[:2])
        return match(differing("acc_bias", 0.1, 0.08))

    monkeypatch.setattr("fieldcal.against.compare", compared)
    with pytest.raises(pytest.fail.Exception, match="another size: acc bias"):
        simulator_matches(*folders)
    found = simulator_matches(*map(str, folders), acc_bias=0.1)
    assert [d.id for d in found.differences] == ["acc_bias"]
    assert all(len(b) == len(block) and a.positions for b, a in given)
