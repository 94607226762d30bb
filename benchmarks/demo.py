"""The whole way over a pty, 20 seeds: the truth must be within what the result says.

Each run is `fieldcal run five_position` against `fieldcal sim` in a process of its own,
on a base tilted by one degree, which only the five positions can see.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from fieldcal.core.samples import Array

SEEDS = range(1, 21)
TILT = {"about_x_deg": 1.0, "about_z_deg": -1.0}
GROUPS = ("acc_bias", "acc_scale", "gyr_bias", "base_tilt")


def one(seed: int, folder: Path) -> Array:
    """Pulls of a run: (found - concealed) / sigma, (11,)."""
    sim = f"--base-tilt={TILT['about_x_deg']},{TILT['about_z_deg']}"
    command = [sys.executable, "-m", "fieldcal", "run", "five_position", "--headless"]
    command += [f"--virtual={sim}", "--speed", "max", "--seed", str(seed), "--json"]
    command += ["-o", str(folder / str(seed))]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    result = json.loads(done.stdout)
    truth = {**result["virtual"], "base_tilt": list(TILT.values())}
    pulls = []
    for group in GROUPS:
        found = result["parameters"][group]
        off = np.subtract(found["value"], truth[group])
        pulls.append(off / np.array(found["sigma"]))
    return np.concatenate(pulls)


def main() -> None:
    """Print the pulls of every seed and how many are beyond 3 sigma."""
    with tempfile.TemporaryDirectory() as folder:
        pulls = np.array([one(seed, Path(folder)) for seed in SEEDS])
    print("seed  largest |pull|")
    for seed, row in zip(SEEDS, pulls, strict=True):
        print(f"{seed:4d}  {np.abs(row).max():.2f}")
    print(f"beyond 3 sigma: {(np.abs(pulls) > 3).sum()} of {pulls.size}")
    print(f"rms pull by parameter: {np.sqrt((pulls**2).mean(axis=0)).round(2)}")
