"""Whatever a recording has and has not: a verdict and exit code, or one sentence."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.cli import main
from fieldcal.samples import Array, Block
from fieldcal.sim_device.profile import NoiseFigures, Profile, Sampling
from fieldcal.sim_device.vocabulary import parse

QUIET = NoiseFigures(acc_instability=(0, 0, 0), gyr_instability=(0, 0, 0))
SAME = Profile(noise=QUIET, sampling=Sampling(50.0))
COUPLED = replace(SAME, effects=(parse("cross_coupling:k12=0.02,k31=-0.02"),))
POSITIONS = places(seconds=12.0)

Table = dict[str, Any]


@pytest.fixture(scope="module")
def coupled() -> Block:
    """Nine positions of a device whose axes are not square."""
    return recorded(COUPLED, POSITIONS)


def diagnosed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> tuple[int, dict[str, Any]]:
    """Exit code and diagnosis; what is a warning is an error here."""
    code = main(
        ["diagnose", str(folder), "--json", "--twin", str(folder / "twin.toml")]
    )
    return code, json.loads(capsys.readouterr().out)


def unknown(values: Array) -> Array:
    return np.full_like(values, np.nan)


def bursty(block: Block) -> Block:
    """As if the host stamped ten samples when its buffer was full."""
    burst = block.t[np.arange(len(block)) // 10 * 10]
    return replace(block, t=burst + 0.17 + 1e-4 * (np.arange(len(block)) % 10))


def shaken(block: Block) -> Block:
    late = np.random.default_rng(1).uniform(0, 0.015, len(block))
    return replace(block, t=np.sort(block.t + late))


def holed(block: Block) -> Block:
    acc = block.acc.copy()
    acc[np.random.default_rng(1).random(acc.shape) < 0.1] = np.nan
    return replace(block, acc=acc)


@pytest.mark.parametrize(
    "made",
    [
        lambda b: replace(b, temperature=unknown(b.temperature)),
        lambda b: replace(b, gyr=unknown(b.gyr)),
        lambda b: replace(b, gyr=0 * b.gyr),
        lambda b: replace(b, gyr=b.gyr * [1.0, np.nan, 1.0]),
        bursty,
        shaken,
        holed,
    ],
    ids=["no temperature", "no gyroscopes", "gyroscopes off", "one gyroscope missing",
         "bursts", "jitter", "holes"],
)  # fmt: skip
def test_what_is_missing_does_not_hide_the_coupling(
    made: Callable[[Block], Block],
    coupled: Block,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    code, said = diagnosed(write_session(tmp_path, made(coupled), POSITIONS), capsys)
    assert code == 1 and "cross_coupling" in [e["id"] for e in said["effects"]]
    assert said["twin"]["twin"]["chi2_per_dof"] < 1.5


def test_without_accelerometers_gyroscopes_are_judged(
    coupled: Block, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    block = replace(coupled, acc=unknown(coupled.acc))
    code, said = diagnosed(write_session(tmp_path, block, POSITIONS), capsys)
    assert (code, said["verdict"]) == (0, "consistent")
    assert set(said["calibration"]) == {"gyr_bias"}


def test_windows_of_a_rate_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    device = replace(SAME, effects=(parse("gyro_cross_coupling:s12=0.01"),))
    rates = [-90.0, -45.0, -10.0, 0.0, 10.0, 45.0, 90.0]
    table: list[Table] = [
        p | {"rate_deg_s": [0.0, rate, 0.0]}
        for p, rate in zip(places([(0.0, 0.0)] * 7, 12.0), rates, strict=True)
    ]
    block = recorded(device, table)
    code, said = diagnosed(write_session(tmp_path / "a", block, table), capsys)
    assert code == 1 and said["effects"][0]["id"] == "gyro_cross_coupling"
    found = said["effects"][0]["parameters"]["s12"]
    assert abs(found["value"] - 0.01) < 4 * found["sigma"]
    assert said["calibration"]["gyr_scale"]["value"][1] == pytest.approx(1.0, abs=1e-3)
    no_angles = [{k: v for k, v in p.items() if "_deg" not in k or "rate" in k}
                 for p in table]  # fmt: skip
    code, said = diagnosed(write_session(tmp_path / "b", block, no_angles), capsys)
    assert said["verdict"] in ("consistent", "left_out", "ambiguous")


@pytest.mark.parametrize("known", [True, False])
def test_one_long_static_recording(
    known: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    device = replace(SAME, effects=(parse("warm_up:ax=0.03,gz=2e-3,tau_s=150"),))
    held: list[Table] = [
        {"alpha_deg": 10.0, "beta_deg": 5.0, "start_s": 2.0, "end_s": 700.0}
    ]
    block = recorded(device, held)
    code, said = diagnosed(
        write_session(tmp_path, block, held if known else []), capsys
    )
    assert code == 1
    there = {i for e in said["effects"] for i in (e["id"], *e["aliases"])}
    assert "warm_up" in there
    replays = said["twin"]
    assert replays["twin"]["chi2_per_dof"] < 0.5 * replays["refitted"]["chi2_per_dof"]


def moved(by: float) -> list[Table]:
    return [
        p | {"start_s": p["start_s"] + by, "end_s": p["end_s"] + by} for p in POSITIONS
    ]


@pytest.mark.parametrize(
    ("made", "positions", "tables", "says"),
    [
        (None, moved(1e5), {}, "check start_s and end_s"),
        (None, POSITIONS[::-1], {}, "in the order in which they were held"),
        (lambda b: replace(b, acc=0 * b.acc, gyr=0 * b.gyr), POSITIONS, {},
         "record them again"),
        (lambda b: replace(b, acc=unknown(b.acc), gyr=unknown(b.gyr)), POSITIONS, {},
         "record them again"),
        (None, POSITIONS, {"model": {"effects": ["nonsense"]}}, "no effect in the"),
        (None, POSITIONS, {"model": {"effects": ["warm_up"], "warm_up": {"ax": 1.0}}},
         "needs tau_s"),
        (None, POSITIONS,
         {"model": {"effects": ["base_tilt"], "base_tilt": {"about_x_deg": "x"}}},
         "is not a number"),
    ],
)  # fmt: skip
def test_what_cannot_be_diagnosed_is_one_sentence(
    made: Callable[[Block], Block] | None,
    positions: list[Table],
    tables: Table,
    says: str,
    coupled: Block,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    block = made(coupled) if made else coupled
    folder = write_session(tmp_path, block, positions, **tables)
    assert main(["diagnose", str(folder)]) == 2
    out, err = capsys.readouterr()
    assert says in err and err.count("\n") == 1 and not out
