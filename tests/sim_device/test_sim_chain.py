"""What the simulated signal chain does to outputs, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest
from simulated import PLAIN, at_rest, told, turning

from fieldcal.core.errors import InputError
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.chain import SignalChain
from fieldcal.sim_device.vocabulary import parse


def test_a_wrong_mounting_and_a_wrong_unit() -> None:
    # procedure x is device +y, procedure y is device -x
    block = at_rest(told("mounting:axes=+y-x+z,unit=g"))
    np.testing.assert_allclose(block.acc[-1], np.array([6.4, -6, 4.8]) / 9.80665)
    np.testing.assert_array_equal(block.gyr[-1], 0)
    spun = turning(PLAIN.having(parse("mounting:axes=+x+y-z,unit=deg/s")))
    np.testing.assert_allclose(spun.gyr[0], np.rad2deg([0.1, 0.2, 0.3]))


def passed(text: str, row: list[float], channel: int = 0) -> list[float]:
    """What becomes of a channel's values in the signal chain, 1 s apart."""
    x = np.zeros((6, len(row)))
    x[channel] = row
    chain = SignalChain(PLAIN.having(parse(text)), 0)
    got: list[float] = chain.passes(np.arange(len(row), dtype=float), x)[
        channel
    ].tolist()
    return got


def test_the_signal_chain() -> None:
    assert passed("quantisation:acc=0.25", [0.1, 0.13, -0.4]) == [0, 0.25, -0.5]
    assert passed("quantisation:acc=0.25", [0.1], channel=3) == [0.1]
    assert passed("quantisation:gyr=0.5", [0.4], channel=5) == [0.5]
    assert passed("saturation:channel=acc,limit=5", [7, -7, 3]) == [5, -5, 3]
    assert passed("saturation:channel=gz,limit=5", [7], channel=5) == [5]
    stuck = "stuck:channel=ax,from_s=1,to_s=4"
    assert passed(stuck, [1, 2, 3, 4, 5]) == [1, 2, 2, 2, 5]
    assert passed("mounting:unit=mrad/s", [0.5], channel=4) == [500]


def test_a_smoothed_output_goes_half_of_the_way_in_each_sample() -> None:
    half = f"smoothing:gyr={1 / np.log(2)}"
    got = passed(half, [4, 0, 8, 8], channel=3)
    np.testing.assert_allclose(got, [4, 2, 5, 6.5])
    assert passed(half, [4, 0, 8, 8]) == [4, 0, 8, 8]  # of the accelerometers
    chain = SignalChain(PLAIN.having(parse(half)), 0)
    t, x = np.arange(4.0), np.tile([4.0, 0.0, 8.0, 8.0], (6, 1))
    pieces = [chain.passes(t[i], x[:, i]) for i in ([0], [1, 2], [3])]
    np.testing.assert_allclose(np.hstack(pieces)[5], [4, 2, 5, 6.5])


def test_the_full_scale_of_the_device_clips() -> None:
    profile = replace(PLAIN, range=replace(PLAIN.range, acceleration=6.0))
    np.testing.assert_allclose(at_rest(profile).acc[-1], [-6, -6, 4.8])


def test_wrongly_decoded_words() -> None:
    def decoded(kind: str, words: list[float]) -> list[float]:
        return passed(f"decode_fault:channel=ax,kind={kind},full_scale=32768", words)

    assert decoded("low_byte_signed", [100, 200, -100, 256]) == [100, -56, -356, 256]
    assert decoded("bytes_swapped", [0x0102, 1, -2]) == [0x0201, 256, -257]
    assert decoded("wrapped", [32767, 32768, -32769]) == [32767, -32768, 32767]
    # +-16 g: 200 words
    lsb = 16 * 9.80665 / 32768
    plain = passed("decode_fault:channel=ax,kind=low_byte_signed", [200 * lsb])
    assert plain == pytest.approx([-56 * lsb])
    at_home = "decode_fault:channel=ay,kind=wrapped"
    assert passed(at_home, [-10.0], channel=1) == pytest.approx([6.0])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("voodoo:x=1", "no effect is called 'voodoo'; the device knows angle_off"),
        ("quadratic:w=1", "quadratic has no parameter 'w'; it takes x, y, z"),
        ("quadratic", "needs at least one of x, y, z"),
        ("hum:ax=1", "hum needs hz"),
        ("hum:ax=1,hz=0", "hz must be above 0"),
        ("hum:ax=1,hz=nan", "hz must be a number"),
        ("hum:ax=one,hz=5", "ax must be a number, not 'one'"),
        ("hum:ax=1,hz", "is not PARAMETER=VALUE"),
        ("hum:ax=1,ax=2,hz=1", "gives ax twice"),
        ("stuck:from_s=1,to_s=2", "stuck needs channel"),
        ("stuck:channel=bx,from_s=1,to_s=2", "channel must be ax"),
        ("mounting:axes=xyz", "axes must be like"),
        ("mounting:axes=+x+x+y", "not three signed axes"),
        ("dropped:fraction=1", "below 1"),
        ("heading_error:psi_deg=3", "Earth's rate only"),
        ("earth_rate:x=1", "it takes no parameter"),
    ],
)
def test_what_cannot_be_given_is_refused(text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        VirtualDevice(PLAIN.having(parse(text)))


def test_only_what_can_happen_twice_is_given_twice() -> None:
    two = PLAIN.having(parse("hum:ax=1,hz=5"), parse("hum:ax=1,hz=6"))
    assert [e.id for e in two.effects] == ["hum", "hum"]
    with pytest.raises(InputError, match="quadratic is given twice"):
        PLAIN.having(parse("quadratic:x=1"), parse("quadratic:y=1"))
