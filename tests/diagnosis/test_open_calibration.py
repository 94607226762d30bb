"""Recordings whose positions leave bias and scale factor of an axis open."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.diagnosis.fit import build_fit, fit_calibration_only
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import Profile

ALIKE = [(0.0, 0.0), (0.4, 0.3), (-0.3, 0.5), (0.5, -0.4), (-0.5, -0.2), (0.2, 0.4)]
"""Angles of a device that lies on one face all the time, deg."""

PLAIN = Profile()
LOUD = replace(PLAIN, noise=replace(PLAIN.noise, acc=(0.1,) * 3))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_simulation_is_compared_with_a_calibration_that_a_device_can_have(
    seed: int, tmp_path: Path
) -> None:
    """The force along y differs by 0.4 mm/s^2 between positions, less than the noise.

    Bias and scale factor of y are open together: along bias = -g scale the priors of 9
    m/s^2 and 0.3 leave 2.8 m/s^2.
    """
    held = places(ALIKE, seconds=10.0, gap=3.0)
    block = recorded(LOUD, held, seed=seed)
    session = Session.open(write_session(tmp_path / "alike", block, held))
    found = prepare_recording(session.block, session.about)
    fitted = fit_calibration_only(build_fit(found), found.rows)
    d = fitted.dictionary
    bias = fitted.set.state.columns == d.bias + 1
    assert np.abs(fitted.estimate[d.bias + 1]) < 3 * 2.8
    assert 0.5 < np.sqrt(fitted.set.state.inverse[bias, bias]).item() < 2.9
