"""Several files of one IMU become one session: one after another, or side by side."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from laid_about import G, turned, write

from fieldcal.acceptance.assessment import start_time
from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.fleet.outcome import SessionTask
from fieldcal.session.folder import Session

FACES = [*np.eye(3), *-np.eye(3)]
BIAS, RATE = np.array([0.38, -0.13, 0.44]), np.array([0.028, 0.027, 0.011])
SCALE = np.array([1.002, 1.006, 1.018])
HEADING = "t (s),ax (m/s^2),ay (m/s^2),az (m/s^2),gx (rad/s),gy (rad/s),gz (rad/s)"
HZ, ROWS = 50.0, 250


def face(number: int, starts: float, seed: int = 3) -> Array:
    """Rows t, a, w of one side of a device whose clock begins so, SI."""
    rng = np.random.default_rng([seed, number])
    t = starts + np.arange(ROWS) / HZ
    acc = SCALE * G * FACES[number] + BIAS + rng.normal(0, 0.01, (ROWS, 3))
    return np.column_stack([t, acc, RATE + rng.normal(0, 2e-3, (ROWS, 3))])


def faces(folder: Path, apart: float) -> list[str]:
    """A file for each side; clocks that start anew, or so many seconds later each."""
    return [
        str(write(folder, face(i, 0.4 + apart * i), f"side_{i}.csv", HEADING))
        for i in range(6)
    ]


def brought(folder: Path, files: list[str]) -> Session:
    out = folder / "out"
    call = ["import", *files, "--in-order", "-o", str(out), "--gravity", str(G)]
    assert main(call) == 0
    return Session.open(out)


def stamped(path: Path, rows: Array, columns: list[int]) -> Path:
    """A file of some columns with stamps to the microsecond."""
    names = [HEADING.split(",")[i] for i in columns]
    lines = [",".join(f"{row[i]:.6f}" for i in columns) for row in rows]
    path.write_text("\n".join([",".join(names), *lines]) + "\n")
    return path


@pytest.mark.parametrize(
    ("how", "starts", "time"),
    [
        ("--in-order", 1714564800.0, "2024-05-01T12:00:00+00:00"),
        ("--join", 1714564800.0, "2024-05-01T12:00:00+00:00"),
        pytest.param(
            "", 1714564800.0, "2024-05-01T12:00:00+00:00", marks=pytest.mark.thorough
        ),
        ("--in-order", 0.4, None),
        pytest.param("--join", 0.4, None, marks=pytest.mark.thorough),
        pytest.param("", 0.4, None, marks=pytest.mark.thorough),
        pytest.param("--in-order", 3.9e9, None, marks=pytest.mark.thorough),
        pytest.param("--join", 3.9e9, None, marks=pytest.mark.thorough),
        pytest.param("", 3.9e9, None, marks=pytest.mark.thorough),
    ],
)
def test_a_recording_is_of_the_time_that_its_stamps_tell(
    tmp_path: Path, how: str, starts: float, time: str | None
) -> None:
    rows = [face(i, starts + 9.0 * i) for i in range(2)]
    every = list(range(7))
    parts = {
        "--in-order": [(rows[0], every), (rows[1], every)],
        "--join": [(rows[0], [0, 1, 2, 3]), (rows[0], [0, 4, 5, 6])],
        "": [(np.concatenate(rows), every)],
    }[how]
    files = [str(stamped(tmp_path / f"{i}.csv", *p)) for i, p in enumerate(parts)]
    out = tmp_path / "out"
    call = ["import", *files, *filter(None, [how]), "-o", str(out), "--gravity", str(G)]
    assert main(call) == 0
    assert start_time(list(Session.open(out).marks())) == time
    assert SessionTask()(str(out)).taken_at == time


def test_a_file_for_each_position_is_one_session(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = brought(tmp_path, faces(tmp_path, 0.0))
    assert len(made.block) == 6 * ROWS and len(made.about.positions) == 6
    assert (np.diff(made.block.t) > 0).all()
    assert "that of the files as they are named" in made.about.raw["guessed"]["order"]
    capsys.readouterr()
    assert main(["solve", str(tmp_path / "out"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    for name, truth in (("acc_bias", BIAS), ("acc_scale", SCALE), ("gyr_bias", RATE)):
        off = np.array(found["parameters"][name]["value"]) - truth
        assert (np.abs(off) < 4 * np.array(found["parameters"][name]["sigma"])).all()
    # how the device came from one face to the next was not recorded
    assert main(["diagnose", str(tmp_path / "out"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["effects"] == []


def test_times_that_go_on_from_file_to_file_are_kept(tmp_path: Path) -> None:
    made = brought(tmp_path, faces(tmp_path, 25.0))
    every = np.concatenate([face(i, 0.4 + 25.0 * i)[:, 0] for i in range(6)])
    np.testing.assert_allclose(made.block.t, every - 0.4, atol=1e-9)
    assert "order" not in made.about.raw.get("guessed", {})


def test_files_of_one_rest_each_are_asked_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files, out = faces(tmp_path, 0.0), str(tmp_path / "apart")
    assert main(["import", *files, "-o", out]) == 0
    assert "import them again with --in-order" in capsys.readouterr().err
    assert main(["import", *files[:1] * 2, "-o", str(tmp_path / "same")]) == 2
    # devices that lie on a shelf side by side are no positions of one
    flat = [write(tmp_path, face(0, 0.0, s), f"imu_{s}.csv", HEADING) for s in range(3)]
    assert main(["import", *map(str, flat), "-o", str(tmp_path / "flat")]) == 0
    assert "--in-order" not in capsys.readouterr().err


def test_files_of_two_sensors_are_pointed_to_each_other(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(3, 50.0)
    acc = write(tmp_path, rows[:, :4], "acc.csv", "t,ax,ay,az")
    gyr = write(tmp_path, rows[:, [0, 4, 5, 6]], "gyr.csv", "t,gx,gy,gz")
    both, out = [str(acc), str(gyr)], str(tmp_path / "apart")
    assert main(["import", *both, "-o", out]) == 0
    assert "import them again with --join" in capsys.readouterr().err
    assert main(["import", *both, "--join", "-o", str(tmp_path / "one")]) == 0
    assert "--join" not in capsys.readouterr().err
    np.testing.assert_allclose(Session.open(tmp_path / "one").block.six, rows[:, 1:])


def test_a_bad_row_is_named_by_its_own_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = faces(tmp_path, 0.0)
    lines = Path(files[2]).read_text().splitlines()
    lines[100] = "0.1," + lines[100].split(",", 1)[1]
    Path(files[2]).write_text("\n".join(lines))
    call = ["import", *files, "--in-order", "-o", str(tmp_path / "out")]
    assert main(call) == 2
    assert "side_2.csv, line 101" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert main([*call, "--join"]) == 2
    assert "one time after another" in capsys.readouterr().err


def test_channels_side_by_side_have_the_same_times(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = face(0, 0.0)
    first = write(tmp_path, whole[:, :4], "acc.csv", HEADING.split(",gx")[0])
    names = "t (s),gx (rad/s),gy (rad/s),gz (rad/s)"
    second = write(tmp_path, whole[:, [0, 4, 5, 6]], "gyr.csv", names)
    call = ["import", str(first), str(second), "--join", "-o"]
    assert main([*call, str(tmp_path / "out")]) == 0
    np.testing.assert_allclose(Session.open(tmp_path / "out").block.six, whole[:, 1:])
    write(tmp_path, whole[:-9, [0, 4, 5, 6]], "gyr.csv", names)
    assert main([*call, str(tmp_path / "short")]) == 2
    assert "the other files have ended" in capsys.readouterr().err
    late = whole[:, [0, 4, 5, 6]] + [0.01, 0, 0, 0]
    write(tmp_path, late, "gyr.csv", names)
    assert main([*call, str(tmp_path / "late")]) == 0
    assert "10 ms apart at most" in capsys.readouterr().err
    write(tmp_path, whole, "gyr.csv", HEADING)
    assert main([*call, str(tmp_path / "whole")]) == 2
    said = capsys.readouterr().err
    assert "holds ax, and so does acc.csv" in said and "--in-order" in said


@pytest.mark.parametrize(
    ("names", "files", "more"),
    [("time,seconds_elapsed,z,y,x", ("TotalAcceleration.csv", "Gyroscope.csv"), []),
     ("", ("acc_exp1_user1.txt", "gyro_exp1_user1.txt"), ["--rate", "50"])],
)  # fmt: skip
def test_the_name_of_a_file_says_whose_its_axes_are(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    names: str,
    files: tuple[str, str],
    more: list[str],
) -> None:
    rows = turned(3, 50.0)
    t, paths = rows[:, 0], []
    for name, three in zip(files, (rows[:, 1:4], rows[:, 4:]), strict=True):
        columns = [1.7e18 + t * 1e9, t, *three.T[::-1]] if names else [*three.T]
        paths.append(write(tmp_path, np.column_stack(columns), name, names))
    out = tmp_path / "out"
    assert main(["import", *map(str, paths), "--join", *more, "-o", str(out)]) == 0
    said = capsys.readouterr().err
    assert "axes are those of the gyroscopes, as the file is called" in said
    block = Session.open(out).block
    np.testing.assert_allclose(block.acc, rows[:, 1:4], atol=1e-6)
    np.testing.assert_allclose(block.gyr, rows[:, 4:], atol=1e-6)


@pytest.mark.parametrize("unit", ["s", "ms"])
def test_accelerometers_and_gyroscopes_may_have_times_of_their_own(
    unit: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The gyroscopes begin later, come twice as often, and in another unit of time."""
    t = 1.7e9 + np.arange(600) / HZ
    acc = np.column_stack([t, np.sin(t), np.cos(t), 9 + 0 * t])
    late = 1.7e9 + 1.003 + np.arange(1100) / (2 * HZ)
    scale = {"s": 1.0, "ms": 1e3}[unit]
    gyr = np.column_stack([late * scale, np.sin(3 * late), late - 1.7e9, 0 * late])
    lines = [",".join(f"{x:.7f}" for x in row) for row in acc]
    first, second = tmp_path / "acc.csv", tmp_path / "gyr.csv"
    names = "x-axis (m/s^2),y-axis (m/s^2),z-axis (m/s^2)"
    first.write_text("\n".join(["time (s)," + names, *lines]))
    lines = [",".join(f"{x:.7f}" for x in row) for row in gyr]
    names = "x-axis (rad/s),y-axis (rad/s),z-axis (rad/s)"
    second.write_text("\n".join(["time," + names, *lines]))
    for order in ([first, second], [second, first]):
        out = tmp_path / order[0].stem
        # its rates say when they were taken, and turn nothing
        call = ["import", *map(str, order), "--join", "--gyr-unit", "rad/s"]
        assert main([*call, "-o", str(out)]) == 0
        assert "times of their own" in capsys.readouterr().err
        block = Session.open(out).block
        np.testing.assert_allclose(block.t, t - t[0], atol=1e-6)
        np.testing.assert_allclose(block.acc, acc[:, 1:], atol=1e-6)
        # half a period of the accelerometers at most is between the two of a pair
        apart = block.gyr[:, 1] - block.t
        assert np.isnan(apart[:49]).all() and np.isfinite(apart[52:598]).all()
        assert np.nanmax(np.abs(apart)) <= 0.5 / HZ
        np.testing.assert_allclose(block.gyr[60:90, 0], np.sin(3 * (1.7e9 + block.gyr[
            60:90, 1])), atol=1e-5)  # fmt: skip


def test_a_part_of_a_file_without_rows_is_not_its_end(tmp_path: Path) -> None:
    """Accelerometers and gyroscopes in files of their own, in unlike pieces."""
    import pyarrow as pa

    rows, files = face(0, 0.4), []
    parts = {"acc": ((0, 1, 2, 3), (150, 150)), "gyr": ((0, 4, 5, 6), ())}
    for name, (columns, cuts) in parts.items():
        names = [HEADING.split(",")[i] for i in columns]
        files.append(str(tmp_path / f"{name}.feather"))
        schema = pa.schema([(n, pa.float64()) for n in names])
        with pa.ipc.new_file(files[-1], schema) as written:
            for part in np.split(rows, cuts):
                columns_of_part = [part[:, i] for i in columns]
                written.write_batch(pa.record_batch(columns_of_part, schema=schema))
    out = tmp_path / "out"
    assert main(["import", *files, "--join", "-o", str(out), "--gravity", str(G)]) == 0
    np.testing.assert_allclose(Session.open(out).block.six, rows[:, 1:])


def test_files_in_different_units_are_not_one_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bare = "t,ax,ay,az,gx,gy,gz"
    rows = [face(i, 0.4 + 20.0 * i) for i in range(6)]
    rows[2][:, 1:4] /= G
    files = [
        str(write(tmp_path, one, f"f_{i}.csv", bare)) for i, one in enumerate(rows)
    ]
    call = ["import", *files, "--in-order", "-o", str(tmp_path / "out")]
    assert main(call) == 2
    said = capsys.readouterr().err
    assert "in f_2.csv: their units differ" in said
    named = bare.replace("ax,ay,az", "ax (g),ay (g),az (g)")
    write(tmp_path, rows[2], "f_2.csv", named)
    stated = bare.replace("ax,ay,az", "ax (m/s^2),ay (m/s^2),az (m/s^2)")
    for i in (0, 1, 3, 4, 5):
        write(tmp_path, rows[i], f"f_{i}.csv", stated)
    assert main(call) == 0
    length = np.linalg.norm(Session.open(tmp_path / "out").block.acc, axis=1)
    assert 9.0 < length.min() and length.max() < 10.8


def test_a_recording_that_is_named_twice_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its samples would count twice; the copy may have another name and clock."""
    first, other = faces(tmp_path, 0.0)[:2]
    copy = write(tmp_path, face(0, 77.0), "copy.csv", HEADING)
    out = tmp_path / "out"
    call = ["import", first, other, str(copy), "--in-order", "-o", str(out)]
    assert main(call) == 2
    said = capsys.readouterr().err
    assert "copy.csv: holds the samples of side_0.csv: name each recording once" in said
    assert not out.exists()


def overlapping(
    folder: Path, first: int, begins: float = 3600.0
) -> tuple[Array, list[str]]:
    """Rows of one recording, and two files of it, the second from row `first` on."""
    rows = turned(3, HZ)
    rows = np.column_stack([begins + np.arange(len(rows)) / HZ, rows[:, 1:]])
    parts = {"a.csv": rows[:400], "b.csv": rows[first:]}
    columns = list(range(7))
    return rows, [str(stamped(folder / n, r, columns)) for n, r in parts.items()]


@pytest.mark.parametrize("begins", [0.0, 3600.0, 1714564800.0])
def test_samples_that_two_files_hold_count_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], begins: float
) -> None:
    rows, files = overlapping(tmp_path, 150, begins)
    out = tmp_path / "out"
    assert main(["import", *files, "--in-order", "-o", str(out)]) == 0
    block = Session.open(out).block
    assert len(block) == len(rows)
    np.testing.assert_allclose(block.t, rows[:, 0] - begins, atol=1e-6)
    np.testing.assert_allclose(block.six, rows[:, 1:], atol=1e-6)
    said = capsys.readouterr().err
    assert (
        "b.csv: begins 4.98 s before a.csv ends, and 250 samples are the same" in said
    )
    assert "times start anew" not in said


def test_files_of_one_time_with_other_samples_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows, files = overlapping(tmp_path, 250)
    rows[300:, 3] += 1e-3
    write(tmp_path, rows[250:], "b.csv", HEADING)
    out = tmp_path / "out"
    assert main(["import", *files, "--in-order", "-o", str(out)]) == 2
    said = capsys.readouterr().err
    assert "b.csv: begins 2.98 s before a.csv ends, and their samples of that" in said
    assert "cut what overlaps from one of them; or, if the clock began anew" in said
    assert not out.exists()


@pytest.mark.parametrize(
    ("first", "begins", "refused"),
    [(250, 3600.0, True), (250, 1714564800.0, True), (420, 1714564800.0, True),
     (420, 3600.0, False)],
)  # fmt: skip
def test_files_that_are_named_in_the_wrong_order(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    first: int,
    begins: float,
    refused: bool,
) -> None:
    """A clock without a date that is behind has begun anew, unless samples tell."""
    _, files = overlapping(tmp_path, first, begins)
    call = ["import", *files[::-1], "--in-order", "-o", str(tmp_path / "out")]
    assert main(call) == (2 if refused else 0)
    said = capsys.readouterr().err
    away = f"a.csv: begins {first / HZ:.2f} s before b.csv, which is named before"
    assert (away in said) == refused and ("times start anew" in said) != refused


def test_a_bad_row_behind_an_overlap_is_named_by_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, files = overlapping(tmp_path, 250)
    lines = Path(files[1]).read_text().splitlines()
    lines[200] = "3600.1," + lines[200].split(",", 1)[1]
    Path(files[1]).write_text("\n".join(lines))
    assert main(["import", *files, "--in-order", "-o", str(tmp_path / "out")]) == 2
    assert "b.csv, line 201" in capsys.readouterr().err


def test_a_clock_that_began_anew_somewhat_later_is_no_overlap(tmp_path: Path) -> None:
    """Each file counts from its own start of the device, which takes its time."""
    files = [
        str(write(tmp_path, face(i, 0.4 + 0.2 * i), f"side_{i}.csv", HEADING))
        for i in range(6)
    ]
    made = brought(tmp_path, files)
    assert len(made.block) == 6 * ROWS and (np.diff(made.block.t) > 0).all()


def test_files_without_noise_may_begin_alike(tmp_path: Path) -> None:
    """A simulator holds the first position again at the end, without any noise."""
    rows = np.concatenate([face(i, 0.0)[:1] for i in (0, 1, 2, 0)]).repeat(ROWS, axis=0)
    rows[:, 0] = np.tile(np.arange(ROWS) / HZ, 4)
    files = [
        str(write(tmp_path, part, f"{i}.csv", HEADING))
        for i, part in enumerate(np.split(rows, 4))
    ]
    assert len(brought(tmp_path, files).block) == len(rows)


def test_files_of_one_sensor_each_are_not_one_after_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows, out = face(0, 0.4), tmp_path / "out"
    files = [
        str(stamped(tmp_path / f"{name}.csv", rows, [0, *columns]))
        for name, columns in (("gyr", [4, 5, 6]), ("acc", [1, 2, 3]))
    ]
    assert main(["import", *files, "--in-order", "-o", str(out)]) == 2
    said = capsys.readouterr().err
    assert "acc.csv: holds accelerometers alone, and gyr.csv gyroscopes alone" in said
    assert "with --join" in said and not out.exists()
