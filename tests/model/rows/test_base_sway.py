"""Sessions of the virtual device on a base that sways."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid
from session_folders import recorded, write_session

from benchmarks.papers import sway as pier
from fieldcal.calibration import Calibration
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis import diagnose
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.evaluation.prepared_session import PreparedSession
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.model.rows import base_sway
from fieldcal.model.rows.base_sway import find_base_sway
from fieldcal.session import description_file
from fieldcal.session.factory import factory_errors
from fieldcal.session.folder import Session
from fieldcal.sim_device import profile as device
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.vocabulary import parse
from fieldcal.solve import solve
from fieldcal.windows.sway import find_sway

FACES = ((0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90))
SECONDS, RATE = 30.0, 50.0
NOISE = np.repeat([5e-3, 1e-3], 3)
WHITE = NOISE / np.sqrt(SECONDS * RATE)
TRUTH = device.Truth(
    acc_bias=(0.05, -0.08, 0.03), acc_scale=(1.002, 0.998, 1.001),
    gyr_bias=(2e-3, -1e-3, 3e-3), gyr_scale=device.ONE,
)  # fmt: skip
IRREGULAR = "sway:amplitude_deg=1,hz=0.3,spread_hz=0.04,phase_deg={},azimuth_deg={}"
NAMES = ("bias", "scale")
PERFECT = {"squareness": 0.0, "quadratic": 0.0, "g_sensitivity": 0.0}
LEVEL = {"level_deg": 0.01, "angle_setting_deg": 0.01}


def positions(angles: bool = True) -> list[dict[str, Any]]:
    out: list[dict[str, Any]] = []
    for i, (alpha, beta) in enumerate(FACES):
        start = 4.0 + i * (SECONDS + 8.0)
        out.append({"start_s": start, "end_s": start + SECONDS})
        if angles:
            out[-1] |= {"alpha_deg": float(alpha), "beta_deg": float(beta)}
    return out


def played(seed: int, *effects: str) -> Block:
    profile = Profile(
        sampling=device.Sampling(RATE),
        truth=TRUTH,
        noise=device.NoiseFigures(
            acc=(5e-3,) * 3, gyr=(1e-3,) * 3,
            acc_instability=device.ZERO, gyr_instability=device.ZERO,
        ),
        effects=tuple(parse(e) for e in effects),
    )  # fmt: skip
    return recorded(profile, positions(), seed)


def session(folder: Path, block: Block, **site: Any) -> Session:
    write_session(folder, block, positions(), site=LEVEL | site)
    return Session.open(folder)


def fitted(session: Session) -> Calibration:
    """Solve without a search for effects that the calibration does not carry."""
    laid = PreparedSession(session, usable_windows(session))
    return solve(
        laid.observations,
        recorded=laid.recorded_rows(True),
        level_sigma_deg=LEVEL["level_deg"],
        angle_sigma_deg=LEVEL["angle_setting_deg"],
        factory=factory_errors(session.about),
    )


def off(found: Any) -> Array:
    """Biases less the truth, over their standard deviations."""
    truth = {f"acc_bias.{x}": v for x, v in zip("xyz", TRUTH.acc_bias, strict=True)}
    truth |= {f"gyr_bias.{x}": v for x, v in zip("xyz", TRUTH.gyr_bias, strict=True)}
    at = [found.names.index(n) for n in truth]
    sigma = np.sqrt(np.diag(found.covariance))[at]
    pulls: Array = (found.values[at] - list(truth.values())) / sigma
    return np.column_stack([pulls, sigma]).T


@pytest.mark.thorough
def test_it_calibrates_through_sway(tmp_path: Path) -> None:
    """Biases as on firm ground; scale factors by turns that begin and end aslant."""
    block = played(3, IRREGULAR.format(40, 30), IRREGULAR.format(200, 120))
    one = session(tmp_path / "pier", block)
    swaying = solve_session(one, usable_windows(one))
    firm = session(tmp_path / "firm", played(3))
    there, here = off(swaying), off(fitted(firm))
    assert np.abs(there[0]).max() < 3.5
    assert (there[1] < 1.5 * here[1]).all()
    assert np.abs(there[0] * there[1] - here[0] * here[1]).max() < 1.5 * there[1].max()
    scale = swaying.names.index("gyr_scale.z")
    sigma = float(np.sqrt(swaying.covariance[scale, scale]))
    assert sigma < 5e-4 and abs(swaying.values[scale] - 1) < 4 * sigma
    said = " ".join(swaying.warnings)
    assert "sways by 1" in said and "each position needs" in said
    told = {e.id: e.parameters for e in diagnose(one.block, one.about).effects}
    assert set(told) == {"sway"}
    assert told["sway"]["amplitude_deg"].value == pytest.approx(1.4, abs=0.25)
    assert told["sway"]["hz"].value == pytest.approx(0.3, abs=0.02)
    needed = told["sway"]["needed_s"]
    assert needed.unit == "s" and 5 < float(needed.value) < 100


@pytest.mark.thorough
def test_it_calibrates_accelerometers_without_gyroscopes(tmp_path: Path) -> None:
    """Biases as on firm ground; whether it turns or is pushed, in the scale factors."""
    block = played(3, IRREGULAR.format(40, 30), IRREGULAR.format(200, 120))
    pair = []
    for name, one in (("pier", block), ("firm", played(3))):
        alone = replace(one, gyr=np.full_like(one.gyr, np.nan))
        held = session(tmp_path / name, alone, level_deg=1e-4, angle_setting_deg=1e-4)
        pair.append(solve_session(held, usable_windows(held), left=PERFECT))
    at = [pair[0].names.index(f"acc_{n}.{x}") for n in NAMES for x in "xyz"]
    assert pair[0].names == pair[1].names
    there, here = ((f.values[at], np.sqrt(np.diag(f.covariance))[at]) for f in pair)
    assert (there[1][:3] < 1.5 * here[1][:3]).all()
    assert np.abs(there[0] - here[0])[:3].max() < 1.5 * here[1][:3].max()
    assert np.abs(there[0] - [*TRUTH.acc_bias, *TRUTH.acc_scale])[:3].max() < 4e-4
    lost = np.deg2rad(1.0) ** 2 / 2  # <phi^2> / 2 of gravity
    wider = np.sqrt(there[1][3:] ** 2 - here[1][3:] ** 2)
    assert wider == pytest.approx([lost] * 3, rel=0.3)
    said = " ".join(pair[0].warnings)
    assert "each position needs" in said and "turns or is pushed" in said
    assert "turns or is pushed" not in " ".join(pair[1].warnings)


def test_a_part_of_a_slow_wave_is_no_drift() -> None:
    """Of irregular waves of ten seconds, of which windows hold three."""
    block, firm = pier.played(0, 0.1, 0.1), pier.played(0)
    for held in (pier.held()[2], pier.held()[4]):
        some = (block.t >= held.start) & (block.t < held.end)
        t, six = block.t[some], block.six[some]
        (found,) = find_sway(t, six)
        s = (t - t.mean()) / np.ptp(t) * 2
        left = six - found.outputs(t) - firm.six[some]
        assert np.abs(left[:, :3].T @ s / (s @ s)).max() < 1e-3


def test_beating_waves_have_no_arm() -> None:
    """One axis, and hardly any swaying in the middle of the window."""
    waves = "sway:amplitude_deg=1,hz=0.1008,spread_hz=0.01008,phase_deg=97.12,"
    block = played(100, f"{waves}azimuth_deg=7.375")
    some = (block.t >= positions()[4]["start_s"]) & (block.t < positions()[4]["end_s"])
    (found,) = find_sway(block.t[some], block.six[some])
    assert np.abs(found.arm).max() < 3.0


def test_between_windows_a_device_that_only_sways_turns_by_nothing() -> None:
    """From one attitude at rest to the same: the integral of the rate is zero.

    At 25 Hz the base moves by 0.03 deg in half a sample, which is no noise.
    """
    rate, hz, size = 25.0, 0.31, np.deg2rad(0.9)
    t = np.arange(0.0, 168.0, 1 / rate)
    held = [(3.02 + 41.07 * i, 36.02 + 41.07 * i) for i in range(4)]
    pulse, noise = 2 * np.pi * hz, np.random.default_rng(5)
    turned, rates = size * np.sin(pulse * t), size * pulse * np.cos(pulse * t)
    six = noise.normal(size=(len(t), 6)) * 1e-5
    six[:, 1] += G0 * np.cos(turned)  # a rotation about x of what lies level
    six[:, 2] -= G0 * np.sin(turned)
    six[:, 3] += rates
    block = Block.of(t, six[:, :3], six[:, 3:], np.full(len(t), np.nan))
    about = description_file.parse_description(
        {"position": [{"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": a, "end_s": b}
                      for a, b in held]}
    )  # fmt: skip
    found = find_base_sway(block, about)
    assert found is not None
    for (_, end), (start, _) in pairwise(held):
        gap = slice(*np.searchsorted(t, [end, start]))
        angle = trapezoid(found.block.gyr[gap, 0], t[gap])
        assert abs(angle) < np.deg2rad(0.004)


@pytest.mark.parametrize(("known", "base"), [(4, True), (2, True), (1, False)])
def test_where_known_positions_sway_the_others_do(known: int, base: bool) -> None:
    """Faces without angles beside a ladder; one known position tells no base."""
    rng, rate, size = np.random.default_rng(4), 25.0, np.deg2rad(0.9)
    t = np.arange(0.0, 140.0, 1 / rate)
    turned = size * np.sin(2 * np.pi * 0.31 * t)
    still = rng.normal(size=(len(t), 6)) * NOISE + [0.0, G0, 0.0, 0.0, 0.0, 0.0]
    six = still.copy()
    six[:, 1:3] += G0 * np.column_stack([np.cos(turned) - 1, -np.sin(turned)])
    six[:, 3] += np.gradient(turned, t)
    held = [(2.0 + 34 * i, 32.0 + 34 * i) for i in range(4)]
    places: list[dict[str, Any]] = [{"start_s": a, "end_s": b} for a, b in held]
    for place in places[:known]:
        place |= {"alpha_deg": 0.0, "beta_deg": 0.0}
    about = description_file.parse_description({"position": places})
    block = Block.of(t, six[:, :3], six[:, 3:], np.full(len(t), np.nan))
    found = find_base_sway(block, about)
    assert (found is not None) == base
    if found is not None:
        assert found.amplitude == pytest.approx(size, rel=0.05)
        for a, b in held:
            some = (t >= a) & (t < b)
            spread = (found.block.six[some] - still[some]).std(axis=0)
            assert (spread < 0.5 * NOISE).all()


def test_two_stretches_of_a_window_are_as_uncertain_as_their_mean() -> None:
    """A window of eighty seconds beside some of thirty, on a base that sways."""
    rng, rate = np.random.default_rng(2), 25.0
    t = np.arange(0.0, 210.0, 1 / rate)
    turned = np.deg2rad(0.9) * np.sin(2 * np.pi * 0.31 * t)
    six = rng.normal(size=(len(t), 6)) * NOISE
    six[:, 1] += G0 * np.cos(turned)
    six[:, 2] -= G0 * np.sin(turned)
    six[:, 3] += np.gradient(turned, t)
    held = [(2.0, 32.0), (40.0, 70.0), (78.0, 158.0), (168.0, 198.0)]
    about = description_file.parse_description(
        {"position": [{"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": a, "end_s": b}
                      for a, b in held]}
    )  # fmt: skip
    block = Block.of(t, six[:, :3], six[:, 3:], np.full(len(t), np.nan))
    found = find_base_sway(block, about)
    assert found is not None
    for (start, end), excess in zip(held, found.excess_variance, strict=True):
        some = (t >= start) & (t < end)
        parts = find_sway(t[some], six[some])
        assert len(parts) == 1 + (end - start > 40)
        # means of independent stretches of the same length
        draws = np.array([one.excess_variance for one in parts])
        np.testing.assert_allclose(excess, draws.mean(axis=0) / len(parts), rtol=0.05)


def test_what_a_window_is_too_short_to_show_is_what_waves_leave_in_its_mean() -> None:
    """Of any phase; three quarters of a period are as bad as the average window.

    In the outputs' own units, as the windows that show it.
    """
    rng, rate, hz = np.random.default_rng(2), 25.0, 0.1
    unit = np.array([2.0, 2.0, 2.0, -50.0, -50.0, -50.0])
    t = np.arange(0.0, 110.0, 1 / rate)
    turned = np.deg2rad(0.9) * np.sin(2 * np.pi * hz * t)
    six = rng.normal(size=(len(t), 6)) * NOISE
    six[:, 1] += G0 * np.cos(turned)
    six[:, 2] -= G0 * np.sin(turned)
    six[:, 3] += np.gradient(turned, t)
    six *= unit
    held = [(2.0, 32.0), (40.0, 70.0), (78.0, 85.5)]
    about = description_file.parse_description(
        {"position": [{"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": a, "end_s": b}
                      for a, b in held],
         "nominal": {"acc_scale": unit[:3].tolist(), "gyr_scale": unit[3:].tolist()}}
    )  # fmt: skip
    block = Block.of(t, six[:, :3], six[:, 3:], np.full(len(t), np.nan))
    found = find_base_sway(block, about)
    assert found is not None
    phase = np.linspace(0.0, 2 * np.pi, 360, endpoint=False)
    inside = np.linspace(0.0, 7.5, 2001)
    wave = np.sin(2 * np.pi * hz * inside + phase[:, None]).mean(axis=1)
    angle = np.deg2rad(0.9) * np.sqrt((wave**2).mean())
    expected = angle * np.repeat([about.gravity, 2 * np.pi * hz], 3) * np.abs(unit)
    np.testing.assert_allclose(np.sqrt(found.excess_variance[2]), expected, rtol=0.02)
    assert (found.excess_variance[0] < 0.1 * found.excess_variance[2]).all()


@pytest.mark.parametrize("unit", [[2.0, 2.0, 2.0, 8.0, 8.0, 8.0],
                                  [-1.0, 1.0, 1.0, 1.0, -1.0, -4.0]])  # fmt: skip
def test_sway_is_the_same_in_any_unit_and_of_axes_that_are_mirrored(
    unit: list[float],
) -> None:
    """Forces and rates make one rotation only in axes of one handedness."""
    rng, rate = np.random.default_rng(2), 25.0
    t = np.arange(0.0, 75.0, 1 / rate)
    turned = np.deg2rad(0.9) * np.sin(2 * np.pi * 0.31 * t)
    six = rng.normal(size=(len(t), 6)) * NOISE
    six[:, 1] += G0 * np.cos(turned)
    six[:, 2] -= G0 * np.sin(turned)
    six[:, 3] += np.gradient(turned, t)
    held = [(2.0, 32.0), (40.0, 70.0)]
    about = description_file.parse_description(
        {"position": [{"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": a, "end_s": b}
                      for a, b in held]}
    )  # fmt: skip
    block = Block.of(t, six[:, :3], six[:, 3:], np.full(len(t), np.nan))
    plain = find_base_sway(block, about)
    scaled = {"acc_scale": np.array(unit[:3]), "gyr_scale": np.array(unit[3:])}
    other = replace(about, nominal={**about.nominal, **scaled})
    found = find_base_sway(block.with_six(block.six * unit), other)
    assert plain is not None and found is not None
    assert found.amplitude == pytest.approx(plain.amplitude, rel=1e-6)
    np.testing.assert_allclose(found.block.six / unit, plain.block.six, atol=1e-9)
    variance = found.excess_variance / np.square(unit)
    np.testing.assert_allclose(variance, plain.excess_variance, rtol=1e-6)
    np.testing.assert_allclose(found.white, plain.white * np.abs(unit), rtol=1e-6)


def test_a_window_without_samples_leaves_nothing() -> None:
    one = np.array([7.0])
    assert not base_sway._unseen_sway_variance(np.array([1e-4, 1e-4]), one).any()


@pytest.mark.thorough
def test_means_of_windows_pull_right(tmp_path: Path) -> None:
    pulls = []
    for seed in range(2):
        effects = [IRREGULAR.format(70 * seed, a) for a in (20, 100)]
        quiet = usable_windows(session(tmp_path / f"q{seed}", played(seed))).averages
        found = usable_windows(
            session(tmp_path / f"s{seed}", played(seed, *effects))
        ).averages
        for one, other in zip(found, quiet, strict=True):
            assert (one.sigma < 1.5 * WHITE).all()
            pulls.append((one.mean - other.mean) / one.sigma)
    # the same noise is in both, so what is left is what swaying adds
    assert np.sqrt((np.array(pulls) ** 2).mean()) < 0.9


@pytest.mark.thorough
def test_a_window_too_short_to_show_it_is_as_uncertain_as_its_ends(
    tmp_path: Path,
) -> None:
    """Ten seconds of a swell of ten; the other windows show that the base sways."""
    block = played(2, "sway:amplitude_deg=1,hz=0.1,azimuth_deg=30")
    places = positions()
    places[2]["end_s"] = places[2]["start_s"] + 8.0
    short = Session.open(write_session(tmp_path / "s", block, places))
    found = find_base_sway(block, short.about)
    assert (
        found is not None
        and found.excess_variance[2, 0] > 100 * found.excess_variance[1, 0]
    )
    still = usable_windows(short)  # eight seconds of it creep, and are no rest
    assert 2 not in still.position_numbers and any(
        "position 3" in w for w in still.warnings
    )


def test_samples_that_are_left_out_part_a_window(tmp_path: Path) -> None:
    block = played(2, IRREGULAR.format(40, 30))
    gap = (block.t > 15.0) & (block.t < 19.0)
    block.acc[gap] = block.gyr[gap] = np.nan
    plain = usable_windows(session(tmp_path / "plain", played(2))).averages[0]
    found = usable_windows(session(tmp_path / "gap", block)).averages[0]
    assert (np.abs(found.mean - plain.mean) < 3 * found.sigma).all()


def test_a_device_in_a_hand_is_on_no_base(tmp_path: Path) -> None:
    block = played(1, IRREGULAR.format(40, 30))
    held = write_session(tmp_path / "s", block, positions(angles=False))
    assert not any("sways" in w for w in usable_windows(Session.open(held)).warnings)


def test_who_says_that_it_sways() -> None:
    assert description_file.parse_description(
        {"site": {"sways": True}, "format": 1}
    ).base_sways
    assert not description_file.parse_description({"format": 1}).base_sways


@pytest.mark.thorough
def test_waves_take_slow_noise_with_them_and_the_rows_know_it(tmp_path: Path) -> None:
    """In the band of the waves hardly any noise is left: it is in their uncertainty."""
    block = played(8, IRREGULAR.format(40, 30), IRREGULAR.format(200, 120))
    one = session(tmp_path / "pier", block)
    found = find_base_sway(one.block, one.about)
    assert found is not None
    assert found.white == pytest.approx(NOISE, rel=0.05)
    rows = prepare_recording(one.block, one.about).rows
    assert rows.noise == pytest.approx(NOISE, rel=0.05)
    assert np.nanmedian(rows.sd * np.sqrt(rows.length * RATE)[:, None], axis=0) == (
        pytest.approx(NOISE, rel=0.06)
    )
