"""Lines of an adapter, and logs that are played."""

from __future__ import annotations

import gzip
from pathlib import Path

import can
import numpy as np
import pytest
from can_wires import DBC, KEYED, numbers, sample, stream, until_the_end
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.errors import DeviceError, InputError
from fieldcal.core.samples import Array
from fieldcal.drivers.can_frame_groups import CanLinkHealth
from fieldcal.drivers.can_frames import (
    ERROR_FLAG,
    EXTENDED_FLAG,
    FRAME_DTYPE,
    FrameBuffer,
)
from fieldcal.drivers.driver import open_driver
from fieldcal.drivers.lawicel import LawicelDecoder


def lines(rows: list[bytes]) -> bytes:
    """The same frames as an adapter writes them."""
    text = ""
    for row in np.frombuffer(b"".join(rows), FRAME_DTYPE):
        data = row["data"][: row["size"]].tobytes().hex().upper()
        text += f"t{row['id']:03X}{row['size']}{data}\r"
    return text.encode()


def test_lines_of_an_adapter_in_any_pieces() -> None:
    data = lines(stream(20))
    for text, bad in ((data, 0), (data.replace(b"t021", b"t0218", 1), 1)):
        health = CanLinkHealth()
        whole = LawicelDecoder(health).feed(b"\a\rz\rV1013\r" + text)
        assert health.bad == bad
        decoder = LawicelDecoder(CanLinkHealth())
        got = b"".join(decoder.feed(text[i : i + 1]) for i in range(len(text)))
        a, b = np.frombuffer(whole, FRAME_DTYPE), np.frombuffer(got, FRAME_DTYPE)
        for name in ("id", "size", "data"):
            np.testing.assert_array_equal(a[name], b[name])
        assert len(a) == 40 - bad


@given(st.data())
def test_mutated_lines_never_break_the_decoder(data: st.DataObject) -> None:
    text = bytearray(lines(stream(5)))
    for _ in range(data.draw(st.integers(0, 20))):
        at = data.draw(st.integers(0, len(text) - 1))
        text[at : at + data.draw(st.integers(0, 2))] = data.draw(st.binary(max_size=3))
        text = text or bytearray(b"t")
    health = CanLinkHealth()
    whole = LawicelDecoder(health).feed(bytes(text))
    rows = np.frombuffer(whole, FRAME_DTYPE)
    assert (rows["size"] <= 64).all() and len(rows) + health.bad <= text.count(13)


FRAMES = st.tuples(
    st.sampled_from(["data", "remote", "error"]),
    st.integers(0, 0x7FF),
    st.booleans(),
    st.binary(max_size=8),
    st.sampled_from(["can0", "can1"]),
)


@given(st.lists(FRAMES, max_size=20), st.integers(1, 8))
def test_messages_of_any_kind_come_out_as_they_are_however_few_fit(
    drawn: list[tuple[str, int, bool, bytes, str]], most: int
) -> None:
    messages = [
        can.Message(
            timestamp=t, arbitration_id=identifier, is_extended_id=extended,
            data=b"" if kind == "remote" else data, channel=channel,
            is_remote_frame=kind == "remote", is_error_frame=kind == "error",
        )
        for t, (kind, identifier, extended, data, channel) in enumerate(drawn)
    ]  # fmt: skip
    waiting, out, seen, more = iter(messages), [], 0, True
    while more:
        packed = FrameBuffer(most)
        packed.fill(waiting, {"can0": 3, "can1": 4})
        out += packed.frames.tolist()
        seen, more = seen + packed.messages_seen, packed.full
    assert seen == len(messages)
    for row, message in zip(
        out, (m for m in messages if not m.is_remote_frame), strict=True
    ):
        t, identifier, size, bus, data = row
        assert (t, bus) == (message.timestamp, 3 + (message.channel == "can1"))
        if message.is_error_frame:
            assert (identifier & ERROR_FLAG, size) == (ERROR_FLAG, 0)
        else:
            assert identifier & 0x1FFFFFFF == message.arbitration_id
            assert bool(identifier & EXTENDED_FLAG) == message.is_extended_id
            assert data[:size].tobytes() == message.data and not data[size:].any()


def test_a_log_of_somebody_else_says_which_frames_are_missing(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("(1.5) can0 123#00\n(1.75) can0 123#00\n")
    with open_driver(f"can:{path}?dbc=virtual&speed=max") as imu:
        says = r"ended after 0.250 s without a sample: .*Status \(0x102\); heard: 0x123"
        with pytest.raises(DeviceError, match=says):
            next(imu.blocks())


def test_every_kind_of_line() -> None:
    health = CanLinkHealth()
    kinds = b"t1232AABB\rT12345678100\rt1230ABCD\rd1239" + b"11" * 12 + b"\rr1238\r"
    wrong = b"t1239" + b"0" * 18 + b"\rt12\rQ\rt123201\rt1231 A\r\xff\r"
    rows = np.frombuffer(LawicelDecoder(health).feed(kinds + wrong), FRAME_DTYPE)
    assert rows["id"].tolist() == [0x123, 0x12345678 | 1 << 31, 0x123, 0x123]
    assert rows["size"].tolist() == [2, 1, 0, 12]
    assert health.bad == 6
    decoder = LawicelDecoder(health)
    for _ in range(10):
        decoder.feed(b"x" * 10_000)
    assert len(decoder._rest) < 200


def test_a_log_is_played_as_the_bus_was(tmp_path: Path) -> None:
    dbc = tmp_path / "imu.dbc"
    dbc.write_text(DBC)
    query = f"dbc={dbc}&map={KEYED}&rate=100&speed=max"
    for ending in (".log", ".asc", ".blf", ".trc"):
        path = tmp_path / f"drive.day.1{ending}"
        with can.Logger(path) as log:
            for row in np.frombuffer(b"".join(stream(200)), FRAME_DTYPE):
                log(
                    can.Message(
                        timestamp=1e9 + float(row["t"]),
                        arbitration_id=int(row["id"]),
                        is_extended_id=False,
                        data=row["data"][: row["size"]].tobytes(),
                        channel=0,
                    )
                )
        packed = tmp_path / f"{path.name}.gz"
        packed.write_bytes(gzip.compress(path.read_bytes()))
        for name in (path, packed):
            with open_driver(f"can:{name}?{query}") as imu:
                assert numbers(until_the_end(imu)) == list(range(200)), name


@pytest.mark.parametrize("scheme", ["can", "replay"])
def test_a_log_of_two_buses_with_the_same_frames_is_asked_about_and_never_mixed(
    tmp_path: Path, scheme: str
) -> None:
    (tmp_path / "imu.dbc").write_text(DBC)
    path = tmp_path / "both.log"
    lines = []
    for i in range(5000):
        for bus, number in ((0, i), (1, i + 3000)) if i >= 4000 else ((0, i),):
            for row in np.frombuffer(b"".join(sample(number, seq=False)), FRAME_DTYPE):
                data = row["data"][: row["size"]].tobytes().hex()
                at = i / 100 + row["t"] % 0.01 + bus * 1e-6
                lines.append(f"({at:.6f}) can{bus} {row['id']:03X}#{data}\n")
        lines.append(f"({i / 100 + 0.005:.6f}) can2 7FF#00\n")
    path.write_text("".join(lines))
    known = KEYED.replace(",seq=seq", "")
    address = f"{scheme}:{path}?dbc={tmp_path / 'imu.dbc'}&map={known}&rate=100"
    address += "&speed=max"
    with pytest.raises(InputError, match="from the buses can0, can1: choose one, such"):
        with open_driver(address) as imu:
            until_the_end(imu)
    with open_driver(f"{address}&channel=can0") as imu:
        assert numbers(until_the_end(imu)) == list(range(5000))
    with open_driver(f"{address}&channel=can1") as imu:
        assert numbers(until_the_end(imu)) == list(range(7000, 8000))
    for name in ("can2", "can7"):
        with pytest.raises(InputError, match=f"comes from {name}, but from can0, can1"):
            with open_driver(f"{address}&channel={name}") as imu:
                until_the_end(imu)


def test_a_log_takes_its_time(tmp_path: Path) -> None:
    dbc, path = tmp_path / "imu.dbc", tmp_path / "x.log"
    dbc.write_text(DBC)
    rows = [f"({i}.000000) can0 020#{i:02X}00000000000{i:X}00" for i in range(9)]
    rows = [row[:-16] + f"{i:02X}00" + "00" * 6 for i, row in enumerate(rows)]
    path.write_text("\n".join(rows) + "\n")
    with open_driver(f"can:{path}?dbc={dbc}&map=ax=ax&rate=1&speed=20") as imu:
        assert imu.receive(0.0) is not None
        assert imu.receive(0.01) is None
        assert imu.host_time() == 0.0
        block = until_the_end(imu)
        np.testing.assert_allclose(block.t_host, np.arange(1, 9))
        assert imu.host_time() == 8.0


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("none.log", None, "there is no such log"),
        ("empty.log", b"", "holds no frame"),
        ("text.log", b"hello\nworld\n", "is no CAN log of this kind"),
        ("bad.blf", b"LOGGG", "is no CAN log of this kind"),
        ("bad.log.gz", b"no gzip", "cannot be read"),
    ],
)
def test_logs_that_are_none(
    tmp_path: Path, name: str, content: bytes | None, says: str
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=says) as raised:
        open_driver(f"can:{tmp_path / name}?dbc=virtual")
    assert "\n" not in str(raised.value)


def test_a_real_car_turns_as_the_phone_in_it_says(shared: Path) -> None:
    folder = shared / "real" / "comma_rav4_can"
    if not folder.is_dir():
        pytest.skip("no recording of a car's CAN beside the project")
    log = next(folder.glob("*.candump.log.gz"))
    dbc = next(folder.glob("*.dbc"))
    url = f"can:{log}?dbc={dbc}&map=gz=KINEMATICS.YAW_RATE&speed=max"
    with pytest.raises(InputError, match="YAW_RATE has no unit"):
        open_driver(url)
    with open_driver(f"{url}&gyr_unit=0.244*deg/s") as imu:
        block = until_the_end(imu)
        assert len(block) > 4800 and imu.health.gaps == 0
    t = block.t - 1533200000
    phone = np.load(folder / "phone_imu.npz")
    inside = (phone["gyro_t"] > t[0]) & (phone["gyro_t"] < t[-1])
    car = np.interp(phone["gyro_t"][inside], t, block.gyr[:, 2])
    down = -phone["gyro_value"][inside, 2]  # the phone's z points down
    a, b = smooth(car), smooth(down)
    assert np.corrcoef(a, b)[0, 1] > 0.95
    assert 0.85 < np.polyfit(a, b, 1)[0] < 1.1
    assert np.corrcoef(a[300:], b[:-300])[0, 1] < 0.8  # and at the same time


def smooth(x: Array) -> Array:
    """Means over half a second of the phone."""
    return np.convolve(x, np.full(52, 1 / 52), "valid")


@pytest.mark.parametrize(
    "line", ["t-121AA", "t+121AA", "t1_21AA", "t12\u00b31AA", "T 00000121AA"]
)
def test_a_frame_has_hex_digits_only(line: str) -> None:
    health = CanLinkHealth()
    data = line.encode("latin-1") + b"\r"
    assert not LawicelDecoder(health).feed(data)
    assert health.bad == 1
