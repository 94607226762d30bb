"""What to do about a mismatch that no effect makes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_sessions import dictionary, ladder

from fieldcal.diagnosis.findings.unknown_mismatch import UnknownMismatch
from fieldcal.diagnosis.result import Mismatch
from fieldcal.diagnosis.wording.advice import MISMATCH_REMEDIES, advice_on_mismatches
from fieldcal.diagnosis.wording.paragraph import exchange_text


def unknown(
    cause: str, channel: str = "ay", correlation: float = 0.9
) -> UnknownMismatch:
    """A mismatch of a cause without physics, in two positions."""
    return UnknownMismatch(
        cause,
        Mismatch(
            channel=channel, kind="time", covariate=cause, positions=(0, 1),
            from_s=0.0, to_s=1.0, rms=1e-3, sigma=9.0, correlation=correlation,
            share=0.9,
        ),
    )  # fmt: skip


def test_each_function_that_no_effect_makes_has_a_way_to_find_its_physics() -> None:
    causes = {c.name for c in dictionary(ladder()).causes if c.kind == "unknown"}
    assert causes - set(MISMATCH_REMEDIES) == {"window", "position"}
    for cause in MISMATCH_REMEDIES:
        (said,) = advice_on_mismatches([unknown(cause)])
        assert ": ay follows " in said and " on purpose" not in said


def test_what_follows_the_time_may_follow_a_temperature() -> None:
    (said,) = advice_on_mismatches([unknown("time"), unknown("time", "az")])
    assert said == (
        "Hold one position for longer, and record the temperature: ay and az follow the"
        " time, as biases do that follow a temperature, and no effect in the catalogue"
        " does."
    )


def test_angles_of_exchanged_positions_are_exchanged() -> None:
    pair = replace(unknown("position"), exchanged=(2, 6))
    (said,) = advice_on_mismatches([pair, pair])
    assert said == (
        "Exchange the angles of positions 3 and 7 in session.toml: each was held at"
        " those of the other."
    )
    assert exchange_text((2, 6)) == (
        "positions 3 and 7 are exchanged: each was held at the angles of the other"
    )


@pytest.mark.parametrize(
    ("cause", "correlation"), [("window", np.nan), ("time", np.nan), ("position", 0.5)]
)
def test_single_positions_are_repeated(cause: str, correlation: float) -> None:
    (said,) = advice_on_mismatches([unknown(cause, "gz", correlation)])
    assert said.startswith("Repeat ") and "gz is off only there" in said
