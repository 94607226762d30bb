"""A phone in a car held against the car's own kinematics; whether a drive rests."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fieldcal.against.motion.alignment import align_motion
from fieldcal.against.motion.held import what_is_held
from fieldcal.cli import main
from fieldcal.core.samples import Array, Block
from fieldcal.session import description, description_file
from fieldcal.session.folder import Session

PHONE = "t=accelerometer_t," + ",".join(
    f"{kind}{axis}={name}_value.{i}"
    for kind, name in (("a", "accelerometer"), ("g", "gyro"))
    for i, axis in enumerate("xyz")
)
EPOCH = 1_533_200_000.0
"""By how much the bus was stamped ahead of the phone when its log was written, s."""


@pytest.mark.thorough
def test_a_phone_in_a_car_against_the_car(shared: Path, tmp_path: Path) -> None:
    folder = shared / "real" / "comma_rav4_can"
    if not folder.is_dir():
        pytest.skip("no recording of a car's CAN beside the project")
    log, dbc = next(folder.glob("*.log.gz")), next(folder.glob("*.dbc"))
    options = f"dbc={dbc}&map=ax=ACCELEROMETER.ACCEL_X,gz=KINEMATICS.YAW_RATE"
    options += "&gyr_unit=0.244*deg/s"
    phone, car = tmp_path / "phone", tmp_path / "car"
    npz = str(folder / "phone_imu.npz")
    assert main(["import", npz, "--columns", PHONE, "-o", str(phone)]) == 0
    assert main(["import", str(log), "--options", options, "-o", str(car)]) == 0
    session = Session.open(phone)
    assert what_is_held(session.block, session.about) == "motion"
    assert main(["diagnose", str(phone), "--against", str(car)]) == 1
    found = json.loads((phone / "against.json").read_text())
    where = found["alignment"]
    delay = where["delay"]["value"] + EPOCH
    assert 0 < where["delay"]["sigma"] < 0.02
    assert abs(delay + 0.041) < 0.008  # a filter that is not there would take 25 ms
    turn = where["turn"]  # the phone's z points down, its x forward
    for axis, wanted in (("x", 180.0), ("y", 0.0), ("z", 0.0)):
        told = turn[axis]
        assert abs(told["value"] - wanted) < 3.5 * told["sigma"] < 15, axis
    scales = found["recordings"]["real"]["calibration"]
    for name, axis in (("acc_scale", "x"), ("gyr_scale", "z")):
        told = scales[name][axis]
        assert abs(told["value"] - 1) < 0.2 and told["sigma"] < 0.1, name
    before, after = (found["prediction"][n] for n in ("before", "after"))
    assert 0.8 < after["chi2_per_dof"] < 1.3 < before["chi2_per_dof"]
    assert any("says nothing of ay, az, gx, gy" in w for w in found["warnings"])


def calm(directions: list[list[float]], angles: bool) -> tuple[Block, object]:
    t = np.arange(0.0, 10.0 * len(directions), 0.1)
    acc = 9.8 * np.repeat(np.array(directions), 100, axis=0)
    tables = [
        {"start_s": 10.0 * i + 1, "end_s": 10.0 * i + 9}
        | ({"alpha_deg": 0.0, "beta_deg": 0.0} if angles else {})
        for i in range(len(directions))
    ]
    about = description_file.parse_description({"format": 1, "position": tables})
    return Block.of(t, acc), about


@pytest.mark.parametrize(
    ("directions", "angles", "holds"),
    [
        ([[0, 0, 1]] * 4, False, "motion"),
        ([[0, 0, 1], [0, 1, 0], [1, 0, 0]], False, "positions"),
        ([[0, 0, 1], [0, 0.1, 0.995], [1, 0, 0]], False, "motion"),
        ([[0, 0, 1]] * 4, True, "positions"),
        ([[0, 0, 1]] * 2, True, "motion"),
    ],
)
def test_calm_stretches_are_positions_only_if_they_differ(
    directions: list[list[float]], angles: bool, holds: str
) -> None:
    block, about = calm(directions, angles)
    assert isinstance(about, description.Description)
    assert what_is_held(block, about) == holds


@pytest.mark.parametrize(("rest_s", "held"), [(9.5, "one position"), (8.5, "motion")])
def test_a_device_at_rest_rests_nine_tenths_of_the_time(
    rest_s: float, held: str
) -> None:
    block = Block.of(np.arange(0.0, 10.0, 0.1), np.tile([0.0, 0.0, 9.8], (100, 1)))
    window = {"start_s": 0.2, "end_s": 0.2 + rest_s}
    about = description_file.parse_description({"format": 1, "position": [window]})
    assert what_is_held(block, about) == held


def test_what_is_quicker_than_both_share_counts_for_nothing() -> None:
    rng, t = np.random.default_rng(2), np.arange(0.0, 300.0, 0.02)
    slow, quick, other = (
        np.stack([smooth(rng, len(t), hz) for _ in range(6)], axis=1)
        for hz in (0.5, 8.0, 8.0)
    )
    real, sim = (
        Block.of(t, v[:, :3], v[:, 3:]) for v in (slow + quick, slow + 0.8 * other)
    )
    hz = align_motion(real, sim, ("a", "b")).hz
    assert (hz > 0.3).all() and (hz < 1.2).all()
    whole = align_motion(real, real, ("a", "b")).hz
    assert np.isinf(whole).all()


def smooth(rng: np.random.Generator, n: int, hz: float) -> Array:
    """Noise of one standard deviation up to a frequency, at 50 Hz."""
    spectrum = np.fft.rfft(rng.standard_normal(n))
    spectrum[np.fft.rfftfreq(n, 0.02) > hz] = 0.0
    out: Array = np.fft.irfft(spectrum, n)
    return np.asarray(out / out.std(), float)
