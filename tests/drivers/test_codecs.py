"""What every wire format must do; a new one needs its stream in wires.py."""

from functools import cache

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from wires import STREAMS, Stream

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block, concat
from fieldcal.drivers.codec import Codec, open_codec, wire_formats
from fieldcal.drivers.options import Options

N = 40
KNOWN = {name: STREAMS[name](N, np.random.default_rng(7)) for name in STREAMS}
FEW = {name: STREAMS[name](16, np.random.default_rng(7)) for name in STREAMS}

every_format = pytest.mark.parametrize("name", wire_formats())


@cache
def long(name: str) -> Stream:
    """A minute of a stream, made where it is needed: every process reads this file."""
    return STREAMS[name](5_000, np.random.default_rng(8))


def decoder(name: str, stream: Stream) -> Codec:
    options = Options("serial", stream.query)
    codec = open_codec(name, options)
    options.finish()
    return codec


def cut(stream: bytes, step: int) -> list[bytes]:
    return [stream[i : i + step] for i in range(0, len(stream), step)]


def fed(codec: Codec, pieces: list[bytes]) -> Block:
    blocks = [codec.feed(piece, 0.0) for piece in pieces]
    return concat(block for block in blocks if block is not None)


def assert_same(one: Block, other: Block) -> None:
    np.testing.assert_array_equal(one.six, other.six)
    np.testing.assert_array_equal(one.temperature, other.temperature)
    np.testing.assert_array_equal(one.t, other.t)


def test_every_format_has_a_stream() -> None:
    assert tuple(sorted(STREAMS)) == wire_formats()


def test_an_unknown_format_is_refused_with_those_there_are() -> None:
    with pytest.raises(InputError, match="witmotion"):
        open_codec("morse", Options("serial"))


@every_format
def test_samples_are_what_was_sent(name: str) -> None:
    stream = KNOWN[name]
    codec = decoder(name, stream)
    block = fed(codec, [b"".join(stream.pieces)])
    truth = stream.samples
    np.testing.assert_allclose(block.six, truth.six, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(block.temperature, truth.temperature, atol=1e-4)
    np.testing.assert_allclose(np.diff(block.t), np.diff(truth.t), atol=1.1e-3)
    assert codec.health.samples == N
    assert codec.health.bad == codec.health.skipped == codec.health.gaps == 0


@every_format
@settings(max_examples=6)
@example(step=1)
@given(step=st.integers(1, 200))
def test_any_pieces_give_the_same(name: str, step: int) -> None:
    stream = FEW[name]
    joined = b"".join(stream.pieces)
    whole, pieces = decoder(name, stream), decoder(name, stream)
    assert_same(fed(whole, [joined]), fed(pieces, cut(joined, step)))
    assert whole.health == pieces.health


@every_format
@settings(max_examples=4)
@given(junk=st.lists(st.binary(max_size=60), min_size=16, max_size=16), data=st.data())
def test_garbage_between_samples_costs_none(
    name: str, junk: list[bytes], data: st.DataObject
) -> None:
    stream = FEW[name]
    pairs = zip(junk, stream.pieces, strict=True)
    dirty = b"".join(noise + piece for noise, piece in pairs)
    step = data.draw(st.integers(1, 300))
    clean = fed(decoder(name, stream), [b"".join(stream.pieces)])
    # what garbage made a frame of may be as long as frames can be: pad to its end
    assert_same(fed(decoder(name, stream), [*cut(dirty, step), bytes(3000)]), clean)


@every_format
@settings(max_examples=5)
@given(
    damage=st.lists(
        st.tuples(st.sampled_from("flip lose double insert".split()), st.integers(0)),
        min_size=1,
        max_size=10,
    ),
    step=st.integers(1, 500),
)
def test_damage_makes_no_fault_and_no_memory(
    name: str, damage: list[tuple[str, int]], step: int
) -> None:
    stream = FEW[name]
    spoilt = bytearray(b"".join(stream.pieces))
    for kind, where in damage:
        at = where % len(spoilt)
        if kind == "flip":
            spoilt[at] ^= 1 << where % 8
        elif kind == "lose":
            del spoilt[at : at + 1 + where % 20]
        elif kind == "double":
            spoilt[at:at] = spoilt[at : at + 1 + where % 20]
        else:
            spoilt.insert(at, where % 256)
    codec = decoder(name, stream)
    for piece in cut(bytes(spoilt), step):
        codec.feed(piece)
        assert codec.waiting_bytes <= codec.longest
        assert len(codec._arrivals) <= codec.longest + 1


def wrong(block: Block, truth: Block) -> int:
    """Samples that were never sent."""
    sent = {row.tobytes() for row in np.round(truth.six, 5) + 0.0}
    return sum(row.tobytes() not in sent for row in np.round(block.six, 5) + 0.0)


@every_format
def test_one_flipped_bit_a_sample_passes_no_check(name: str) -> None:
    stream, rng = long(name), np.random.default_rng(3)
    pieces = [bytearray(piece) for piece in stream.pieces]
    for piece in pieces[::2]:
        piece[rng.integers(len(piece))] ^= 1 << rng.integers(8)
    codec = decoder(name, stream)
    block = fed(codec, [b"".join(pieces)])
    assert wrong(block, stream.samples) == 0
    assert len(block) >= len(pieces) // 2 - 20  # a line whose end is hit takes its next
    assert codec.health.bad > len(pieces) // 10


@every_format
def test_random_damage_passes_no_more_than_the_check_lets(name: str) -> None:
    stream, rng = long(name), np.random.default_rng(4)
    pieces = [np.frombuffer(piece, np.uint8).copy() for piece in stream.pieces]
    for piece in pieces:
        spoil = rng.integers(len(piece), size=4)
        piece[spoil] = rng.integers(256, size=4)
    codec = decoder(name, stream)
    block = fed(codec, cut(b"".join(p.tobytes() for p in pieces), 4096))
    assert wrong(block, stream.samples) < 2 * len(pieces) / 256


@every_format
def test_noise_alone_is_no_sample(name: str) -> None:
    noise = np.random.default_rng(5).bytes(300_000)
    codec = decoder(name, KNOWN[name])
    assert len(fed(codec, cut(noise, 1000))) <= 3
    assert codec.health.skipped > 0.5 * codec.health.received


@every_format
def test_a_broken_link_joins_no_halves(name: str) -> None:
    stream = KNOWN[name]
    codec = decoder(name, stream)
    first = fed(codec, [b"".join(stream.pieces[:20]), stream.pieces[20][:-3]])
    codec.reset()
    second = fed(codec, [stream.pieces[30][-3:], *stream.pieces[31:]])
    block = concat([first, second])
    assert wrong(block, stream.samples) == 0
    assert len(first) == 20
    assert len(second) == 9
    assert np.all(np.diff(block.t) > 0)
    assert codec.health.gaps == 1
