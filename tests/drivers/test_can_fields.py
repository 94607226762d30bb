"""Bits out of CAN frames, against cantools on every signal."""

from collections import OrderedDict

import numpy as np
import pytest
from cantools.database.can import Database, Message, Signal
from cantools.database.conversion import BaseConversion
from cantools.database.namedsignalvalue import NamedSignalValue
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.drivers.can_fields import Bytes, SignalField
from fieldcal.drivers.can_map import VIRTUAL_DBC, load_database

NAMED: OrderedDict[int, str | NamedSignalValue] = OrderedDict({0: "no", 1: "bad"})


def decoded(message: Message, signal: Signal, data: Bytes) -> Array:
    """What cantools makes of a signal, frame by frame; nan for a named value."""
    values = []
    for row in data:
        found = message.decode(row.tobytes(), decode_choices=True)
        assert isinstance(found, dict)
        value = found[signal.name]
        values.append(value if isinstance(value, int | float) else np.nan)
    return np.array(values, dtype=float)


def padded(data: Bytes) -> Bytes:
    rows = np.zeros((len(data), 64), np.uint8)
    rows[:, : data.shape[1]] = data
    return rows


@st.composite
def signals(draw: st.DrawFn) -> tuple[Signal, int]:
    """A signal anywhere in a frame of 8 to 64 bytes, and the length of the frame."""
    size = draw(st.sampled_from([8, 8, 12, 24, 64]))
    floating = draw(st.sampled_from([0, 0, 0, 16, 32, 64]))
    length = floating or draw(st.integers(1, 64))
    begin = draw(st.integers(0, 8 * size - length))
    big = draw(st.booleans())
    conversion = BaseConversion.factory(
        scale=draw(st.sampled_from([1, 0.01, -2.5, 1e-6])),
        offset=draw(st.sampled_from([0, -512, 0.25])),
        choices=draw(st.sampled_from([None, None if floating else NAMED])),
        is_float=bool(floating),
    )
    signal = Signal(
        "s",
        8 * (begin // 8) + 7 - begin % 8 if big else begin,
        length,
        byte_order="big_endian" if big else "little_endian",
        is_signed=not floating and draw(st.booleans()),
        conversion=conversion,
    )
    return signal, size


@given(signals(), st.integers(0, 2**32))
def test_any_signal_is_what_cantools_says(pair: tuple[Signal, int], seed: int) -> None:
    signal, size = pair
    message = Message(1, "m", size, [signal], is_fd=size > 8)
    rng = np.random.default_rng(seed)
    data = rng.integers(0, 256, (20, size), dtype=np.uint8)
    data[0], data[1] = 0, 255
    if signal.is_float:
        data[1] = 0
    got = SignalField.of(signal).values(padded(data))
    with np.errstate(over="ignore", invalid="ignore"):
        want = decoded(message, signal, data)
    np.testing.assert_allclose(got, want, rtol=1e-12)


def test_a_signal_may_end_where_the_longest_frame_does_and_no_bit_later() -> None:
    frame = np.arange(64, dtype=np.uint8)[None]
    last = bytes([60, 61, 62, 63])
    little = SignalField.of(Signal("s", 480, 32, byte_order="little_endian"))
    assert little.values(frame) == int.from_bytes(last, "little")
    big = SignalField.of(Signal("s", 487, 32, byte_order="big_endian"))
    assert big.values(frame) == int.from_bytes(last, "big")
    for beyond in (
        Signal("s", 480, 33, byte_order="little_endian"),
        Signal("s", 487, 33, byte_order="big_endian"),
    ):
        with pytest.raises(InputError, match="no frame holds such a number"):
            SignalField.of(beyond)


def every_signal(database: Database) -> list[tuple[Message, Signal]]:
    return [(m, s) for m in database.messages for s in m.signals]


@pytest.mark.parametrize(
    "pair", every_signal(load_database(VIRTUAL_DBC)), ids=lambda p: p[1].name
)
def test_every_signal_of_the_virtual_device(pair: tuple[Message, Signal]) -> None:
    message, signal = pair
    data = np.random.default_rng(3).integers(0, 256, (200, 8), dtype=np.uint8)
    got = SignalField.of(signal).values(padded(data))
    np.testing.assert_allclose(got, decoded(message, signal, data), rtol=1e-14)


def test_the_file_of_the_virtual_device_is_strict() -> None:
    from cantools.database import load_file

    database = load_file(VIRTUAL_DBC, strict=True)
    assert isinstance(database, Database)
    bits = {m.name: sum(s.length for s in m.signals) for m in database.messages}
    assert bits == {"Acceleration": 64, "AngularRate": 64, "Status": 52}
