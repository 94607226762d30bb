"""Lines of numbers, in the ways that devices write them."""

import numpy as np
import pytest

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block, concat
from fieldcal.drivers.options import Options
from fieldcal.drivers.protocols.text import LONGEST, TextCodec

G = 9.80665


def codec(query: str = "") -> TextCodec:
    return TextCodec(Options("serial", query))


def fed(codec: TextCodec, *pieces: bytes) -> Block:
    blocks = [codec.feed(piece, float(i)) for i, piece in enumerate(pieces)]
    return concat(block for block in blocks if block is not None)


def test_si_by_default_and_the_first_line_is_distrusted() -> None:
    stream = b"9,0,0,0,0,0,0,0\n0.5,1,-2,9.81,0.1,-0.2,3e-1,25.5\n"
    block = fed(codec(), stream)
    assert block.t.tolist() == [0.5]
    assert block.six.tolist() == [[1, -2, 9.81, 0.1, -0.2, 0.3]]
    assert block.temperature.tolist() == [25.5]


def test_units_order_separator_and_columns_of_no_use() -> None:
    query = (
        "columns=name,gz,gy,gx,-,az,ay,ax,t,seq&separator=semicolon"
        "&acc_unit=mg&gyr_unit=deg/s&t_unit=us"
    )
    stream = b"\r\nimu 1;3;2;1;north;1000;-500;0;1500000;7\r\n"
    block = fed(codec(query), stream)
    np.testing.assert_allclose(block.acc, [[0, -G / 2, G]])
    np.testing.assert_allclose(block.gyr, [np.deg2rad([1, 2, 3])])
    np.testing.assert_allclose(block.t, [1.5])
    assert block.seq.tolist() == [7]


@pytest.mark.parametrize(
    ("separator", "line"),
    [("space", b"  1.0   2 3\t4 \n"), ("tab", b"1.0\t2\t3\t4\n"), ("|", b"1|2|3|4\n")],
)
def test_separators(separator: str, line: bytes) -> None:
    block = fed(codec(f"columns=t,ax,ay,az&separator={separator}"), b"\n" + line)
    assert block.acc.tolist() == [[2, 3, 4]]
    assert np.isnan(block.gyr).all()
    assert np.isnan(block.temperature).all()


# 0x31 ^ 0x2c ^ 0x32 ^ 0x2c ^ 0x33 ^ 0x2c ^ 0x34 = 0x28
SUMMED = b"$1,2,3,4*28\r\n"


def test_a_checksum_written_out_by_hand_vouches_for_the_first_line_too() -> None:
    decoder = codec("columns=t,ax,ay,az&checksum=xor")
    assert len(fed(decoder, SUMMED)) == 1
    for at in range(len(SUMMED) - 2):
        for flip in (1, 2, 4, 8, 16, 64, 128):
            damaged = bytearray(SUMMED)
            damaged[at] ^= flip
            # 1F for 1f, and a $ that is none, say the same
            block = codec("columns=t,ax,ay,az&checksum=xor").feed(bytes(damaged))
            assert block is None or block.acc.tolist() == [[2, 3, 4]]


def test_a_prefix_picks_a_sentence_among_others() -> None:
    body = b"IMU,1,2,3,4"
    check = b"%02X" % np.bitwise_xor.reduce(np.frombuffer(body, np.uint8))
    stream = b"$GPGGA,1,2,3,4*00\n$" + body + b"*" + check + b"\n" + b"imu ready\n"
    decoder = codec("prefix=$IMU&columns=t,ax,ay,az&checksum=xor")
    assert fed(decoder, stream).acc.tolist() == [[2, 3, 4]]
    assert decoder.health.bad == 0
    decoder = codec("prefix=$IMU&columns=t,ax,ay,az")
    assert not len(fed(decoder, b"\n$IMUX,1,2,3,4\n9,2,3,4\n"))


@pytest.mark.parametrize(
    "line",
    [
        b"1,2,3",
        b"1,2,3,4,5",
        b"1,2,,4",
        b"1,2,3,4,",
        b"1,2,3,0x4",
        b"1,2,3,4_0",
        b"1,2,3,1e999",
        b"1,2,3,4\x00",
        b"1,2,3,\xb24",
        b"nan,2,3,4,",
        b"-nan,2,3,4",
        b"1,2,3,4 5",
        b"1,2,3\r,4",
        b"1,2,3,4" + b"0" * LONGEST,
    ],
)
def test_a_malformed_line_is_counted_and_nothing_else_suffers(line: bytes) -> None:
    decoder = codec("columns=t,ax,ay,az")
    block = fed(decoder, b"\n0,2,3,4\n" + line + b"\n2,2,3,4\n")
    assert block.t.tolist() == [0, 2]
    assert decoder.health.bad == (0 if line.startswith(b"nan") else 1)


def test_headers_comments_and_blank_lines_are_no_fault() -> None:
    decoder = codec("columns=t,ax,ay,az")
    stream = b"boot\r\n# IMU\r\nt,ax,ay,az\r\n\r\n; x\n1,2,3,4\r\n"
    assert len(fed(decoder, stream)) == 1
    assert decoder.health.bad == 0


def test_missing_values_stay_unknown() -> None:
    block = fed(codec("columns=t,ax,ay,az"), b"\n1,nan,3,NaN\n")
    np.testing.assert_array_equal(block.acc, [[np.nan, 3, np.nan]])


def test_what_never_ends_is_let_go() -> None:
    decoder = codec("columns=t,ax,ay,az")
    assert not len(fed(decoder, *[b"1,2,3,4," * 100] * 50, b"7,2,3,4\n"))
    assert len(fed(decoder, b"8,2,3,4\n")) == 1


def test_a_microsecond_counter_wraps_after_71_minutes() -> None:
    counts = (np.arange(100) * 10_000 + 2**32 - 500_000) % 2**32
    stream = b"\n" + b"".join(b"%d,0,0,1\n" % c for c in counts)
    decoder = codec("columns=t,ax,ay,az&t_unit=us")
    block = fed(decoder, stream)
    np.testing.assert_allclose(np.diff(block.t), 0.01, atol=1e-9)
    assert decoder.health.gaps == 0


def test_a_sequence_counter_shows_what_is_missing_at_a_declared_rate() -> None:
    decoder = codec("columns=seq,ax,ay,az&rate=50")
    block = fed(decoder, b"\n" + b"".join(b"%d,0,0,1\n" % i for i in (3, 4, 7, 8)))
    np.testing.assert_allclose(block.t, np.array([0, 1, 4, 5]) / 50)
    assert (decoder.health.gaps, decoder.health.missing) == (1, 2)


@pytest.mark.parametrize(
    "query",
    [
        "columns=t,ax,ay",
        "columns=t,ax,ay,az,ax",
        "separator=,,",
        "separator=.",
        "acc_unit=furlong",
        "checksum=sum",
        "t_unit=h",
    ],
)
def test_options_that_are_none(query: str) -> None:
    with pytest.raises(InputError):
        codec(query)


@pytest.mark.parametrize(("rate", "digits"), [(150, 2), (200, 2), (400, 2), (2000, 3)])
def test_samples_that_share_a_coarse_stamp_are_no_repetitions(
    rate: int, digits: int
) -> None:
    """As of a program that prints seconds with two digits, whatever its rate."""
    rng, q = np.random.default_rng(1), 10.0**-digits
    t = 5.0 + (np.arange(3000) + 0.3 * rng.random(3000)) / rate
    force = rng.standard_normal(3000)
    rows = zip(np.floor(t / q) * q, force, strict=True)
    lines = [f"{stamp:.{digits}f},0.1,{f:.3f},9.8\n".encode() for stamp, f in rows]
    made = codec("columns=t,ax,ay,az")
    blocks = [made.feed(b"".join(lines[i : i + 7]), 0.0) for i in range(0, 3000, 7)]
    block = concat(block for block in blocks if block is not None)
    assert made.health.repeated < 20 and made.health.missing < 20
    late = block.t[-2000:] - t[-2000:]
    assert np.abs(late - late.mean()).max() < q
    assert np.diff(block.t[-2000:]).std() < 0.3 / rate


@pytest.mark.parametrize("query", ["", "&t_resolution=0"])
def test_a_few_doubled_lines_or_stamps_are_repetitions(query: str) -> None:
    lines = [f"{0.01 * i:.2f},0.1,{i % 7},9.8\n".encode() for i in range(1000)]
    for i in (300, 500, 501):
        lines[i] = lines[i - 1][:4] + lines[i][4:]
    lines[700:700] = lines[690:691] * 100
    made = codec(f"columns=t,ax,ay,az{query}")
    block = made.feed(b"".join(lines), 0.0)
    assert block is not None and made.health.repeated == 103
    assert len(block) == 999 - 3
