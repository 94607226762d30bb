"""Recordings that others published, from the file to the verdict, as a new user would.

    python -m benchmarks recordings [--only=FOLDER] [--screens]

Each is imported with nothing else; a question is answered with what its PROVENANCE.md
says, and the options that took are counted. Then `fieldcal diagnose`. The right answer
is what was found independently (the README.md beside them): effects that must be named,
or that nothing is. `--screens` prints what a terminal of 80 by 24 shows of each.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections import Counter
from pathlib import Path
from time import process_time
from typing import NamedTuple

from benchmarks._words import ran
from benchmarks.injected.recorded import REAL

JOINED = "set-2__full-sphere__"

SCREEN = 24, 80
"""Rows and columns of the terminal that is looked at."""


class Published(NamedTuple):
    """A recording and what is known of it.

    Attributes
    ----------
    folder, files : beside the project; several files hold channels of one IMU
    options : that answer what is asked, as PROVENANCE.md says them
    right : effects of which one must be named; empty if none may be, "?" if unknown
    stream : which of several IMUs is looked at, "" for the only one

    """

    folder: str
    files: tuple[str, ...]
    options: tuple[str, ...]
    right: str
    stream: str = ""


HAND = "cross_coupling"

PUBLISHED = (
    *(Published("mikoff_mpu9150_x5", (f"imu{i}.log.gz",), ("--rate 100",), HAND)
      for i in range(5)),
    Published("imucal_ferraris", ("example_ferraris_session.csv.gz",),
              ("--rate 102.4",), HAND),
    Published("mpu9150_array", ("exp2_imu1.csv.gz",), (), HAND),
    Published("mpu9150_array", ("exp6_imu5.csv.gz",), (), f"{HAND} warm_up bias_drift"),
    Published("tomisuarez_mpu6050", ("example_data_calibration.csv.gz",), (), "?"),
    Published("tomisuarez_mpu6050", ("example_data_tinit_calc.csv.gz",),
              ("--gyr-unit deg/s --gyr-lsb 131",), "?"),
    Published("pyulog_samples", ("sample.ulg.gz",), (), "warm_up bias_drift",
              "sensor_combined.0"),
    Published("psim_cold", ("TVCtest3_7_20.csv.gz",),
              ("--temp-unit count --temp-lsb 256 --temp-zero -231",),
              "temperature_bias"),
    Published("sunsided_mpu6050_temp",
              tuple(f"{JOINED}{part}.mat"
                    for part in ("accelerometer", "gyroscope", "temperature")),
              ("--gyr-unit deg/s",), "?"),
    Published("autopilot_streams", ("autopilot_12_positions.tlog.gz",), (), "",
              "HIGHRES_IMU.0"),
    Published("autopilot_streams", ("autopilot_12_positions.tlog.gz",), (),
              "quantisation", "RAW_IMU.0"),
    Published("autopilot_streams", ("vectornav.bin.gz",), (), "?"),
    Published("autopilot_streams", ("microstrain_mip.bin.gz",), ("--rate 25",), "?"),
    Published("comma_rav4_can", ("phone_imu.npz",), (), "?"),
)  # fmt: skip


class Verdict(NamedTuple):
    """What became of one: options, still stretches, verdict and effects, s of CPU.

    `instead` are the aliases of each effect.
    """

    options: int
    positions: int
    verdict: str
    effects: tuple[str, ...]
    seconds: float
    screen: str = ""
    instead: dict[str, frozenset[str]] = {}


def main() -> None:
    """Print the table."""
    if not REAL.is_dir():
        print(f"the recordings are not here: {REAL}")
        return
    only = [w.removeprefix("--only=") for w in sys.argv if w.startswith("--only=")]
    screens = "--screens" in sys.argv
    if not screens:
        print("| recording | options | rests | verdict | seconds | right answer |")
        print("|---|---|---|---|---|---|")
    for one in PUBLISHED:
        if not only or one.folder in only:
            found = of(one, screens)
            print(found.screen if screens else row(one, found), flush=True)


def row(one: Published, found: Verdict) -> str:
    """One line of the table."""
    many = Counter(found.effects)
    effects = ", ".join(f"{e} ×{n}" if n > 1 else e for e, n in many.items())
    named = f"{found.verdict.replace('_', ' ')}: {effects}".strip(": ")
    right = {"?": "not known", "": "nothing"}.get(one.right, one.right)
    held = {"?": "", "": " ✓" if not found.effects else " ✗"}.get(
        one.right, " ✓" if set(one.right.split()) & set(found.effects) else " ✗"
    )
    file = one.files[0].removesuffix(".gz")
    name = f"{one.folder}: {file}{' ' + one.stream if one.stream else ''}"
    said = right.replace(" ", " or ") if one.right not in ("?", "") else right
    return (
        f"| {name} | {found.options} | {found.positions} | {named} |"
        f" {found.seconds:.1f} | {said}{held} |"
    )


def of(one: Published, screen: bool = False) -> Verdict:
    """Import a recording and diagnose it, on a screen as well if wanted."""
    began = process_time()
    with tempfile.TemporaryDirectory() as name:
        asked, folder = imported(one, Path(name) / "session")
        if folder is None:
            return Verdict(asked, 0, "not imported", (), process_time() - began)
        found = diagnosed(folder)
        found = found._replace(options=asked, seconds=process_time() - began)
        return found._replace(screen=shown(folder)) if screen else found


def imported(one: Published, out: Path) -> tuple[int, Path | None]:
    """Import a recording: options that it took, and its session, if there is one."""
    paths = [str(REAL / one.folder / name) for name in one.files]
    call = ["import", *paths, *(["--join"] if len(paths) > 1 else [])]
    given: list[str] = []
    code, asked = ran([*call, "-o", str(out)]).code, 0
    for answer in one.options:
        if code == 0:
            break
        given += answer.split()
        asked += 1
        code = ran([*call, *given, "-o", str(out)]).code
    if code:
        return asked, None
    stream = out / one.stream
    return asked, stream if one.stream and stream.exists() else out


def diagnosed(folder: Path) -> Verdict:
    """What is said of a session."""
    began = process_time()
    code, text, _ = ran(["diagnose", str(folder), "--json"])
    seconds = process_time() - began
    marks = (folder / "session.toml").read_text().count("[[position]]")
    if code not in (0, 1):
        return Verdict(0, marks, f"exit code {code}", (), seconds)
    said = json.loads(text)
    effects = tuple(effect["id"] for effect in said["effects"])
    instead = {e["id"]: frozenset(e["aliases"]) for e in said["effects"]}
    return Verdict(0, marks, said["verdict"], effects, seconds, instead=instead)


def shown(folder: Path) -> str:
    """What `fieldcal diagnose` leaves on a terminal, as a user finds it."""
    import pexpect
    import pyte

    rows, columns = SCREEN
    terminal = pyte.Screen(columns, rows)
    words = ["-m", "fieldcal", "diagnose", folder.name]
    child = pexpect.spawn(
        sys.executable, words, dimensions=SCREEN, cwd=str(folder.parent), timeout=None
    )
    output = child.read()
    pyte.ByteStream(terminal).feed(output)
    lines = "\n".join(line.rstrip() for line in terminal.display).rstrip()
    return f"{'-' * columns}\n{lines}\n{'-' * columns}"
