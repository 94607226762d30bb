"""Single samples that jump away and back."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.samples import Block
from fieldcal.windows.spikes import without_spikes
from fieldcal.windows.stretches import still_stretches


def block(seed: int, n: int = 900, grain: float = 0.0) -> Block:
    rng = np.random.default_rng(seed)
    acc = [0.1, 0.2, 9.8] + rng.normal(0, 0.02, (n, 3))
    gyr = rng.normal(0, 2e-3, (n, 3))
    acc = np.round(acc / grain) * grain if grain else acc
    return Block.of(np.arange(n) / 30, acc, gyr)


@given(
    st.integers(0, 2**20), st.sampled_from([0.0, 0.01, 0.15]),
    st.lists(st.integers(2, 890), max_size=12, unique=True), st.floats(2.0, 40.0),
)  # fmt: skip
def test_they_are_left_out_and_nothing_else(
    seed: int, grain: float, at: list[int], size: float
) -> None:
    made = block(seed, grain=grain)
    apart = [i for i in at if not {i - 2, i - 1, i + 1, i + 2} & {*at}]
    for i in apart:
        made.acc[i, i % 3] += size * (-1) ** i
    found = without_spikes(made)
    gone = np.argwhere(np.isnan(found.acc)).tolist()
    assert sorted(gone) == sorted([i, i % 3] for i in apart)
    assert found.gyr is made.gyr


def test_what_moves_and_what_is_missing_is_kept() -> None:
    t = np.arange(900) / 30
    swing = np.sin(2 * np.pi * 3 * t)[:, None] * [1.0, 2.0, 3.0]
    step = np.where(t < 15, 0.0, 5.0)[:, None] + [0.0, 0.0, 9.8]
    for acc in (swing, step, np.full((900, 3), np.nan), np.zeros((900, 3)), swing[:2]):
        made = Block.of(t[: len(acc)], acc)
        assert without_spikes(made) is made


def test_a_face_with_wrong_bytes_is_one_stretch() -> None:
    made = block(7)
    for i in range(40, 880, 70):
        made.acc[i, i % 3] += 2.4
    ((start, end),) = still_stretches(made)
    assert end - start > 28
