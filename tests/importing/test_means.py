"""Tables of means: a session like any other, or a question about how well they hold."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import G, write

from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.importing.headings.heading import Column
from fieldcal.importing.headings.headings import match_headings
from fieldcal.importing.tables.means import estimate_mean_uncertainty
from fieldcal.importing.units.gravity_size import are_means, estimate_gravity
from fieldcal.session.folder import Session

BIAS, RATE = np.array([0.1, -0.05, 0.2]), np.array([0.01, -0.02, 0.005])
SIX = "ax,ay,az,gx,gy,gz"
STD = ",".join(f"{name}_std" for name in SIX.split(","))
SIGMA, SCATTER, COUNT = 4e-4, 0.02, 2500


def means(seed: int, n: int, coupling: float = 0.0) -> Array:
    """Means of a device in n orientations (n, 6), m/s^2 and rad/s."""
    rng = np.random.default_rng(seed)
    up = rng.normal(size=(n, 3))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    gain = np.diag([1.004, 0.997, 1.006])
    gain[0, 1] = coupling
    acc = G * up @ gain.T + BIAS + rng.normal(0, SIGMA, (n, 3))
    return np.hstack([acc, RATE + rng.normal(0, 1e-4, (n, 3))])


def session(
    folder: Path, rows: Array, heading: str, *more: str
) -> tuple[Path, Session]:
    path = write(folder, rows, heading=heading)
    out = folder / "out"
    assert main(["import", str(path), "-o", str(out), "--gravity", str(G), *more]) == 0
    return out, Session.open(out)


@pytest.mark.parametrize(
    ("coupling", "scattered"),
    [(0.0, True), pytest.param(0.01, False, marks=pytest.mark.thorough)],
)
def test_means_are_a_session_like_any_other(
    coupling: float, scattered: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows, heading = means(1, 20, coupling), SIX
    if scattered:
        beside = np.full((20, 6), [SCATTER] * 3 + [5e-3] * 3)
        rows = np.hstack([rows, beside, np.full((20, 1), COUNT)])
        heading = f"{SIX},{STD},n"
    out, made = session(tmp_path, rows, heading)
    assert "20 positions, means only" in capsys.readouterr().err
    assert ("sigma" in made.about.raw.get("guessed", {})) == (not scattered)
    assert main(["solve", str(out), "--cross", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["parameters"]
    for name, truth in (("acc_bias", BIAS), ("gyr_bias", RATE)):
        off = np.abs(np.array(found[name]["value"]) - truth) / found[name]["sigma"]
        assert off.max() < 4 and max(found[name]["sigma"]) < 1e-3
    assert main(["diagnose", str(out), "--json"]) == (1 if coupling else 0)
    said = json.loads(capsys.readouterr().out)
    assert [e["id"] for e in said["effects"]] == ["cross_coupling"] * bool(coupling)
    assert main(["report", str(out)]) == main(["verify", str(out)]) == 0


def test_without_gyroscopes_names_or_unit(tmp_path: Path) -> None:
    out, made = session(tmp_path, means(2, 20)[:, :3] / G, "")
    assert {"columns", "acceleration", "sigma"} == set(made.about.raw["guessed"])
    assert main(["solve", str(out)]) == main(["diagnose", str(out)]) == 0


def test_times_that_are_written_are_kept(tmp_path: Path) -> None:
    rows = np.column_stack([40.0 * np.arange(12), means(3, 12)])
    _, made = session(tmp_path, rows, f"t [s],{SIX}")
    assert made.about.means_timed
    np.testing.assert_allclose(made.block.t, rows[:, 0])


def test_too_few_positions_are_asked_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, means(4, 6), heading=SIX)
    assert main(["import", str(path), "-o", str(tmp_path / "s")]) == 2
    assert "add --sigma 0.005,0.0005" in capsys.readouterr().err
    call = ["import", str(path), "-o", str(tmp_path / "s"), "--sigma"]
    assert main([*call, "-1"]) == 2
    assert "cannot be" in capsys.readouterr().err
    assert main([*call, "0.001,0.0001"]) == 0
    sigma = Session.open(tmp_path / "s").about.mean_sigma
    assert (sigma == [1e-3] * 3 + [1e-4] * 3).all()


@pytest.mark.thorough
@pytest.mark.statistical
def test_what_remains_of_gravity_is_the_error_of_the_means() -> None:
    found = [
        estimate_mean_uncertainty(
            means(seed, 24, 0.01), np.full((24, 6), np.nan), None, G
        ).sigma[0, 0]
        for seed in range(40)
    ]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(SIGMA, rel=0.1)


@pytest.mark.thorough
@pytest.mark.statistical
def test_a_position_that_was_moved_is_no_part_of_the_scatter() -> None:
    found = []
    for seed in range(30):
        table = means(100 + seed, 40, 0.01)
        table[seed, 2] += 0.8
        found.append(
            estimate_mean_uncertainty(table, np.full((40, 6), np.nan), None, G).sigma[
                0, 0
            ]
        )
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(SIGMA, rel=0.15)
    # where hardly more rows than parameters are there, none can be told from the others
    few = means(7, 12, 0.01)
    few[3, 2] += 0.8
    assert (
        estimate_mean_uncertainty(few, np.full((12, 6), np.nan), None, G).sigma[0, 0]
        > 9 * SIGMA
    )


def test_a_position_that_was_moved_is_named_and_costs_the_others_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = means(8, 40)[:, :3]
    table[12, 2] += 0.8
    out, _ = session(tmp_path, table, "ax,ay,az")
    capsys.readouterr()
    assert main(["solve", str(out), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert "position 13 disagrees" in " ".join(found["warnings"])
    # the jumps of the table are no bytes that were decoded wrongly
    assert "decoded" not in " ".join(found["warnings"])
    off = np.array(found["parameters"]["acc_bias"]["value"]) - BIAS
    sigma = np.array(found["parameters"]["acc_bias"]["sigma"])
    # a kink that the factory may have left is part of it
    assert (np.abs(off) < 3 * sigma).all() and sigma.max() < 8e-4


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [30])
def test_a_position_that_was_moved_hides_no_effect(
    seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither the effect nor the position explains much while the other is there."""
    table = means(seed, 40, 0.02)[:, :3]
    table += np.random.default_rng(seed).normal(0, 0.01, table.shape)
    table[12, 2] += 0.8
    out, _ = session(tmp_path, table, "ax,ay,az")
    capsys.readouterr()
    assert main(["diagnose", str(out), "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert [e["id"] for e in said["effects"]] == ["cross_coupling"]
    assert main(["solve", str(out), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert "cross_coupling" in " ".join(found["warnings"])
    parameters = found["parameters"]["acc_bias"]
    assert (
        np.abs(parameters["value"] - BIAS) < 4 * np.array(parameters["sigma"])
    ).all()
    assert max(parameters["sigma"]) < 0.006


def test_a_mean_its_scatter_and_what_it_ought_to_be_stand_beside_each_other(
    tmp_path: Path,
) -> None:
    # six faces of a device with 0.25 g of bias, as a table of a report has them
    offset = np.array([0.09, 0.05, -0.25])
    faces = np.vstack([np.eye(3), -np.eye(3)])
    table = [
        [part for axis in range(3) for part in (f[axis], f[axis] + offset[axis], 4e-3)]
        for f in faces
    ]
    heading = ",".join(f"{c}_true (g),{c}_mean (g),{c}_std" for c in "xyz")
    _, made = session(tmp_path, np.array(table), heading)
    np.testing.assert_allclose(made.block.acc, (faces + offset) * G0, atol=1e-6)
    np.testing.assert_allclose(made.about.mean_sigma[:, :3], 4e-3 * G0, rtol=1e-3)


def test_what_outputs_ought_to_be_is_taken_where_it_stands_alone() -> None:
    def found(*names: str) -> list[tuple[str, ...]]:
        return [h.columns for h in match_headings([Column(n, n) for n in names])]

    true = [f"true_acc_{c} (m/s^2)" for c in "xyz"]
    sensed = [f"acc_{c} (m/s^2)" for c in "xyz"]
    assert found(*true, *sensed) == [tuple(f"a{n[4]}={n}" for n in sensed)]
    assert found(*true) == [tuple(f"a{n[9]}={n}" for n in true)]


def test_samples_are_no_means() -> None:
    assert are_means(means(5, 12)[:, :3])
    angle = np.deg2rad(np.arange(60.0))
    slow = G * np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    # counts about an offset that is larger than gravity
    assert are_means(means(6, 12)[:, :3] * 40 + 33000)
    noise = np.random.default_rng(7).normal(0, 0.01, (60, 3)) + [0.1, -0.2, 9.8]
    assert not are_means(noise)
    assert not are_means(slow) and not are_means(slow[:2]) and not are_means(0 * slow)


def test_what_a_hand_shakes_is_no_table_of_means(tmp_path: Path) -> None:
    """Ten rows a second, each turned far from the one before."""
    shaken = means(9, 36)
    shaken[:, 3:] = np.random.default_rng(9).normal(0, 3, (36, 3))
    for size, unit in ((1.0, "s"), (1e3, "ms")):
        t = size * 0.1 * np.arange(36)
        assert are_means(shaken[:, :3]) and not are_means(shaken[:, :3], t / size)
        path = write(
            tmp_path, np.column_stack([t, shaken]), heading=f"t ({unit}),{SIX}"
        )
        out = tmp_path / unit
        assert main(["import", str(path), "-o", str(out), "--gyr-unit", "rad/s"]) == 0
        made = Session.open(out)
        assert not made.about.positions and "means" not in made.about.raw


def test_rates_tell_what_a_hand_shakes_where_there_are_no_times(
    tmp_path: Path,
) -> None:
    shaken = means(9, 36)
    shaken[:, 3:] = np.random.default_rng(9).normal(0, 80, (36, 3))
    for heading in (SIX, "ax,ay,az,gx (deg/s),gy (deg/s),gz (deg/s)"):
        with pytest.raises(InputError, match="no column is t, the time"):
            read_files([write(tmp_path, shaken, heading=heading)])


def test_rounding_at_rest_is_no_sphere() -> None:
    """Each axis changes between two numbers: the corners of a box lie on a sphere."""
    rng = np.random.default_rng(8)
    at = np.array([0.002, -0.002, 0.9995])
    rounded = np.round(at + [4e-4, 5e-4, 5e-4] * rng.integers(0, 2, (400, 3)), 4)
    for rows in (rounded[:40], rounded):
        assert not are_means(rows)
        gravity = estimate_gravity(rows)
        assert gravity is not None and not gravity.round
        np.testing.assert_allclose(gravity.size, 1, rtol=1e-3)


def test_a_scatter_that_is_only_rounding_is_none() -> None:
    means = np.array([[0.0, 0, 9.8, 1e-2, 2e-3, -3e-3]] * 9)
    scatter = np.array([[0.1, 0.1, 0.1, 1e-17, 9e-18, 5e-18]] * 9)
    sigma = estimate_mean_uncertainty(means, scatter, np.full(9, 100.0), 9.8).sigma
    np.testing.assert_allclose(sigma[:, :3], 0.01)
    assert np.isnan(sigma[:, 3:]).all()


@pytest.mark.parametrize(
    "beside", ["std Ax,std Ay,std Az", "mx,my,mz", "Roll,Pitch,Yaw"]
)
def test_what_names_say_is_none_is_no_gyroscope(tmp_path: Path, beside: str) -> None:
    other = 0.02 + 1e-3 * np.random.default_rng(6).random((6, 3))
    rows = np.hstack([means(5, 6)[:, :3], other, np.full((6, 1), COUNT)])
    out, made = session(tmp_path, rows, f"Ax,Ay,Az,{beside},N", "--sigma", "0.01,0.001")
    assert made.block.acc.shape == (6, 3) and np.isnan(made.block.gyr).all()


FAULTS = {
    "constant": (1, "the gyroscopes are not used: gx never changes"),
    "empty": (0, "the gyroscopes are not used: gx never changes, or is missing"),
    "one cell": (2, "position 3 (position 3) has no mean of gy"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_channel_that_says_nothing_leaves_each_uncertainty_with_its_own(
    fault: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = means(8, 14)
    rows[:, 4] += np.tile([3e-3, -3e-3], 7)
    if fault == "one cell":
        rows[2, 4] = np.nan
    else:
        rows[:, 3] = 0.01 if fault == "constant" else np.nan
    out, made = session(tmp_path, rows, SIX)
    sigma, known = made.about.mean_sigma, np.isfinite(rows)
    known[:, 3] &= fault == "one cell"
    assert (np.isfinite(sigma) == known).all()
    for c in (3, 4, 5):
        shown = rows[known[:, c], c]
        if len(shown):
            expected = shown.std(ddof=1)
            np.testing.assert_allclose(sigma[known[:, c], c], expected, rtol=1e-3)
    code, sentence = FAULTS[fault]
    assert (main(["verify", str(out)]), main(["solve", str(out)])) == (0, code)
    told = capsys.readouterr()
    assert sentence in " ".join((told.out + told.err).split())


def test_a_scatter_of_the_gyroscopes_alone_leaves_gravity_to_tell_the_rest() -> None:
    rows, count = means(9, 20), np.full(20, 100.0)
    scatter = np.hstack([np.full((20, 3), np.nan), np.full((20, 3), 2e-3)])
    found = estimate_mean_uncertainty(rows, scatter, count, G)
    np.testing.assert_allclose(found.sigma[:, 3:], 2e-4)
    np.testing.assert_allclose(found.sigma[:, :3], SIGMA, rtol=0.6)
    assert found.why.endswith(
        "their scatter, and what remains of |a| = g and of steady rates"
    )


@pytest.mark.parametrize("what", ["empty", "names again", "damaged"])
def test_a_line_that_is_no_position_leaves_the_others_their_own_scatter(
    tmp_path: Path, what: str
) -> None:
    rows = means(7, 12)
    scatter = SCATTER * (1 + np.arange(12))
    table = np.column_stack([rows, *[scatter] * 3, *[scatter / 4] * 3, [COUNT] * 12])
    path = write(tmp_path, table, heading=f"{SIX},{STD},n")
    head, *lines = path.read_text().splitlines()
    odd = {"empty": "," * 12, "names again": head, "damaged": f"x{lines[4]}"}[what]
    path.write_text("\n".join([head, *lines[:4], odd, *lines[4:]]) + "\n")
    out = tmp_path / "out"
    call = ["import", str(path), "-o", str(out), "--gravity", str(G)]
    assert main([*call, *(["--repair"] if what == "damaged" else [])]) == 0
    sigma = Session.open(out).about.mean_sigma
    expected = np.outer(scatter / np.sqrt(COUNT), [1, 1, 1, 0.25, 0.25, 0.25])
    np.testing.assert_allclose(sigma, expected, rtol=1e-3)


def test_an_axis_that_a_position_lacks_is_unknown_there_alone(tmp_path: Path) -> None:
    rows = means(8, 12)
    rows[3, 0] = np.nan
    _, made = session(tmp_path, rows, SIX, "--sigma", "0.005,0.0005")
    assert np.argwhere(np.isnan(made.about.mean_sigma)).tolist() == [[3, 0]]


def test_of_named_means_no_rate_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    session(tmp_path, means(3, 12)[:, :3], "acc_x,acc_y,acc_z")
    said = capsys.readouterr().err
    assert "taken from the names of its columns: --columns ax,ay,az" in said
    assert "--rate" not in said
