"""Times that were counted from a nominal rate: gyroscopes are known no better."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from session_folders import NINE, places, recorded, write_session

from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import Profile

HELD = places(NINE, seconds=12.0, gap=4.0)
FAST = 1.02
"""Seconds that the clock counts in a true one."""

SIGMA = 0.007
"""Relative error that the rate may have."""

SCALES = [f"gyr_scale.{axis}" for axis in "xyz"]


@pytest.fixture(scope="module")
def block() -> Block:
    return recorded(Profile(), HELD)


@pytest.fixture(scope="module")
def exact(block: Block, tmp_path_factory: pytest.TempPathFactory) -> Calibration:
    """With times that are right, and known to be."""
    return solved(tmp_path_factory.mktemp("exact") / "s", block, 1.0, 0.0)


def solved(folder: Path, block: Block, fast: float, sigma: float) -> Calibration:
    stretched = Block.of(fast * block.t, block.acc, block.gyr)
    held = [p | {k: fast * p[k] for k in ("start_s", "end_s")} for p in HELD]
    rate = 100.0 / fast
    sampling = {"rate_hz": rate, "rate_sigma_hz": sigma * rate}
    session = Session.open(write_session(folder, stretched, held, sampling=sampling))
    return solve_session(session, usable_windows(session), "auto")


def test_a_clock_is_what_scale_factors_are_measured_by(
    block: Block, exact: Calibration, tmp_path: Path
) -> None:
    counted = solved(tmp_path, block, FAST, SIGMA)
    for name in SCALES:
        # the same turn lasts longer by this clock, so that it seems to be a larger one
        off = counted.value(name) - exact.value(name)
        assert off == pytest.approx((FAST - 1) * exact.value(name), rel=0.1)
        assert counted.uncertainty(name) == pytest.approx(
            np.hypot(SIGMA, exact.uncertainty(name)), rel=0.15
        )
        assert abs(off) < 3.0 * counted.uncertainty(name)
    assert any("times were counted" in one for one in counted.warnings)


@pytest.mark.thorough
def test_a_clock_that_is_trusted_spoils_scale_factors_in_silence(
    block: Block, exact: Calibration, tmp_path: Path
) -> None:
    trusted = solved(tmp_path, block, FAST, 0.0)
    for name in SCALES:
        assert trusted.value(name) / FAST == pytest.approx(exact.value(name), rel=2e-3)
    assert abs(trusted.value(SCALES[2]) - exact.value(SCALES[2])) > (
        5 * trusted.uncertainty(SCALES[2])
    )
    assert not any("times were counted" in one for one in trusted.warnings)


def test_what_axes_share_leaves_their_ratio_as_well_known(
    block: Block, exact: Calibration, tmp_path: Path
) -> None:
    counted = solved(tmp_path / "counted", block, 1.0, SIGMA)
    apart = np.array([1.0, -1.0])
    for found in (exact, counted):
        at = [found.names.index(n) for n in SCALES[::2]]
        sigma = np.sqrt(apart @ found.covariance[np.ix_(at, at)] @ apart)
        usual = np.hypot(exact.uncertainty(SCALES[0]), exact.uncertainty(SCALES[2]))
        assert sigma < 1.3 * usual
    for name in ("acc_bias.x", "acc_scale.y", "gyr_bias.z"):
        assert counted.value(name) == pytest.approx(exact.value(name), abs=1e-6)


SIX = "ax,ay,az,gx,gy,gz"


def table(folder: Path, block: Block, with_times: bool) -> Path:
    path = folder / "log.csv"
    columns = [block.acc, block.gyr]
    names = SIX
    if with_times:
        columns, names = [block.t[:, None], *columns], f"t,{SIX}"
    np.savetxt(path, np.hstack(columns), delimiter=",", header=names, comments="")
    return path


def imported(path: Path, *more: str) -> int:
    units = ["--acc-unit", "m/s^2", "--gyr-unit", "rad/s"]
    place = ["--latitude", "50.45", "-o", str(path.parent / "s")]
    return main(["import", str(path), *units, *place, *more])


@pytest.mark.parametrize(
    ("more", "hz"), [((), 0.7), (("--rate-sigma", "0.05"), 0.05)], ids=["nominal", "±"]
)
def test_an_import_states_how_well_a_rate_is_known(
    more: tuple[str, ...], hz: float, block: Block, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    path = table(tmp_path, block, False)
    assert imported(path, "--rate", "100", *more) == 0
    session = Session.open(tmp_path / "s")
    assert session.about.raw["sampling"] == {"rate_hz": 100.0, "rate_sigma_hz": hz}
    assert session.about.clock_sigma == pytest.approx(hz / 100)
    assert ("its times are counted at 100 Hz" in capsys.readouterr().err) == (not more)


def test_times_of_its_own_have_no_rate_to_be_wrong(
    block: Block, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = table(tmp_path, block, True)
    assert imported(path, "--rate-sigma", "0.05") == 2
    assert "it has times of its own" in capsys.readouterr().err
    assert imported(path) == 0
    assert "sampling" not in Session.open(tmp_path / "s").about.raw


def test_worse_than_makers_do_it_is_no_value(block: Block, tmp_path: Path) -> None:
    found = solved(tmp_path / "s", block, 1.0, 0.02)
    assert not set(SCALES) & set(found.names)
    said = " ".join(found.warnings)
    assert "known to ± 2 %" in said and "add turns" not in said


@pytest.mark.parametrize("given", ["-1", "nan", "wide"])
def test_an_uncertainty_is_a_number(
    given: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["import", str(tmp_path), f"--rate-sigma={given}"]) == 2
    assert "write by how many Hz" in capsys.readouterr().err
