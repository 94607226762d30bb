"""What a device beyond its grade has besides, as far as its rows show it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from session_folders import SITE, places, recorded, write_session

from fieldcal.calibration import limits
from fieldcal.diagnosis.explain import explain
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import NoiseFigures, Profile, Truth
from fieldcal.sim_device.vocabulary import checked_effect

AROUND = [(a, b) for a in (-135.0, -60.0, 0.0, 45.0, 90.0, 180.0) for b in (0.0, 40.0)]
NOISE = NoiseFigures((3e-3,) * 3, (3e-4,) * 3)


def quadratic_left(folder: Path, truth: Truth) -> float:
    """Size of K2 that the uncertainties of a device in twelve positions have."""
    profile = Profile(
        noise=NOISE, truth=truth, effects=(checked_effect("earth_rate", {}),)
    )
    held = places(AROUND)
    written = write_session(folder, recorded(profile, held), held, site=SITE)
    session = Session.open(written)
    found = explain(prepare_recording(session.block, session.about))
    (group,) = [g for g in found.dictionary.unfitted if g.part == "quadratic"]
    # an output of K2 g^2 for each m/s^2 of K2
    return float(np.max(group.typical))


@pytest.mark.thorough
@pytest.mark.parametrize(("gyr_bias", "most"), [(0.09, 0.3), (0.01, 0.09)])
def test_accelerometers_are_as_straight_as_positions_show(
    gyr_bias: float, most: float, tmp_path: Path
) -> None:
    """Beside gyroscopes that no tactical device has, they still may be."""
    truth = Truth((0.1, -0.1, 0.05), (1.0, 1.0, 1.0), (gyr_bias, 0.0, 0.0))
    usual, coarse = (limits.read(g).quadratic for g in ("tactical", "consumer"))
    left = quadratic_left(tmp_path / "s", truth)
    assert 0.99 * usual < left < most * coarse
