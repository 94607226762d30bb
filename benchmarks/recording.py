"""What recording ten devices at 1 kHz costs in real time, in parts of a core."""

from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, process_time, sleep

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.session.recorder import Recorder

DEVICES, RATE, CHUNK, WATCHED = 10, 1000, 20, 5.0
"""Devices, Hz, samples handed over at once, s."""


def recording(folder: Path) -> None:
    """Print what recording costs in real time."""
    recorders = [Recorder(folder / f"device{i}", {"format": 1}) for i in range(DEVICES)]
    began, spent = monotonic(), process_time()
    k = 0
    while (now := monotonic() - began) < WATCHED:
        if k * CHUNK / RATE <= now:
            t = (k * CHUNK + np.arange(CHUNK)) / RATE
            block = Block.of(t, np.ones((CHUNK, 3)), np.ones((CHUNK, 3)))
            for recorder in recorders:
                recorder.append(block)
            k += 1
        else:
            sleep(0.001)
    share = (process_time() - spent) / (monotonic() - began)
    for recorder in recorders:
        recorder.close()
    print(
        f"recording {DEVICES} devices at {RATE} Hz: {share:.3f} of a core, to be < 0.25"
    )


def main() -> None:
    """Print the cost."""
    with TemporaryDirectory() as folder:
        recording(Path(folder))
