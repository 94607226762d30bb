"""A calibration is applied to the device that it is of."""

from __future__ import annotations

from pathlib import Path

import pytest
from session_folders import CALM, FACES, places, recorded, write_session

from fieldcal.cli import main


def test_that_of_another_device_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    held = places(FACES, 4.0, 4.0)
    block = recorded(CALM, held)
    folders = {}
    for name, serial in (("a", "A1"), ("b", " B2 "), ("again", "A1 "), ("none", "")):
        device = {"serial": serial} if serial else {"name": "bench"}
        folders[name] = write_session(tmp_path / name, block, held, device=device)
    own = ["--history", str(tmp_path / "h.sqlite")]
    for name in ("a", "b", "none"):
        assert main(["solve", str(folders[name]), *own]) in (0, 1)
    capsys.readouterr()

    def applied(to: str, of: str) -> int:
        out = tmp_path / f"{to}-{of}.csv"
        call = ["apply", str(folders[to]), str(out)]
        found = main([*call, "--calibration", str(folders[of])])
        assert out.exists() == (found == 0)
        return found

    assert applied("a", "b") == 2
    said = capsys.readouterr().err
    assert f"{folders['b']}: is a calibration of device B2, and" in said
    assert f"{folders['a']} was recorded with A1" in said
    for to, of in (("again", "a"), ("none", "a"), ("a", "none"), ("a", "a")):
        assert applied(to, of) == 0
