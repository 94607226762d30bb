"""Records in JSON one behind the other, however they are parted."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from written_logs import ROWS, A, assert_same, imported

from fieldcal.cli import main
from fieldcal.session.folder import Session

RECORDS = [
    {"t": row[0], "acc": dict(zip("xyz", row[1:4], strict=True)), "gyro": row[4:]}
    for row in ROWS.tolist()
]
PARTED = {
    "nothing": ("", None), "a space": (" ", None), "a comma": (",\n", None),
    "a line": ("\n", None), "lines within": ("\n", 2), "RFC 7464": ("\n\x1e", None),
}  # fmt: skip


def write(folder: Path, text: str) -> Path:
    path = folder / "log.json"
    path.write_text(text)
    return path


@pytest.mark.parametrize("parted", PARTED)
@pytest.mark.parametrize("behind", ["", "\n", ",\n"])
def test_records_are_read_however_they_are_parted(
    tmp_path: Path, parted: str, behind: str
) -> None:
    between, indent = PARTED[parted]
    text = between.join(json.dumps(one, indent=indent) for one in RECORDS)
    assert_same(imported(write(tmp_path, text + behind)))


@pytest.mark.parametrize("parted", ["nothing", "lines within", "a line"])
def test_a_last_record_that_is_cut_off_is_told(
    tmp_path: Path, parted: str, capsys: pytest.CaptureFixture[str]
) -> None:
    between, indent = PARTED[parted]
    text = between.join(json.dumps(one, indent=indent) for one in RECORDS)
    path, out = write(tmp_path, text[:-30]), tmp_path / "out"
    assert main(["import", str(path), "-o", str(out)]) == 2
    said = capsys.readouterr().err
    line = parted == "a line"
    assert ("its end: is cut off" in said) != (f"line {len(RECORDS)}:" in said) == line
    assert "--repair" in said
    assert main(["import", str(path), "-o", str(out), "--repair"]) == 0
    block = Session.open(out).block
    np.testing.assert_allclose(block.acc, A[:-1], rtol=1e-6)
