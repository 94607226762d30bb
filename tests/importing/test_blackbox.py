"""Blackbox logs: frames written here as the firmware's documentation says."""

import logging
from pathlib import Path

import numpy as np
import pytest
from blackbox_logs import FIELDS, ROWS, counts, frames, header

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Block, concat
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.times.row_validator import RowValidator

pytest.importorskip("orangebox", reason="the extra betaflight is not installed")


def flights(path: Path, repair: bool = False) -> dict[str, Block]:
    recording = open_recording(path, ReadOptions(), repair=repair)
    found = {}
    for one in recording.streams():
        judge = RowValidator(str(path), recording.place, repair)
        found[one.name] = concat(judge.through(recording.blocks(one.name)))
    return found


@pytest.mark.parametrize(
    ("firmware", "scale", "unit"),
    [("Cleanflight", 1.0, np.pi / 180), ("INAV", 0.061, 0.061 * np.pi / 180),
     ("Baseflight", 1.064e-9, 1.064e-3)],
)  # fmt: skip
def test_counts_become_si(
    tmp_path: Path, firmware: str, scale: float, unit: float
) -> None:
    path, table = tmp_path / "LOG.BFL", counts(1)
    path.write_bytes(header(scale, firmware) + frames(table))
    (got,) = flights(path).values()
    n = len(got)
    # the last frame stands before the end, which the reader looks at
    assert n >= ROWS - 1
    np.testing.assert_allclose(got.t, table[:n, 1] * 1e-6)
    np.testing.assert_allclose(got.acc, table[:n, 5:] * G0 / 2048)
    np.testing.assert_allclose(got.gyr, table[:n, 2:5] * unit, rtol=1e-6)


def test_reading_many_logs_leaves_one_handler_of_what_their_reader_says(
    tmp_path: Path,
) -> None:
    """One a file made each of thousands slower than the one before."""
    path = tmp_path / "LOG.BFL"
    path.write_bytes(header(1.0) + frames(counts(1)))
    for _ in range(3):
        flights(path)
    assert len(logging.getLogger("orangebox").handlers) == 1


@pytest.mark.parametrize(
    ("line", "damaged"),
    [(b"P interval:1/1", b"P interval:0/1"), (b"P interval:1/1", b"P interval:-1/1"),
     (b"P interval:1/1", b"P interval:1x1"), (b"I interval:16", b"I interval:99999999"),
     (b"P interval:1/1", b"P interval:1/0")],
)  # fmt: skip
def test_intervals_that_no_frame_has_are_refused(
    tmp_path: Path, line: bytes, damaged: bytes
) -> None:
    """The reader would count loops for ever, looking for the next one with a frame."""
    path = tmp_path / "LOG.BFL"
    content = header(1.0) + frames(counts(1))
    assert line in content
    path.write_bytes(content.replace(line, damaged))
    with pytest.raises(InputError, match="LOG.BFL: its header"):
        flights(path)


def test_a_log_of_frames_that_stand_for_themselves_is_read(tmp_path: Path) -> None:
    """P interval 0 is what the firmware writes where there are no others."""
    path = tmp_path / "LOG.BFL"
    top = header(1.0).replace(b"P interval:1/1", b"P interval:0")
    path.write_bytes(top + frames(counts(1)))
    assert list(flights(path, repair=True))


@pytest.mark.parametrize(
    "damaged",
    ["rx3f80P000", "0x3f8000001234", "0x7f800000", "0xbf800000", "0x7fc00000"],
)
def test_a_scale_that_is_none_is_refused(tmp_path: Path, damaged: str) -> None:
    """No number, too many digits, infinite, negative, and none at all."""
    path = tmp_path / "LOG.BFL"
    top = header(1.0).replace(b"0x3f800000", damaged.encode())
    path.write_bytes(top + frames(counts(1)))
    with pytest.raises(InputError, match="LOG.BFL: its header gyro_scale is .* copy"):
        flights(path)


@pytest.mark.parametrize(("fine", "counts_in_deg"), [(0, 1), (1, 10)])
def test_rates_of_high_resolution_are_tenths(
    tmp_path: Path, fine: int, counts_in_deg: int
) -> None:
    path, table = tmp_path / "LOG.BFL", counts(1)
    top = header(1.0, "Betaflight", more=f"blackbox_high_resolution:{fine}")
    path.write_bytes(top + frames(table))
    (got,) = flights(path).values()
    n, unit = len(got), np.pi / 180 / counts_in_deg
    np.testing.assert_allclose(got.gyr, table[:n, 2:5] * unit, rtol=1e-6)
    np.testing.assert_allclose(got.acc, table[:n, 5:] * G0 / 2048)


def test_flights_behind_each_other_are_apart(tmp_path: Path) -> None:
    path = tmp_path / "LOG.BFL"
    logs = [header(1.0) + frames(counts(seed)) for seed in (1, 2)]
    path.write_bytes(b"".join(logs))
    got = flights(path)
    assert list(got) == ["log.1", "log.2"]
    assert not np.allclose(got["log.1"].acc[:100], got["log.2"].acc[:100])


def test_a_log_without_accelerations_says_what_to_set(tmp_path: Path) -> None:
    path = tmp_path / "LOG.BFL"
    names = ",".join(name.replace("accSmooth", "debug") for name in FIELDS)
    path.write_bytes(header(1.0, fields=names) + frames(counts(1)))
    with pytest.raises(InputError, match="blackbox_disable_acc = OFF"):
        flights(path)


@pytest.mark.parametrize("at", [3, 200, 900, 1500])
def test_damaged_logs_end_in_words(tmp_path: Path, at: int) -> None:
    data = bytearray(header(1.0) + frames(counts(1)))
    data[at : at + 7] = b"\xff" * 7
    path = tmp_path / "LOG.BFL"
    path.write_bytes(bytes(data))
    try:
        got = flights(path, repair=True)
    except InputError as error:
        assert "LOG.BFL" in str(error)
        return
    assert sum(map(len, got.values())) <= ROWS
