"""A .zip of one file is read as that file."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from laid_about import turned

from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.session.folder import Session

ROWS = turned(5, 50.0, 2.0)


def text(rows: Array) -> str:
    lines = [",".join(f"{x:.10g}" for x in row) for row in rows]
    return "\n".join(["t,ax,ay,az,gx,gy,gz", *lines]) + "\n"


def packed(path: Path, files: dict[str, str]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("session/", "")
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def imported(path: Path, *more: str) -> int:
    return main(["import", str(path), "-o", str(path.parent / "out"), *more])


@pytest.mark.parametrize("beside", [{}, {"__MACOSX/session/._log.csv": "\0\5"}])
def test_the_one_file_of_an_archive_is_read(
    tmp_path: Path, beside: dict[str, str]
) -> None:
    path = packed(tmp_path / "run 3.zip", {"session/log.csv": text(ROWS), **beside})
    assert imported(path) == 0
    block = Session.open(tmp_path / "out").block
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4])
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:])


def test_a_table_in_an_archive_is_read_where_it_must_be_searched(
    tmp_path: Path,
) -> None:
    import pyarrow as pa
    import pyarrow.parquet

    names = ["t", "ax", "ay", "az", "gx", "gy", "gz"]
    table = pa.table(list(ROWS.T), names=names)
    pyarrow.parquet.write_table(table, tmp_path / "log.parquet")
    path = tmp_path / "log.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.write(tmp_path / "log.parquet", "log.parquet")
    assert imported(path) == 0
    np.testing.assert_allclose(Session.open(tmp_path / "out").block.acc, ROWS[:, 1:4])


def test_a_damaged_archive_is_taken_up_to_its_fault(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = packed(tmp_path / "log.zip", {"log.csv": text(ROWS)})
    data = bytearray(path.read_bytes())
    data[len(data) * 2 // 3] ^= 0xFF
    path.write_bytes(bytes(data))
    assert imported(path) == 2
    assert "the archive is damaged" in capsys.readouterr().err
    assert imported(path, "--repair") == 0
    block = Session.open(tmp_path / "out").block
    # bits behind a fault may be read otherwise until that shows
    whole = len(ROWS) // 2
    np.testing.assert_allclose(block.acc[:whole], ROWS[:whole, 1:4])


def test_an_archive_with_a_password_says_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = packed(tmp_path / "log.zip", {"log.csv": text(ROWS)})
    data = bytearray(path.read_bytes())
    for mark, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        data[data.rindex(mark) + flags] |= 1
    path.write_bytes(bytes(data))
    assert imported(path) == 2
    assert "unpack it, and import the file" in capsys.readouterr().err


def test_a_name_of_which_damage_left_nothing_is_no_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "damaged.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("x", text(ROWS))
    content = path.read_bytes()
    at = content.index(b"PK\x01\x02") + 46  # the name in the list of files
    path.write_bytes(content[:at] + b"\0" + content[at + 1 :])
    with zipfile.ZipFile(path) as archive:
        assert archive.namelist() == [""]
    assert imported(path) == 2
    assert "damaged.zip" in capsys.readouterr().err
