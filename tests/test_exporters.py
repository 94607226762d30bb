"""Exported numbers, used as each program uses them, against fieldcal's own `apply`."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from fieldcal.calibration import Calibration
from fieldcal.drivers.mavlink_installed import ARDUPILOT, PX4, Installed, names
from fieldcal.errors import InputError
from fieldcal.exporters import ardupilot, px4
from fieldcal.samples import Array, Block

PAIRS = [f"{i}{j}" for i in "123" for j in "123" if i != j]


def calibration(
    rng: np.random.Generator, cross: float, gyr_scale: float = 0.0
) -> Calibration:
    values = {
        "acc_bias": rng.normal(0, 0.3, 3),
        "acc_scale": 1 + rng.normal(0, 0.02, 3),
        "gyr_bias": rng.normal(0, 0.02, 3),
    }
    if gyr_scale:
        values["gyr_scale"] = 1 + rng.normal(0, gyr_scale, 3)
    flat = {
        f"{g}.{a}": v
        for g, three in values.items()
        for a, v in zip("xyz", three, strict=True)
    }
    if cross:
        flat |= {f"cross_coupling.k{p}": rng.normal(0, cross) for p in PAIRS}
        if gyr_scale:
            flat |= {f"gyro_cross_coupling.e{p}": rng.normal(0, cross) for p in PAIRS}
    k = len(flat)
    return Calibration(
        "joint", tuple(flat), np.array(list(flat.values())), 1e-8 * np.eye(k),
        ("1",) * k, 1.0, 1, 1e-3,
    )  # fmt: skip


def samples(rng: np.random.Generator, n: int = 200) -> Block:
    return Block.of(
        np.arange(n) / 100, rng.normal(0, 9, (n, 3)), rng.normal(0, 1, (n, 3))
    )


def corrected(
    values: dict[str, float], autopilot: int, instance: int, raw: Block
) -> tuple[Array, Array]:
    """(raw - offset) * scale, as both autopilots do it."""
    known = names(autopilot, instance)
    offset, scale, gyro = (
        np.array([values[n] for n in known[what]])
        for what in ("acc_offset", "acc_scale", "gyr_offset")
    )
    return (raw.acc - offset) * scale, raw.gyr - gyro


@pytest.mark.parametrize(("module", "number"), [(ardupilot, ARDUPILOT), (px4, PX4)])
@pytest.mark.parametrize("instance", [0, 2])
def test_an_autopilot_corrects_raw_samples_as_apply_does(
    module: ModuleType, number: int, instance: int
) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        cal, raw = calibration(rng, 0.0), samples(rng)
        found = module.parameters(cal, instance=instance)
        acc, gyr = corrected(dict(found.values), number, instance, raw)
        np.testing.assert_allclose(acc, cal.apply(raw).acc, atol=1e-12)
        np.testing.assert_allclose(gyr, cal.apply(raw).gyr, atol=1e-12)
        assert not found.says


@pytest.mark.parametrize(("module", "number"), [(ardupilot, ARDUPILOT), (px4, PX4)])
@pytest.mark.parametrize("taken_out", [False, True])
def test_what_was_installed_is_put_together_with_what_was_found(
    module: ModuleType, number: int, taken_out: bool
) -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        known = names(number, 1)
        device = Installed(number, 1, dict.fromkeys(known["rotation"], 0.0), taken_out)
        for what, centre, width in (
            ("acc_offset", 0, 0.4),
            ("acc_scale", 1, 0.03),
            ("gyr_offset", 0, 0.02),
        ):
            device.values |= {n: float(rng.normal(centre, width)) for n in known[what]}
        raw, cal = samples(rng), calibration(rng, 0.0)
        acc, gyr = corrected(device.values, number, 1, raw)
        sent = raw if taken_out else Block.of(raw.t, acc, gyr)
        new = module.parameters(
            cal, installed=Installed.from_table(device.as_table())
        ).values
        acc, gyr = corrected(dict(new), number, 1, raw)
        np.testing.assert_allclose(acc, cal.apply(sent).acc, atol=1e-12)
        np.testing.assert_allclose(gyr, cal.apply(sent).gyr, atol=1e-12)


def test_what_an_autopilot_has_no_place_for_is_said_with_its_size() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        cal = calibration(rng, 0.003, 0.01)
        raw = samples(rng)
        found = ardupilot.parameters(cal)
        acc, _ = corrected(dict(found.values), ARDUPILOT, 0, raw)
        true = cal.apply(raw).acc
        error = np.abs(acc - true).max(axis=1) / np.linalg.norm(true, axis=1)
        (said,) = [s for s in found.says if s.startswith("cross_coupling")]
        bound = float(said.split(" m/s^2")[0].rpartition(" ")[2]) / 9.80665
        assert error.max() <= bound * 1.01
        assert error.max() > 0.3 * bound
        assert any(s.startswith("gyr_scale") for s in found.says)


def test_parameters_of_another_program_or_a_turned_board_are_refused() -> None:
    rng = np.random.default_rng(4)
    cal = calibration(rng, 0.0)
    with pytest.raises(InputError, match="another autopilot"):
        ardupilot.parameters(cal, installed=Installed(PX4, 0))
    turned = Installed(
        PX4, 0, {n: 1.0 for some in names(PX4, 0).values() for n in some}
    )
    with pytest.raises(InputError, match="SENS_BOARD_ROT"):
        px4.parameters(cal, installed=turned)
    with pytest.raises(InputError, match="in full"):
        Installed.from_table({"parameters": 3})
