"""Axes that a program filtered from others are left out, and it is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned, write

from fieldcal.core.errors import InputError
from fieldcal.importers import open_recording
from fieldcal.importing.headings.heading import Column
from fieldcal.importing.headings.headings import match_headings
from fieldcal.importing.read_options import ReadOptions

BARE = ("t", "ax", "ay", "az", "gx", "gy", "gz")
ROWS = turned(31, 50.0, 2.0)


FORMS = ("filtered_{}", "{}_filt", "{}_lpf", "kf_{}", "{} smoothed", "avg_{}")


@pytest.mark.parametrize("form", FORMS)
def test_filtered_axes_are_no_second_device(form: str) -> None:
    made = [form.format(name) for name in BARE[1:]]
    for names in ((*BARE, *made), (BARE[0], *made, *BARE[1:])):
        (found,) = match_headings([Column("", name) for name in names], "_")
        taken = [n for n, channel in zip(names, found.columns, strict=True)
                 if channel != "_"]  # fmt: skip
        assert tuple(taken) == BARE == tuple(c for c in found.columns if c != "_")
        assert found.says == (f"{', '.join(made)}: filtered from others; left out",)


def test_filtered_axes_are_taken_where_a_sensor_has_no_others() -> None:
    names = ("t", "ax_lpf", "ay_lpf", "az_lpf", "gx", "gy", "gz")
    (found,) = match_headings([Column("", name) for name in names], "_")
    assert found.columns == BARE
    (says,) = found.says
    assert says.startswith("ax_lpf, ay_lpf, az_lpf: a program filtered them")


def test_filtered_columns_beside_raw_ones_are_read_as_one_device(
    tmp_path: Path,
) -> None:
    made = np.array([np.convolve(x, np.ones(9) / 9, "same") for x in ROWS[:, 1:4].T]).T
    head = ",".join([*BARE, "ax_ema", "ay_ema", "az_ema"])
    path = write(tmp_path, np.hstack([ROWS, made]), heading=head)
    recording = open_recording(path, ReadOptions())
    (stream,) = recording.streams()
    block = next(iter(recording.blocks(stream.name)))
    np.testing.assert_allclose(block.acc, ROWS[: len(block), 1:4])
    assert "ax_ema, ay_ema, az_ema: filtered from others" in " ".join(recording.says)


@pytest.mark.parametrize(
    "line",
    ["left x: {:.3f} y: {:.3f} z: {:.3f}\nright x: {:.3f} y: {:.3f} z: {:.3f}",
     "left x: {:.3f} y: {:.3f} z: {:.3f} right x: {:.3f} y: {:.3f} z: {:.3f}",
     "left: x: {:.3f} y: {:.3f} z: {:.3f}\nright: x: {:.3f} y: {:.3f} z: {:.3f}"],
)  # fmt: skip
def test_axes_of_two_devices_are_not_offered_as_forces_and_rates(
    tmp_path: Path, line: str
) -> None:
    """Both are as long as gravity, which no rates are."""
    acc = ROWS[:, 1:4]
    both = np.hstack([acc, acc[:, [1, 2, 0]]])
    path = tmp_path / "log.txt"
    path.write_text("\n".join(line.format(*row) for row in both.tolist()))
    with pytest.raises(InputError) as asked:
        read_files([path])
    says = str(asked.value)
    assert "they are of several devices" in says
    assert "--columns ax,ay,az,_,_,_ or --columns _,_,_,ax,ay,az, and --rate" in says
    assert "gx" not in says
