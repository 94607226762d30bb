"""Six sides by hand, of a device that nobody calibrated: all that is usual, no more."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from laid_about import SIDES, G, write
from scipy.spatial.transform import Rotation

from fieldcal.cli import main
from fieldcal.core.samples import Array

RATE = 100.0


def laid_by_hand(seed: int) -> Array:
    """Rows t, a, w, SI: each side up, two degrees from where it ought to be.

    On the way the hand wobbles, so that the device turns about two axes at once.
    """
    rng = np.random.default_rng(seed)
    held = [_up(rng, np.array(side, float)) for side in SIDES]
    course = [held[0]] * int(RATE * rng.uniform(12, 18))
    for one, other in zip(held, held[1:], strict=False):
        steps = int(RATE * rng.uniform(2, 5))
        s = (np.arange(steps) + 0.5) / steps
        part = s - np.sin(2 * np.pi * s) / (2 * np.pi)
        way = Rotation.from_rotvec(np.outer(part, (one.inv() * other).as_rotvec()))
        wobble = np.outer(np.sin(np.pi * s) ** 2, rng.normal(0, 0.25, 3))
        course += [one * turn for turn in way * Rotation.from_rotvec(wobble)]
        course += [other] * int(RATE * rng.uniform(12, 18))
    every = Rotation.concatenate(course)
    rate = (every[:-1].inv() * every[1:]).as_rotvec() * RATE
    off = [np.eye(3) + rng.uniform(-0.01, 0.01, (3, 3)) for _ in "ag"]
    acc = every.inv().apply([0, 0, G]) @ off[0].T + rng.uniform(-0.4, 0.4, 3)
    gyr = np.vstack([rate, np.zeros(3)]) @ off[1].T + rng.uniform(-0.03, 0.03, 3)
    acc += rng.normal(0, 0.03, acc.shape)
    gyr += rng.normal(0, 9e-4, gyr.shape)
    return np.column_stack([np.arange(len(acc)) / RATE, acc, gyr])


def _up(rng: np.random.Generator, side: Array) -> Rotation:
    """A device with a side up, turned about the vertical by any angle."""
    up = side + rng.normal(0, 0.035, 3)
    beside = rng.normal(0, 1, 3)
    axes = np.linalg.qr(np.column_stack([up, beside, np.cross(up, beside)]))[0]
    axes[:, 0] *= np.sign(axes[:, 0] @ up)
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    return Rotation.from_matrix(axes[:, [1, 2, 0]].T)


SEEDS = [0, *(pytest.param(i, marks=pytest.mark.thorough) for i in (1, 2, 3, 5, 6, 7))]


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.thorough
def test_what_every_triad_has_is_named_and_nothing_in_its_place(
    tmp_path: Path, seed: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """As many numbers as rows: products of rates would explain them as well."""
    head = "t,ax,ay,az,gx,gy,gz"
    path, to = write(tmp_path, laid_by_hand(seed), heading=head), str(tmp_path / "out")
    said = ["--acc-unit", "m/s^2", "--gyr-unit", "rad/s", "-o", to]
    assert main(["import", str(path), *said]) == 0
    capsys.readouterr()
    assert main(["diagnose", to, "--json"]) == 1
    named = {e["id"] for e in json.loads(capsys.readouterr().out)["effects"]}
    assert named <= {"gyro_scale", "gyro_cross_coupling", "cross_coupling"}
    assert "gyro_cross_coupling" in named
