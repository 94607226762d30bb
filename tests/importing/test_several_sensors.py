"""Columns of several sensors without names, or with names of some of them alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import G, turned, write

from fieldcal.core.errors import InputError
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.words.heading_words import is_counter

ROWS = turned(14, 50.0, 2.0)
T, A, W = ROWS[:, :1], ROWS[:, 1:4], ROWS[:, 4:]


def test_two_accelerometers_and_a_gyroscope_in_counts_are_asked_about(
    tmp_path: Path,
) -> None:
    """As a data set of falls has them: 256, 1024 counts in a g, 16.384 in a deg/s."""
    counts = np.round(
        np.hstack([A / G * 256, np.rad2deg(W) * 16.384, A / G * 1024])
    ).astype(int)
    path = tmp_path / "log.txt"
    path.write_text("".join(",".join(f"{n:4d}" for n in row) + ";\n" for row in counts))
    with pytest.raises(InputError) as asked:
        read_files([path])
    says = str(asked.value)
    assert (
        "--columns ax,ay,az,gx,gy,gz,_,_,_ or --columns _,_,_,gx,gy,gz,ax,ay,az,"
        in says
    )
    assert says.endswith("and --rate HZ, as no column is a time")


def test_sensors_that_stand_side_by_side_are_asked_about_first(tmp_path: Path) -> None:
    other = A[:, [1, 2, 0]], W[:, [1, 2, 0]]
    path = write(tmp_path, np.hstack([T, A, W, np.sin(T), *other]))
    with pytest.raises(InputError, match=r"t,ax,ay,az,gx,gy,gz,_\.\.\. or --columns"):
        read_files([path])


def test_each_of_two_imus_has_rates_that_are_called_p_q_r(tmp_path: Path) -> None:
    names = [f"I[{i}].{kind}[{k}]" for i in "01" for kind in ("pqr", "acc")
             for k in range(3)]  # fmt: skip
    rows = np.hstack([T, W, A, -W, A])
    path = write(tmp_path, rows, heading=",".join(["time", *names]))
    recording = open_recording(path, ReadOptions())
    imus = [recording.alone(stream.name) for stream in recording.streams()]
    assert len(imus) == 2
    for one, sign in zip(imus, (1, -1), strict=True):
        (stream,) = one.streams()
        block = next(iter(one.blocks(stream.name)))
        np.testing.assert_allclose(block.gyr, sign * W[: len(block)], atol=1e-6)


def test_what_no_name_says_beside_two_imus_is_said(tmp_path: Path) -> None:
    head = "time," + ",".join(f"{k}_a{x}" for k in "AB" for x in "xyz")
    path = write(tmp_path, np.hstack([T, A, A, W]), heading=f"{head},u_x,u_y,u_z")
    recording = open_recording(path, ReadOptions())
    assert len(recording.streams()) == 2
    assert "u_x u_y u_z: nothing says what they are; they are left out" in " ".join(
        recording.says
    )


def test_axes_of_a_file_may_be_called_values(tmp_path: Path) -> None:
    names = "id,attr_time,attr_x,attr_y,attr_z"
    count = np.arange(1.0, len(T) + 1)[:, None]
    paths = [write(tmp_path, np.hstack([count, 1e3 * T, three]), name, names)
             for name, three in (("acc_walking.csv", A), ("Gyroscope_walking.csv", W))
             ]  # fmt: skip
    block, _ = read_files(paths)
    np.testing.assert_allclose(block.six, ROWS[:, 1:], atol=1e-6)


@pytest.mark.parametrize(
    ("name", "counts"),
    [("DATA_CNTR", True), ("Message Count", True), ("data", False), ("value", False)],
)
def test_a_counter_is_one_whatever_it_counts(name: str, counts: bool) -> None:
    assert is_counter(name) == counts
