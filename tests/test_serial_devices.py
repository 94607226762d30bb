"""Every serial format between two processes: a minute at 1 kHz without a loss."""

import subprocess
import sys

import numpy as np
import pytest

from fieldcal.driver import open_driver
from fieldcal.drivers.codec import formats
from fieldcal.errors import DeviceError
from fieldcal.samples import concat

TOLD = {"vnimu": "&rate=1000", "text": "&checksum=xor"}
SENT = {"text": "text?checksum=xor"}


@pytest.mark.parametrize("name", formats())
def test_a_minute_at_1_khz(name: str) -> None:
    command = [sys.executable, "-m", "fieldcal", "sim", "--rate", "1000", "--once"]
    command += ["--serial", SENT.get(name, name), "--duration", "60", "--speed", "max"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as sim:
        assert sim.stdout
        port = sim.stdout.readline().strip()
        url = f"serial:{port}?format={name}&reconnect=0{TOLD.get(name, '')}"
        blocks = []
        with open_driver(url) as imu:
            with pytest.raises(DeviceError, match="hung up"):
                for block in imu.blocks(10.0):
                    blocks.append(block)
            health = imu.health
    got = concat(blocks)
    assert len(got) == health.samples == 60_000
    assert health.bad == health.skipped == health.gaps == health.repeated == 0
    np.testing.assert_allclose(np.diff(got.t), 1e-3, atol=1e-3)
    assert got.t[-1] - got.t[0] == pytest.approx(59.999, abs=1.1e-3)
    assert np.all(np.diff(got.t) > 0)
    assert np.linalg.norm(got.acc.mean(axis=0)) == pytest.approx(9.8, abs=0.5)
