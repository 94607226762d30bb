"""One long rest, in which something happens once."""

from pathlib import Path

import numpy as np
import pytest
from session_folders import SITE, write_session

from fieldcal.diagnosis import Diagnosis, diagnose
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import Climate, NoiseFigures, Profile, Sampling
from fieldcal.sim_device.replay import HeldWindow, simulate
from fieldcal.sim_device.vocabulary import checked_effect

NOISE = 0.01
CALM = NoiseFigures(
    acc=(NOISE,) * 3, acc_instability=(0.0,) * 3, gyr_instability=(0.0,) * 3
)


def told(folder: Path, at: float, size: float) -> Diagnosis:
    """What is said of 15 minutes at 20 Hz in which one bias jumps."""
    jump = checked_effect("bias_step", {"az": size, "at_s": at})
    device = Profile(
        noise=CALM,
        temperature=Climate(self_heating_k=0.0),
        sampling=Sampling(rate_hz=20.0),
        effects=(checked_effect("earth_rate", {}), jump),
    )
    held = (HeldWindow(0.35, 0.05, 5.0, 905.0),)
    block = simulate(device, held, seed=round(at))
    place = {"alpha_deg": 20.05, "beta_deg": 2.86, "start_s": 5.0, "end_s": 905.0}
    session = Session.open(write_session(folder, block, [place], site=SITE))
    return diagnose(session.block, session.about)


@pytest.mark.thorough
@pytest.mark.parametrize("at", [210.0, 560.0, 760.0])
def test_a_jump_anywhere_in_a_long_rest_is_a_jump(tmp_path: Path, at: float) -> None:
    """Of 20 sigma, which is a fifth of the noise of a sample: no walk, and in place."""
    before, after = 20 * (at - 5), 20 * (905 - at)
    size = 20 * NOISE * float(np.sqrt(1 / before + 1 / after))
    said = told(tmp_path / "s", at, size)
    assert [e.id for e in said.effects if e.id != "earth_rate"] == ["bias_step"]
    (found,) = (e for e in said.effects if e.id == "bias_step")
    there, when = found.parameters["az"], found.parameters["at_s"]
    assert isinstance(there.value, float) and isinstance(when.value, float)
    assert there.sigma and abs(there.value - size) < 4 * there.sigma
    assert abs(when.value - at) < 20
