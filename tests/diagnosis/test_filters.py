"""A filter of the sensors, which the virtual device has, named by its turns."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_diagnosis_page import found_in

from fieldcal.diagnosis import Diagnosis

TAU = 0.05


def told(found: Diagnosis, name: str) -> dict[str, tuple[float, float]]:
    """Numbers of an effect with their sigmas; none where it is not named."""
    return {
        p: (float(q.value), q.sigma or 0.0)
        for one in found.effects
        if one.id == name
        for p, q in one.parameters.items()
    }


@pytest.mark.parametrize(
    ("acc", "gyr"), [(TAU, TAU), pytest.param(TAU, 0.02, marks=pytest.mark.thorough)]
)
@pytest.mark.thorough
def test_both_triads_behind_one_of_first_order(
    tmp_path: Path, acc: float, gyr: float
) -> None:
    """Of two filters the gyroscopes are the later, which is named as well."""
    found = found_in(tmp_path, f"bandwidth:acc={acc},gyr={gyr}")
    assert found.verdict == "left_out"
    names = {"bandwidth"} | ({"time_delay"} if acc != gyr else set())
    assert {e.id for e in found.effects} == names
    numbers = told(found, "bandwidth")
    assert "acc" in numbers
    for name, true in (("acc", acc), ("gyr", gyr)):
        if name in numbers:
            value, sigma = numbers[name]
            assert abs(value - true) < 3 * sigma < 0.4 * true
    if acc != gyr:
        late, sigma = told(found, "time_delay")["seconds"]
        assert abs(late - (gyr - acc)) < 3 * sigma + 0.01 * TAU


@pytest.mark.thorough
def test_gyroscopes_alone_are_late_as_well(tmp_path: Path) -> None:
    found = found_in(tmp_path, f"bandwidth:gyr={TAU}")
    assert {e.id for e in found.effects} == {"bandwidth", "time_delay"}
    assert list(told(found, "bandwidth")) == ["gyr"]
    value, sigma = told(found, "bandwidth")["gyr"]
    assert abs(value - TAU) < 3 * sigma < 0.4 * TAU


@pytest.mark.thorough
def test_a_butterworth_filter_only_makes_late(tmp_path: Path) -> None:
    """Its impulse response has no variance, so that of first order is not named."""
    found = found_in(tmp_path, "second_order:acc=0.03,gyr=0.03")
    assert not told(found, "bandwidth")
