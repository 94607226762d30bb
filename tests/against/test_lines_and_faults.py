"""A line that both have, where a channel shows it above its noise in one of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from strapdown_sessions import DEVICE, played

from benchmarks.concealed import kinds
from fieldcal.against.lines_and_faults import compare_lines_and_faults
from fieldcal.against.side import DiagnosedRecording, diagnose_side
from fieldcal.diagnosis.result import FoundEffect, Quantity

HZ, LOUD = 7.3, 0.02
"""Hz, and amplitude on a_x, m/s^2: 60 standard deviations."""

CLEAR, FAINT = 0.0026, 0.0008
"""Amplitudes on a_y, m/s^2: 7 and 2 standard deviations."""


def humming(seed: int, weak: float) -> DiagnosedRecording:
    """The device with a line on two channels."""
    block, about = played(DEVICE, seed)
    wave = np.sin(2 * np.pi * HZ * block.t)
    acc = block.acc + np.outer(wave, [LOUD, weak, 0.0])
    return diagnose_side("simulator", replace(block, acc=acc), about)


def with_effects(one: DiagnosedRecording, **at: tuple[float, float]) -> Any:
    """The recording with effects of an instant alone: when, and for how long or ±."""
    effects = [
        FoundEffect(
            name,
            {"at_s": Quantity(when, 0.05, "s"), "for_s": Quantity(much, 0.1, "s")}
            if name == "bump"
            else {"at_s": Quantity(when, much, "s")},
        )
        for name, (when, much) in at.items()
    ]
    return replace(one, diagnosis=replace(one.diagnosis, effects=tuple(effects)))


def test_a_touch_at_the_instant_of_a_slip_of_the_other_is_that_slip(
    clear: DiagnosedRecording, faint: DiagnosedRecording
) -> None:
    """Both slip there; in one the samples of the turn stand out of the noise."""
    at = clear.start + 20.0
    touched = with_effects(clear, bump=(at, 0.3), mount_slip=(at + 1.0, 2.0))
    slipped = with_effects(faint, mount_slip=(at + 2.0, 1.5))
    still = with_effects(faint)
    elsewhere = with_effects(faint, mount_slip=(at + 30.0, 1.5))
    assert compare_lines_and_faults(touched, slipped) == ([], ())
    assert compare_lines_and_faults(slipped, touched) == ([], ())
    for other in (still, elsewhere):
        (one,), _ = compare_lines_and_faults(touched, other)
        (two,), _ = compare_lines_and_faults(other, touched)
        assert (one.id, one.direction) == ("bump", "left_out")
        assert (two.id, two.direction) == ("bump", "added")


def told(one: DiagnosedRecording) -> set[str]:
    """Parameters of the line in its own diagnosis."""
    (hum,) = (e for e in one.diagnosis.effects if e.id == "hum")
    return set(hum.parameters)


@pytest.fixture(scope="module")
def clear() -> DiagnosedRecording:
    return humming(1, CLEAR)


@pytest.fixture(scope="module")
def faint() -> DiagnosedRecording:
    return humming(4, FAINT)


def test_an_amplitude_within_the_noise_is_measured(
    clear: DiagnosedRecording, faint: DiagnosedRecording
) -> None:
    """It is not zero, from which the clear one differs by 7 standard deviations."""
    assert told(clear) == {"ax", "ay", "hz"} and told(faint) == {"ax", "hz"}
    assert compare_lines_and_faults(clear, faint) == ([], ("hum",))
    assert compare_lines_and_faults(faint, clear) == ([], ("hum",))


def test_a_channel_without_the_line_is_a_difference(faint: DiagnosedRecording) -> None:
    loud = humming(3, 2 * CLEAR)
    for one, two, sign in ((loud, faint, 1), (faint, loud, -1)):
        (found,), alike = compare_lines_and_faults(one, two)
        assert (found.id, found.direction, alike) == ("hum", "resized", ())
        apart = {"ax": 0.0, "ay": 2 * CLEAR - FAINT, "hz": 0.0}
        assert found.parameters.keys() == apart.keys()
        for name, true in apart.items():
            pair = found.parameters[name]
            assert pair.real is not None and pair.simulator is not None
            sigma = pair.difference.sigma
            assert sigma is not None
            assert abs(float(pair.difference.value) - sign * true) < 4 * sigma


@pytest.mark.thorough
def test_a_base_that_sways_by_little_is_a_hum_in_one_of_the_two() -> None:
    """By 2 mdeg at 0.9 Hz: its force is like the noise, and shows in one only."""
    seed = 98_800_240
    session = kinds()["sway"][0](np.random.default_rng(seed))
    real = diagnose_side("recording", session.record(2 * seed + 5), session.about)
    again = session.record(2 * seed)
    sim = diagnose_side("simulator", again, session.about, real)
    named = [{e.id for e in one.diagnosis.effects} for one in (real, sim)]
    assert named == [{"hum"}, {"sway"}]
    assert compare_lines_and_faults(real, sim) == ([], ("sway",))
    assert compare_lines_and_faults(sim, real) == ([], ("hum",))
