"""Effects of which an unknown function hides a part are found with all of it."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.diagnosis.explain import explain
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.session.description_file import parse_description
from fieldcal.sim_device.profile import Profile, Sampling
from fieldcal.sim_device.replay import simulate
from fieldcal.sim_device.vocabulary import checked_effect

AROUND = (
    *((0, 0), (45, 0), (-45, 0), (0, 40), (90, 0), (45, -40)),
    *((-90, 0), (0, -80), (180, 0)),
)
SEED = 3
"""One of five with which a function of alpha is found first, in the place of both."""


@pytest.mark.thorough
def test_a_function_of_the_angle_does_not_stay_in_the_place_of_two_effects() -> None:
    """What y has of both looks like one function; x and z show the other parameters."""
    there = (
        checked_effect("cross_coupling", {"k21": 2e-3}),
        checked_effect("quadratic", {"x": 2e-4, "y": -1e-4, "z": 1e-4}),
    )
    device = Profile(sampling=Sampling(50.0), effects=there)
    held = [(a, b, 3.0 + 21 * i, 18.0 + 21 * i) for i, (a, b) in enumerate(AROUND)]
    moved = [(*np.deg2rad((a, b)), start, end) for a, b, start, end in held]
    names = ("alpha_deg", "beta_deg", "start_s", "end_s")
    about = parse_description(
        {
            "format": 1,
            "site": {"gravity": 9.8106},
            "position": [dict(zip(names, one, strict=True)) for one in held],
        }
    )
    block = simulate(device, moved, seed=SEED)
    best = explain(prepare_recording(block, about)).inferred.best
    assert best.keys == {"cross_coupling", "quadratic"}
