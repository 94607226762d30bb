"""Several IMUs of one log, of which one is out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laid_about import G, turned, write

from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.evaluation.instances import compare_instances


def rests(seed: int, scale: float, n: int = 14) -> Array:
    """Means of an IMU in n orientations (n, 3), with a bias of its own."""
    rng = np.random.default_rng(seed)
    up = rng.normal(size=(n, 3))
    up *= scale * G / np.linalg.norm(up, axis=1, keepdims=True)
    return up + rng.normal(0, 0.1, 3) + rng.normal(0, 0.002, (n, 3))


@given(st.integers(0, 2**20), st.integers(2, 5), st.sampled_from([0.973, 1.03, 1.0]))
def test_the_one_that_is_out_is_named_whatever_the_biases(
    seed: int, many: int, scale: float
) -> None:
    odd = seed % many
    made = {
        f"imu{i}": rests(seed + i, scale if i == odd else 1 + 1e-3 * (i - 2))
        for i in range(many)
    }
    found = compare_instances(made, G)
    assert [one.name for one in found if one.out] == [f"imu{odd}"] * (scale != 1)
    one = found[odd]
    assert one.of_g == pytest.approx(scale - 1, abs=0.004) and one.every_way


def test_a_level_imu_may_have_a_bias() -> None:
    level = np.tile([0.0, 0.0, G], (3, 1))
    found = compare_instances(
        {"a": level, "b": level + [0, 0, 0.2], "none": level[:0]}, G
    )
    assert [one.out for one in found] == [False, False]
    assert "bias included" in found[1].sentence()
    (alone,) = compare_instances({"a": 1.2 * level}, G)
    assert not alone.out and alone.document()["of_others"] is None


def test_a_single_rest_tells_no_uncertainty() -> None:
    """Its scatter is unknown, and not 0."""
    one = compare_instances({"a": np.array([[0.1, 0.0, G]])}, G)[0]
    assert "m/s² in a single rest" in one.sentence() and "±" not in one.sentence()
    assert one.document()["sigma"] is None and one.rests == 1


def test_import_says_at_once_which_imu_is_out_and_so_does_compare(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(1, 50.0, sides=7)
    low = rows[:, 1:].copy()
    low[:, :3] *= 0.95
    names = [f"{imu}_{kind}{axis}" for imu in ("mid", "low", "top") for kind in "ag"
             for axis in "xyz"]  # fmt: skip
    log = np.hstack([rows, low, rows[:, 1:] * 1.002])
    path = write(tmp_path, log, heading=",".join(["t", *names]))
    assert main(["import", str(path), "-o", str(tmp_path / "s")]) == 0
    said = [line for line in capsys.readouterr().err.split("\n") if "is out" in line]
    assert len(said) == 1 and "low: |a| at rest is 9.3" in said[0]
    call = ["compare", "--instances", str(tmp_path / "s")]
    assert main(call) == 1
    assert capsys.readouterr().out.count("is out") == 1
    assert main([*call, "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert [one["name"] for one in found if one["out"]] == ["low"]
    assert main(["compare", "--instances", str(tmp_path / "s" / "low")]) == 2
    assert main(["compare", str(tmp_path / "s" / "low")]) == 2


def test_folders_of_the_same_name_are_different_imus(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(1, 50.0)
    paths = [tmp_path / one / "imu0" for one in "ab"]
    for path in paths:
        path.parent.mkdir()
        log = write(path.parent, rows, heading="t,ax,ay,az,gx,gy,gz")
        assert main(["import", str(log), "-o", str(path)]) == 0
    capsys.readouterr()
    call = ["compare", "--json", "--instances"]
    assert main([*call, *map(str, paths)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [one["name"] for one in found] == [str(path) for path in paths]
    same = paths[0].parent / ".." / "a" / "imu0"
    assert main([*call, str(paths[0]), str(same)]) == 2
    assert "holds 1 session;" in capsys.readouterr().out
