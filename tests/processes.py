"""Commands of fieldcal in processes of their own, as a user starts them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, sleep
from typing import Any

FIELDCAL = [sys.executable, "-m", "fieldcal"]
RUN, SIM = [*FIELDCAL, "run"], [*FIELDCAL, "sim"]
TWO_POSITION = [*RUN, "two_position", "--headless", "--level=0.001"]
"""Two positions on a base that is level, and no operator."""


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
    folder: Path, run: subprocess.Popen[Any], size: int = 20_000
) -> None:
    """Until a run has recorded so many bytes of samples."""
    file, deadline = folder / "samples.arrows", monotonic() + 30
    while not (file.exists() and file.stat().st_size > size):
        assert monotonic() < deadline and run.poll() is None
        sleep(0.02)
