"""Lines whose values have names, as sent and as damaged on the way."""

import json
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block, concat
from fieldcal.drivers.named_lines import read_named_line
from fieldcal.drivers.options import Options
from fieldcal.drivers.protocols.text import LONGEST, TextCodec

PLAIN = "map=t=t,ax=ax,ay=ay,az=az"
LISTS = "map=t=t,ax=acc[0],ay=acc[1],az=acc[2]"
FORMS = {
    "pairs": (PLAIN, "t={} ax={} ay={} az={}"),
    "colons and units": (PLAIN, "t: {} s, ax: {} m/s^2, ay: {} m/s^2, az: {} m/s^2"),
    "bars": (PLAIN, "t:{}|ax:{}|ay:{}|az:{}"),
    "tabs, and more names": (PLAIN, "n=1\tt={}\tax={}\tay={}\taz={}\tmx=3"),
    "numbers behind a name": (LISTS, "t: {} acc: {} {} {}"),
    "an object": (PLAIN, '{{"t":{},"ax":{},"ay":{},"az":{},"id":"a","ok":true}}'),
    "lists": (LISTS, '{{"t": {}, "acc": [{}, {}, {}], "gyr": null}}'),
}


def codec(query: str) -> TextCodec:
    return TextCodec(Options("serial", query))


def sent(form: str, rows: Sequence[tuple[object, ...]]) -> bytes:
    return b"\n" + "".join(form.format(*row) + "\r\n" for row in rows).encode()


ROWS = [(float(i), 0.25 + i, -17.5, 9.81 + i) for i in range(1, 6)]


@pytest.mark.parametrize("name", FORMS)
def test_names_tell_the_channels(name: str) -> None:
    query, form = FORMS[name]
    decoder = codec(query)
    block = decoder.feed(sent(form, ROWS), 0.0)
    assert block is not None
    assert block.acc.tolist() == [list(row[1:]) for row in ROWS]
    assert block.t.tolist() == [row[0] for row in ROWS]
    assert np.isnan(block.gyr).all() and decoder.health.bad == 0


def test_the_order_is_that_of_the_names_and_units_are_stated() -> None:
    query = (
        "map=gz=wz,gx=wx,gy=wy,ax=acc.x,ay=acc.y,az=acc.z,t=ms,temperature=T"
        "&acc_unit=mg&gyr_unit=deg/s&t_unit=ms"
    )
    said = {"wx": 1, "wy": 2, "wz": 3, "T": 25, "ms": 1500}
    line = json.dumps({"acc": {"z": 1000, "y": -500, "x": 0}, **said})
    block = codec(query).feed(f"\n{line}\n".encode(), 0.0)
    assert block is not None
    np.testing.assert_allclose(block.acc, 9.80665 * np.array([[0, -0.5, 1]]))
    np.testing.assert_allclose(block.gyr, [np.deg2rad([1, 2, 3])])
    assert (block.t[0], block.temperature[0]) == (1.5, 25)


def test_a_prefix_and_a_checksum_go_with_names() -> None:
    body = b"IMU,t=1,ax=2,ay=3,az=4"
    check = b"%02X" % np.bitwise_xor.reduce(np.frombuffer(body, np.uint8))
    decoder = codec(f"{PLAIN}&prefix=IMU&checksum=xor")
    stream = b"$GPS,t=1*00\n$" + body + b"*" + check + b"\r\n"
    block = decoder.feed(stream + stream.replace(b"ax=2", b"ax=7"), 0.0)
    assert block is not None and block.acc.tolist() == [[2, 3, 4]]
    assert decoder.health.bad == 1


@pytest.mark.parametrize(
    "line",
    [
        "t=2 ax=1 ay=2",
        "t=2 ax=1 ay=2 a=3",
        "t=2 ax=1 ay=2 az=",
        "t=2 ax=1 ay=2 az=-",
        "t=2 ax=1 ay=2 az=3e",
        "t=2 ax=1 ay=2 az=3e999",
        "t=2 ax=1 ay=2 az=inf",
        "t=2 ax=1 ay=2 az=1_0",
        "t=2 ax=1 ay=2 az=3 az=3",
        "t=2 ax=1 ax=1 ay=2 az=3",
        "t=2 ax=1 ay=2 az=9 8",
        "t=2 ax=1 ay=2 az=9x8",
        "t=2 ax=1ay=2 az=9",
        "t=nan ax=1 ay=2 az=9",
        "ax=1 ay=2 az=3",
        "boot ok",
        "2,1,2,3",
        '{"t":2,"ax":1,"ay":2,"az":3',
        '{"t":2,"ax":1,"ay":2,"az":null}',
        '{"t":2,"ax":1,"ay":2,"az":"3"}',
        '{"t":2,"ax":1,"ay":2,"az":true}',
        '{"t":2,"ax":1,"ay":2,"az":[3]}',
        '{"t":2,"ax":1,"ay":2,"az":3,"az":3}',
        '{"t":2,"ax":1,"ay":2,"az":Infinity}',
        '{"t":2,"ax":1,"ay":2,"az":1' + "0" * 400 + "}",
        '{"a":' + "[" * 990,
        '{"t":2,"ax":1,"ay":2,"az":3' + " " * LONGEST + "}",
    ],
)
def test_a_line_that_is_broken_or_lacks_a_name_is_counted(line: str) -> None:
    decoder = codec(PLAIN)
    good = "t={0} ax=0 ay=0 az=1"
    stream = f"\n{good.format(1)}\n{line}\n{good.format(3)}\n"
    block = decoder.feed(stream.encode(), 0.0)
    assert block is not None and block.t.tolist() == [1, 3]
    assert decoder.health.bad == 1


@pytest.mark.parametrize("line", ["acc: 1 2 9 8", '{"acc":[1,2,9,8]}', "acc: 1 2"])
def test_a_list_of_another_length_is_no_sample(line: str) -> None:
    """A blank for the point of 9.8 would make a 9 of it."""
    decoder = codec("map=ax=acc[0],ay=acc[1],az=acc[2]&rate=10")
    assert decoder.feed(f"\n{line}\n".encode(), 0.0) is None
    assert decoder.health.bad == 1


@pytest.mark.parametrize(
    "query",
    [
        "map=ax=aX,ay=aY",
        "map=ax=aX,ay=aY,az=aZ,ax=a",
        "map=ax=aX,ay=aX,az=aZ",
        "map=ax,ay,az",
        "map=ax=aX,ay=aY,az=",
        "map=ax=aX,ay=aY,az=aZ,mx=mX",
        "map=ax=aX,ay=aY,az=aZ&columns=ax,ay,az",
    ],
)
def test_maps_that_are_none(query: str) -> None:
    with pytest.raises(InputError):
        codec(query)


def pieces_fed(query: str, stream: bytes, cuts: list[int]) -> tuple[Block | None, int]:
    decoder = codec(query)
    ends = [0, *sorted(cut % (len(stream) + 1) for cut in cuts), len(stream)]
    pairs = zip(ends, ends[1:], strict=False)
    blocks = [decoder.feed(stream[a:b], 0.0) for a, b in pairs]
    whole = [block for block in blocks if block is not None]
    return (concat(whole) if whole else None), decoder.health.bad


# no digit of these values makes another of them, and none is the beginning of one
VALUE = st.sampled_from(["0.125", "-7.75", "9.8125", "3e-4", "6.5"])


@given(
    name=st.sampled_from(sorted(FORMS)),
    values=st.lists(st.tuples(VALUE, VALUE, VALUE), min_size=4, max_size=4),
    at=st.integers(0, 1000),
    noise=st.sampled_from([b"", b"\x00", b"\xff", b"\r", b"q", b"=", b":", b'"', b"{"]),
    over=st.booleans(),
    cuts=st.lists(st.integers(0, 1000), max_size=4),
)
def test_a_damaged_byte_costs_its_line_and_invents_nothing(
    name: str,
    values: list[tuple[str, str, str]],
    at: int,
    noise: bytes,
    over: bool,
    cuts: list[int],
) -> None:
    """A byte that is no part of a number is put in, or over one that is no digit."""
    query, form = FORMS[name]
    rows = [(f"{i}", *row) for i, row in enumerate(values)]
    clean = sent(form, rows)
    marks = b"0123456789.+-e"
    places = [i for i in range(1, len(clean)) if clean[i] not in marks]
    at = places[at % len(places)]
    stream = clean[:at] + noise + clean[at + over :]
    true = [[float(value) for value in row] for row in rows]
    block, _ = pieces_fed(query, stream, cuts)
    got = [] if block is None else np.column_stack([block.t, block.acc]).tolist()
    assert all(row in true for row in got)
    assert len(got) >= 2, "at most the line of the byte, or the two that it joins"


@given(st.text(max_size=60) | st.text('ax=:{}[]", 019.-e|;', max_size=60))
def test_any_line_is_read_or_refused(line: str) -> None:
    said = read_named_line(line)
    assert said is None or all(isinstance(x, float) for x in said.values.values())
