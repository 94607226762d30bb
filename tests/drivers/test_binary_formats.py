"""Binary formats: frames written out by hand, variants, and streams of real devices."""

import gzip
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from wires import (
    G,
    crc16_xmodem,
    fletcher,
    ilabs,
    mip_packet,
    mtdata2,
    ubx_message,
    ubx_word,
    vn_message,
)

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block, concat
from fieldcal.drivers.codec import Codec, codec_class, open_codec
from fieldcal.drivers.options import Options


def codec(name: str, query: str = "") -> Codec:
    return open_codec(name, Options("serial", query))


def fed(codec: Codec, *pieces: bytes) -> Block:
    blocks = [codec.feed(piece, float(i)) for i, piece in enumerate(pieces)]
    return concat(block for block in blocks if block is not None)


def test_343_messages_of_an_autopilots_vectornav(shared: Path) -> None:
    path = shared / "real" / "autopilot_streams" / "vectornav.bin.gz"
    stream = gzip.decompress(path.read_bytes())
    decoder = codec("vectornav")
    block = fed(decoder, stream)
    assert len(block) == 343
    assert decoder.health.bad == decoder.health.gaps == 0
    np.testing.assert_allclose(block.acc.mean(axis=0), [0, 0, -G], atol=1e-6)
    np.testing.assert_allclose(np.diff(block.t), 0.020825, atol=1e-9)
    np.testing.assert_allclose(block.temperature[0], 11.204346, atol=1e-6)
    compensated = fed(codec("vectornav", "source=compensated"), stream)
    assert np.abs(compensated.gyr - block.gyr).max() > 1e-4


def test_370_packets_of_an_autopilots_microstrain(shared: Path) -> None:
    path = shared / "real" / "autopilot_streams" / "microstrain_mip.bin.gz"
    stream = gzip.decompress(path.read_bytes())
    decoder = codec("mip", "rate=25")
    array = np.frombuffer(stream, np.uint8)
    assert np.count_nonzero(decoder.scan(array).good) == 370
    block = fed(decoder, stream)
    assert len(block) == 178
    assert decoder.health.bad == 0
    np.testing.assert_allclose(block.acc, np.tile([0, 0, -G], (178, 1)), atol=1e-6)
    assert 1e-4 < block.gyr.std() < 1e-3


def test_a_vectornav_message_from_the_imu_group_written_out_by_hand() -> None:
    # groups 2 and 3: TimeStartup; UncompAccel, UncompGyro, Temp
    body = bytes.fromhex("06 0100 1c00") + struct.pack("<Q", 1_500_000_000)
    body += struct.pack("<7f", 1, 2, 3, 4, 5, 6, 20)
    crc = codec_crc(body)
    block = fed(codec("vectornav"), b"\xfa" + body + crc)
    assert block.six.tolist() == [[1, 2, 3, 4, 5, 6]]
    assert block.t.tolist() == [1.5]
    assert block.temperature.tolist() == [20]


def codec_crc(body: bytes) -> bytes:
    return crc16_xmodem(body).to_bytes(2, "big")


def test_messages_of_several_kinds_stay_in_order() -> None:
    pieces = []
    for i in range(60):
        six = np.full(6, float(i))
        if i % 3:
            pieces.append(vn_message(i / 100, six, 20.0))
        else:
            body = bytes.fromhex("04 0c00") + struct.pack("<6f", *six)
            pieces.append(b"\xfa" + body + codec_crc(body))
    decoder = codec("vectornav")
    # the first has a time, so those without are placed between
    block = fed(decoder, pieces[1], b"".join(pieces[2:]))
    assert block.acc[:, 0].tolist() == list(range(1, 60))
    assert np.all(np.diff(block.t) > 0)


# 0x80: acceleration 1 g along z, in big-endian floats
MIP = bytes.fromhex("75 65 80 0e 0e 04 00000000 00000000 3f800000")


def test_a_mip_packet_written_out_by_hand() -> None:
    decoder = codec("mip", "rate=100")
    block = fed(decoder, MIP + fletcher(MIP))
    np.testing.assert_allclose(block.acc, [[0, 0, G]])
    assert np.isnan(block.gyr).all()


def test_a_mip_time_of_week_goes_on_over_the_weeks_end() -> None:
    packets = []
    for i in range(60):
        tow = (604799.8 + i * 0.01) % 604800
        week = struct.pack(">dHH", tow, 2300, 7)
        acc = struct.pack(">3f", 0, 0, 1)
        packets.append(mip_packet(0x80, (0xD3, week), (0x04, acc)))
    decoder = codec("mip")
    block = fed(decoder, b"".join(packets))
    np.testing.assert_allclose(np.diff(block.t), 0.01, atol=1e-6)
    assert decoder.health.gaps == 0


def test_a_mip_packet_whose_fields_do_not_add_up_is_no_sample() -> None:
    decoder = codec("mip", "rate=100")
    packet = mip_packet(0x80, (0x04, struct.pack(">3f", 0, 0, 1)))
    longer = bytearray(packet)
    longer[4] = 0x20
    broken = bytes(longer[:-2]) + fletcher(bytes(longer[:-2]))
    assert not len(fed(decoder, broken))


def fixed_16_32(x: float) -> bytes:
    """Fraction first, then the whole, as Xsens sends it."""
    fixed = round(x * 2**32)
    return struct.pack(">Ih", fixed & 0xFFFFFFFF, fixed >> 32)


@pytest.mark.parametrize(
    ("precision", "pack"),
    [
        (0, lambda x: struct.pack(">f", x)),
        (1, lambda x: struct.pack(">i", round(x * 2**20))),
        (2, fixed_16_32),
        (3, lambda x: struct.pack(">d", x)),
    ],
)
def test_the_numbers_of_xsens(precision: int, pack: Callable[[float], bytes]) -> None:
    acc, gyr = [-1.25, 0.5, 9.75], [-0.125, 2.5, -2000.25]
    message = mtdata2(
        (0x4020 | precision, b"".join(map(pack, acc))),
        (0x8020 | precision, b"".join(map(pack, gyr))),
        (0x0810 | precision, pack(-3.5)),
        (0x1060, struct.pack(">I", 12345)),
    )
    block = fed(codec("xsens"), message)
    assert block.six.tolist() == [acc + gyr]
    assert block.temperature.tolist() == [-3.5]
    np.testing.assert_allclose(block.t, [1.2345])


def test_a_long_xsens_message_and_high_rate_kinds() -> None:
    acc, gyr = struct.pack(">3f", 1, 2, 3), struct.pack(">3f", 4, 5, 6)
    message = mtdata2((0xA010, bytes(250)), (0x4040, acc), (0x8040, gyr))
    assert message[3] == 255
    block = fed(codec("xsens", "rate=100"), message)
    assert block.six.tolist() == [[1, 2, 3, 4, 5, 6]]


def test_an_xsens_counter_shows_what_is_missing() -> None:
    acc = (0x4020, struct.pack(">3f", 1, 2, 3))
    counts = [65534, 65535, 0, 3, 4]
    pieces = [mtdata2((0x1020, struct.pack(">H", c)), acc) for c in counts]
    decoder = codec("xsens", "rate=10")
    block = fed(decoder, b"".join(pieces))
    np.testing.assert_allclose(block.t, [0, 0.1, 0.2, 0.5, 0.6])
    assert (decoder.health.gaps, decoder.health.missing) == (1, 2)


def test_esf_raw_in_bursts() -> None:
    pyubx2 = pytest.importorskip("pyubx2")
    kinds, values = (14, 13, 5, 16, 17, 18), (4096, -4096, 2048, 1024, -1024, 10000)
    payload = bytes(4)
    for i in range(10):
        tag = struct.pack("<I", 256 * i)
        for kind, value in zip(kinds, values, strict=True):
            payload += ubx_word(kind, value) + tag
    message = pyubx2.UBXMessage(0x10, 0x03, pyubx2.GET, payload=payload).serialize()
    assert message == ubx_message(3, payload)
    block = fed(codec("ubx"), message)
    np.testing.assert_allclose(block.t, np.arange(10) / 100)
    np.testing.assert_allclose(block.acc[0], [1, -1, 9.765625])
    np.testing.assert_allclose(block.gyr[9], np.deg2rad([1, -1, 0.5]))


KINDS = {16: 0, 17: 1, 18: 2, 14: 3, 13: 4, 5: 5, 12: 6}
PER_UNIT = np.array([2.0**10] * 3 + [np.rad2deg(2.0**12)] * 3 + [100])


def read_by_the_library(messages: list[bytes]) -> list[list[float]]:
    """Samples of ESF-RAW messages, value by value, as the library takes them apart."""
    pyubx2 = pytest.importorskip("pyubx2")
    samples: dict[int, list[float]] = {}
    for raw in messages:
        message = pyubx2.UBXReader.parse(raw)
        for i in range(1, (len(raw) - 12) // 8 + 1):
            word = getattr(message, f"data_{i:02d}")
            tag = int.from_bytes(getattr(message, f"sTag_{i:02d}"), "little")
            column = KINDS[word[3]]
            value = int.from_bytes(word[:3], "little", signed=True)
            row = samples.setdefault(tag, [np.nan] * 7)
            row[column] = value / PER_UNIT[column]
    return list(samples.values())


@pytest.mark.parametrize("per_message", [1, 3])
@pytest.mark.parametrize("shuffled", ["never", "once", "always"])
def test_esf_raw_is_what_the_library_reads(shuffled: str, per_message: int) -> None:
    rng = np.random.default_rng(per_message)
    messages, tag = [], 0
    for i in range(30):
        order, payload = list(KINDS), bytes(4)
        for _ in range(per_message):
            if shuffled == "always" or (shuffled == "once" and i == 17):
                order = rng.permutation(list(KINDS)).tolist()
            tag += 256
            for kind in order:
                value = int(rng.integers(-(2**23), 2**23))
                payload += ubx_word(kind, value) + struct.pack("<I", tag)
        messages.append(ubx_message(3, payload))
    block = fed(codec("ubx"), b"".join(messages))
    seven = np.column_stack([block.six, block.temperature])
    np.testing.assert_allclose(seven, read_by_the_library(messages), rtol=1e-12)


@pytest.mark.parametrize("counted", [True, False])
def test_esf_meas_of_two_sensors_is_put_together(counted: bool) -> None:
    pyubx2 = pytest.importorskip("pyubx2")

    def message(ms: int, kinds: tuple[int, ...], value: int) -> bytes:
        flags = 1 << 3 | (len(kinds) << 11 if counted else 0)
        payload = struct.pack("<IHH", ms, flags, 0)
        payload += b"".join(ubx_word(kind, value) for kind in kinds)
        payload += struct.pack("<I", 99)
        raw: bytes = pyubx2.UBXMessage(0x10, 2, pyubx2.GET, payload=payload).serialize()
        return raw

    decoder = codec("ubx", "message=meas")
    pieces = []
    for i in range(20):
        pieces.append(message(100 * i, (14, 13, 5, 12), 4096 * (i + 1)))
        pieces.append(message(100 * i, (16, 17, 18), 1024 * (i + 1)))
    block = fed(decoder, *pieces)
    np.testing.assert_allclose(block.t, np.arange(20) / 10)
    np.testing.assert_allclose(block.acc[:, 2], np.arange(1, 21))
    np.testing.assert_allclose(block.gyr[:, 1], np.deg2rad(np.arange(1, 21)))
    assert block.temperature[0] == pytest.approx(40.96)
    found = codec_class("ubx").match(b"".join(pieces), 2.0)
    assert found is not None
    assert found.query == "message=meas"


def test_vnimu_takes_no_columns() -> None:
    with pytest.raises(InputError, match="columns is fixed"):
        codec("vnimu", "columns=t,ax,ay,az")


def test_a_signalling_nan_is_a_missing_value_and_no_warning() -> None:
    strange = bytes.fromhex("7fa00000") + struct.pack(">2f", 1.0, 2.0)
    message = mtdata2((0x1060, struct.pack(">I", 100)), (0x4020, strange))
    block = open_codec("xsens", Options("serial")).feed(message, 0.0)
    assert block is not None
    np.testing.assert_array_equal(block.acc, [[np.nan, 1.0, 2.0]])


def test_inertiallabs_reads_up_to_a_value_that_it_does_not_know() -> None:
    acc = (0x23, (0, -1_000_000, 0))
    whole = ilabs((0x01, (5,)), acc, (0x21, (100_000, 0, 0)))
    # an identifier nobody knows in place of the rates: as long, and of unknown length
    data = bytearray(whole)
    data[9] = 0xEE
    data[-2:] = struct.pack("<H", sum(data[2:-2]) % 65536)
    for packet, known in ((whole, True), (bytes(data), False)):
        block = fed(codec("inertiallabs"), packet)
        np.testing.assert_allclose(block.acc, [[0.0, -9.8106, 0.0]])
        assert np.isfinite(block.gyr).all() == known
    assert open_codec("inertiallabs", Options("serial")).feed(whole[:-1], 0.0) is None
    broken = whole[:-1] + bytes([whole[-1] ^ 1])
    decoder = codec("inertiallabs")
    decoder.feed(broken + whole[:8], 0.0)
    assert decoder.health.samples == 0 and decoder.health.bad == 1
