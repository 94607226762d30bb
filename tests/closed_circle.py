"""Which effects of the catalogue go round the closed circle in every run.

Round the circle an effect is put into the virtual device, and named from the recording.
That takes seconds each, so every run takes one of each mechanism, the same ones each
time: a test that turns red has been turned red by the change, and not by the day it is
run on. `--all` takes the whole catalogue. What only a reference shows that follows the
motion goes round a circle of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from fieldcal.effects import catalogue
from fieldcal.sim_device.effects import kind

IN_EVERY_RUN = (
    "saturation",  # of the signal chain
    "hum",  # a line
    "gravity_error",  # of the motion
    "angle_setting",  # by chance
    "gyro_cross_coupling",  # of a sensor, seen in positions and turns
    "settling",  # after each turn
)
"""Of what changes with time, `test_diagnosis_one_axis` conceals a step of a bias, and
`test_diagnosis_page` one that follows the temperature."""


def one_in(number: int, cases: Sequence[tuple[Any, ...]]) -> list[Any]:
    """Parameters of a test: all cases, of which some are for `--all` alone."""
    return [
        pytest.param(*case, marks=[pytest.mark.thorough] if i % number else [])
        for i, case in enumerate(cases)
    ]


def every_effect() -> list[Any]:
    """Ids that positions show, of which some are for `--all` alone."""
    assert set(IN_EVERY_RUN) <= set(catalogue())
    return [
        pytest.param(id_, marks=[] if id_ in IN_EVERY_RUN else [pytest.mark.thorough])
        for id_ in catalogue()
        if not kind(id_).EXAMPLE.in_motion
    ]
