"""Whatever part of a recording somebody has: it is answered or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.injected.recorded import REAL
from benchmarks.parts import SEED, part_of, recordings, tried
from fieldcal.core.samples import Block


@pytest.fixture(scope="module")
def every(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[str, Block]]:
    if not REAL.is_dir():
        pytest.skip(f"the recordings are not here: {REAL}")
    return list(recordings(tmp_path_factory.mktemp("published")))


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(SEED + 1000, SEED + 1005))
def test_a_part_of_a_recording_is_answered_or_refused(
    seed: int, every: list[tuple[str, Block]], tmp_path: Path
) -> None:
    rng = np.random.default_rng(seed)
    name, block = every[rng.integers(len(every))]
    table = part_of(block, rng)
    assert len(table.names) == table.samples.shape[1]
    assert (np.diff(table.samples[:, 0]) > 0).all()
    for one in tried(table, tmp_path):
        assert not one.broken, f"{name}: {one.command}: {one.said}"
