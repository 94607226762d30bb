"""Two sensors whose times count different units, or have nothing in common."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.times.clock_ratio import RATIOS, clock_ratio

ROWS = turned(33, 50.0, 2.0)
T, A, W = ROWS[:, 0], ROWS[:, 1:4], ROWS[:, 4:]
MS = np.round(T * 1e3)


def hdf5(path: Path, t: Array, late: Array) -> None:
    with h5py.File(path, "w") as file:
        file["acc/t"], file["acc/xyz"] = t, A
        file["gyro/t"], file["gyro/xyz"] = late, W


def records(path: Path, t: Array, late: Array) -> None:
    both = (("accel", t, A), ("gyro", late, W))
    path.write_text("\n".join(
        json.dumps({"sensor": s, "ts": times[i], **dict(zip("xyz", xyz[i].tolist(),
                                                           strict=True))})
        for i in range(len(T)) for s, times, xyz in both
    ))  # fmt: skip


def tagged(path: Path, t: Array, late: Array) -> None:
    lines = []
    for i, row in enumerate(ROWS[:, 1:].tolist()):
        lines += [",".join(["ACC", f"{t[i]:.10g}", *map(str, row[:3])]),
                  ",".join(["GYR", f"{late[i]:.10g}", *map(str, row[3:])])]  # fmt: skip
    path.write_text("\n".join(lines) + "\n")


FORMS = [hdf5, records, tagged]


@pytest.mark.parametrize("write", FORMS)
@pytest.mark.parametrize(
    ("t", "late"),
    [(MS, T + 0.002), (T, MS + 2), (T, (T + 0.002) * 1e9), (T, T + 0.002)],
)
def test_times_in_another_unit_are_of_the_same_clock(
    write: Callable[[Path, Array, Array], None], t: Array, late: Array, tmp_path: Path
) -> None:
    write(tmp_path / "log", t, late)
    block, says = read_files([tmp_path / "log"])
    np.testing.assert_allclose(np.diff(block.t), 0.02, atol=1e-6)
    np.testing.assert_allclose(block.gyr[2:-2], W[2:-2], atol=1e-6)
    told = any("a unit of the times of" in one for one in says)
    assert told == (not np.isclose(np.ptp(t), np.ptp(late), rtol=0.01))


@pytest.mark.parametrize("write", FORMS)
def test_rates_of_another_clock_are_not_lost_without_a_word(
    write: Callable[[Path, Array, Array], None], tmp_path: Path
) -> None:
    write(tmp_path / "log", T, T + 9e4)
    with pytest.raises(InputError, match="log: the times of .* nothing in common"):
        read_files([tmp_path / "log"])


@given(
    st.sampled_from((1.0, *RATIOS)), st.floats(0, 1e3), st.floats(5, 500),
    st.floats(-0.04, 0.04), st.floats(0.3, 3),
)  # fmt: skip
def test_the_unit_is_that_in_which_both_run(
    ratio: float, began: float, span: float, late: float, pace: float
) -> None:
    t = began + np.arange(0, span, 0.02)
    others = (began + late * span + np.arange(0, span, 0.02 * pace)) / ratio
    assert clock_ratio(t, others) == pytest.approx(ratio)
