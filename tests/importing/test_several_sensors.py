"""Columns of several sensors without names, or with names of some of them alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import G, turned, write

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.words.other_columns import is_counter

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


def still(seed: int, up: tuple[float, float, float], rows: int = 120) -> Array:
    """Rows a, w of a device that lies still, m/s^2 and rad/s."""
    rng = np.random.default_rng(seed)
    six = np.hstack([G * np.array(up), 0.02, -0.03, 0.01])
    return six + rng.normal(0, [0.02] * 3 + [0.002] * 3, (rows, 6))


@pytest.mark.parametrize("up", [(0.02, 0.03, 1.0), (1.0, 0.02, 0.03)])
def test_what_lies_still_tells_its_accelerometers_and_no_rates(
    tmp_path: Path, up: tuple[float, float, float]
) -> None:
    # nine axes in counts, rates first, as a driver of a chip with a compass prints them
    six = still(1, up)
    field = np.random.default_rng(2).normal([-59, 254, 57], 12, (len(six), 3))
    rates = np.rad2deg(six[:, 3:]) * 131
    rows = np.round(np.hstack([rates, six[:, :3] / G * 16384, field]))
    with pytest.raises(InputError) as asked:
        read_files([write(tmp_path, rows)])
    first, second, third = str(asked.value).split("--columns ")[1:]
    assert first.startswith("gx,gy,gz,ax,ay,az,_,_,_ or")
    assert second.startswith("_,_,_,ax,ay,az,gx,gy,gz or")
    assert third.startswith("_,_,_,ax,ay,az,_,_,_ without rates, and --rate HZ")


def test_axes_that_keep_the_length_of_gravity_when_moved_are_asked_for_first(
    tmp_path: Path,
) -> None:
    # beside a flat table, any three with the axis that is up are as long as gravity
    six = still(3, (0.01, 0.02, 1.0), 160)
    six[-14:] += np.random.default_rng(4).normal(0, [2] * 3 + [3] * 3, (14, 6))
    beside = np.tile([97.5, 33.8], (len(six), 1)) + 0.01 * six[:, :2]
    t = 50.0 + 0.05 * np.arange(len(six))
    path = write(tmp_path, np.column_stack([t, six, six[:, 3:5] ** 2, beside]))
    with pytest.raises(
        InputError, match=r"Add --columns t,ax,ay,az,gx,gy,gz,_\.\.\. or"
    ):
        read_files([path])


def test_steps_of_a_power_of_two_in_one_tell_a_device_with_large_biases(
    tmp_path: Path,
) -> None:
    # |a| is 1.1 upside down, as a bias of a tenth of g has it
    six = still(5, (0, 0, -1))
    acc = np.round((six[:, :3] / G - [0, 0, 0.1]) * 8192) / 8192
    rows = np.hstack([acc, np.round(np.rad2deg(six[:, 3:]) * 131) / 131])
    path = tmp_path / "log.csv"
    path.write_text("\n".join(",".join(map(repr, row)) for row in rows.tolist()))
    found = open_recording(path, ReadOptions(rate_hz=20.0))
    (stream,) = found.streams()
    block = next(iter(found.alone(stream.name).blocks(stream.name)))
    assert found.wanted.columns == ("ax", "ay", "az", "gx", "gy", "gz")
    np.testing.assert_allclose(block.acc, acc[: len(block)])


def test_devices_that_have_only_numbers_are_told_by_what_they_measure(
    tmp_path: Path,
) -> None:
    ways = [(1.0, 0.0, 0.0), (0.0, 0.6, 0.8), (0.0, 0.0, -1.0)]
    each = [still(seed, up, 60) for seed, up in enumerate(ways)]
    rows = np.stack(each, axis=1).reshape(-1, 6)
    number = np.tile([0, 2, 5], 60)[:, None]
    path = write(tmp_path, np.hstack([number, rows]))
    said = ReadOptions(("_", "ax", "ay", "az", "gx", "gy", "gz"), 20.0)
    found = open_recording(path, said)
    assert [stream.name for stream in found.streams()] == ["0", "2", "5"]
    for name, six in zip("025", each, strict=True):
        block = next(iter(found.alone(name).blocks(name)))
        np.testing.assert_allclose(block.six, six, atol=1e-6)
    # a counter that begins again and again is of one device
    counted = np.hstack([np.arange(180)[:, None] % 3, still(7, ways[1], 180)])
    path = write(tmp_path, counted, "counted.csv")
    assert len(open_recording(path, said).streams()) == 1


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
    path = write(tmp_path, np.hstack([T, A, A + 0.1, W]), heading=f"{head},u_x,u_y,u_z")
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


def test_what_rates_ought_to_be_is_no_accelerometer(tmp_path: Path) -> None:
    """As a rate table's log has it beside them; without a turn of gravity no unit."""
    speed = np.concatenate([np.zeros(100), np.full(300, 2.0), np.zeros(100)])
    noise = np.random.default_rng(3).normal(0, 0.002, (len(speed), 3))
    rates = np.column_stack([0 * speed, 0 * speed, 1.01 * speed]) + 0.01 + noise
    ought = np.column_stack([0 * speed, 0 * speed, speed])
    t = np.arange(len(speed)) / 100
    head = "run,t,gx,gy,gz,ref_x,ref_y,ref_z"
    table = np.column_stack([np.ones_like(t), t, rates, ought])
    path = write(tmp_path, table, heading=head)
    found = open_recording(path, ReadOptions(gyr_unit="rad/s"))
    (stream,) = found.streams()
    block = next(iter(found.alone(stream.name).blocks(stream.name)))
    np.testing.assert_allclose(block.gyr, rates[: len(block)])
    assert np.isnan(block.acc).all()
