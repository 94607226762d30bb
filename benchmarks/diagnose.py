"""Time and memory of `fieldcal diagnose`, beside those of merely reading the session.

Nine positions at 100 Hz (34 000 samples) and one hour at 1 kHz (3.6 million), recorded
by the virtual device with cross-coupling in it. Each command is a process of its own,
start-up included; memory is the most that it held at once.
"""

from __future__ import annotations

import multiprocessing
import resource
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from time import perf_counter

import numpy as np

from fieldcal.session.sample_table import to_record_batch
from fieldcal.sim_device.profile import Profile, Sampling
from fieldcal.sim_device.replay import simulate
from fieldcal.sim_device.vocabulary import checked_effect

GAP_S = 8.0
ANGLES = [(a, b) for b in (0.0, 5.0, -5.0) for a in (0.0, 45.0, -45.0)]
SESSIONS = {"nine positions, 100 Hz": (100.0, 30.0), "one hour, 1 kHz": (1000.0, 391.0)}
TWIN = "{folder}/twin.toml"
COMMANDS = {
    "read": ["-c", "import sys; from fieldcal.session.folder import Session;"
             " Session.open(sys.argv[1]).block"],
    "diagnose": ["-m", "fieldcal", "diagnose"],
    "diagnose --twin": ["-m", "fieldcal", "diagnose", "--twin", TWIN],
}  # fmt: skip


Parameters = Mapping[str, Mapping[str, float]]

COUPLED: Parameters = {"cross_coupling": {"k12": 0.003}}


def record(
    folder: Path,
    rate_hz: float,
    seconds: float,
    angles: Sequence[tuple[float, float]] = ANGLES,
    there: Parameters = COUPLED,
) -> int:
    """Record a session, of nine positions; returns how many samples it has.

    `there` are the effects in it with their parameters.
    """
    import pyarrow as pa

    starts = [3.0 + i * (seconds + GAP_S) for i in range(len(angles))]
    held = [(*a, s, s + seconds) for a, s in zip(angles, starts, strict=True)]
    effects = tuple(checked_effect(name, values) for name, values in there.items())
    device = Profile(sampling=Sampling(rate_hz), effects=effects)
    block = simulate(device, [(*np.deg2rad(w[:2]), *w[2:]) for w in held], seed=1)
    rows = "".join(
        f"[[position]]\nalpha_deg = {a}\nbeta_deg = {b}\nstart_s = {s}\nend_s = {e}\n"
        for a, b, s, e in held
    )
    (folder / "session.toml").write_text(
        f"format = 1\n[sampling]\nrate_hz = {rate_hz}\n"
        f"[site]\nlatitude_deg = 50.45\nheight_m = 170.0\n{rows}"
    )
    batch = to_record_batch(block)
    with pa.ipc.new_stream(folder / "samples.arrows", batch.schema) as file:
        file.write_table(pa.Table.from_batches([batch]), max_chunksize=1000)
    return len(block)


def timed(command: Sequence[str]) -> tuple[float, float]:
    """Seconds and the most memory, MB, of a process."""
    began = perf_counter()
    subprocess.run([sys.executable, *command], capture_output=True, check=False)
    seconds = perf_counter() - began
    most = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    return seconds, most


def main() -> None:
    """Print seconds and megabytes of each command on each session."""
    # a child counts the memory of the one that starts it: let a small process do it
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as small:
        for name, (rate_hz, seconds) in SESSIONS.items():
            with tempfile.TemporaryDirectory() as folder:
                made = small.apply(record, (Path(folder), rate_hz, seconds))
                print(f"{name}, {made} samples")
                for label, words in COMMANDS.items():
                    command = [w.format(folder=folder) for w in words]
                    took, most = small.apply(timed, ([*command, folder],))
                    print(f"  {label:16} {took:6.2f} s {most:6.0f} MB")
