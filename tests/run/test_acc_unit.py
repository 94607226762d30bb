"""Accelerometers in another unit or range than the device's address states."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.core.samples import Array, Block, split_by_time
from fieldcal.drivers.options import Options
from fieldcal.planning.steps import Hold
from fieldcal.run.acc_unit import acc_unit_message
from fieldcal.run.gyro_unit import GyroUnitWatch
from fieldcal.run.wait_reason import WaitState
from fieldcal.run.waiting import PositionWait
from fieldcal.session.description_file import parse_description

G = 9.811
TEXT = "serial:/dev/ttyACM0?format=text&columns=ax,ay,az"
CAN = "can:can0?dbc=imu.dbc"
STANDARD = 9.80665
UNITS = {"m/s^2": 1.0, "g": STANDARD, "mg": STANDARD / 1000}


@pytest.mark.parametrize(
    ("reading", "stated"),
    [(1.0, ""), (1000.0, ""), (-16384.0, ""), (2048.0, ""), (981.0, ""), (9810.0, ""),
     (9.79, "g"), (9.79, "mg"), (1000.0, "g"), (1.02, "mg"), (16700.0, "mg")],
)  # fmt: skip
def test_begun_again_as_is_said_it_reads_gravity(reading: float, stated: str) -> None:
    """The option that the sentence names, taken as a driver takes it."""
    address = TEXT + (f"&acc_unit={stated}" if stated else "")
    norm = abs(reading) * UNITS[stated or "m/s^2"]
    said = acc_unit_message(norm, G, address)
    option = re.search(r"begin again with (acc_unit=\S+) in", said)
    assert option is not None, said
    factor = Options("text", option[1]).unit("acc_unit", UNITS, "m/s^2")
    assert abs(reading) * factor == pytest.approx(G, rel=0.05)


@pytest.mark.parametrize(("stated", "own"), [(16, 4), (16, 8), (4, 16), (8, 2)])
def test_a_full_scale_that_is_another_is_named(stated: float, own: float) -> None:
    address = f"serial:/dev/ttyUSB0?format=witmotion&acc_range={stated}"
    said = acc_unit_message(1.03 * G * stated / own, G, address)
    assert f"begin again with acc_range={own:g} in" in said


@pytest.mark.parametrize(
    ("norm", "address"),
    [(3.0, TEXT), (0.0, TEXT), (3.3e9, TEXT), (6.0, "serial:/dev/ttyUSB0"),
     (1.0, "serial:/dev/ttyUSB0?format=xsens"), (1.0, ""), (1.0, CAN)],
)  # fmt: skip
def test_where_no_unit_fits_none_is_named(norm: float, address: str) -> None:
    said = acc_unit_message(norm, G, address)
    assert said.endswith("gravity is 9.81 m/s²: check unit, range and wire format")


def resting(scale: float, seconds: float = 12.0) -> Block:
    """A raw device at rest at home, with the noise of a cheap one."""
    t = np.arange(int(100 * seconds)) / 100
    noise: Array = np.random.default_rng(4).standard_normal((len(t), 6))
    acc = scale * (np.array([0.12, -10.0, 0.3]) + 0.02 * noise[:, :3])
    return Block.of(t, acc, 900.0 * 1e-3 * noise[:, 3:])


@pytest.mark.parametrize(
    ("scale", "option"), [(16384 / STANDARD, "0.0610352*mg"), (1e3 / STANDARD, "mg")]
)
def test_counts_that_are_never_still_enough_are_told(scale: float, option: str) -> None:
    """Their noise is a motion in m/s^2, so that nothing else would ever be said."""
    about = parse_description({"site": {"gravity": G}, "run": {"device": TEXT}})
    units = GyroUnitWatch(G)
    hold = Hold(0, FIVE_POSITIONS[0], 10.0)
    waiting = PositionWait(hold, about, None, units=units)
    for piece in split_by_time(resting(scale), 0.1):
        units.add(piece)
        waiting.add(piece, float(piece.t[-1]))
    assert waiting.reason.state is WaitState.WRONG_UNIT
    assert f"begin again with acc_unit={option} in" in waiting.reason.text


def test_a_device_that_is_carried_about_is_not_asked_for_its_unit() -> None:
    about = parse_description({"site": {"gravity": G}, "run": {"device": TEXT}})
    units = GyroUnitWatch(G)
    waiting = PositionWait(Hold(0, FIVE_POSITIONS[0], 10.0), about, None, units=units)
    still = resting(1.0)
    shaken = 3.0 * np.sin(9.0 * still.t)[:, None] * [1.0, 1.0, 0.0]
    for piece in split_by_time(Block.of(still.t, still.acc + shaken, shaken), 0.1):
        units.add(piece)
        waiting.add(piece, float(piece.t[-1]))
    assert waiting.reason.state is WaitState.MOVING
