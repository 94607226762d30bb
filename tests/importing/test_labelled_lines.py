"""What a line with labels is called says its sensor, or which device wrote it."""

import warnings
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.samples import Array, Block, concat
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.text.label_spellings import plain_labels
from fieldcal.importing.text.labels import labelled_values

RATE, ROWS = 20.0, 80
TURN = 0.02 * np.arange(ROWS)
FORCE = np.round(9.8 * np.column_stack([np.sin(TURN), 0 * TURN, np.cos(TURN)]), 3)
RATES = np.round(0.01 * np.column_stack([TURN, -TURN, 1 + TURN]), 4)


def axes(values: Array, names: str = "x y z") -> str:
    """Values with their labels, as a program prints them."""
    return " ".join(f"{n}: {v:.4f}" for n, v in zip(names.split(), values, strict=True))


def read(folder: Path, lines: list[str], timed: bool) -> dict[str, Block]:
    path = folder / "log.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    recording = open_recording(path, ReadOptions(rate_hz=None if timed else RATE))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return {
            stream.name: concat(list(recording.alone(stream.name).blocks(stream.name)))
            for stream in recording.streams()
        }


@pytest.mark.parametrize("words", ["A G M", "acc gyro mag", "Accel Gyro Magnetometer"])
@pytest.mark.parametrize("late", [0.0, 0.004])
def test_lines_of_a_sensor_each_with_its_time_are_of_one_row(
    tmp_path: Path, words: str, late: float
) -> None:
    # as a row of their own each, rates and fields would be forces
    acc, gyr, mag = words.split()
    lines = [
        f"{word}: t: {i / RATE + shift:.4f} {axes(values)}"
        for i in range(ROWS)
        for word, values, shift in (
            (acc, FORCE[i], 0.0),
            (gyr, RATES[i], late),
            (mag, np.array([20.0, -30, 40]), 2 * late),
        )
    ]
    (block,) = read(tmp_path, lines, True).values()
    np.testing.assert_allclose(block.t, np.arange(ROWS) / RATE, atol=1e-9)
    np.testing.assert_array_equal(block.acc, FORCE)
    np.testing.assert_array_equal(block.gyr, RATES)


FLIPPED = FORCE[:, ::-1] * [1, 1, -1]


@pytest.mark.parametrize(
    "form",
    [
        "{word}: t: {t:.3f} ax: {x} ay: {y} az: {z}",
        "{word}: ax: {x} ay: {y} az: {z}",
        "{word} ax: {x} ay: {y} az: {z}",
        "[{word}] ax: {x} ay: {y} az: {z}",
        "{word} - ax: {x} ay: {y} az: {z}",
        "{word},{t:.3f},{x},{y},{z}",
    ],
)
@pytest.mark.parametrize(
    "words", [("left", "right"), ("imu1", "imu2"), ("MPU 1", "MPU 2")]
)
def test_what_lines_of_the_same_labels_are_called_tells_devices_apart(
    tmp_path: Path, words: tuple[str, str], form: str
) -> None:
    forces = dict(zip(words, (FORCE, FLIPPED), strict=True))
    lines = [
        form.format(word=word, t=i / RATE, **dict(zip("xyz", force[i], strict=True)))
        for i in range(ROWS)
        for word, force in forces.items()
    ]
    head = ["imu,t,ax,ay,az"] if "," in form else []
    got = read(tmp_path, head + lines, "{t" in form)
    assert [*got] == [*words]
    for word, force in forces.items():
        np.testing.assert_allclose(got[word].t, np.arange(ROWS) / RATE, atol=1e-9)
        np.testing.assert_array_equal(got[word].acc, force)


def test_the_same_labels_twice_in_a_line_are_of_what_stands_before(
    tmp_path: Path,
) -> None:
    lines = [
        f"left {axes(a, 'ax ay az')} right {axes(b, 'ax ay az')}"
        for a, b in zip(FORCE, FLIPPED, strict=True)
    ]
    got = read(tmp_path, lines, False)
    assert [*got] == ["left", "right"]
    np.testing.assert_array_equal(got["left"].acc, FORCE)
    np.testing.assert_array_equal(got["right"].acc, FLIPPED)


def test_a_number_in_what_a_line_is_called_may_count_lines(tmp_path: Path) -> None:
    lines = [f"Sample {i}: {axes(FORCE[i], 'ax ay az')}" for i in range(ROWS)]
    (block,) = read(tmp_path, lines, False).values()
    np.testing.assert_array_equal(block.acc, FORCE)


@pytest.mark.parametrize(
    "warm",
    ["temperature: 31.047 degrees Celsius", "Temperature is 31.047 degrees C",
     "Temperature 31.047 deg C"],
)  # fmt: skip
def test_a_temperature_in_a_line_of_its_own_is_read(tmp_path: Path, warm: str) -> None:
    """As the sketch of the Arduino Playground and others print it."""
    lines = [
        text
        for a, w in zip(FORCE, RATES, strict=True)
        for text in (
            "MPU-6050", warm, "accel x,y,z: {:.3f}, {:.3f}, {:.3f}".format(*a),
            "gyro x,y,z : {:.4f}, {:.4f}, {:.4f}, ".format(*w),
        )
    ]  # fmt: skip
    (block,) = read(tmp_path, lines, timed=False).values()
    np.testing.assert_allclose(block.temperature, 31.047)
    np.testing.assert_allclose(block.acc, FORCE)


@pytest.mark.parametrize(
    "form",
    [
        "LSM6DSL [acc/mg]:  {:.3f}, {:.3f}, {:.3f}\n"
        "LSM6DSL [gyro/mdps]: {:.3f}, {:.3f}, {:.3f}",
        "Accel data [milli g] - X: {:.3f}   Y: {:.3f}   Z: {:.3f}\n"
        "Gyro data [mdps] - X: {:.3f}   Y: {:.3f}   Z: {:.3f}\nCompass [uT] - X: 1",
        "I/imu: accel({:.3f}, {:.3f}, {:.3f}) mg, gyro({:.3f}, {:.3f}, {:.3f}) mdps",
    ],
    ids=["mbed", "RIOT", "RT-Thread"],
)
def test_units_that_stand_in_a_label_are_those_of_its_values(
    tmp_path: Path, form: str
) -> None:
    values = np.hstack([FORCE / 9.80665 * 1e3, np.rad2deg(RATES) * 1e3])
    lines = "\n".join(form.format(*row) for row in values).split("\n")
    (block,) = read(tmp_path, lines, timed=False).values()
    np.testing.assert_allclose(block.acc, FORCE, atol=1e-4)
    np.testing.assert_allclose(block.gyr, RATES, atol=1e-6)


def test_another_message_between_rows_gives_them_no_time(tmp_path: Path) -> None:
    """Its own would be that of the row behind it, of which it is no part."""
    lines = [f"14:20:00.000 -> Filter bandwidth set to: {21} Hz"]
    for i in range(ROWS):
        at = f"14:20:{5 + i / RATE:06.3f} -> "
        lines += [f"{at}Accel {axes(FORCE[i])} m/s^2", f"{at}Gyro {axes(RATES[i])}"]
        if i == ROWS // 2:
            lines.append(f"14:20:{5 + (i + 0.9) / RATE:06.3f} -> Battery left: 97")
    (block,) = read(tmp_path, lines, True).values()
    np.testing.assert_allclose(block.t, np.arange(ROWS) / RATE, atol=1e-6)
    np.testing.assert_array_equal(block.acc, FORCE)


def listened(topic: str, fields: list[str], instances: int = 1) -> list[str]:
    """Messages of a topic as the shell of PX4 shows them, field by field."""
    found = []
    for i in range(ROWS):
        found += ["", f"TOPIC: {topic}"]
        for k in range(instances):
            found += [f"Instance {k}:"] if instances > 1 else []
            found += [
                f" {topic}",
                f"    timestamp: {5_000_000 + round(i * 1e6 / RATE)} (0.003524 seconds"
                " ago)",
                f"    timestamp_sample: {4_999_800 + round(i * 1e6 / RATE)}  (208 us"
                " before timestamp)",
                f"    device_id: {2752786 + k} (Type: 0x2A, SPI:2 (0x01))",
                *(f"    {one}" for one in fields),
                "    error_count: 0",
            ]
            force, rate = FORCE[i] * (1 + 0.1 * k), RATES[i]
            values = dict(zip(("ax", "ay", "az", "gx", "gy", "gz"),
                              [*force, *rate], strict=True))  # fmt: skip
            found = [line.format(**values) for line in found]
    return found


def test_messages_that_the_shell_of_px4_shows(tmp_path: Path) -> None:
    """With what they hold besides, and how long ago they came behind their time."""
    fields = ["gyro_rad: [{gx:.5f}, {gy:.5f}, {gz:.5f}]", "gyro_integral_dt: 50000",
              "accelerometer_timestamp_relative: 0",
              "accelerometer_m_s2: [{ax:.5f}, {ay:.5f}, {az:.5f}]",
              "accelerometer_clipping: 0"]  # fmt: skip
    (block,) = read(tmp_path, listened("sensor_combined", fields), True).values()
    np.testing.assert_allclose(np.diff(block.t), 1 / RATE * 1e6)
    np.testing.assert_allclose(block.acc, FORCE, atol=1e-9)
    np.testing.assert_allclose(block.gyr, RATES, atol=1e-9)


@pytest.mark.parametrize("seconds", [1 / RATE, 0.005])
def test_gains_are_those_of_the_time_that_stands_beside_them(
    tmp_path: Path, seconds: float
) -> None:
    """The shell shows some of the messages: a row is not as long as they are."""
    step = round(1e6 * seconds)
    address = "device_id: 2752786 (Type: 0x2A, SPI:2 (0x01))"
    fields = [f"accel_{address}", f"gyro_{address}",
              "delta_angle: [{gx:.9f}, {gy:.9f}, {gz:.9f}]",
              "delta_velocity: [{ax:.9f}, {ay:.9f}, {az:.9f}]",
              f"delta_angle_dt: {step}", f"delta_velocity_dt: {step}"]  # fmt: skip
    (block,) = read(tmp_path, listened("vehicle_imu", fields), True).values()
    np.testing.assert_allclose(block.acc * seconds, FORCE, atol=1e-6)
    np.testing.assert_allclose(block.gyr * seconds, RATES, atol=1e-6)


def test_titles_number_the_devices_of_what_stands_below(tmp_path: Path) -> None:
    fields = ["x: {ax:.5f}", "y: {ay:.5f}", "z: {az:.5f}", "temperature: 38.4425"]
    got = read(tmp_path, listened("sensor_accel", fields, 2), True)
    assert [*got] == ["Instance 0", "Instance 1"]
    for k, block in enumerate(got.values()):
        np.testing.assert_allclose(block.acc, FORCE * (1 + 0.1 * k), atol=1e-4)
        np.testing.assert_allclose(block.temperature, 38.4425)


@pytest.mark.parametrize(
    "form",
    ["accel [g]: {:.5f} {:.5f} {:.5f} gyro [deg/s]: {:.5f} {:.5f} {:.5f}",
     "Accel (g): X={:.5f} Y={:.5f} Z={:.5f} | Gyro (deg/s): X={:.5f} Y={:.5f} Z={:.5f}",
     "Accel [g]:\n x: {:.5f}\n y: {:.5f}\n z: {:.5f}\nGyro [deg/s]:\n x: {:.5f}\n"
     " y: {:.5f}\n z: {:.5f}"],
    ids=["lists", "axes", "titles"],
)  # fmt: skip
def test_a_unit_in_brackets_stands_before_the_values(tmp_path: Path, form: str) -> None:
    """One of rates is no rad of which the unit is s."""
    values = np.hstack([FORCE / 9.80665, np.rad2deg(RATES)])
    lines = "\n".join(form.format(*row) for row in values).split("\n")
    (block,) = read(tmp_path, lines, timed=False).values()
    np.testing.assert_allclose(block.acc, FORCE, atol=1e-4)
    np.testing.assert_allclose(block.gyr, RATES, atol=1e-6)


def test_counts_beside_what_they_are_in_a_unit(tmp_path: Path) -> None:
    values = np.hstack([FORCE / 9.80665, np.rad2deg(RATES)])
    units = ["g"] * 3 + ["dps"] * 3
    lines = [
        " ".join(
            f"{name}: {round(16384 * x)} ({x:.6f} {unit})"
            for name, x, unit in zip(
                ("AX", "AY", "AZ", "GX", "GY", "GZ"), row, units, strict=True
            )
        )
        for row in values.tolist()
    ]
    (block,) = read(tmp_path, lines, timed=False).values()
    np.testing.assert_allclose(block.acc, FORCE, atol=1e-5)
    np.testing.assert_allclose(block.gyr, RATES, atol=1e-6)


@given(st.integers(0, 86399), st.integers(0, 999_999), st.booleans())
def test_a_clock_behind_a_label_is_so_many_seconds(
    second: int, micros: int, dated: bool
) -> None:
    clock = datetime(2024, 5, 3, tzinfo=UTC) + timedelta(
        seconds=second, microseconds=micros
    )
    form = "%Y-%m-%d %H:%M:%S.%f" if dated else "%H:%M:%S.%f"
    read_time = labelled_values(f"Time: {clock.strftime(form)}, ax: 1, ay: 2")[0]
    assert read_time[0] == "Time"
    since = clock.timestamp() if dated else second + 1e-6 * micros
    assert float(read_time[1]) == pytest.approx(since, abs=2e-6)


@given(st.text(alphabet="ax=:0123456789.()[] gT-", max_size=40))
def test_no_line_breaks_the_spelling_of_labels(line: str) -> None:
    assert isinstance(plain_labels(line), str)
