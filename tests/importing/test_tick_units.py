"""Times in ticks of a timer: read as they are said, and asked about elsewhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned, write

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.read_options import ReadOptions, seconds_in
from fieldcal.importing.words.tick_units import SECONDS, parse_tick, tick_seconds

ROWS = turned(7, 100.0, 2.0, sides=7)
DEGREES = np.array([*[1.0] * 3, *[180 / np.pi] * 3])


def counted(tick: float, bits: int = 0, scale: Array | float = 1.0) -> Array:
    """The rows behind what a timer of so many bits counts."""
    ticks = np.round((ROWS[:, 0] + 0.3) / tick)
    return np.column_stack([ticks % 2.0**bits if bits else ticks, ROWS[:, 1:] * scale])


@given(st.floats(0.001, 999.0), st.sampled_from([*SECONDS]))
def test_so_many_of_a_unit_are_so_many_seconds(many: float, unit: str) -> None:
    text = f"{many:.6f} {unit}"
    assert tick_seconds(text) == pytest.approx(float(f"{many:.6f}") * SECONDS[unit])
    assert parse_tick(parse_tick(text) or "") == parse_tick(text)


@given(st.text(alphabet="0123456789./ smunµ-", max_size=8))
def test_what_is_a_tick_has_a_length(text: str) -> None:
    unit = parse_tick(text)
    assert (unit is None) == (tick_seconds(text) is None)
    assert unit is None or tick_seconds(unit) == tick_seconds(text) != 0


@pytest.mark.parametrize(
    ("head", "tick"),
    [("t [0.1ms]", 1e-4), ("time (10us)", 1e-5), ("time [1/10 ms]", 1e-4),
     ("timestamp (100 µs)", 1e-4)],
)  # fmt: skip
def test_a_heading_may_say_the_tick(tmp_path: Path, head: str, tick: float) -> None:
    path = write(tmp_path, counted(tick, 16), heading=f"{head},ax,ay,az,gx,gy,gz")
    block, _ = read_files([path])
    np.testing.assert_allclose(np.diff(block.t), 0.01, atol=tick)


@pytest.mark.parametrize(
    ("unit", "bits"), [("10us", 16), ("31.25us", 24), ("1/32768s", 16), ("12.5ns", 24)]
)
def test_an_option_may_say_the_tick(tmp_path: Path, unit: str, bits: int) -> None:
    tick = seconds_in(unit)
    path = write(tmp_path, counted(tick, bits), heading="t,ax,ay,az,gx,gy,gz")
    block, _ = read_files([path], ReadOptions(time_unit=unit))
    np.testing.assert_allclose(np.diff(block.t), 0.01, atol=2 * tick)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-9)


@pytest.mark.parametrize("tick", ["0.1ms", "10us", "31.25us", "39.0625us"])
@pytest.mark.parametrize(
    ("head", "scale", "unit"),
    [("gx,gy,gz", 1.0, "rad/s"), ("gx,gy,gz", DEGREES, "deg/s"),
     ("gx (rad/s),gy (rad/s),gz (rad/s)", 1.0, "rad/s")],
)  # fmt: skip
def test_a_tick_that_nobody_says_is_asked_about(
    tmp_path: Path, tick: str, head: str, scale: Array | float, unit: str
) -> None:
    """Of 10 us, ms would make a log of 1 Hz whose rates were rad/s for all it says."""
    rows = counted(seconds_in(tick), scale=scale)
    path = write(tmp_path, rows, heading=f"timestamp,ax,ay,az,{head}")
    with pytest.raises(InputError, match=f"--time-unit {tick}, if .* are {unit}"):
        read_files([path])


def test_a_tick_that_no_usual_timer_has_is_asked_about(tmp_path: Path) -> None:
    path = write(tmp_path, counted(1 / 80e6), heading="t,ax,ay,az,gx,gy,gz")
    with pytest.raises(InputError, match=r"--time-unit 12\.\d+ns, if"):
        read_files([path])


def test_counts_beside_ticks_are_asked_about(tmp_path: Path) -> None:
    scale = np.array([*[16384 / 9.80665] * 3, *[131.072 * 180 / np.pi] * 3])
    rows = np.round(counted(1e-4, scale=scale))
    path = write(tmp_path, rows, heading="t,ax,ay,az,gx,gy,gz")
    with pytest.raises(InputError, match=r"--time-unit 0.1ms, if .*131.072 in a deg/s"):
        read_files([path])


def test_a_rate_that_no_unit_makes_says_the_tick(tmp_path: Path) -> None:
    path = write(tmp_path, counted(31.25e-6), heading="t,ax,ay,az,gx,gy,gz")
    with pytest.raises(InputError, match=r"add --time-unit 31\.25us if"):
        read_files([path], ReadOptions(rate_hz=100.0))


def test_a_unit_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="such as 31.25us"):
        seconds_in("fortnight")


def test_gains_of_angle_are_no_rates_beside_ticks(tmp_path: Path) -> None:
    """Over 10 ms they seem to be rates beside times of 0.1 s."""
    rows = counted(1e-6, scale=0.01)
    names = [f"delta_{kind}_{axis}" for kind in ("velocity", "angle") for axis in "xyz"]
    path = write(tmp_path, rows, heading=",".join(["timestamp", *names]))
    block, _ = read_files([path])
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], rtol=1e-3)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], rtol=1e-3)
