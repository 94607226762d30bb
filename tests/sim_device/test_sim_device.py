"""The device as a whole: reproducible, whatever the blocks, and honest about itself."""

import json
from dataclasses import replace

import numpy as np
import pytest

from fieldcal.core.errors import InputError
from fieldcal.core.positions import Position
from fieldcal.core.samples import Block, concat
from fieldcal.sim_device import Profile, VirtualDevice, effects
from fieldcal.sim_device.in_process import InProcess
from fieldcal.sim_device.profile import NoiseFigures
from fieldcal.sim_device.vocabulary import parse

RICH = Profile(
    noise=NoiseFigures(
        acc_flicker=(1e-4,) * 3, gyr_walk=(1e-5,) * 3, acc_walk=(1e-4,) * 3
    )
).having(
    *map(
        parse,
        [
            "random_walk:ax=1e-3,gz=1e-4",
            "angle_setting:sigma_deg=0.2",
            "vibration_rectification:x=1e-3",
            "dropped:fraction=0.1",
            "stuck:channel=ay,from_s=3,to_s=4",
            "sway:amplitude_deg=0.1,hz=0.3",
            "time_delay:seconds=0.013",
            "lever_arm:x=0.1",
            "settling:az=0.01,tau_s=3",
        ],
    )
)


def run(step: int, profile: Profile = RICH, seed: int = 5) -> Block:
    """20 s with commands at fixed instants, in blocks of at most `step` samples."""
    device = VirtualDevice(profile, seed)
    commands = {307: lambda: device.turn(0.4, 0.05), 1501: lambda: device.bump()}
    blocks, at = [], 0
    for stop in (*commands, 2000):
        while at < stop:
            n = min(step, stop - at)
            blocks.append(device.take(n))
            at += n
        if stop in commands:
            commands[stop]()
    return concat(blocks)


@pytest.mark.parametrize(
    "step", [37, *(pytest.param(n, marks=pytest.mark.thorough) for n in (1, 7, 64))]
)
def test_samples_do_not_depend_on_the_size_of_the_blocks(step: int) -> None:
    whole, pieces = run(2000), run(step)
    for name in ("t", "acc", "gyr", "temperature", "seq", "t_host"):
        np.testing.assert_array_equal(getattr(pieces, name), getattr(whole, name))


def test_a_seed_repeats_and_another_differs() -> None:
    one, same, other = run(100), run(100), run(100, seed=6)
    np.testing.assert_array_equal(one.six, same.six)
    assert len(one) != len(other) or not np.array_equal(one.six, other.six)


def test_the_default_is_a_device_of_the_practice_kind() -> None:
    device = VirtualDevice(seed=1)
    block = device.take(6000)
    scatter = block.six.std(axis=0)
    np.testing.assert_allclose(scatter, [0.02] * 3 + [0.002] * 3, rtol=0.05)
    truth = device.profile.truth
    at_home = [truth.acc_bias[0],
               truth.acc_bias[1] - truth.acc_scale[1] * device.profile.gravity,
               truth.acc_bias[2], *truth.gyr_bias]  # fmt: skip
    np.testing.assert_allclose(block.six.mean(axis=0), at_home, atol=2e-3)
    assert 0.2 < block.temperature[-100:].mean() - block.temperature[:100].mean() < 0.5
    np.testing.assert_allclose(np.diff(block.t), 0.01)


def test_what_is_concealed_can_be_written_down() -> None:
    concealed = VirtualDevice(RICH, 5).concealed()
    assert json.loads(json.dumps(concealed)) == concealed
    assert concealed["effects"]["angle_setting"] == {"sigma_deg": 0.2}
    assert concealed["seed"] == 5
    assert set(concealed["effects"]) <= set(effects.ids())


def test_the_driver_in_process_hands_out_blocks_and_moves() -> None:
    with InProcess(VirtualDevice(seed=2)) as imu:
        assert imu.receive(0) is None
        blocks = imu.blocks()
        assert len(next(blocks)) == 10
        there = imu.place(Position.deg(30, 5))
        assert there == pytest.approx(4.1)
        while imu.device.time < there:
            next(blocks)
        assert next(blocks).acc[:, 0].mean() < -4
        assert imu.health.samples == 420
        spun = imu.place(Position("table", rate=(0.0, 0.5, 0.0)))
        assert spun == imu.device.busy_until
        assert imu.place(Position("both", 0.1, 0.2, (0.0, 0.5, 0.0))) > spun
        with pytest.raises(InputError, match="needs the angles"):
            imu.place(Position("anywhere"))


def test_a_seed_below_zero_is_refused() -> None:
    with pytest.raises(InputError, match="seed"):
        VirtualDevice(seed=-1)


def test_samples_drop_and_the_counter_shows_it() -> None:
    profile = replace(Profile(), effects=(parse("dropped:fraction=0.2"),))
    block = VirtualDevice(profile, 3).take(5000)
    assert len(block) == pytest.approx(4000, abs=120)
    np.testing.assert_allclose(block.t, block.seq / 100)
    assert np.diff(block.seq).max() > 1
