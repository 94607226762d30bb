"""Kills while recording: samples lost, samples invented, sessions not readable."""

import sys
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

KILLS = 200
AT_ONCE = 2


def main() -> None:
    """Print what the kills cost; every count is to be 0."""
    sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
    recorded: Any = import_module("recorded")
    wrong: list[str] = []
    samples = 0
    with TemporaryDirectory() as folder:

        def one(pair: tuple[int, float]) -> tuple[int, list[str]]:
            place = Path(folder, str(pair[0]))
            written = recorded.killed(place, pair[1])
            return written, recorded.faults(place, written)

        moments = recorded.moments(KILLS, seed=2)
        with ThreadPoolExecutor(AT_ONCE) as pool:
            for written, faults in pool.map(one, enumerate(moments)):
                samples += written
                wrong += faults
    lost = sum("lost" in text for text in wrong)
    print(f"kills                        {KILLS}")
    print(f"samples written before them  {samples}")
    print(f"sessions with samples lost   {lost}")
    print(f"other faults                 {len(wrong) - lost}")
