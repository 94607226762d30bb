"""Bytes of a port in a file: found by their checksums, whatever stands around them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laid_about import turned

from fieldcal.cli import main
from fieldcal.core.samples import Array, Block
from fieldcal.session.folder import Session
from fieldcal.sim_device.wire import open_wire

BINARY = ("witmotion", "vectornav", "mip", "xsens", "ubx", "inertiallabs")
RATE = 50.0
SAYING = b"booting, please wait\r\n" * 400


def stream(wire: str) -> tuple[bytes, Array]:
    """Bytes of a device that is laid on each of its sides, and its samples."""
    rows = turned(1, RATE, sides=7)
    n = len(rows)
    warm, seq = np.full(n, 25.0), np.arange(n, dtype=float)
    block = Block.of(rows[:, 0], rows[:, 1:4], rows[:, 4:], warm, seq)
    return open_wire(wire).encode(block), rows


def imported(folder: Path, data: bytes, *more: str) -> Session:
    path = folder / "kept.bin"
    path.write_bytes(data)
    assert main(["import", str(path), "-o", str(folder / "s"), *more]) == 0
    return Session.open(folder / "s")


@pytest.mark.parametrize("wire", [*BINARY, "vnimu"])
@pytest.mark.parametrize("named", [True, False])
def test_every_format_is_found_behind_what_a_device_says_first(
    wire: str, named: bool, tmp_path: Path
) -> None:
    data, rows = stream(wire)
    more = ["--format", wire] if named else []
    more += ["--rate", str(RATE)] if wire == "vnimu" else []
    made = imported(tmp_path, SAYING + data[7:-3], *more)
    block = made.block
    n = len(block)
    assert len(rows) - 3 <= n
    off = [
        np.abs(block.acc - rows[k : k + n, 1:4]).max() for k in range(len(rows) - n + 1)
    ]
    assert min(off) < 0.01
    assert next(iter(made.marks()))["format"] == "wire"
    assert len(made.windows) >= 7


def test_a_full_scale_that_no_byte_says_is_told_by_gravity(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, rows = stream("witmotion?acc_range=2&gyr_range=500")
    path = tmp_path / "kept.bin"
    path.write_bytes(data)
    assert main(["import", str(path), "-o", str(tmp_path / "s")]) == 2
    said = capsys.readouterr().err
    assert 'add --options "acc_range=2&gyr_range=500"' in said
    made = imported(tmp_path, data, "--options", "acc_range=2&gyr_range=500")
    np.testing.assert_allclose(made.block.acc, rows[:, 1:4], atol=1e-3)
