"""What Zephyr's sensor shell and its samples print is read with nothing said."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from written_logs import A, T, W, assert_same, imported

from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.session.folder import Session

WARM = 27.31
NUMBERS = {"accel_x": 0, "accel_xyz": 3, "gyro_x": 4, "gyro_xyz": 7, "die_temp": 12}
STYLES = ("type", "idx", "none")


def printed(style: str, name: str, ns: int, values: Array) -> str:
    """A line of one channel as releases 3.7, 3.4 and 2.7 print it."""
    number = NUMBERS.get(name, 1)
    several = ", ".join(f"{x:.6f}" for x in values)
    value = f"value={ns}ns{',' if len(values) > 1 else ''} ({several})"
    if style == "type":
        return (
            f"channel type={number}({name}) index=0 shift=8 num_samples=1 {value}"
        )  # fmt: skip
    if style == "idx":
        return f"channel idx={number} {name} shift=8 num_samples=1 {value}"
    axes = zip("xyz", values, strict=False)
    told = " ".join(f"{a} = {x:10.6f}" for a, x in axes)
    alone = f"= {values[0]:10.6f}"
    return f"channel idx={number} {name} {told if len(values) > 1 else alone}"


def lines(style: str, each: bool, device: str = "imu@0") -> Iterator[str]:
    """What the shell prints; with `each`, axes alone as well."""
    for t, a, w in zip(T.tolist(), A, W, strict=True):
        ns = round(t * 1e9) + 8_123_456_789
        yield f"uart:~$ sensor get {device} "
        for sensor, three in (("accel", a), ("gyro", w)):
            for axis, x in zip("xyz", three, strict=True) if each else ():
                yield printed(style, f"{sensor}_{axis}", ns, np.array([x]))
            yield printed(style, f"{sensor}_xyz", ns, three)
        yield printed(style, "die_temp", ns, np.array([WARM]))
        yield "channel type=11(magn_xyz) index=0 shift=0 num_samples=0 value=4294967295"


def write(folder: Path, text: str) -> Path:
    path = folder / "log.txt"
    path.write_text(text)
    return path


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("each", [False, True])
def test_channels_of_the_shell_are_rows(tmp_path: Path, style: str, each: bool) -> None:
    path = write(tmp_path, "\n".join(lines(style, each)))
    folder = imported(path, *(["--rate", "50"] if style == "none" else []))
    assert_same(folder)
    block = Session.open(folder).block
    assert len(block) == len(T)
    np.testing.assert_allclose(block.temperature, WARM)


def test_two_devices_that_were_asked_in_turn_are_two(tmp_path: Path) -> None:
    one, two = (
        "\n".join(lines("type", False, name)).split("uart:~$")[1:]
        for name in ("icm42688p@0", "lsm6dso@1")
    )
    both = "".join(
        f"uart:~${part.rstrip()}\n"
        for pair in zip(one, two, strict=True)
        for part in pair
    )
    out = tmp_path / "out"
    assert main(["import", str(write(tmp_path, both)), "-o", str(out)]) == 0
    folders = sorted(path.name for path in out.iterdir())
    assert folders == ["icm42688p_0", "lsm6dso_1"]
    for name in folders:
        assert_same(out / name)


@pytest.mark.parametrize("late", [0, 1_234_567])
def test_frames_of_a_stream_go_together_by_their_times(
    tmp_path: Path, late: int
) -> None:
    rows = zip(np.round(T * 1e9).astype(int).tolist(), A, W, strict=True)
    text = "\n".join(
        "{} data for imu@6b {}ns ({:.6f}, {:.6f}, {:.6f})".format(kind, ns, *three)
        for t, a, w in rows
        for kind, ns, three in (("XL", t, a), ("GY", t + late, w))
    )
    assert_same(imported(write(tmp_path, text)))


def test_a_time_and_a_temperature_stand_before_the_axes(tmp_path: Path) -> None:
    """As samples/sensor/mpu6050 prints them."""
    text = "*** Booting Zephyr OS build v3.5.0 ***\n" + "\n".join(
        "[0:00:{:06.3f}]:27.3 Cel\n  accel {:f} {:f} {:f} m/s/s\n"
        "  gyro  {:f} {:f} {:f} rad/s".format(*row)
        for row in np.column_stack([T, A, W]).tolist()
    )
    folder = imported(write(tmp_path, text))
    assert_same(folder)
    np.testing.assert_allclose(Session.open(folder).block.temperature, 27.3)
