"""What is said of a window that begins again, by what interrupted it."""

from __future__ import annotations

import pytest

from fieldcal.core.errors import Moved
from fieldcal.run.interruptions import (
    DeviceChanged,
    SamplesLost,
    is_motion,
    restart_notice,
)

GUST = Moved("disturbed 3 s into the window on gz", 3.0, "gz")


@pytest.mark.parametrize(
    "other",
    [DeviceChanged("the device started anew", 3.0, "t"),
     SamplesLost("9 samples were lost", 3.0, "t"),
     Moved("no samples came between 1 s and 2 s", 3.0, "t")],
)  # fmt: skip
def test_the_wind_is_blamed_for_motion_only(other: Moved) -> None:
    """A clock that jumps and a loose cable are not sheltered from the wind."""
    assert not is_motion(other) and "from the wind" not in restart_notice(other, 5)
    assert is_motion(GUST) and "disturbed 5 times now" in restart_notice(GUST, 5)
    assert "from the wind" not in restart_notice(GUST, 2)
