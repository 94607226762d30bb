"""A device that takes the bias of its gyroscopes out is told of at its first rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from engine_bench import hold_all, make

from fieldcal.core.positions import TWO_POSITIONS
from fieldcal.run.zero_rates_watch import ZeroRatesWatch
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.in_process import InProcess
from fieldcal.sim_device.profile import Profile, Truth
from fieldcal.windows import Average

CLAIM = "if the device takes their bias out itself"


@pytest.mark.parametrize(("bias", "zero"), [(0.0, True), (2e-3, False)])
def test_a_run_says_at_its_first_rest_that_rates_are_zero(
    tmp_path: Path, bias: float, zero: bool
) -> None:
    truth = Truth(gyr_bias=(bias, -bias, bias))
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        bench = make(recorder, InProcess(VirtualDevice(Profile(truth=truth), seed=4)))
        bench.engine.run(hold_all(TWO_POSITIONS[:1], 5.0))
    assert any(CLAIM in told for told in bench.turner.told) == zero
    assert zero or not bench.turner.told


def window(bias: float) -> Average:
    """Half a minute of rates with a bias about x."""
    mean = np.array([0.0, -9.81, 0.0, bias, 0.0, 0.0])
    return Average(mean, np.diag([1e-6] * 3 + [2.5e-9] * 3), 20.0, 3000, 0.0, 30.0)


def test_a_bias_that_a_window_shows_withdraws_it() -> None:
    rng = np.random.default_rng(1)
    noise = 2e-3 * rng.standard_normal((100, 3))
    noise -= noise.mean(axis=0)
    watch, precise = ZeroRatesWatch("tactical"), ZeroRatesWatch("navigation")
    autopilot = ZeroRatesWatch("tactical", stated=True)  # averages them at each start
    for each in (watch, precise, autopilot):
        each.add_rest(noise)
    assert CLAIM in watch.notice and not precise.notice and not autopilot.notice
    watch.add_window(window(0.0))
    assert watch.notice
    watch.add_window(window(3e-4))
    assert not watch.notice
    watch.add_rest(noise)  # it is known by now
    assert not watch.notice
