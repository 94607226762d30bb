"""What a device that corrects its own samples says of that."""

from __future__ import annotations

from typing import Any

import pytest

from fieldcal.session.installed_calibration import NO_CORRECTION, subtracts_gyro_offset


def told(**changed: Any) -> dict[str, Any]:
    """A mark of a device that was asked for its calibration."""
    return {"event": "device", "installed": {"in_samples": NO_CORRECTION | changed}}


AVERAGED = told(gyr_offset=[0.01, -0.02, 0.0])


@pytest.mark.parametrize(
    ("marks", "tells"),
    [
        ([], False),
        ([{"event": "window", "end_s": 30.0}], False),
        ([told()], False),
        ([told(acc_offset=[0.1, 0.0, 0.0])], False),
        ([AVERAGED], True),
        ([told(), AVERAGED], True),
        ([AVERAGED, told()], False),
        ([{**AVERAGED, "installed": {"in_samples": None}}], False),
    ],
)
def test_an_offset_of_the_gyroscopes_is_told(
    marks: list[dict[str, Any]], tells: bool
) -> None:
    assert subtracts_gyro_offset(marks) is tells


def test_what_it_does_not_subtract_is_no_offset() -> None:
    out = {"in_samples": AVERAGED["installed"]["in_samples"], "taken_out": True}
    assert not subtracts_gyro_offset([{"event": "device", "installed": out}])
