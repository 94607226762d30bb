"""Writing and undoing, killed at any step, on an autopilot that misbehaves."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from time import monotonic, sleep

import pytest

pytest.importorskip("fastcrc")
pytest.importorskip("pymavlink")

from processes import FIELDCAL, HANGS, simulated

from benchmarks.write_undo import OLD, WRITTEN, session, trial
from fieldcal.cli import main
from fieldcal.drivers.mavlink_parameters import ParameterLink, same_float32
from fieldcal.install.transaction import SAVED


@pytest.mark.parametrize("seed", range(0, 200, 12))
def test_the_vehicle_has_one_set_whole_and_it_is_said_which(
    seed: int, tmp_path: Path
) -> None:
    _, _, claimed, kept = trial(seed, tmp_path)
    assert claimed == kept != "neither"


@pytest.mark.parametrize(
    "then", ["undo", pytest.param("write", marks=pytest.mark.thorough)]
)
def test_after_a_kill_it_is_given_back_or_finished(
    then: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded = session(tmp_path / "s")
    has = "&".join(f"{name}={value}" for name, value in OLD.items())
    with simulated("--mavlink", f"tcpin:127.0.0.1:0?{has}") as (place, _):
        url = f"mavlink:{place}?system=1&component=1"
        to = [str(recorded), "--device", url, "--yes"]
        writing = subprocess.Popen([*FIELDCAL, "write", *to])
        deadline = monotonic() + HANGS
        while not any(recorded.glob(f"{SAVED}*")):
            assert writing.poll() is None and monotonic() < deadline
            sleep(0.001)
        writing.kill()
        writing.wait()
        assert main([then, *to]) == 0
        with ParameterLink(url.removeprefix("mavlink:")) as link:
            kept = link.read(WRITTEN)
        assert all(same_float32(kept[n], OLD[n]) for n in WRITTEN) == (then == "undo")
        if then == "write":
            assert main(["undo", *to]) == 0
            with ParameterLink(url.removeprefix("mavlink:")) as link:
                kept = link.read(WRITTEN)
            assert all(same_float32(kept[n], OLD[n]) for n in WRITTEN)
    (last,) = sorted(recorded.glob(f"{SAVED}*"))[-1:]
    assert json.loads(last.read_text())["undone"]
    capsys.readouterr()
