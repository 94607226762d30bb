"""The frames of the virtual device, and the adapter in front of it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.drivers.can_map import VIRTUAL_DBC, load_database
from fieldcal.sim_device import Profile, VirtualDevice
from fieldcal.sim_device.adapter import Adapter
from fieldcal.sim_device.can_packing import frames

DATABASE = load_database(VIRTUAL_DBC)

six = st.lists(
    st.tuples(*[st.floats(-60, 60)] * 3, *[st.floats(-40, 40)] * 3), min_size=1
)


@given(six, st.floats(0, 1e4), st.floats(-400, 400))
def test_cantools_reads_what_was_packed(
    rows: list[tuple[float, ...]], begin: float, degrees: float
) -> None:
    values, n = np.array(rows), len(rows)
    t = begin + np.arange(n) / 1000
    seq = np.arange(n) + 13.0
    block = Block.of(t, values[:, :3], values[:, 3:], np.full(n, degrees), seq)
    packed = frames(block)
    assert [frame.identifier for frame in packed] == [0x100, 0x101, 0x102] * n
    for i in range(n):
        found: dict[str, float] = {}
        for identifier, data in packed[3 * i : 3 * i + 3]:
            part = DATABASE.decode_message(identifier, data)
            assert isinstance(part, dict)
            assert part["seq"] == (i + 13) % 16
            found |= {name: float(str(value)) for name, value in part.items()}
        acc = [found[name] for name in ("ax", "ay", "az")]
        gyr = [found[name] for name in ("gx", "gy", "gz")]
        np.testing.assert_allclose(
            acc, np.clip(values[i, :3], -52.4288, 52.4287), atol=0.5001e-4
        )
        rate = np.clip(np.rad2deg(values[i, 3:]), -2097.152, 2097.148)
        np.testing.assert_allclose(gyr, rate, atol=0.002001)
        assert found["temperature"] == pytest.approx(
            np.clip(degrees, -327.68, 327.67), abs=0.00501
        )
        assert found["t"] == pytest.approx(t[i] * 1e6 % 2**32, abs=0.6)


def test_what_is_unknown_is_zero() -> None:
    block = Block.of(np.zeros(1), np.full((1, 3), np.nan))
    assert all(frame.data == bytes(8) for frame in frames(block))


def test_the_adapter_answers_as_lawicel_says() -> None:
    adapter = Adapter()
    for said, answer in (
        (b"\r", b"\r"),
        (b"V\r", b"V1013\r"),
        (b"N\r", b"NF1CA\r"),
        (b"C\r", b"\a"),
        (b"t1230\r", b"\a"),
        (b"F\r", b"\a"),
        (b"S6\r", b"\r"),
        (b"S\r", b"\a"),
        (b"Z0\rO\r", b"\r\r"),
        (b"S6\r", b"\a"),
        (b"O\r", b"\a"),
        (b"t1230\rT123456780\r", b"z\rZ\r"),
        (b"F\r", b"F00\r"),
        (b"Z1\r", b"\a"),
        (b"what?\r", b"\a"),
        (b"C", b""),
        (b"\r", b"\r"),
        (b"L\r", b"\r"),
    ):
        assert adapter.answer(said) == answer, said
    assert adapter.open
    adapter.unplug()
    assert not adapter.open
    adapter.answer(b"x" * 10_000)
    assert len(adapter._line) <= 64


def test_the_lines_of_a_sample() -> None:
    block = VirtualDevice(Profile(), seed=1).take(3)
    text = Adapter().encode(block).decode()
    assert text.endswith("\r")
    lines = text.split("\r")[:-1]
    assert [line[:5] for line in lines] == ["t1008", "t1018", "t1028"] * 3
    for line, frame in zip(lines, frames(block), strict=True):
        assert bytes.fromhex(line[5:]) == frame.data


@pytest.mark.parametrize(
    ("options", "code", "says"),
    [
        (["--can", "udp_multicast"], 2, "needs a channel"),
        (["--can", "slcan:/tmp/x"], 2, "name it with --port-link"),
        (["--can", "virtual:x", "--port-link", "y"], 2, "leave --port-link out"),
        (["--can", "morse:x"], 2, "--can morse"),
        (["--can", "socketcan:nosuch0"], 3, "cannot join socketcan channel nosuch0"),
    ],
)
def test_bad_input_is_one_sentence(
    options: list[str], code: int, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sim", *options]) == code
    out, err = capsys.readouterr()
    assert out == "" and says in err and err.count("\n") == 1
