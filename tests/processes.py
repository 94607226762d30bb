"""Commands of fieldcal in processes of their own, as a user starts them."""

from __future__ import annotations

import json
import shutil
import stat
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from filelock import FileLock

if TYPE_CHECKING:
    from fieldcal.run.movers import RunningDevice

HANGS = 300.0
"""No machine is so busy that what is waited for takes longer, s: it hangs."""

FIELDCAL = [sys.executable, "-m", "fieldcal"]
RUN, SIM = [*FIELDCAL, "run"], [*FIELDCAL, "sim"]
TWO_POSITION = [*RUN, "two_position", "--headless", "--level=0.001", "--angles=0.001"]
TWO_POSITION += ["--squareness=1e-5", "--no-report"]
"""Two positions on a base that is level, set exactly, of a device with square axes; no
operator, and no report."""


def steady(folder: Path) -> list[str]:
    """Options of a virtual device that stays what it is, however long it waits.

    A device that is many times as fast as the clock waits for hours on a slow machine,
    and its instability would rightly be in what is known of it. It is half as noisy as
    usual, so that GO does not hang on which samples a window has.
    """
    file = folder / "steady.toml"
    lines = ["format = 1", "[noise]", "acc = 0.01"]
    lines += ["acc_instability = 0.0", "gyr_instability = 0.0"]
    lines += ["[temperature]", "self_heating_k = 0.0", "[effects.earth_rate]"]
    file.write_text("\n".join(lines) + "\n")
    return ["--profile", str(file)]


@contextmanager
def simulated(*options: str) -> Iterator[tuple[str, str]]:
    """A virtual device while it is needed: where it is, and its control socket."""
    command = [*SIM, *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as sim:
        assert sim.stdout
        try:
            yield sim.stdout.readline().strip(), sim.stdout.readline().strip()
        finally:
            sim.terminate()


def wait_for_samples(
    folder: Path, run: subprocess.Popen[Any] | None, size: int = 20_000
) -> None:
    """Until a run has recorded so many bytes of samples."""
    file, deadline = folder / "samples.arrows", monotonic() + HANGS
    while not (file.exists() and file.stat().st_size > size):
        assert monotonic() < deadline and (run is None or run.poll() is None)
        sleep(0.02)


def turned(devices: Sequence[RunningDevice], alpha: float, beta: float) -> None:
    """Turn devices on one table; the first one last, when the others are there.

    Whoever waits for the first to rest finds all of them at rest, however late each of
    their processes runs.
    """
    angles = {"alpha_deg": alpha, "beta_deg": beta}
    for device in reversed(devices):
        until = device.ask(turn=angles)["until_s"]
        while device is not devices[0] and device.ask(status={})["time_s"] < until:
            sleep(0.01)


@dataclass(frozen=True)
class Recalibrated:
    """What a user has of a run.

    Attributes
    ----------
    folder : the session; whoever changes something in it makes a copy
    result : what was printed
    progress : what was said meanwhile, a line of JSON each

    """

    folder: Path
    result: dict[str, Any]
    progress: str

    def copy(self, folder: Path) -> Path:
        """The session in another folder."""
        shutil.copytree(self.folder, folder)
        return folder


def recalibrate(folder: Path) -> Recalibrated:
    """Five positions of a virtual device on a tilted base, once for all processes.

    `folder` is where to; what another process of the tests has made there is taken.
    """
    session, said = folder / "session", folder / "said.json"
    call = [*RUN, "five_position", "--headless", "--virtual=--base-tilt=1,-1"]
    call += ["--speed", "20", "--seconds", "15", "--seed", "5", "--json"]
    call += ["-o", str(session)]
    with FileLock(folder.with_suffix(".lock")):
        folder.mkdir(exist_ok=True)
        if not said.exists():
            done = subprocess.run(call, capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
            said.write_text(json.dumps([json.loads(done.stdout), done.stderr]))
    return Recalibrated(session, *json.loads(said.read_text()))


def script(folder: Path, body: str) -> list[str]:
    """A command that is a small program of ours."""
    path = folder / "turntable.py"
    path.write_text(body)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return [sys.executable, str(path), "{position}", "{alpha}", "{beta}", "{name}"]
