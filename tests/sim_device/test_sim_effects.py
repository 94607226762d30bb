"""What effects add to the outputs of a simulated device."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from simulated import PLAIN, QUIET, RATE, A, added, at_rest, told, turning

from fieldcal.core.samples import Array, Block
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.effects import catalogue
from fieldcal.sim_device.profile_file import profile_from_tables
from fieldcal.sim_device.vocabulary import checked_effect, parse


def test_every_effect_of_the_catalogue_can_be_given(shared: Path) -> None:
    text = (shared / "design" / "effects.md").read_text()
    rows = re.findall(r"^\| `(\w+)`.*?\|.*?\|(.*?)\|", text, re.MULTILINE)
    assert rows
    for id_, parameters in rows:
        for name in re.findall(
            r"\b(?:[a-z]+_\w+|ppm|hz|tau_s|axes|unit)\b", parameters
        ):
            assert name in catalogue()[id_].names(), (id_, name)


@pytest.mark.parametrize("id_", catalogue())
def test_every_effect_shows_somewhere(id_: str) -> None:
    example = catalogue()[id_].EXAMPLE
    plain = profile_from_tables({"noise": {"acc": 0.01}, **example.device})
    profile = plain.having(checked_effect(id_, example.given))
    devices = [VirtualDevice(p, 4) for p in (profile, plain)]
    for device in devices:
        device.spin(RATE, (A, A, 0.0), 1.0)
    # the way is over soon, and some effects begin late
    parts = [1_000] if example.in_motion else [1_000, 11_000]
    assert any(differ(*(device.take(n) for device in devices)) for n in parts)


def differ(one: Block, other: Block) -> bool:
    """Whether samples, their stamps or their arrivals are others."""
    if len(one) != len(other):
        return True
    return bool(
        np.any(one.six != other.six)
        or np.any(np.abs(one.t_host - other.t_host) > 1e-4)
        or np.any(one.t != other.t)
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("cross_coupling:k12=0.01,k31=0.02", [0.01 * -6.4, 0, 0.02 * -6, 0, 0, 0]),
        ("quadratic:x=1e-3,z=-1e-3", [0.036, 0, -0.02304, 0, 0, 0]),
        ("cubic:y=1e-5", [0, -0.00262144, 0, 0, 0, 0]),
        ("scale_asymmetry:x=0.01,z=0.01", [0.06, 0, 0.048, 0, 0, 0]),
        (
            "pendulous_products:l11=1e-4,l22=1e-4,l33=1e-4",
            [0.00384, -0.003072, -0.00288, 0, 0, 0],
        ),
        ("g_sensitivity:g11=1e-4,g23=1e-4", [0, 0, 0, -6e-4, 4.8e-4, 0]),
        ("g2_sensitivity:x=1e-5", [0, 0, 0, 3.6e-4, 0, 0]),
        ("gravity_error:relative=0.001", [-0.006, -0.0064, 0.0048, 0, 0, 0]),
        ("temperature_bias:ax=0.003,gz=-2e-4", [0.003, 0, 0, 0, 0, -2e-4]),
        ("temperature_scale:y=1e-4", [0, -6.4e-4, 0, 0, 0, 0]),
        ("scale_drift:x=1e-5,z=-2e-5", [-0.006, 0, -0.0096, 0, 0, 0]),
        ("scale_step:y=1e-3,at_s=60", [0, -6.4e-3, 0, 0, 0, 0]),
        ("scale_step:y=1e-3,at_s=160", [0] * 6),
        ("scale_warm_up:y=1e-3,tau_s=50", [0, -6.4e-3 * np.exp(-2), 0, 0, 0, 0]),
        (
            "scale_transient:y=1e-3,at_s=60,tau_s=20",
            [0, -6.4e-3 * (1 - np.exp(-2)), 0, 0, 0, 0],
        ),
        ("scale_transient:y=1e-3,at_s=160,tau_s=20", [0] * 6),
        (
            "thermal_transient:az=0.02,gz=-1e-3,at_s=60,tau_s=20",
            [0, 0, 0.02 * (1 - np.exp(-2)), 0, 0, -1e-3 * (1 - np.exp(-2))],
        ),
        ("thermal_transient:az=0.02,gz=-1e-3,at_s=160,tau_s=20", [0] * 6),
        ("thermal_hysteresis:az=0.5,gx=0.01", [0, 0, 0.005, 1e-4, 0, 0]),
        (
            "warm_up:ay=0.01,gx=1e-3,tau_s=50",
            [0, 0.01 * np.exp(-2), 0, 1e-3 * np.exp(-2), 0, 0],
        ),
        ("bias_drift:ax=1e-4,gy=1e-6", [0.01, 0, 0, 0, 1e-4, 0]),
        ("bias_step:az=0.02,gz=-1e-3,at_s=60", [0, 0, 0.02, 0, 0, -1e-3]),
        ("hum:ay=0.05,gx=1e-3,hz=50.25,phase_deg=90", [0, 0.05, 0, 1e-3, 0, 0]),
        ("gyro_scale:s3=0.01", [0] * 6),
        ("gyro_cross_coupling:s12=0.01", [0] * 6),
        ("gyro_products:p11=0.1,p22=0.1,p33=0.1", [0] * 6),
        ("lever_arm:x=0.1,z=-0.2", [0] * 6),
        ("time_delay:seconds=0.02", [0] * 6),
        ("bump:at_s=61.7,for_s=0.8", [0] * 6),
    ],
)
def test_what_is_added_at_rest_after_100_s_and_1_k(
    text: str, expected: list[float]
) -> None:
    np.testing.assert_allclose(added(text), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("gyro_cross_coupling:s12=0.01", [0.002, 0, 0]),
        ("gyro_scale:s3=0.01", [0, 0, -0.003]),
        ("gyro_products:p11=0.1,p22=0.1,p33=0.1", [0.002, -0.006, -0.003]),
    ],
)
def test_what_is_added_to_a_steady_rate(text: str, expected: list[float]) -> None:
    more = turning(told(text)).gyr - turning(PLAIN).gyr
    np.testing.assert_allclose(more, np.tile(expected, (100, 1)), atol=1e-12)


def test_settling_fades_from_the_end_of_the_turn() -> None:
    blocks = []
    for profile in (told("settling:ax=-0.03,gy=1e-3,tau_s=4"), PLAIN):
        device = VirtualDevice(profile)
        device.take(500)
        assert device.turn(A, A, 2.0) == 7.0
        blocks.append(device.take(2000).six)
    more = blocks[0] - blocks[1]
    np.testing.assert_allclose(more[0], 0, atol=1e-12)
    np.testing.assert_allclose(more[200], [-0.03, 0, 0, 0, 1e-3, 0], atol=1e-12)
    np.testing.assert_allclose(more[600, 0], -0.03 * np.exp(-1))
    assert np.abs(np.diff(more, axis=0)).max() < 2e-4


def test_a_bias_step_comes_at_its_instant() -> None:
    with_, without = at_rest(told("bias_step:az=0.02,gz=-1e-3,at_s=60")), at_rest(PLAIN)
    more = (with_.six - without.six)[:, 2]
    np.testing.assert_array_equal(with_.t[more != 0][0], 60.0)


def test_vibration_is_rectified_by_its_variance() -> None:
    def shaken(x: float) -> Array:
        effect = parse(f"vibration_rectification:x={x},level=0.5")
        device = VirtualDevice(PLAIN.having(effect), 3)
        levels = []
        for _ in range(20):
            device.turn(0, 0, 0.01)
            device.take(2)
            levels.append(device.take(500).acc[:, 0])
        return np.array(levels)

    plain, rectified = shaken(1e-12), shaken(0.01)
    scatter = plain.std(axis=1)
    assert scatter.max() < 0.55 and scatter.max() > 3 * scatter.min()
    shift = (rectified - plain).mean(axis=1)
    np.testing.assert_allclose(shift, 0.01 * (plain**2).mean(axis=1), rtol=1e-6)


def test_noise_is_louder_where_it_is_said() -> None:
    profile = replace(PLAIN, noise=replace(QUIET, acc=(0.01,) * 3, gyr=(0.001,) * 3))
    loud = profile.having(parse("noise_level:channel=ay,ratio=3"))
    ratio = VirtualDevice(loud, 1).take(500).six.std(axis=0) / (
        VirtualDevice(profile, 1).take(500).six.std(axis=0)
    )
    np.testing.assert_allclose(ratio, [1, 3, 1, 1, 1, 1], rtol=1e-9)
