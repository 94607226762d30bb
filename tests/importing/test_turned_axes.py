"""Rates whose axes are not those of the accelerometers are told by gravity's turns."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned, write

from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.importing.units.gravity_size import GravityReading
from fieldcal.importing.units.turned_axes import find_axis_naming
from fieldcal.session.folder import Session

ROWS = turned(3, 50.0)
T, A, W = ROWS[:, 0], ROWS[:, 1:4], ROWS[:, 4:]
HEAD = "t (s),ax (m/s2),ay (m/s2),az (m/s2),{} (rad/s),{} (rad/s),{} (rad/s)"


@pytest.mark.parametrize(
    ("order", "signs", "named"),
    [
        ((2, 1, 0), (1, 1, 1), "gz gy gx"),  # yaw, pitch, roll called x, y, z
        ((1, 0, 2), (1, 1, -1), "gy gx -gz"),  # a chip on the other side of the board
        ((0, 1, 2), (1, 1, -1), "gx gy -gz"),  # one sign
        ((0, 1, 2), (-1, -1, -1), "-gx -gy -gz"),  # turns counted clockwise
    ],
)
def test_other_axes_are_asked_about_with_their_names(
    tmp_path: Path,
    order: tuple[int, ...],
    signs: tuple[int, ...],
    named: str,
) -> None:
    """Column k holds the rate about axis order[k], times its sign."""
    written = np.column_stack([T, A, W[:, order] * signs])
    path = write(tmp_path, written, heading=HEAD.format("wx", "wy", "wz"))
    with pytest.raises(InputError, match=f"if these are {named}[:,] ") as raised:
        read_files([path])
    first, *_, second = re.findall(r"--columns (\S+?),? ", f"{raised.value} ")
    for option, rates in ((first, W), (second, W[:, order] * signs)):
        out = tmp_path / f"as_{option.count('-')}{option[-2:]}{rates is W}"
        columns = ["--columns", shlex.split(option)[0]]
        assert main(["import", str(path), *columns, "-o", str(out)]) == 0
        np.testing.assert_allclose(Session.open(out).block.gyr, rates, atol=1e-8)


@pytest.mark.parametrize(
    ("order", "signs"),
    [((0, 1, 2), (1, 1, -1)), ((1, 0, 2), (1, 1, 1)), ((1, 2, 0), (1, 1, 1)),
     ((2, 1, 0), (-1, 1, 1)), ((0, 2, 1), (-1, -1, -1))],
)  # fmt: skip
def test_forces_that_are_named_otherwise_are_asked_about_as_well(
    tmp_path: Path, order: tuple[int, ...], signs: tuple[int, ...]
) -> None:
    """Column k holds the force along axis order[k], times its sign.

    No turn tells a force from its opposite, so of both the one with fewer signs.
    """
    written = np.column_stack([T, A[:, order] * signs, W])
    path = write(tmp_path, written, heading=HEAD.format("wx", "wy", "wz"))
    with pytest.raises(InputError, match=", or if the forces ax ay az are ") as raised:
        read_files([path])
    _, option, _ = re.findall(r"--columns (\S+?),? ", f"{raised.value} ")
    columns = ["--columns", shlex.split(option)[0]]
    assert main(["import", str(path), *columns, "-o", str(tmp_path / "out")]) == 0
    block = Session.open(tmp_path / "out").block
    minus = sum(sign < 0 for sign in signs)
    np.testing.assert_allclose(block.acc, A if minus < 2 else -A, atol=1e-6)
    np.testing.assert_allclose(block.gyr, W, atol=1e-8)


def test_where_the_user_names_them_it_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, np.column_stack([T, A, W[:, ::-1]]))
    out = ["-o", str(tmp_path / "out")]
    columns = ["--columns", "t,ax,ay,az,gx,gy,gz", "--gyr-unit", "rad/s"]
    assert main(["import", str(path), *columns, *out]) == 0
    assert "but does if these are gz gy gx" in " ".join(capsys.readouterr())


def test_turns_about_one_axis_leave_the_names() -> None:
    """About x alone nothing tells y from z, so nothing is said of an order."""
    angle = np.concatenate([np.zeros(200), np.linspace(0, 3, 300), np.full(200, 3.0)])
    rate = np.gradient(angle, 0.01)
    still = np.zeros_like(angle)
    acc = np.column_stack([still, np.sin(angle), np.cos(angle)])
    gyr = np.column_stack([still, rate, still])
    gyr += np.random.default_rng(5).normal(0, 1e-3, gyr.shape)
    t = np.arange(len(angle)) * 0.01
    gravity = GravityReading(1.0, np.zeros(3), False)
    assert find_axis_naming(t, acc, gyr, gravity) is None


def test_axes_as_they_are_named_raise_no_question(tmp_path: Path) -> None:
    path = write(tmp_path, ROWS, heading=HEAD.format("wx", "wy", "wz"))
    block, says = read_files([path])
    np.testing.assert_allclose(block.gyr, W, atol=1e-8)
    assert not [one for one in says if "as they are named" in one]
