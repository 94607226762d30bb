"""Logs that were cut off: refused with the remedy, or taken up to the cut."""

from __future__ import annotations

import bz2
import gzip
import lzma
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from logs import can_log, dbc, imu
from mcap.reader import make_reader
from mcap.summary import Summary
from mcap.writer import Writer
from small_files import SMALL, Small, whole

from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.importing.files.packed_stream import unpacked_pieces
from fieldcal.session.folder import Session

NO_STREAM = ("arrays", "parquet", "phone_zip", "workbook", "sqlite_log", "octave_text",
             "series_log", "sensor_tables", "sensor_sheets")  # fmt: skip
"""Formats that nothing, or no whole sample, can be read of without their end."""


def begins(found: Block, expected: Block) -> None:
    """Check that it is the beginning of another, to the last bit.

    A gyroscope that is logged apart may be cut off before the last of its samples.
    """
    many = len(found)
    np.testing.assert_array_equal(found.t, expected.t[:many])
    there = expected.six[:many].copy()
    there[-1:, 3:][np.isnan(found.six[-1:, 3:])] = np.nan
    np.testing.assert_array_equal(found.six, there)


@pytest.mark.parametrize("name", sorted(set(SMALL) - set(NO_STREAM)))
def test_of_a_packed_log_that_was_cut_off_what_is_whole_is_taken(
    tmp_path: Path, name: str
) -> None:
    small = Small(name, tmp_path / "file")
    packed = gzip.compress(small.content)
    most = 0
    for at in np.linspace(len(packed) // 3, len(packed) - 1, 10).astype(int).tolist():
        small.path.write_bytes(packed[:at])
        with pytest.raises(InputError, match="with --repair") as caught:
            whole(small.path, small.wanted, name)
        assert str(small.path) in str(caught.value)
        try:
            found = whole(small.path, small.wanted, name, repair=True)
        except InputError as error:
            assert at < 0.9 * len(packed), error
            continue
        begins(found, small.expected)
        most = max(most, len(found))
    assert most >= len(small.expected) - 1


@pytest.mark.parametrize("compress", [bz2.compress, lzma.compress])
@pytest.mark.parametrize("name", ["csv_like", "rosbag", "sqlite_log"])
def test_a_log_is_read_however_it_is_packed(
    tmp_path: Path, name: str, compress: Callable[[bytes], bytes]
) -> None:
    """As a stream, and where a format has to be searched."""
    small = Small(name, tmp_path / "file")
    small.path.write_bytes(compress(small.content))
    found = whole(small.path, small.wanted, name)
    np.testing.assert_array_equal(found.six, small.expected.six)


@pytest.mark.parametrize("ending", [".asc", ".blf", ".trc"])
def test_of_a_can_log_that_was_cut_off_what_is_whole_is_taken(
    tmp_path: Path, ending: str
) -> None:
    can_log(tmp_path / f"log{ending}", imu(1, 60))
    (tmp_path / "imu.dbc").write_text(dbc())
    small = Small("can_log", tmp_path / "file")
    packed = gzip.compress((tmp_path / f"log{ending}").read_bytes())
    small.path.write_bytes(packed)
    expected = whole(small.path, small.wanted)
    most = 0
    for at in np.linspace(len(packed) // 2, len(packed) - 1, 8).astype(int).tolist():
        small.path.write_bytes(packed[:at])
        try:
            found = whole(small.path, small.wanted, repair=True)
        except InputError:
            continue
        begins(found, expected)
        most = max(most, len(found))
    assert most > 0


def chunked(path: Path, size: int) -> bytes:
    """Write an MCAP file anew, in chunks of some bytes."""
    SMALL["mcap"](path, imu(1, 60))
    with path.open("rb") as file, path.with_suffix(".new").open("wb") as new:
        writer = Writer(new, chunk_size=size)
        writer.start("ros2", "test")
        numbers: dict[str, int] = {}
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.topic not in numbers:
                assert schema is not None
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                numbers[channel.topic] = writer.register_channel(
                    channel.topic, channel.message_encoding, kind
                )
            writer.add_message(
                numbers[channel.topic],
                message.log_time,
                message.data,
                message.publish_time,
            )
        writer.finish()  # type: ignore[no-untyped-call]
    return path.with_suffix(".new").read_bytes()


def summary(path: Path) -> Summary:
    with path.open("rb") as file:
        found = make_reader(file).get_summary()
    assert found is not None
    return found


def test_an_mcap_file_without_its_end(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = chunked(tmp_path / "x", 2000)
    path = tmp_path / "cut.mcap"
    path.write_bytes(content)
    call = ["import", str(path), "--instance", "/imu/raw"]
    assert main([*call, "-o", str(tmp_path / "all")]) == 0
    expected = Session.open(tmp_path / "all").block
    path.write_bytes(content[: len(content) // 2])
    assert main([*call, "-o", str(tmp_path / "no")]) == 2
    said = capsys.readouterr().err
    assert "messages of /imu/raw are whole: take them with --repair" in said
    assert main([*call, "-o", str(tmp_path / "part"), "--repair"]) == 0
    found = Session.open(tmp_path / "part").block
    begins(found, expected)
    assert f"{len(found)} messages of /imu/raw are whole" in said
    assert 10 < len(found) < len(expected)
    assert "what was whole before that is taken" in capsys.readouterr().err


def test_a_damaged_chunk_of_an_mcap_file_costs_no_other(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = bytearray(chunked(tmp_path / "x", 2000))
    path = tmp_path / "damaged.mcap"
    path.write_bytes(content)
    call = ["import", str(path), "--instance", "/imu/raw"]
    assert main([*call, "-o", str(tmp_path / "all")]) == 0
    expected = Session.open(tmp_path / "all").block
    chunks = [c.chunk_start_offset for c in summary(path).chunk_indexes]
    content[chunks[len(chunks) // 2] + 150] ^= 0x55
    path.write_bytes(content)
    assert main([*call, "-o", str(tmp_path / "no")]) == 2
    assert "with --repair" in capsys.readouterr().err
    assert main([*call, "-o", str(tmp_path / "part"), "--repair"]) == 0
    assert "chunk " in capsys.readouterr().err
    found = Session.open(tmp_path / "part").block
    known = {tuple(row) for row in expected.six.tolist()}
    assert all(tuple(row) in known for row in found.six.tolist())
    assert len(expected) - 30 < len(found) < len(expected)


@pytest.mark.parametrize("compress", [gzip.compress, bz2.compress, lzma.compress])
def test_files_of_several_packed_parts_and_padding(
    tmp_path: Path, compress: Callable[[bytes], bytes]
) -> None:
    path = tmp_path / "log.packed"
    parts = [bytes([n]) * 70_000 for n in range(1, 4)]
    packed = bytes(200_000).join(map(compress, parts))
    path.write_bytes(packed + bytes(100))
    assert b"".join(unpacked_pieces(path)) == b"".join(parts)
    for wrong, says in (
        (packed + b"nothing packed", "cannot be unpacked"),
        (packed[:-9], "cut"),
    ):
        path.write_bytes(wrong)
        with pytest.raises(InputError, match=says):
            list(unpacked_pieces(path))
