"""Every wire format as the virtual device writes it and as the drivers read it.

The two are written apart. A format without a line here needs no options, and rounds as
its decoder says.
"""

import numpy as np
import pytest

from fieldcal.core.samples import Block, concat
from fieldcal.drivers import codec
from fieldcal.drivers.options import Options
from fieldcal.sim_device import wire

OPTIONS = {
    "text": ["checksum=xor&acc_unit=mg&gyr_unit=deg/s&t_unit=us"] * 2,
    "vnimu": ["", "rate=200"],
    "witmotion": ["acc_range=8&gyr_range=500"] * 2,
    "xsens": ["numbers=16.32", ""],
}
ROUNDING = {
    "mip": (1e-6, 1e-6, 1e-5, 1e-8),
    "text": (1e-7, 1e-8, 0.006, 1e-6),
    "ubx": (0.5 / 1024, np.deg2rad(0.5 / 4096), 0.006, 20e-6),
    "vectornav": (2e-6, 1e-6, 1e-5, 1e-8),
    "vnimu": (0.51e-3, 0.51e-6, 0.051, 1e-9),
    "witmotion": (0.51 * 8 * 9.80665 / 32768, np.deg2rad(0.51 / 65.5), 0.006, 1.1e-3),
    "xsens": (1e-9, 1e-9, 1e-9, 0.6e-4),
}
"""Largest error of acc, gyr, temperature, time."""

TEMPERATURE, TIME = 0.051, 1.1e-3
"""The same of a format without a line above."""


def test_the_virtual_device_writes_what_the_drivers_read() -> None:
    assert wire.formats() == codec.wire_formats()


@pytest.mark.parametrize("name", wire.formats())
@pytest.mark.parametrize(
    "cut", [10_000_000, 4096, pytest.param(61, marks=pytest.mark.thorough)]
)
def test_what_was_measured_arrives_within_the_rounding(name: str, cut: int) -> None:
    rng = np.random.default_rng(11)
    n = 800
    sent = Block.of(
        1000 + np.arange(n) / 200,
        rng.normal(0, 20, (n, 3)),
        rng.normal(0, 2, (n, 3)),
        rng.normal(25, 5, n),
        np.arange(n) + 65000.0,
    )
    written, read = OPTIONS.get(name, ["", ""])
    encoder = wire.open_wire(f"{name}?{written}" if written else name)
    stream = b"\n" + encoder.encode(sent)  # from its start on a line is whole
    decoder = codec.open_codec(name, Options("serial", read))
    pieces = [decoder.feed(stream[i : i + cut]) for i in range(0, len(stream), cut)]
    got = concat(block for block in pieces if block is not None)
    assert len(got) == n
    grain = decoder.grain
    says = (0.51 * grain.acc, 0.51 * grain.gyr, TEMPERATURE, TIME)
    acc, gyr, temperature, time = ROUNDING.get(name, says)
    np.testing.assert_allclose(got.acc, sent.acc, atol=acc, rtol=1e-7)
    np.testing.assert_allclose(got.gyr, sent.gyr, atol=gyr, rtol=1e-7)
    np.testing.assert_allclose(got.temperature, sent.temperature, atol=temperature)
    np.testing.assert_allclose(got.t - got.t[0], sent.t - sent.t[0], atol=time)
    assert decoder.health.bad == decoder.health.gaps == 0
