"""Checksums of many stretches at once, against each stretch byte by byte."""

import doctest

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from wires import crc16_xmodem
from wires import fletcher as by_bytes

from fieldcal.drivers import checksums
from fieldcal.drivers.checksums import FEW_STRETCHES, byte_sums, crc16, fletcher_sums

Stretches = tuple[bytes, list[tuple[int, int]]]


@st.composite
def stretches(draw: st.DrawFn) -> Stretches:
    """Bytes, and stretches of them that may overlap, be empty, and end with them."""
    data = draw(st.binary(min_size=1, max_size=300))
    place = st.integers(0, len(data))
    pairs = draw(st.lists(st.tuples(place, place), max_size=20))
    return data, sorted((min(pair), max(pair)) for pair in pairs)


def arrays(
    given_: Stretches,
) -> tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64]]:
    data, pairs = given_
    starts, ends = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    return np.frombuffer(data, np.uint8), starts, ends


@given(stretches())
def test_sums(some: Stretches) -> None:
    data, pairs = some
    expected = [by_bytes(data[s:e]) for s, e in pairs]
    array = arrays(some)
    assert byte_sums(*array).tolist() == [sum(data[s:e]) % 256 for s, e in pairs]
    first, second = fletcher_sums(*array)
    got = zip(first.tolist(), second.tolist(), strict=True)
    assert [bytes(pair) for pair in got] == expected


@given(stretches())
def test_crc_of_stretches_of_any_length(some: Stretches) -> None:
    data, pairs = some
    assert crc16(*arrays(some)).tolist() == [crc16_xmodem(data[s:e]) for s, e in pairs]


@pytest.mark.parametrize("size", [1, 2, 57, 600])
def test_crc_of_many_stretches_of_one_length(size: int) -> None:
    data = np.random.default_rng(size).bytes(FEW_STRETCHES * size + size)
    # half of them in a row, the others anywhere
    for step in (size, 1):
        pairs = [(step * i, step * i + size) for i in range(FEW_STRETCHES)]
        found = crc16(*arrays((data, pairs)))
        assert found.tolist() == [crc16_xmodem(data[s:e]) for s, e in pairs]


def test_the_examples_hold() -> None:
    failed, tried = doctest.testmod(checksums, extraglobs={"np": np})
    assert not failed and tried
