"""What autopilots do to their messages, decoded: stamps, units, vehicles, versions."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("fastcrc")
pytest.importorskip("pymavlink")

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import all as dialect

from fieldcal.core.errors import DeviceError, InputError
from fieldcal.core.samples import Array, Block
from fieldcal.drivers.driver import open_driver
from fieldcal.drivers.mavlink_samples import MavlinkDecoder
from fieldcal.drivers.mavlink_units import untruncated_mean
from fieldcal.drivers.options import Options
from fieldcal.sim_device.mavlink_packing import HIGHRES, RAW, messages

RATE = 100.0


def at_rest(n: int, t: Array | None = None, seed: int = 1) -> Block:
    rng = np.random.default_rng(seed)
    return Block.of(
        np.arange(1, n + 1) / RATE if t is None else t,
        rng.normal([0.3, -0.2, -9.8], 0.02, (n, 3)),
        rng.normal(0.01, 0.002, (n, 3)),
        np.full(n, 25.0),
    )


def packed(number: int, block: Block, *source: int, **how: Any) -> bytes:
    out = dialect.MAVLink(None, *(source or (1, 1)))
    made = messages(dialect, number, block, **how)
    return b"".join(message.pack(out) for message in made)


def older(number: int, block: Block) -> bytes:
    """Pack as version 1, whose messages end before the fields that came later."""
    out, packets = dialect.MAVLink(None, 1, 1), []
    size = 26 if number == RAW else 22
    for message in messages(dialect, number, block):
        packet = message.pack(out, force_mavlink1=True)
        body = bytes([size]) + packet[2 : 6 + size]
        check = mcrf4xx(body + bytes([message.crc_extra]))
        packets.append(b"\xfe" + body + check.to_bytes(2, "little"))
    return b"".join(packets)


def decoder(query: str) -> MavlinkDecoder:
    return MavlinkDecoder(Options("test", query))


def fed(query: str, data: bytes) -> Block:
    block = decoder(query).feed(data, 0.0)
    assert block is not None
    return block


@pytest.mark.parametrize(
    "name", ["RAW_IMU", "SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3"]
)
@pytest.mark.parametrize("version_1", [False, True])
def test_whole_numbers_come_back_within_half_a_unit(name: str, version_1: bool) -> None:
    sent, message = at_rest(50), decoder(f"message={name}")
    number = message.kind.identifier
    pack = older if version_1 else packed
    got = message.feed(pack(number, sent), 0.0)
    assert got is not None
    np.testing.assert_allclose(got.acc, sent.acc, atol=0.51 * 9.80665e-3)
    np.testing.assert_allclose(got.gyr, sent.gyr, atol=1.01e-3)
    np.testing.assert_allclose(got.t, sent.t, atol=1.1e-3)
    # version 1 ends before the temperature: unknown, not zero
    assert np.isnan(got.temperature).all() == version_1


def test_high_resolution_comes_back_as_floats() -> None:
    sent = at_rest(50)
    got = fed("message=HIGHRES_IMU", packed(HIGHRES, sent))
    np.testing.assert_allclose(got.six, sent.six, rtol=1e-6)
    np.testing.assert_allclose(got.temperature, 34.0)  # whoever's it is


def test_cutting_has_no_bias_left() -> None:
    x = np.random.default_rng(2).uniform(-50, 50, 200_000)
    k = np.trunc(x)
    error = untruncated_mean(k) - x
    for some, share in ((k > 0, 1 / 12), (k < 0, 1 / 12), (k == 0, 1 / 3)):
        assert abs(error[some].mean()) < 5 * np.sqrt(share / some.sum())
        assert error[some].var() == pytest.approx(share, rel=0.05)


def test_repeated_stamps_are_one_sample() -> None:
    twice = np.repeat(np.arange(1, 101) / 400, 2)
    message = decoder("message=RAW_IMU")
    got = message.feed(packed(RAW, at_rest(200, twice)), 0.0)
    assert got is not None
    assert len(got) == message.health.repeated == 100
    assert np.all(np.diff(got.t) > 0)


def test_messages_that_say_nothing_new_are_left_out() -> None:
    made = list(messages(dialect, HIGHRES, at_rest(100)))
    for message in made[1::2]:
        message.fields_updated = 0x1C0  # the magnetometer alone
    out = dialect.MAVLink(None, 1, 1)
    highres = decoder("message=HIGHRES_IMU")
    got = highres.feed(b"".join(message.pack(out) for message in made), 0.0)
    assert got is not None
    assert len(got) == highres.health.repeated == 50


@pytest.mark.parametrize("jump", [1.7e9, -500.0])
def test_a_clock_that_is_set_goes_on(jump: float) -> None:
    t = np.arange(1, 401) / RATE + 1000
    t[200:] += jump
    message = decoder("message=RAW_IMU")
    blocks = [
        message.feed(packed(RAW, at_rest(400, t)[i : i + 10]), 50 + i / RATE)
        for i in range(0, 400, 10)
    ]
    times = np.concatenate([block.t for block in blocks if block is not None])
    assert len(times) == 400
    assert message.health.restarts == 1
    assert np.all(np.diff(times) > 0)
    assert times[-1] - times[0] < 5


def test_a_counter_of_milliseconds_wraps() -> None:
    t = np.arange(1, 401) / RATE + 2.0**32 / 1e3 - 2
    got = fed("message=SCALED_IMU", packed(26, at_rest(400, t)))
    np.testing.assert_allclose(np.diff(got.t), 0.01, atol=1.1e-3)


def test_one_vehicle_and_one_sensor_are_taken() -> None:
    sent, other = at_rest(30), at_rest(30, seed=2)
    data = packed(RAW, other, 2, 1) + packed(RAW, sent, 1, 1)
    data += packed(RAW, other, 1, 1, instance=1)
    chosen = decoder("message=RAW_IMU&system=1")
    got = chosen.feed(data, 0.0)
    assert got is not None
    alone = fed("message=RAW_IMU", packed(RAW, sent))
    np.testing.assert_array_equal(got.six, alone.six)
    free = decoder("message=RAW_IMU")
    free.feed(data, 0.0)
    assert free.sources == {(1, 1), (2, 1)}


def test_several_vehicles_are_not_chosen_from(tmp_path: Path) -> None:
    out, stamp = tmp_path / "two.tlog", (10**6).to_bytes(8, "big")
    packets = [
        packed(RAW, at_rest(30)[i : i + 1], system, 1)
        for i in range(30)
        for system in (1, 2)
    ]
    out.write_bytes(b"".join(stamp + packet for packet in packets))
    url = f"mavlink:{out}?speed=max&message=RAW_IMU"
    with (
        open_driver(url) as imu,
        pytest.raises(InputError, match="name one, system=1&component=1, system=2"),
    ):
        list(imu.blocks())
    with open_driver(f"{url}&system=2") as imu:
        assert len(next(imu.blocks())) == 30


def test_a_signed_packet_is_read_to_its_end() -> None:
    out = dialect.MAVLink(None, 1, 1)
    out.signing.secret_key, out.signing.sign_outgoing = bytes(32), True
    sent = at_rest(20)
    data = b"".join(message.pack(out) for message in messages(dialect, RAW, sent))
    signed = decoder("message=RAW_IMU")
    got = signed.feed(data, 0.0)
    assert got is not None and len(got) == 20
    assert signed.health.skipped == 0


def test_units_are_told_and_what_fits_none_is_refused() -> None:
    sent = at_rest(64)
    message = decoder("message=RAW_IMU")
    got = message.feed(packed(RAW, sent, acc_unit="mm/s^2"), 0.0)
    assert got is not None and message.acc_unit == "mm/s^2"
    np.testing.assert_allclose(got.acc, sent.acc, atol=1e-3)
    odd = Block.of(
        np.arange(1, 401) / RATE, np.full((400, 3), 20.0), np.zeros((400, 3))
    )
    with pytest.raises(DeviceError, match="neither 1 g in mg"):
        decoder("message=RAW_IMU").feed(packed(RAW, odd), 0.0)
    named = fed("message=RAW_IMU&acc_unit=mg", packed(RAW, odd))
    np.testing.assert_allclose(named.acc, 20.0, atol=0.01)


def test_a_device_that_moves_at_first_tells_its_unit_later() -> None:
    sent = at_rest(64)
    sent.acc[:20] *= 1.6
    got = fed("message=HIGHRES_IMU", packed(HIGHRES, sent))
    assert len(got) == 64


@given(st.data())
def test_a_flipped_bit_loses_one_sample_and_no_more(data: st.DataObject) -> None:
    stream = bytearray(packed(RAW, at_rest(20)))
    at = data.draw(st.integers(0, len(stream) * 8 - 1))
    whole = fed("message=RAW_IMU&acc_unit=mg", bytes(stream)).six.tolist()
    stream[at // 8] ^= 1 << at % 8
    padding = packed(HIGHRES, at_rest(10))  # for a length that has grown
    got = fed("message=RAW_IMU&acc_unit=mg", bytes(stream) + padding).six.tolist()
    assert len(got) >= 19
    assert all(row in whole for row in got)
