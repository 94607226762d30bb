"""Whatever a recording has and has not: a verdict and exit code, or one sentence."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from laid_about import turned
from session_folders import places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.samples import Array, Block
from fieldcal.sim_device.profile import NoiseFigures, Profile, Sampling
from fieldcal.sim_device.vocabulary import parse

QUIET = NoiseFigures(acc_instability=(0, 0, 0), gyr_instability=(0, 0, 0))
SAME = Profile(noise=QUIET, sampling=Sampling(50.0))
COUPLED = replace(SAME, effects=(parse("cross_coupling:k12=0.02,k31=-0.02"),))
POSITIONS = places(seconds=12.0)
AROUND = [
    *((0.0, 0.0), (90.0, 0.0), (180.0, 0.0), (-90.0, 0.0), (0.0, 90.0), (0.0, -90.0)),
    *((45.0, 30.0), (-45.0, -30.0), (135.0, 20.0), (-135.0, -40.0), (60.0, 60.0)),
    *((-120.0, 50.0), (30.0, -60.0)),
]
"""Every way up, and some between."""

Table = dict[str, Any]


@pytest.fixture(scope="module")
def coupled() -> Block:
    """Nine positions of a device whose axes are not square."""
    return recorded(COUPLED, POSITIONS)


thorough = pytest.mark.thorough


def diagnosed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> tuple[int, dict[str, Any]]:
    """Exit code and diagnosis; what is a warning is an error here."""
    code = main(
        ["diagnose", str(folder), "--json", "--twin", str(folder / "twin.toml")]
    )
    return code, json.loads(capsys.readouterr().out)


def foretold(said: dict[str, Any], channel: str) -> list[float]:
    """Held-out rms of a channel before and after."""
    return [said["fit"][k]["held_out_by_channel"][channel] for k in ("before", "after")]


def unsaid(positions: list[Table]) -> list[Table]:
    """Positions of which nobody knows the angles."""
    angles = ("alpha_deg", "beta_deg")
    return [{k: v for k, v in p.items() if k not in angles} for p in positions]


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
        pytest.param(
            lambda b: replace(b, temperature=unknown(b.temperature)), marks=thorough
        ),
        pytest.param(lambda b: replace(b, gyr=unknown(b.gyr)), marks=thorough),
        pytest.param(lambda b: replace(b, gyr=0 * b.gyr), marks=thorough),
        pytest.param(
            lambda b: replace(b, gyr=b.gyr * [1.0, np.nan, 1.0]), marks=thorough
        ),
        pytest.param(bursty, marks=thorough),
        pytest.param(shaken, marks=thorough),
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


def test_gyroscopes_alone_are_solved(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(5)
    t, bias = np.arange(6000) / 50, np.array([0.01, -0.02, 0.005])
    rates = bias + rng.normal(0, 2e-3, (len(t), 3))
    # two turns between three rests
    rates[2000:2100] += [0.5, 0.2, 0.0]
    rates[4000:4100] += [0.0, -0.4, 0.3]
    np.savetxt(tmp_path / "log.csv", np.c_[t, rates], delimiter=",", comments="",
               header="time (s),gx (rad/s),gy (rad/s),gz (rad/s)")  # fmt: skip
    assert main(["import", str(tmp_path / "log.csv"), "-o", str(tmp_path / "s")]) == 0
    capsys.readouterr()
    assert main(["solve", str(tmp_path / "s"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["parameters"]["gyr_bias"]
    pulls = (np.array(found["value"]) - bias) / found["sigma"]
    assert (np.abs(pulls) < 4).all() and max(found["sigma"]) < 1e-4


@pytest.mark.thorough
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
    code, said = diagnosed(write_session(tmp_path / "b", block, unsaid(table)), capsys)
    assert said["verdict"] in ("consistent", "left_out", "ambiguous")


UPRIGHT = {"x": (90.0, 0.0), "y": (0.0, 0.0), "z": (0.0, 90.0)}
"""Angles at which an axis of the device is the table's."""


def on_a_table(rates: tuple[float, ...] = (0.0, 60.0, -60.0, 120.0)) -> list[Table]:
    axes = [a for a in UPRIGHT for _ in rates]
    turned = [[r * (a == b) for b in "xyz"] for a in UPRIGHT for r in rates]
    positions = places([UPRIGHT[a] for a in axes], 12.0)
    return [p | {"rate_deg_s": w} for p, w in zip(positions, turned, strict=True)]


@thorough
def test_a_table_shows_the_lever_arm(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The accelerometers off its axis feel even turning, too."""
    truth = {"x": 0.04, "z": -0.02}
    device = replace(SAME, effects=(parse("lever_arm:x=0.04,z=-0.02"),))
    table = on_a_table()
    code, said = diagnosed(
        write_session(tmp_path, recorded(device, table), table), capsys
    )
    assert code == 1
    assert [e["id"] for e in said["effects"]] == ["lever_arm"]
    for axis, found in said["effects"][0]["parameters"].items():
        assert abs(found["value"] - truth.get(axis, 0.0)) < 4 * found["sigma"] < 2e-3
    fit = said["fit"]
    assert fit["after"]["held_out_rms"] < 0.1 * fit["before"]["held_out_rms"]


def test_gravity_that_turns_hides_no_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A table with its axis level turns gravity round; gyroscopes have their hum."""
    device = replace(SAME, effects=(parse("hum:gx=5e-4,hz=7"),))
    rates = (30.0, -30.0, 90.0, -90.0)
    table: list[Table] = [
        p | {"rate_deg_s": [rate, 0.0, 0.0]}
        for p, rate in zip(places([(0.0, 0.0)] * 4, 12.0), rates, strict=True)
    ]
    block = recorded(device, table)
    acc = block.acc.copy()
    for place, rate in zip(table, rates, strict=True):
        at = (block.t >= place["start_s"]) & (block.t <= place["end_s"])
        angle = np.deg2rad(rate) * (block.t[at] - place["start_s"])
        acc[at, 1] += 9.81 * (1 - np.cos(angle))
        acc[at, 2] += 9.81 * np.sin(angle)
    code, said = diagnosed(
        write_session(tmp_path, replace(block, acc=acc), table), capsys
    )
    assert code == 1
    assert [e["id"] for e in said["effects"]] == ["hum"]
    found = said["effects"][0]["parameters"]["gx"]
    assert abs(found["value"] - 5e-4) < 4 * found["sigma"]


@pytest.mark.thorough
def test_the_length_of_the_force_foretells_positions_not_seen(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With orientations unknown, what is predicted is held against turns made anew."""
    held = places(AROUND, 12.0)
    block = recorded(COUPLED, held)
    code, said = diagnosed(write_session(tmp_path, block, unsaid(held)), capsys)
    assert code == 1
    there = {i for e in said["effects"] for i in (e["id"], *e["aliases"])}
    assert "cross_coupling" in there
    before, after = foretold(said, "ax")
    assert after < 0.2 * before


@thorough
def test_what_settles_shows_whatever_the_orientations(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The Earth turns each window by the same all through it, and hides no course."""
    truth = {"ay": 0.04, "gx": 1e-3, "tau_s": 4.0}
    device = replace(SAME, effects=(parse("settling:ay=0.04,gx=1e-3,tau_s=4"),))
    held = places(AROUND[:7], 12.0)
    block = recorded(device, held)
    code, said = diagnosed(write_session(tmp_path, block, unsaid(held)), capsys)
    assert (code, [e["id"] for e in said["effects"]]) == (1, ["settling"])
    found = said["effects"][0]["parameters"]
    for name, value in truth.items():
        assert abs(found[name]["value"] - value) < 4 * found[name]["sigma"], name
        assert found[name]["sigma"] < 0.4 * value
    assert said["fit"]["after"]["chi2_per_dof"] == pytest.approx(1.0, abs=0.15)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("effect", "parameters"),
    [
        pytest.param("base_tilt", {"about_x_deg": 0.5}, marks=pytest.mark.thorough),
        ("cross_coupling", {"k12": 0.004, "k31": -0.003}),
        pytest.param("gyro_scale", {"s1": 0.02}, marks=pytest.mark.thorough),
    ],
)
def test_positions_without_angles_among_those_that_have_them(
    effect: str,
    parameters: dict[str, float],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Angles that are known stay known."""
    given = ",".join(f"{n}={v}" for n, v in parameters.items())
    device = replace(SAME, effects=(parse(f"{effect}:{given}"),))
    held = places(AROUND[:12], 12.0)
    some = [bare if i % 3 == 2 else p for i, (p, bare) in
            enumerate(zip(held, unsaid(held), strict=True))]  # fmt: skip
    block = recorded(device, held)
    code, said = diagnosed(write_session(tmp_path, block, some), capsys)
    assert (code, [e["id"] for e in said["effects"]]) == (1, [effect])
    for name, found in said["effects"][0]["parameters"].items():
        off = found["value"] - parameters.get(name, 0.0)
        assert abs(off) < 4 * found["sigma"], name
    fit = said["fit"]
    assert fit["after"]["held_out_rms"] < 0.3 * fit["before"]["held_out_rms"]


def walked(
    seed: int, folder: Path, capsys: pytest.CaptureFixture[str]
) -> dict[str, Any]:
    """What is said of a device that walks, held for 15 minutes."""
    device = replace(SAME, effects=(parse("random_walk:gx=8e-5"),))
    held: list[Table] = [
        {"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": 2.0, "end_s": 900.0}
    ]
    block = recorded(device, held, seed)
    code, said = diagnosed(write_session(folder / str(seed), block, held), capsys)
    assert code == 1
    return said


@pytest.mark.thorough
def test_a_walk_foretells_what_comes_soon(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = walked(13, tmp_path, capsys)
    assert [e["id"] for e in said["effects"]] == ["random_walk"]
    before, after = foretold(said, "gx")
    assert after < 0.8 * before


@thorough
def test_most_walks_are_named_and_are_as_fast_as_they_say(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One in ten happens to look smoother than walks do, and is called unexplained."""
    every = [walked(seed, tmp_path, capsys) for seed in range(11, 21)]
    named = [e for said in every for e in said["effects"]]
    assert {e["id"] for e in named} == {"random_walk"} and len(named) >= 8
    speed = [e["parameters"]["gx"]["value"] for e in named]
    assert np.mean(speed) == pytest.approx(8e-5, rel=0.2)


@pytest.mark.thorough
def test_a_recording_of_windows_alone_has_lost_nothing(
    coupled: Block, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A recorder that pauses while the device is turned drops no samples."""
    inside = np.zeros(len(coupled), dtype=bool)
    for place in POSITIONS:
        inside |= (coupled.t >= place["start_s"]) & (coupled.t <= place["end_s"])
    columns = (coupled.acc, coupled.gyr, coupled.temperature)
    block = Block.of(coupled.t[inside], *(c[inside] for c in columns))
    code, said = diagnosed(write_session(tmp_path, block, POSITIONS), capsys)
    assert code == 1
    assert [e["id"] for e in said["effects"]] == ["cross_coupling"]


@thorough
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


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("beta", "scale", "found"),
    [
        (0.6, (1.0030, 1.0033, 0.996), []),
        pytest.param(5.0, (1.0030, 1.0030, 0.996), [], marks=thorough),
        pytest.param(5.0, (1.0030, 1.0030, 1.0030), ["gravity_error"], marks=thorough),
    ],
    ids=["the third hardly known", "the third another", "all three"],
)
def test_two_scale_factors_that_agree_are_no_gravity(
    beta: float,
    scale: tuple[float, float, float],
    found: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    angles = [(a, b) for b in (0.0, beta, -beta) for a in (0.0, 45.0, -45.0)]
    positions = places(angles, seconds=12.0)
    device = replace(SAME, truth=replace(SAME.truth, acc_scale=scale))
    folder = write_session(tmp_path, recorded(device, positions), positions)
    assert main(["diagnose", str(folder), "--json"]) == (1 if found else 0)
    said = json.loads(capsys.readouterr().out)
    assert [e["id"] for e in said["effects"]] == found


def moved(by: float) -> list[Table]:
    return [
        p | {"start_s": p["start_s"] + by, "end_s": p["end_s"] + by} for p in POSITIONS
    ]


@pytest.mark.parametrize(
    ("made", "positions", "tables", "says"),
    [
        (None, moved(1e5), {}, "check start_s and end_s"),
        (None, [p | {"end_s": p["start_s"] + 0.1} for p in POSITIONS], {},
         "samples, and 20 are needed: rest longer, or record at a higher rate"),
        (None, [*POSITIONS, {"start_s": 30.0, "end_s": 40.0}], {},
         "the device cannot be in both"),
        (None, [], {}, "the device is turned in this recording"),
        (lambda b: replace(b, acc=unknown(b.acc), gyr=b.gyr + [0, 0, 3.5]), [], {},
         "deg/s for a second, which no bias is, and session.toml has no [[position]]"),
        (lambda b: b[:15], [], {}, "no [[position]], and 15 samples are less than"),
        (lambda b: replace(b, gyr=unknown(b.gyr)), [], {}, "let fieldcal import find"),
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


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("made", "says", "left"),
    [
        pytest.param(
            lambda b: replace(b, gyr=0 * b.gyr),
            "gyroscopes are not used: gx, gy and gz",
            "acc",
            marks=thorough,
        ),
        pytest.param(
            lambda b: replace(b, gyr=b.gyr * [1, np.nan, 1]),
            "not used: gy",
            "acc",
            marks=thorough,
        ),
        (lambda b: replace(b, acc=b.acc * [np.nan, 1, 1]), "not used: ax", "gyr"),
    ],
)
def test_a_sensor_that_says_nothing_does_not_cost_the_other(
    made: Callable[[Block], Block],
    says: str,
    left: str,
    coupled: Block,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder = write_session(tmp_path, made(coupled), POSITIONS)
    assert main(["solve", str(folder), "--cross", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert any(says in warning for warning in found["warnings"])
    assert {name[:3] for name in found["parameters"]} & {"acc", "gyr"} == {left}
    assert main(["report", str(folder)]) == 0


@thorough
@pytest.mark.parametrize(
    ("axes", "columns"),
    [("+y-x+z", "gy,-gx,gz"), ("-x-y-z", "")],
)
def test_gyroscopes_along_other_axes_are_named_and_mended(
    axes: str, columns: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(8, 50.0, 4.0, sides=7)
    own = {"+y-x+z": rows[:, [5, 4, 6]] * [1, -1, 1], "-x-y-z": -rows[:, 4:]}[axes]
    np.savetxt(tmp_path / "log.csv", np.c_[rows[:, :4], own], delimiter=",",
               comments="", header="t,ax,ay,az,gx,gy,gz")  # fmt: skip
    said = ["--acc-unit", "m/s^2", "--gyr-unit", "rad/s", "--latitude", "45"]
    log, folder = str(tmp_path / "log.csv"), tmp_path / "s"
    as_named = ["--columns", "t,ax,ay,az,gx,gy,gz"]  # as they are, or it is asked
    assert main(["import", log, "-o", str(folder), *said, *as_named]) == 0
    capsys.readouterr()
    _, found = diagnosed(folder, capsys)
    (named,) = [e for e in found["effects"] if e["id"] == "mounting"]
    assert named["parameters"]["gyr_axes"]["value"] == axes
    assert main(["solve", str(folder), "--json"]) == 1
    if columns:
        named_so = ["--columns", f"t,ax,ay,az,{columns}"]
        assert main(["import", log, "-o", str(tmp_path / "m"), *said, *named_so]) == 0
        capsys.readouterr()
        _, found = diagnosed(tmp_path / "m", capsys)
        assert "mounting" not in [e["id"] for e in found["effects"]]


@pytest.mark.thorough
def test_gyroscopes_along_other_axes_than_the_ladder_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = replace(SAME, effects=(parse("mounting:gyr_axes=-z+y+x"),))
    block = recorded(other, POSITIONS)
    code, said = diagnosed(write_session(tmp_path, block, POSITIONS), capsys)
    named = [e["parameters"] for e in said["effects"] if e["id"] == "mounting"]
    assert code == 1 and [p["gyr_axes"]["value"] for p in named] == ["-z+y+x"]
    assert said["twin"]["twin"]["chi2_per_dof"] < 1.5


@pytest.mark.thorough
def test_a_mirrored_device_is_mirrored_and_its_gyroscopes_do_not_turn_back(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    block, swap = recorded(SAME, POSITIONS), [1, 0, 2]
    mirrored = replace(block, acc=block.acc[:, swap], gyr=block.gyr[:, swap])
    code, said = diagnosed(write_session(tmp_path, mirrored, POSITIONS), capsys)
    (named,) = [e["parameters"] for e in said["effects"] if e["id"] == "mounting"]
    assert code == 1 and {k: v["value"] for k, v in named.items()} == {"axes": "+y+x+z"}
    other = replace(mirrored, gyr=mirrored.gyr * [-1, -1, 1])
    _, said = diagnosed(write_session(tmp_path / "b", other, POSITIONS), capsys)
    (named,) = [e["parameters"] for e in said["effects"] if e["id"] == "mounting"]
    found = {k: v["value"] for k, v in named.items()}
    assert found["axes"] == "+y+x+z" and sorted(found) == ["axes", "gyr_axes"]


@pytest.mark.thorough
def test_a_hand_that_trembles_now_and_then_is_no_noisy_sensor(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows, rng = turned(8, 50.0, 6.0, sides=7), np.random.default_rng(4)
    angle = np.zeros(len(rows))
    for i, kick in enumerate(rng.normal(0, 1.5e-3, len(rows) - 1), 1):
        angle[i] = 0.9 * angle[i - 1] + kick
    # about x in three of seven rests, about y in the others
    about = np.eye(3)[1 * (np.arange(len(rows)) // 375 % 3 > 0)]
    rows[:, 1:4] -= np.cross(angle[:, None] * about, rows[:, 1:4])
    rows[:, 4:] += np.gradient(angle, rows[:, 0])[:, None] * about
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", comments="",
               header="t,ax,ay,az,gx,gy,gz")  # fmt: skip
    said = ["--acc-unit", "m/s^2", "--gyr-unit", "rad/s", "--latitude", "45"]
    log, folder = str(tmp_path / "log.csv"), tmp_path / "s"
    assert main(["import", log, "-o", str(folder), *said]) == 0
    capsys.readouterr()
    _, found = diagnosed(folder, capsys)
    assert "noise_level" not in [e["id"] for e in found["effects"]]
