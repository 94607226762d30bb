"""Ways that the device is carried along, against turns that are known otherwise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fieldcal.core import frames
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.sim_device.profile import (
    ONE,
    ZERO,
    Climate,
    MountingAxes,
    Profile,
    Sampling,
    Truth,
)
from fieldcal.sim_device.replay import HeldWindow, simulate
from fieldcal.sim_device.vocabulary import parse
from fieldcal.sim_device.way import Manoeuvre

PERFECT = Profile(
    truth=Truth(ZERO, ONE, ZERO, ONE),
    temperature=Climate(self_heating_k=0.0),
    sampling=Sampling(1000.0),
)
END = (0.9, -0.6)
HOME, AWAY = HeldWindow(0.2, 0.1, 0.0, 2.0), (*END, 6.0, 8.0)


def summed(t: Array, w: Array) -> Array:
    """Rates (n, 3) summed up by Simpson's rule at every other instant, (3, m)."""
    step = (t[2::2] - t[:-2:2])[:, None]
    each = (w[:-2:2] + 4 * w[1:-1:2] + w[2::2]) / 6 * step
    return np.vstack([np.zeros(3), np.cumsum(each, axis=0)]).T


@pytest.mark.parametrize("mounting", [("+x", "+y", "+z"), ("+x", "-z", "+y")])
def test_a_way_read_from_perfect_gyroscopes_is_the_turn_itself(
    mounting: tuple[str, str, str],
) -> None:
    device = Profile(
        truth=PERFECT.truth,
        temperature=PERFECT.temperature,
        sampling=PERFECT.sampling,
        frame=MountingAxes(mounting),
        effects=(
            parse("lever_arm:x=0.1,y=-0.05,z=0.2"),
            parse("base_tilt:about_x_deg=2"),
        ),
    )
    by_joints = simulate(
        device, [HOME, HeldWindow(*AWAY, turn=(2.5, 5.5))], noise=False
    )
    on_way = by_joints.between(2.2, 5.8)
    rate = on_way.gyr @ frames.mounting_matrix(mounting).T
    way = Manoeuvre(on_way.t[::2], summed(on_way.t, rate)[:, : len(on_way.t[::2])])
    carried = simulate(
        device, [HOME, HeldWindow(*AWAY, turn=(2.5, 5.5), way=way)], noise=False
    )
    inside = slice(*np.searchsorted(by_joints.t, [2.3, 5.7]))
    np.testing.assert_allclose(carried.gyr[inside], by_joints.gyr[inside], atol=1e-6)
    np.testing.assert_allclose(carried.acc[inside], by_joints.acc[inside], atol=2e-4)
    np.testing.assert_allclose(carried.acc[-500:], by_joints.acc[-500:], atol=1e-12)


@settings(max_examples=25)
@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3), st.floats(0.2, 5.0))
def test_a_turn_about_a_fixed_axis_is_one_rotation(
    axis: list[float], seconds: float
) -> None:
    t = np.linspace(0, seconds, 60)
    part = (1 - np.cos(np.pi * t / seconds)) / 2
    attitude, rate, _ = Manoeuvre(t, np.outer(axis, part)).at(np.array([seconds]))
    s, x, y, z = attitude[:, 0]
    apart = Rotation.from_quat([x, y, z, s]) * Rotation.from_rotvec(axis).inv()
    assert apart.magnitude() < 1e-9
    np.testing.assert_allclose(rate, 0, atol=2e-3 / seconds)


def test_before_and_after_it_nothing_moves() -> None:
    way = Manoeuvre(
        np.linspace(3, 4, 20), np.outer([0.0, 0.0, 0.5], np.linspace(0, 1, 20))
    )
    windows = [HOME, HeldWindow(0.7, 0.1, 6.0, 8.0, way=way, turn=(3.0, 4.0))]
    block = simulate(PERFECT, windows, noise=False)
    moving = block.t[np.abs(block.gyr).max(axis=1) > 1e-6]
    assert moving[0] == pytest.approx(3.0) and moving[-1] == pytest.approx(4.0)
    np.testing.assert_allclose(block.between(3.2, 3.8).gyr[:, 2], 0.5, atol=1e-9)


@pytest.mark.parametrize("t", [[0.0, 1.0, 2.0], [0.0, 1.0, 1.0, 2.0]])
def test_too_few_or_no_ascending_instants_are_refused(t: list[float]) -> None:
    with pytest.raises(InputError, match="one after the other"):
        Manoeuvre(np.array(t), np.zeros((3, len(t))))
