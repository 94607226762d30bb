"""Encoders against frames written out by hand from the public format descriptions."""

import numpy as np
import pytest

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.sim_device.line_faults import LineFaults
from fieldcal.sim_device.wire import formats, open_wire

G = 9.80665
SAMPLE = Block.of(
    np.array([3723.456]),
    np.array([[0.0, -G, G / 2]]),
    np.deg2rad([[250.0, -2000.0, 0.0]]),
    np.array([25.0]),
    np.array([7.0]),
)
# 1 h 2 min 3.456 s after 2024-01-01; -1 g = -2048, 1/2 g = 1024; 250 °/s = 4096
CLOCK = bytes.fromhex("55 50  18 01 01 01 02 03 c801  8e")
ACC = bytes.fromhex("55 51  0000 00f8 0004 c409  6f")
GYR = bytes.fromhex("55 52  0010 0080 0000 c409  04")


def test_witmotion_frames() -> None:
    assert open_wire("witmotion").encode(SAMPLE) == CLOCK + ACC + GYR
    assert open_wire("witmotion?time=0").encode(SAMPLE) == ACC + GYR


def test_witmotion_clips_at_full_scale_and_does_not_wrap() -> None:
    beyond = Block.of(
        np.zeros(1), np.array([[200.0, -200.0, 0]]), np.array([[99.0, -99.0, 0]])
    )
    frames = open_wire("witmotion?time=0").encode(beyond)
    assert frames[2:6] == bytes.fromhex("ff7f 0080")
    assert frames[13:17] == bytes.fromhex("ff7f 0080")


def test_witmotion_ranges_can_be_others() -> None:
    frames = open_wire("witmotion?time=0&acc_range=2&gyr_range=250").encode(SAMPLE)
    assert frames[4:8] == bytes.fromhex("00c0 0020")
    assert frames[13:15] == bytes.fromhex("ff7f")


def test_witmotion_midnight_and_new_year() -> None:
    late = Block.of(np.array([366 * 86400 - 0.001, 366 * 86400.0]), np.zeros((2, 3)))
    frames = open_wire("witmotion").encode(late)
    assert frames[2:10] == bytes([24, 12, 31, 23, 59, 59, 0xE7, 0x03])
    assert frames[35:43] == bytes([25, 1, 1, 0, 0, 0, 0, 0])


def test_text_line() -> None:
    line = open_wire("text?acc_unit=g&gyr_unit=deg/s&digits=4").encode(SAMPLE)
    assert line == b"3723.456000,0,-1,0.5,250,-2000,0,25.00\r\n"


def test_text_with_checksum() -> None:
    # 41^2c^37^2c^32^35^2e^30^30 = 6d
    wire = open_wire("text?columns=seq,temperature&checksum=xor&prefix=A")
    assert wire.encode(SAMPLE) == b"$A,7,25.00*%02X\r\n" % (
        0x41 ^ 0x2C ^ 0x37 ^ 0x2C ^ 0x32 ^ 0x35 ^ 0x2E ^ 0x30 ^ 0x30
    )
    short = open_wire("text?columns=seq,ay&checksum=xor&prefix=$A&acc_unit=g&digits=1")
    # 41^2c^37^2c^2d^31 = 6a
    assert short.encode(SAMPLE) == b"$A,7,-1*6A\r\n"
    plain = open_wire("text?columns=seq&prefix=$A")
    assert plain.encode(SAMPLE) == b"$A,7\r\n"


def test_text_separator_order_and_time_unit() -> None:
    wire = open_wire("text?columns=az,t,seq&separator=tab&t_unit=us&acc_unit=mg")
    assert wire.encode(SAMPLE) == b"500\t3723456000\t7\r\n"
    nan = Block.of(np.zeros(1), np.zeros((1, 3)))
    wire = open_wire("text?columns=ax,gx&separator=;")
    assert wire.encode(nan) == b"0;nan\r\n"


def test_formats_are_found_by_their_file() -> None:
    assert {"witmotion", "text"} <= set(formats())


@pytest.mark.parametrize(
    ("spec", "says"),
    [
        ("morse", "no wire format 'morse'.*text.*witmotion"),
        ("../x", "no wire format"),
        ("witmotion?rate=3", "no option 'rate'"),
        ("witmotion?acc_range=none", "must be a number above 0"),
        ("text?columns=ax,mx", "no column 'mx'"),
        ("text?separator=and", "separator"),
        ("text?acc_unit=V", "none of m/s"),
        ("text?checksum", "options are like"),
    ],
)
def test_a_format_that_is_none_is_refused(spec: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        open_wire(spec)


DATA = bytes(range(200))


def spoilt(**order: int) -> bytes:
    faults = LineFaults(3)
    faults.order(order)
    out = faults.spoil(DATA)
    assert faults.spoil(DATA) == DATA
    return out


def test_faults_of_the_line_spoil_what_they_say() -> None:
    assert len(spoilt(garbage_bytes=17)) == 217
    assert 195 <= len(spoilt(lose_bytes=5)) < 200
    assert len(spoilt(double_bytes=5)) == 205
    flipped = spoilt(flip_bits=3)
    bits = sum((a ^ b).bit_count() for a, b in zip(flipped, DATA, strict=True))
    assert bits in (1, 3)


def test_faults_wait_for_bytes_and_repeat_with_the_seed() -> None:
    faults = LineFaults(3)
    faults.order({"garbage_bytes": 5})
    assert faults.spoil(b"") == b""
    assert faults.spoil(DATA) == spoilt(garbage_bytes=5) != DATA


@pytest.mark.parametrize("count", [0, -1, 10**9, 1.5, True])
def test_a_fault_without_a_count_is_refused(count: int) -> None:
    with pytest.raises(InputError, match="whole number"):
        LineFaults(1).order({"flip_bits": count})
