"""What a factory left of cross-coupling, where turns show the gyroscopes' axes.

A device stands nearly upright and is turned about the vertical. Its accelerometers have
a percent of cross-coupling, which is counted and not estimated. Products of it with the
orientations are then far above what the turns are known to.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from observed import OMEGA
from scipy.spatial.transform import Rotation
from session_folders import SITE, write_session

from fieldcal.calibration import Calibration
from fieldcal.core.factory import FactoryErrors
from fieldcal.core.gravity import normal_gravity
from fieldcal.core.samples import Array, Block, concat
from fieldcal.evaluation.prepared_session import PreparedSession
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session
from fieldcal.solve import solve

RATE, REST, TURN = 100.0, 800, 200
LEFT = 0.01
UP = normal_gravity(SITE["latitude_deg"], SITE["height_m"])
LATITUDE = float(np.deg2rad(SITE["latitude_deg"]))
EARTH = OMEGA * np.array([0.0, -np.sin(LATITUDE), np.cos(LATITUDE)])


class Device:
    """Triangular accelerometers, and gyroscopes in their axes."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.acc = np.eye(3) + np.triu(LEFT * self.rng.standard_normal((3, 3)), 1)
        self.gyr = np.eye(3) + 0.01 * self.rng.standard_normal((3, 3))
        self.bias = 0.01 * self.rng.standard_normal(3)

    def samples(self, first: int, f: Array, w: Array) -> Block:
        """Its outputs from a sample on."""
        acc = f @ self.acc.T + 0.01 * self.rng.standard_normal(f.shape)
        gyr = self.bias + w @ self.gyr.T + 1e-3 * self.rng.standard_normal(w.shape)
        return Block.of((first + np.arange(len(f))) / RATE, acc, gyr)

    def upright(self, turns: int) -> Iterator[Array]:
        """Turns about the vertical that tilt it a little, rad, device axes."""
        for _ in range(turns):
            tilts = 0.12 * self.rng.standard_normal(2)
            yaw = self.rng.uniform(1.0, 2.5) * self.rng.choice([-1, 1])
            yield np.array([tilts[0], yaw, tilts[1]])

    def recorded(self, turns: Iterable[Array]) -> tuple[Block, list[dict[str, object]]]:
        """Rests, and turns between them."""
        at, now, blocks, places = Rotation.identity(), 0, [], []
        u = np.arange(TURN) / TURN
        way, rate = u**3 * (10 - 15 * u + 6 * u * u), 30 * u**2 * (1 - u) ** 2
        for turn in [None, *turns]:
            if turn is not None:
                on = at * Rotation.from_rotvec(way[:, None] * turn)
                w = rate[:, None] * turn * RATE / TURN + on.inv().apply(EARTH)
                blocks.append(self.samples(now, np.zeros_like(w), w))
                at, now = at * Rotation.from_rotvec(turn), now + TURN
            f, w = (np.tile(at.inv().apply(v), (REST, 1)) for v in ([0, -UP, 0], EARTH))
            blocks.append(self.samples(now, f, w))
            times = {"start_s": now / RATE + 0.3, "end_s": (now + REST) / RATE - 0.3}
            places.append(dict[str, object](times))
            now += REST
        return concat(blocks), places


def solved(device: Device, turns: Iterable[Array], cross: bool) -> Calibration:
    """A calibration from its rests and turns."""
    block, places = device.recorded(turns)
    with TemporaryDirectory() as folder:
        session = Session.open(write_session(Path(folder) / "s", block, places))
        laid = PreparedSession(session, usable_windows(session))
        return solve(
            laid.observations, recorded=laid.recorded_rows(True), cross=cross,
            factory=FactoryErrors(cross_coupling=LEFT),
        )  # fmt: skip


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(s, marks=pytest.mark.thorough) for s in (1, 2, 3, 4))]
)
def test_gyroscopes_are_right_beside_cross_coupling_that_is_only_counted(
    seed: int,
) -> None:
    device = Device(seed)
    found = solved(device, device.upright(13), cross=False)
    names = [n for n in found.names if n.startswith("gyro_cross_coupling")]
    assert len(names) >= 4
    pulls = [
        (found.value(n) - device.gyr[int(n[-2]) - 1, int(n[-1]) - 1])
        / found.uncertainty(n)
        for n in names
    ]
    assert np.abs(pulls).max() < 3.5


@pytest.mark.parametrize("seed", range(4))
def test_what_few_positions_leave_open_does_not_contradict_the_turns(seed: int) -> None:
    """Windows alone leave cross-coupling anywhere, and with it every attitude."""
    whole, quarter = 2 * np.pi * np.eye(3), np.array([np.pi / 2, 0.0, 0.0])
    device = Device(seed)
    found = solved(device, [whole[1], whole[0], quarter, whole[2]], cross=True)
    assert found.good
    assert not any("another attitude" in said for said in found.warnings)
    values, sigmas = found.vector("gyr_bias")
    assert np.abs((values - device.bias) / sigmas).max() < 4
