"""Gyroscopes from turns: rotations built another way, many seeds, real devices."""

import doctest
import io
import json
import shutil
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from observed import OMEGA, SHARED, motionless
from recordings import mpu9150, mpu9150_published
from scipy.spatial.transform import Rotation
from session_folders import SITE, write_session

from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.core.errors import NotObservable
from fieldcal.core.gravity import normal_gravity
from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS, Position
from fieldcal.core.rotation import rotation_matrices
from fieldcal.core.samples import Array, Block, concat
from fieldcal.evaluation.prepared_session import PreparedSession
from fieldcal.evaluation.solution import solve_session as solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.model.turns import rotation
from fieldcal.model.turns.rotation import attitudes_from_rotations, small_turns
from fieldcal.session.folder import Session
from fieldcal.solve import solve
from fieldcal.windows import Average

RATE = 100.0
S = np.array([[1.012, 0.004, -0.009], [-0.006, 0.991, 0.011], [0.008, -0.003, 1.02]])
BIAS = np.array([0.011, -0.032, 0.0021])
NAMES = (
    *(f"gyr_bias.{x}" for x in "xyz"),
    *(f"gyr_scale.{x}" for x in "xyz"),
    *(f"gyro_cross_coupling.s{i}{j}" for i in "123" for j in "123" if i != j),
)
TRUTH = np.array([*BIAS, *np.diag(S), *S[~np.eye(3, dtype=bool)]])
UP = normal_gravity(SITE["latitude_deg"], SITE["height_m"])
LATITUDE = float(np.deg2rad(SITE["latitude_deg"]))
EARTH = OMEGA * np.array([0.0, -np.sin(LATITUDE), np.cos(LATITUDE)])
vectors = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)


def test_examples_in_the_text() -> None:
    failed, tried = doctest.testmod(rotation, extraglobs={"np": np})
    assert tried and not failed


@given(vectors)
def test_exponential_is_a_rotation(v: Array) -> None:
    np.testing.assert_allclose(
        rotation_matrices(v), Rotation.from_rotvec(v).as_matrix(), atol=1e-12
    )


def whole(t: Array, w: Array, each: int = 1) -> Array:
    """Attitude after a turn, in steps of some samples."""
    edge = np.arange(0, len(t), each)
    return np.asarray(attitudes_from_rotations(small_turns(t, w, edge))[-1])


@pytest.mark.parametrize("each", [1, 7])
def test_constant_rate_is_exact(each: int) -> None:
    w = np.array([0.4, -1.1, 0.7])
    turn = whole(np.linspace(0, 3, 50), np.tile(w, (50, 1)), each)
    seen = Rotation.from_rotvec(3 * w).as_matrix().T
    np.testing.assert_allclose(turn, seen, atol=1e-12)


@given(st.lists(vectors, min_size=1, max_size=9))
def test_attitudes_on_the_way_are_products_of_the_turns(steps: list[Array]) -> None:
    there = Rotation.identity()
    found = attitudes_from_rotations(np.array(steps))
    np.testing.assert_array_equal(found[0], np.eye(3))
    for step, seen in zip(steps, found[1:], strict=True):
        there = there * Rotation.from_rotvec(step)
        np.testing.assert_allclose(seen, there.inv().as_matrix(), atol=1e-9)


def coning(t: Array, cone: float, speed: float) -> tuple[Array, Rotation]:
    """Body rate and attitude of an axis that goes round a cone."""
    z = np.column_stack([0 * t, 0 * t, speed * t])
    tilt = Rotation.from_rotvec([cone, 0, 0])
    attitude = Rotation.from_rotvec(z) * tilt * Rotation.from_rotvec(-z)
    spin = np.array([0, 0, speed])
    # of R = Z T Z^-1: the last turn is in the body, the first seen through the others
    w = (tilt * Rotation.from_rotvec(-z)).inv().apply(spin) - spin
    return w, attitude


def test_coning_is_followed() -> None:
    errors = []
    for n in (100, 200):
        t = np.linspace(0, 2, n + 1)
        w, attitude = coning(t, 0.2, 2 * np.pi)
        exact = (attitude[0].inv() * attitude[-1]).as_matrix().T
        errors.append(np.abs(whole(t, w) - exact).max())
    # the mean of two rates alone would be 1.6e-4 off
    assert errors[1] < 2e-5
    assert errors[0] / errors[1] > 3.5


def turned(
    start: Rotation, first: Array, second: Array, seconds: float
) -> tuple[Array, Rotation]:
    """Body rates of a turn about two axes, one a little behind the other."""
    t = np.arange(0, seconds + 0.5 / RATE, 1 / RATE)

    def smooth(x: Array) -> tuple[Array, Array]:
        x = np.clip(x, 0, 1)
        return x**3 * (10 - 15 * x + 6 * x**2), 30 * x**2 * (1 - x) ** 2

    s1, d1 = smooth(t / seconds / 0.8)
    s2, d2 = smooth((t / seconds - 0.2) / 0.8)
    back = Rotation.from_rotvec(s2[:, None] * second).inv()
    w = back.apply(first * (d1 / seconds / 0.8)[:, None])
    w = w + second * (d2 / seconds / 0.8)[:, None]
    end = start * Rotation.from_rotvec(first) * Rotation.from_rotvec(second)
    return w, end


def record(
    seed: int, steps: list[tuple[Array, Array]], start: Rotation, *,
    still: float = 8.0, noise: float = 1e-3, acc_noise: float = 0.01,
) -> tuple[Block, list[tuple[float, float]]]:  # fmt: skip
    """A recording of rests and turns on the turning Earth, and when the rests were."""
    rng = np.random.default_rng(seed)
    at, now, blocks, windows = start, 0.0, [], []
    n = round(still * RATE)
    for step in [None, *steps]:
        parts = []
        if step is not None:
            w, after = turned(at, *step, 2.0)
            middle = np.linspace(0, 1, len(w))[:, None]
            ends = [r.inv().apply(EARTH) for r in (at, after)]
            parts.append((w + ends[0] + middle * (ends[1] - ends[0]), np.zeros_like(w)))
            at = after
        rest = np.tile(at.inv().apply(EARTH), (n, 1))
        parts.append((rest, np.tile(at.inv().apply([0.0, -UP, 0.0]), (n, 1))))
        for w, f in parts:
            t = now + np.arange(len(w)) / RATE
            now = t[-1] + 1 / RATE
            gyr = BIAS + w @ S.T + noise * rng.standard_normal(w.shape)
            acc = f + acc_noise * rng.standard_normal(f.shape)
            blocks.append(Block.of(t, acc, gyr))
        windows.append((float(blocks[-1].t[0]), float(blocks[-1].t[-1])))
    return concat(blocks), windows


def calibrated(
    folder: Path, block: Block, windows: list[tuple[float, float]],
    angles: list[tuple[float, float]] | None = None, turns: str = "auto",
    whole_way: bool = True,
) -> Calibration:  # fmt: skip
    """Solve a session folder; where angles are not given they are not known."""
    places: list[dict[str, object]] = [
        {"start_s": a + 0.3, "end_s": b - 0.3} for a, b in windows
    ]
    for place, (alpha, beta) in zip(places, angles or [], strict=False):
        place |= {"alpha_deg": alpha, "beta_deg": beta}
    nominal = {"gyr_bias": [0.01, -0.03, 0.0], "gyr_scale": [1.0, 1.0, 1.0]}
    write_session(folder, block, places, nominal=nominal)
    opened = Session.open(folder)
    if not whole_way:
        return fitted(opened)
    return solve_session(opened, usable_windows(opened), turns)  # type: ignore[arg-type]


def fitted(session: Session, **asked: bool) -> Calibration:
    """Without what is said of effects that the calibration does not carry."""
    laid = PreparedSession(session, usable_windows(session))
    return solve(laid.observations, recorded=laid.recorded_rows(True), **asked)  # type: ignore[arg-type]


def many_ways(seed: int, n: int) -> list[tuple[Array, Array]]:
    rng = np.random.default_rng(seed)
    return [(1.3 * rng.standard_normal(3), 0.8 * rng.standard_normal(3))
            for _ in range(n)]  # fmt: skip


ANYHOW = Rotation.from_rotvec([0.3, 0.1, -0.4])


def pulls_of(found: Calibration) -> Array:
    return np.array([
        (found.value(n) - v) / found.uncertainty(n)
        for n, v in zip(NAMES, TRUTH, strict=True)
        if n in found.names
    ])  # fmt: skip


@cache
def seeds() -> list[Calibration]:
    found = []
    with TemporaryDirectory() as folder:
        for seed in range(4):
            block, windows = record(seed, many_ways(seed, 9), ANYHOW)
            there = Path(folder) / str(seed)
            found.append(calibrated(there, block, windows, whole_way=False))
    return found


def test_turns_by_hand_give_the_whole_matrix() -> None:
    for found in seeds():
        assert set(NAMES) <= set(found.names)
        assert "turns" in found.info
        sigma = [found.uncertainty(n) for n in NAMES[3:]]
        assert np.median(sigma) < 3e-3


def test_pulls_of_turns_by_hand() -> None:
    pulls = np.array([pulls_of(found) for found in seeds()])
    rms = np.sqrt((pulls[:, 3:] ** 2).mean())
    assert 0.6 < rms < 1.2
    assert (np.abs(pulls) < 1.96).mean() > 0.9
    assert np.abs(pulls).max() < 4.5
    turns = [found.info["turns"] for found in seeds()]
    ratio = sum(t["chi2"] for t in turns) / sum(t["dof"] for t in turns)
    assert 0.3 < ratio < 1.5


@pytest.mark.parametrize("places", [TWO_POSITIONS, FIVE_POSITIONS])
def test_the_turns_of_the_paper_s_own_procedure(
    places: tuple[Position, ...], tmp_path: Path
) -> None:
    steps = []
    angles = [p.degrees or (0.0, 0.0) for p in places]
    degrees = np.deg2rad(angles)
    for (a0, b0), (a1, b1) in zip(degrees[:-1], degrees[1:], strict=True):
        z = Rotation.from_rotvec([b0, 0, 0]).inv().apply([0, 0, a1 - a0])
        steps.append((np.asarray(z), np.array([b1 - b0, 0, 0])))
    block, windows = record(5, steps, Rotation.identity(), still=30)
    found = calibrated(tmp_path, block, windows, angles, whole_way=False)
    assert "gyr_scale.z" in found.names and found.uncertainty("gyr_scale.z") < 0.01
    assert "gyr_scale.y" not in found.names
    assert any("gyr_scale.y" in w and "add turns" in w for w in found.warnings)
    assert (np.abs(pulls_of(found)) < 3.5).all()


@pytest.mark.thorough
def test_without_the_turns_there_is_no_scale_factor(tmp_path: Path) -> None:
    block, windows = record(4, many_ways(6, 6), ANYHOW)
    found = calibrated(tmp_path, block, windows, turns="no")
    assert "gyr_scale" not in found.groups and "turns" not in found.info


@pytest.mark.parametrize(
    ("turns", "sentence"),
    [(-1, "the mounting (gyr_axes = -x-y-z)"),
     pytest.param(1, "in 1 turn the gyroscopes lead to another attitude",
                  marks=pytest.mark.thorough)],
)  # fmt: skip
def test_gyroscopes_that_turn_the_other_way_are_said_to(
    tmp_path: Path, turns: int, sentence: str
) -> None:
    """In all turns it is their mounting, in one nobody knows."""
    block, windows = record(4, many_ways(6, 6), ANYHOW)
    so_far = block.t < windows[turns][0]
    gyr = np.where(so_far[:, None], -block.gyr, block.gyr)
    found = calibrated(tmp_path, replace(block, gyr=gyr), windows)
    assert len([w for w in found.warnings if sentence in w]) == 1 and not found.good


@pytest.mark.thorough
def test_a_turn_with_samples_missing_is_left_out(tmp_path: Path) -> None:
    block, windows = record(4, many_ways(6, 6), ANYHOW)
    middle = (windows[0][1] + windows[1][0]) / 2
    keep = (block.t < middle - 0.3) | (block.t > middle + 0.3)
    holed = Block.of(block.t[keep], block.acc[keep], block.gyr[keep])
    found = calibrated(tmp_path / "holed", holed, windows, whole_way=False)
    every = calibrated(tmp_path / "whole", block, windows, whole_way=False)
    counted = every.info["turns"]["dof"]
    assert found.info["turns"]["dof"] < counted
    assert (np.abs(pulls_of(found)) < 4.5).all()
    inside = np.zeros(len(block.t), dtype=bool)
    for a, b in windows:
        inside |= (block.t >= a) & (block.t <= b)
    bare = Block.of(block.t[inside], block.acc[inside], block.gyr[inside])
    with pytest.raises(NotObservable, match="record the turns"):
        calibrated(tmp_path / "bare", bare, windows, turns="yes")


# --- real devices ---


@cache
def unit(i: int) -> tuple[Block, list[Average], Calibration]:
    block = mpu9150(i)
    still = motionless(block.t, block.acc, block.gyr)
    places = [{"start_s": a.start, "end_s": a.end} for a in still]
    with TemporaryDirectory() as folder:
        write_session(Path(folder) / "unit", block, places)
        opened = Session.open(Path(folder) / "unit")
        found = fitted(opened, cross=True)
    return block, still, found


def published(i: int) -> Array:
    """The peer's matrix: triangular, behind a small turn of the gyroscopes' frame."""
    peer = mpu9150_published()["gyroscope"]
    m = np.diag([1 + peer[f"scale_percent_{x}"][i] / 100 for x in "xyz"])
    for place, name in [((0, 1), "xy"), ((0, 2), "xz"), ((1, 2), "yz")]:
        m[place] = np.deg2rad(peer[f"m_{name}_deg"][i])
    x, y, z = (np.deg2rad(peer[f"eps_{a}_deg"][i]) for a in "xyz")
    return np.asarray(m @ (np.eye(3) + [[0, -z, y], [z, 0, -x], [-y, x, 0]]))


@pytest.mark.parametrize(
    "i", [1, *(pytest.param(i, marks=pytest.mark.thorough) for i in (0, 2, 3, 4))]
)
def test_five_units_against_the_published_table(i: int) -> None:
    _, _, found = unit(i)
    assert found.method == "scalar" and set(NAMES) <= set(found.names)
    _, matrix = found.gyroscopes()
    difference = np.abs(matrix - published(i))
    # unit 1's published z scale and misalignments are off by more: see the next test
    assert difference.max() < (0.008 if i == 1 else 0.004)
    assert np.sqrt((difference**2).mean()) < (0.004 if i == 1 else 0.002)


@pytest.mark.thorough
def test_where_the_published_table_differs_ours_predicts_the_turns_better() -> None:
    block, still, found = unit(1)
    bias = found.gyroscopes()[0]
    inverse = np.linalg.inv(found.accelerometers()[1])
    f = (np.array([a.mean[:3] for a in still]) - found.accelerometers()[0]) @ inverse.T
    up = f / np.linalg.norm(f, axis=1, keepdims=True)
    misses = []
    for matrix in (found.gyroscopes()[1], published(1)):
        w = (block.gyr - bias) @ np.linalg.inv(matrix).T
        miss = []
        for k in range(len(still) - 1):
            part = (block.t >= still[k].end) & (block.t < still[k + 1].start)
            steps = Rotation.from_rotvec(w[part] / 100)
            while len(steps) > 1:  # neighbours in pairs, and a last one by itself
                pairs = steps[: len(steps) // 2 * 2]
                last = steps[len(pairs) :]
                steps = Rotation.concatenate([pairs[::2] * pairs[1::2], last])
            (attitude,) = steps
            miss.append(attitude.inv().apply(up[k]) - up[k + 1])
        misses.append(np.sqrt(np.mean(np.square(miss))))
    assert misses[0] < 0.5 * misses[1]


# --- the command line ---


@dataclass(frozen=True)
class Practised:
    """A practice session that was solved, and what was printed."""

    folder: Path
    code: int
    result: Calibration
    said: str


Practise = Callable[..., Practised]


@pytest.fixture(scope="module")
def practised(tmp_path_factory: pytest.TempPathFactory) -> Practise:
    """Solve a practice session in its own folder; each once for all tests."""

    @cache
    def made(name: str, *options: str) -> Practised:
        source = SHARED / "practice" / name
        if not source.is_dir():
            pytest.skip(f"practice sessions are not here: {source}")
        folder = tmp_path_factory.mktemp("practice") / name
        shutil.copytree(source, folder)
        said = io.StringIO()
        with redirect_stdout(said):
            code = main(["solve", str(folder), *options])
        document = json.loads((folder / "result.json").read_text())
        return Practised(folder, code, Calibration.from_json(document), said.getvalue())

    return made


def test_solve_takes_the_turns_of_a_session_along(practised: Practise) -> None:
    one = practised("p01")
    result = one.result
    assert one.code == 0
    # the practice device's gyroscopes have scale factor 1 and no cross-coupling
    matrix, sigma = result.gyroscopes()[1], result.vector("gyr_scale")[1]
    assert abs(matrix[2, 2] - 1) < 3 * sigma[2] and sigma[2] < 2e-3
    for part in result.components("gyro_cross_coupling"):
        name = f"gyro_cross_coupling.{part}"
        assert abs(result.value(name)) < 3.5 * result.uncertainty(name)
    assert "gyro scale factor z" in one.said
    assert not any("too weak" in w for w in result.warnings)


@pytest.mark.thorough
def test_solve_leaves_the_turns_out_when_told_to(practised: Practise) -> None:
    result = practised("p10", "--turns", "no").result
    assert "gyr_scale" not in result.groups
    assert any("gyr_scale is not determined" in w for w in result.warnings)


@pytest.mark.thorough
def test_compare_and_apply(
    practised: Practise, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, later = practised("p01").folder, practised("p10")
    result, second = later.result, later.folder
    assert main(["compare", str(first), str(second / "result.json"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    # the same device on two days: nothing has changed
    assert found["chance"] > 1e-3
    tilt = {"angle_offset.beta0_deg", "base_tilt.about_x_deg"}  # one by either name
    assert tilt & set(found["only_first"])
    assert main(["compare", str(first), str(second)]) == 0
    assert "all together" in capsys.readouterr().out
    out = tmp_path / "calibrated.csv"
    assert main(["apply", str(second), str(out)]) == 0
    taken = capsys.readouterr().err  # its turns are about one axis
    axes = {f"gyr_scale.{axis}" for axis in "xyz"}
    assert {name for name in axes if name in taken} == axes - {*result.names}
    rows = np.genfromtxt(out, delimiter=",", names=True)
    still = (rows["t"] > 3) & (rows["t"] < 63)
    down = np.mean(rows["ay"][still])
    assert down == pytest.approx(-result.info["conditions"]["gravity"], abs=1e-3)
    # a table says its units, and is imported without being asked about
    table = tmp_path / "calibrated.parquet"
    assert main(["apply", str(second), str(table)]) == 0
    assert main(["import", str(table), "-o", str(tmp_path / "again")]) == 0
    imported = Session.open(tmp_path / "again").block
    np.testing.assert_allclose(imported.acc[:, 1], rows["ay"], rtol=1e-12)


def test_compare_and_apply_say_what_is_wrong(
    practised: Practise, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", str(tmp_path), str(tmp_path)]) == 2
    assert "run fieldcal solve first" in capsys.readouterr().err
    broken = tmp_path / "result.json"
    broken.write_text("{")
    assert main(["compare", str(broken), str(broken)]) == 2
    assert "is no calibration" in capsys.readouterr().err
    broken.write_text("{}")
    assert main(["compare", str(broken), str(broken)]) == 2
    assert "format is missing" in capsys.readouterr().err
    folder = practised("p01").folder
    capsys.readouterr()
    assert main(["apply", str(folder), str(tmp_path / "x.xls")]) == 2
    assert ".parquet" in capsys.readouterr().err
