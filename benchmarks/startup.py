"""Start-up of the command line, as a multiple of an interpreter that does nothing."""

import subprocess
import sys
from time import perf_counter

RUNS = 15


def _best(command: list[str]) -> float:
    times = []
    for _ in range(RUNS):
        began = perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        times.append(perf_counter() - began)
    return min(times)


def main() -> None:
    """Print the ratios; `fieldcal --help` is to stay below 5."""
    python = sys.executable
    nothing = _best([python, "-c", "pass"])
    print(f"python -c pass        {1e3 * nothing:6.1f} ms")
    for what in (["--help"], ["run", "--help"], ["solve", "--help"]):
        took = _best([python, "-m", "fieldcal", *what])
        name = " ".join(["fieldcal", *what])
        print(f"{name:21} {1e3 * took:6.1f} ms  {took / nothing:5.2f} x")
    took = _best([python, "-c", "import fieldcal.solve"])
    print(f"{'import fieldcal.solve':21} {1e3 * took:6.1f} ms  {took / nothing:5.2f} x")
