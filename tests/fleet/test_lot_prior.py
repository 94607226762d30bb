"""What a lot says of its next unit, against the units that it was drawn from."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.recorded_part import RecordedPart
from fieldcal.core.samples import Array
from fieldcal.fleet.lot_prior import estimate_lot_prior
from fieldcal.history import sessions
from fieldcal.history.database import Database
from fieldcal.history.sessions import StoredSession
from fieldcal.sim_device.profile import Profile

NAMES = ("acc_bias.x", "acc_bias.y", "gyr_bias.z", "acc_scale.x")
UNITS = ("m/s^2", "m/s^2", "rad/s", "1")
MIDDLE = np.array([0.1, -0.2, 1e-3, 1.002])
WIDE = np.array([0.02, 0.02, 1e-4, 1e-3])
LADDER = [(0.0, 0.0), (45.0, 5.0), (-45.0, -5.0), (45.0, -5.0), (-45.0, 5.0)]
ERROR = np.array([0.02, 0.01, 1e-4, 5e-4])


@pytest.fixture(autouse=True)
def few_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many as these units need, whose errors are as large as their spread."""
    monkeypatch.setattr("fieldcal.fleet.lot_prior.KEPT_DRAWS", 300)


def calibration(x: Array, sigma: Array, together: float = 0.0) -> Calibration:
    alike = (1 - together) * np.eye(len(x)) + together
    return Calibration("joint", NAMES[: len(x)], x, alike * sigma * sigma[:, None],
                       UNITS[: len(x)], 1.0, 3, 0.01)  # fmt: skip


def stored(i: int, found: Calibration, place: bool = True) -> StoredSession:
    one = sessions.session_of_calibration(Path(f"/s/{i}"), found, None)
    known = {"conditions": {"latitude_deg": 50.0}, "site": {"height_m": 100.0}}
    result = {**(one.result or {}), **(known if place else {})}
    return replace(one, serial=f"A{i}", levels={"lot": "7"}, result=result)


def drawn(
    rng: np.random.Generator, count: int, lot: float = 0.0, error: float = 0.0
) -> list[StoredSession]:
    """Units; the first two parameters go together by `lot`, errors by `error`."""
    cov = np.diag(WIDE**2)
    cov[0, 1] = cov[1, 0] = lot * WIDE[0] * WIDE[1]
    out = []
    for i in range(count):
        found = calibration(MIDDLE, ERROR * rng.uniform(0.7, 1.4), error)
        true = rng.multivariate_normal(MIDDLE, cov)
        x = rng.multivariate_normal(true, found.covariance)
        out.append(stored(i, replace(found, values=x)))
    return out


def test_mean_and_spread_are_those_of_the_next_unit() -> None:
    found = estimate_lot_prior("lot 7", drawn(np.random.default_rng(1), 400))
    assert found.names == NAMES and found.units == (400,) * 4
    np.testing.assert_allclose(found.mean, MIDDLE, atol=4 * (WIDE + ERROR).max() / 20)
    np.testing.assert_allclose(found.sigma, WIDE, rtol=0.2)
    off = found.covariance / found.sigma / found.sigma[:, None] - np.eye(4)
    assert np.abs(off).max() < 0.25 and (found.outlier_probability < 0.02).all()


@pytest.mark.parametrize("lot", [0.8, pytest.param(-0.8, marks=pytest.mark.thorough)])
def test_what_goes_together_in_a_lot_is_told_from_errors_that_do(lot: float) -> None:
    found = estimate_lot_prior("7", drawn(np.random.default_rng(2), 300, lot, -lot / 3))
    made = found.covariance[0, 1] / found.sigma[0] / found.sigma[1]
    assert made == pytest.approx(lot, abs=0.15)
    few = estimate_lot_prior("7", drawn(np.random.default_rng(3), 6, lot, -lot / 3))
    assert abs(few.covariance[0, 1]) < 0.75 * few.sigma[0] * few.sigma[1]


@pytest.mark.thorough
@pytest.mark.statistical
def test_few_units_leave_as_much_open_as_is_said() -> None:
    rng = np.random.default_rng(4)
    off = []
    for _ in range(10):
        found = estimate_lot_prior("7", drawn(rng, 7))
        following = MIDDLE + WIDE * rng.standard_normal((3, 4))
        off.append((following - found.mean) / found.sigma)
    inside = np.mean(np.abs(off) < 1.96)
    assert 0.91 < inside < 0.99, "of 120 intervals"


def test_odd_units_and_the_unit_itself_have_no_say() -> None:
    rng = np.random.default_rng(5)
    some = drawn(rng, 60, 0.5)
    plain = estimate_lot_prior("7", some[1:])
    itself = estimate_lot_prior("7", some, serial="A0", folder="/none")
    again = estimate_lot_prior("7", some, folder=some[0].folder)
    part = RecordedPart("5a", 0.0, 9.0)
    copied = [replace(some[0], folder="/copy", serial="", part=part), *some[1:]]
    copy = estimate_lot_prior("7", copied, folder=some[0].folder, part=part)
    np.testing.assert_array_equal(copy.mean, plain.mean)
    for found in (itself, again):
        np.testing.assert_array_equal(found.covariance, plain.covariance)
    odd = calibration(MIDDLE + 30 * WIDE, ERROR)
    beside = estimate_lot_prior("7", [*some[1:], stored(90, odd)])
    np.testing.assert_allclose(beside.sigma, plain.sigma, rtol=0.1)
    assert (np.abs(beside.mean - plain.mean) < 0.1 * WIDE).all()
    np.testing.assert_allclose(beside.covariance, plain.covariance, rtol=0.25,
                               atol=0.02 * np.outer(WIDE, WIDE).max())  # fmt: skip


def test_scale_factors_count_where_gravity_was_known() -> None:
    rng = np.random.default_rng(6)
    nowhere = [stored(i, calibration(MIDDLE + WIDE * rng.standard_normal(4), ERROR),
                      place=False) for i in range(9)]  # fmt: skip
    assert estimate_lot_prior("7", nowhere).names == NAMES[:3]
    with pytest.raises(InputError, match="a lot needs 5"):
        estimate_lot_prior("7", nowhere[:4])


def test_what_was_borrowed_is_not_learned_from_again() -> None:
    found = calibration(MIDDLE, 0.1 * ERROR)
    told = {
        "refused": False,
        "parameters": {
            name: {"own_value": float(x), "own_sigma": float(s), "sigma": 0.1 * s}
            for name, x, s in zip(NAMES, MIDDLE + ERROR, ERROR, strict=True)
        },
    }
    told["parameters"]["gyr_bias.z"]["own_sigma"] = None  # type: ignore[index]
    one = stored(99, replace(found, info={"borrowed": told}))
    assert "gyr_bias.z" not in one.parameters
    value, sigma, unit = one.parameters["acc_bias.x"]
    assert (value, unit) == (MIDDLE[0] + ERROR[0], "m/s^2")
    assert sigma == pytest.approx(ERROR[0])
    rng = np.random.default_rng(7)
    others = drawn(rng, 8)
    assert estimate_lot_prior("7", [*others, one]).units == (9, 9, 8, 9)


@pytest.fixture
def five(tmp_path: Path) -> Path:
    """A session of five positions."""
    held = places(LADDER, seconds=6.0, gap=6.0)
    folder = tmp_path / "session"
    site = {"latitude_deg": 50.45, "height_m": 170.0}
    write_session(folder, recorded(Profile(), held, seed=3), held, site=site)
    return folder


@pytest.mark.thorough
def test_solve_takes_the_lot_from_the_store(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], five: Path
) -> None:
    own = ["--history", str(tmp_path / "h")]
    assert main(["solve", str(five), "--json", *own]) in (0, 1)
    alone = json.loads(capsys.readouterr().out)
    names, matrix = alone["covariance"]["names"], alone["covariance"]["matrix"]
    wide = np.sqrt(np.diag(matrix))
    mean = np.array([
        Calibration.from_json(alone).value(name) for name in names
    ])  # fmt: skip
    rng = np.random.default_rng(8)

    def put(db: object) -> None:
        for i in range(24):
            off = 0.5 * wide * rng.standard_normal(len(names))
            made = replace(Calibration.from_json(alone), values=mean + off)
            one = stored(i, replace(made, covariance=1e-4 * made.covariance))
            sessions.store_session(db, one)  # type: ignore[arg-type]

    Database(tmp_path / "h").run(put, write=True)
    call = ["solve", str(five), "--lot", "lot=7", *own]
    assert main(call) in (0, 1)
    text = capsys.readouterr().out
    beside = json.loads((five / "result.json").read_text())
    told = beside["borrowed"]
    assert told["lot"] == "lot=7" and not told["refused"]
    assert told["parameters"]["acc_bias.x"]["units"] == 24
    found = Calibration.from_json(beside)
    assert found.uncertainty("acc_bias.x") < 0.9 * wide[names.index("acc_bias.x")]
    assert "Beside lot=7" in text and "± both" in text and "…" not in text
    assert "24 units of lot=7" in text
    for wrong in (["--lot", "lot=8"], ["--lot", "7"]):
        assert main(["solve", str(five), *wrong, *own]) == 2
    assert "lot=8: 0 other units" in capsys.readouterr().err
