"""Units that nobody says: the right session, or one question; never a wrong unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from joined import read_files
from laid_about import COLUMNS, GYR, G, turned, write

from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.importing.units.gravity_size import estimate_gravity
from fieldcal.session.folder import Session

ACC = {"m/s^2": 1.0, "g": 1 / G, "mg": 1000 / G} | {
    f"{lsb} in g": lsb / G for lsb in (16384, 8192, 4096, 2048)
}
TIME = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def option(kind: str, unit: str) -> str:
    """What the user would add for it."""
    lsb, _, bare = unit.rpartition(" in ")
    return f"--{kind}-unit {bare}" + (f" --{kind}-lsb {float(lsb):g}" if lsb else "")


@settings(
    max_examples=4,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    seed=st.integers(0, 2**20),
    rate=st.sampled_from([20.0, 50.0, 100.0, 200.0]),
    acc=st.sampled_from(sorted(ACC)),
    gyr=st.sampled_from(sorted(GYR)),
    time=st.sampled_from(sorted(TIME)),
    zero=st.sampled_from([0.0, 32768.0]),
)
def test_an_awkward_log_is_read_right_or_asked_about(
    tmp_path_factory: pytest.TempPathFactory,
    capsys: pytest.CaptureFixture[str],
    seed: int,
    rate: float,
    acc: str,
    gyr: str,
    time: str,
    zero: float,
) -> None:
    folder, truth = tmp_path_factory.mktemp("log"), turned(seed, rate)
    zero *= "in" in acc
    log = np.column_stack(
        [truth[:, 0] * TIME[time], truth[:, 1:4] * ACC[acc], truth[:, 4:] * GYR[gyr]]
    )
    log[:, 1:4] = np.round(log[:, 1:4]) + zero if "in" in acc else log[:, 1:4]
    log[:, 4:] = np.round(log[:, 4:]) if "in" in gyr else log[:, 4:]
    path = write(folder, log)
    call = ["import", str(path), "--columns", COLUMNS, "-o", str(folder / "out")]
    code = main(call)
    said = capsys.readouterr().err
    if code == 2:
        assert said.count("\n") == 1 and ": add --" in said
        assert option("acc", acc) in said or option("gyr", gyr) in said
        return
    assert code == 0
    session = Session.open(folder / "out")
    block, guessed = session.block, session.about.raw.get("guessed", {})
    np.testing.assert_allclose(block.t, truth[:, 0], atol=1e-5)
    bias = session.nominal["acc_bias"]
    np.testing.assert_allclose(block.acc - bias, truth[:, 1:4], atol=0.5)
    scale = np.polyfit(truth[:, 4:].ravel(), block.gyr.ravel(), 1)[0]
    assert scale == pytest.approx(1, abs=0.01)
    for what, unit, usual in (
        ("time", time, "s"), ("acceleration", acc, "m/s^2"),
        ("angular_rate", gyr, "rad/s"),
    ):  # fmt: skip
        assert (what in guessed) == (unit != usual)
        assert (f"{what.replace('_', ' ')} taken as" in said) == (unit != usual)
    assert ("acc_bias" in guessed) == bool(zero)


def test_a_guess_is_shown_until_it_is_confirmed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(1, 20.0)[:330]  # the first four sides
    rows[:, 1:4] /= G
    folder = tmp_path / "out"
    path = write(tmp_path, rows)
    assert main(["import", str(path), "--columns", COLUMNS, "-o", str(folder)]) == 0
    for command in ("solve", "diagnose"):
        main([command, str(folder)])
        said = " ".join("".join(capsys.readouterr()).split())
        assert "acceleration was taken as g: |a| at rest is" in said
    about = folder / "session.toml"
    text = about.read_text()
    about.write_text(text.replace("acceleration =", "columns ="))
    said = " ".join(Session.open(folder).warnings)
    assert "columns were taken as g: |a|" in said
    kept = [line for line in text.split("\n") if not line.startswith("acceleration =")]
    assert len(kept) == text.count("\n")
    about.write_text("\n".join(kept))
    assert "taken as" not in " ".join(Session.open(folder).warnings)


def test_what_the_user_says_is_taken(tmp_path: Path) -> None:
    rows = turned(2, 50.0)
    path, out = write(tmp_path, rows), tmp_path / "out"
    said = ["--acc-unit", "g", "--gyr-unit", "deg/s", "--time-unit", "ms"]
    call = ["import", str(path), "--columns", COLUMNS, "-o", str(out), *said]
    assert main(call) == 0
    session = Session.open(out)
    assert "guessed" not in session.about.raw
    np.testing.assert_allclose(session.block.acc, rows[:, 1:4] * G, rtol=1e-6)
    np.testing.assert_allclose(session.block.t, rows[:, 0] / 1000, atol=1e-9)


@pytest.mark.parametrize(
    ("column", "factor", "asks"),
    [(slice(1, 4), 700.0, "--acc-unit g --acc-lsb"),
     (slice(4, 7), 9.0, "--gyr-unit deg/s --gyr-lsb")],
)  # fmt: skip
def test_what_is_no_usual_unit_is_asked(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    column: slice,
    factor: float,
    asks: str,
) -> None:
    rows = turned(3, 50.0)
    rows[:, column] *= factor
    path, out = write(tmp_path, rows), tmp_path / "out"
    assert main(["import", str(path), "--columns", COLUMNS, "-o", str(out)]) == 2
    said = capsys.readouterr().err
    assert asks in said and said.count("\n") == 1 and not out.exists()


@given(
    st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3),
    st.floats(1e-2, 1e5),
    st.integers(0, 2**20),
)
def test_the_sphere_is_found_wherever_it_lies(
    center: list[float], radius: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    sides = rng.normal(size=(12, 3))
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    points = radius * (np.repeat(sides, 64, axis=0) + center)
    found = estimate_gravity(points * (1 + 1e-6 * rng.normal(size=points.shape)))
    assert found is not None
    if found.round:
        assert found.size == pytest.approx(radius, rel=0.02)
        np.testing.assert_allclose(found.offset / radius, center, rtol=1e-3, atol=0.02)


@pytest.mark.parametrize("points", [np.ones((200, 3)), np.eye(3).repeat(70, axis=0)])
def test_few_directions_make_no_sphere(points: Array) -> None:
    noise = 1e-3 * np.random.default_rng(7).normal(size=points.shape)
    found = estimate_gravity(points + noise)
    assert found is not None and not found.round
    assert found.size == pytest.approx(np.median(np.linalg.norm(points, axis=1)), 0.01)


@pytest.mark.parametrize("lsb", [256.0, 2048.0])
def test_zeros_in_the_middle_of_16_bits_are_no_gravity(
    tmp_path: Path, lsb: float, capsys: pytest.CaptureFixture[str]
) -> None:
    # of three sides no sphere tells where zero lies
    rows = turned(8, 50.0, 3.0)[:600]
    rows[:, 1:4] = np.round(rows[:, 1:4] * lsb / G) + 33000
    path = write(tmp_path, rows, heading=COLUMNS)
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    assert "no usual unit" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("lsb", "reversed_axis"),
    [
        (256, False),
        (2048, True),
        (16384, False),
        pytest.param(256, True, marks=pytest.mark.thorough),
        pytest.param(2048, False, marks=pytest.mark.thorough),
        pytest.param(16384, True, marks=pytest.mark.thorough),
    ],
)
def test_a_zero_elsewhere_is_asked_for_and_taken(
    tmp_path: Path,
    lsb: int,
    reversed_axis: bool,
    capsys: pytest.CaptureFixture[str],
) -> None:
    rng = np.random.default_rng(lsb)
    force = np.array([1.2, -3.4, 9.1]) + rng.normal(0, 0.02, (500, 3))
    zero = np.array([33000.0, 32900.0, 33100.0])
    signs = np.array([1, 1, -1 if reversed_axis else 1])
    rows = np.zeros((500, 7))
    rows[:, 0] = np.arange(500) / 50
    rows[:, 1:4] = np.round(force * signs * lsb / G + zero)
    path, out = write(tmp_path, rows), tmp_path / "out"
    names = COLUMNS.replace("az", "-az") if reversed_axis else COLUMNS
    call = ["import", str(path), "-o", str(out), "--columns", names]
    call += ["--gyr-unit", "rad/s"]
    where = ["--acc-zero", "33000,32900,33100"]
    size = ["--acc-unit", "g", "--acc-lsb", str(lsb)]
    for said in ([], size):
        assert main(call + said) == 2
        asked = capsys.readouterr().err
        assert "--acc-zero X,Y,Z" in asked and asked.count("\n") == 1
        assert not out.exists()
    # where zero lies tells the size as well
    for n, said in enumerate((where, where + size)):
        folder = tmp_path / f"out{n}"
        assert main([*call, "-o", str(folder), *said]) == 0
        session = Session.open(folder)
        found = session.block.acc - session.nominal["acc_bias"]
        np.testing.assert_allclose(found, force, atol=1.01 * G / lsb)
        assert "acc_bias" not in session.about.raw.get("guessed", {})


def test_a_zero_that_is_said_to_be_at_0_is_believed(tmp_path: Path) -> None:
    rows = np.tile([0.0, 40.0, 60.0, 2048.0 * 1.5, 0, 0, 0], (500, 1))
    rows[:, 0] = np.arange(500) / 50
    rows[:, 1:4] += np.random.default_rng(1).integers(-3, 4, (500, 3))
    path, out = write(tmp_path, rows), tmp_path / "out"
    call = ["import", str(path), "-o", str(out), "--columns", COLUMNS]
    call += ["--gyr-unit", "rad/s", "--acc-unit", "g", "--acc-lsb", "2048"]
    assert main(call) == 2
    assert main([*call, "--acc-zero", "0"]) == 0
    assert Session.open(out).nominal["acc_bias"] == pytest.approx(np.zeros(3))


@pytest.mark.parametrize("text", ["", "1,2", "x", "nan,0,0", "1,2,3,4"])
def test_a_zero_that_is_no_zero_is_refused(
    tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, turned(1, 50.0))
    assert main(["import", str(path), f"--acc-zero={text}"]) == 2
    assert "write one number or three" in capsys.readouterr().err


def test_steps_of_a_power_of_two_are_those_of_g(tmp_path: Path) -> None:
    """An MPU-6050 may be 0.15 g off on z; its registers are divided by 4096."""
    rng = np.random.default_rng(4)
    counts = np.round([400.0, 70.0, 3420.0] + rng.normal(0, 30, (300, 3)))
    rows = np.column_stack([0.02 * np.arange(300), counts / 4096])
    path = tmp_path / "log.csv"
    for divisor, taken in ((4096, True), (4000, False)):
        rows[:, 1:] = counts / divisor
        lines = [",".join(f"{x:.12g}" for x in row) for row in rows]
        path.write_text("\n".join(["t,ax,ay,az", *lines]) + "\n")
        if taken:
            block, _ = read_files([path])
            np.testing.assert_allclose(block.acc, counts / 4096 * G0)
        else:
            with pytest.raises(InputError, match="gravity in no usual unit"):
                read_files([path])
