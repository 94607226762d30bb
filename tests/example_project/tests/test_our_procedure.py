"""The team's tests: a virtual device with known errors on each link they use."""

import pytest
from our_procedure import GRAVITY, recalibrate

SPEED = 40
"""A device at full speed sends far more than these tests need, and all is read."""


@pytest.mark.parametrize("link", ["serial", "can"])
def test_our_procedure_finds_what_is_concealed(virtual_imu, link):
    device = virtual_imu(link, speed=SPEED, acc_bias=(0.1, -0.2, 0.3), gravity=GRAVITY)
    found = recalibrate(device.url, device.turn)
    device.assert_calibration(found, within={"acc_bias": 0.05, "gyr_bias": 2e-4})


def test_their_five_positions_over_mavlink(virtual_imu):
    device = virtual_imu("mavlink", effects=["base_tilt:about_x_deg=1,about_z_deg=-1"])
    device.assert_calibration(device.recalibrate("five_position", seconds=8.0))


def test_two_positions_over_mavlink_take_a_tilted_base_for_a_bias(virtual_imu):
    device = virtual_imu("mavlink", effects=["base_tilt:about_x_deg=1"])
    found = device.recalibrate("two_position", seconds=4.0)
    with pytest.raises(pytest.fail.Exception, match="acc_bias.z"):
        device.assert_calibration(found)
    value, sigma = found.vector("gyr_bias")
    device.assert_calibration({"gyr_bias": {"value": value, "sigma": sigma}})


def test_a_wrong_procedure_is_caught(virtual_imu):
    device = virtual_imu("serial", speed=SPEED, gravity=GRAVITY)
    found = recalibrate(device.url, lambda alpha, beta: device.turn(-alpha, beta))
    with pytest.raises(pytest.fail.Exception, match="the calibration is wrong: acc"):
        device.assert_calibration(found)


def test_a_bump_is_not_averaged_over(virtual_imu):
    device = virtual_imu("serial", speed=SPEED, gravity=GRAVITY)

    def turn_and_bump(alpha: float, beta: float) -> float:
        there = device.turn(alpha, beta)
        device.bump(push=3.0)
        return there

    device.fault(flip_bits=2)
    found = recalibrate(device.url, turn_and_bump)
    device.assert_calibration(found)
