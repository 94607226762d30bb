"""Sentences about what follows from noise."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

from fieldcal.noise.recalibration import Recalibration
from fieldcal.noise.wording import consequences


def test_a_date_that_is_beyond_the_horizon_is_no_date() -> None:
    quiet = SimpleNamespace(pair=SimpleNamespace(left_out=1.0))
    when = Recalibration(1e-4, (3600.0, math.inf), False, False, False)
    found: Any = SimpleNamespace(
        model=SimpleNamespace(channels={"gx": quiet}),
        recalibrate={"gx": when},
        since="2026-04-01T10:00:00+00:00",
        alignment=None,
    )
    _, said = consequences(found)
    assert said == (
        "recalibrate: gx is beyond its limit with 5 % by 2026-04-01 11:00,"
        " 32 % not within 20 years, says this recording"
    )
