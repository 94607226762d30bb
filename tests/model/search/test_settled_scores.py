"""Sets whose estimates are far from the state of the rows, about their own states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_sessions import SD, G, dictionary, ladder, nominal, rows_of

from fieldcal.core.samples import Array
from fieldcal.effects.mount_slip import MountSlip
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.rows.averages import Rows
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.inference import InferenceResult
from fieldcal.model.search.selection import Search
from fieldcal.model.search.settled_scores import correct_scores
from fieldcal.model.system.linear_system import gram
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.physics.experience import Experience

LAST = 8
"""The last position of the ladder, where a step of the bias would do as well."""


def outputs(turn: float) -> Array:
    """Outputs, (n, 6), of which the last position is turned in alpha, rad."""
    x = ladder()
    held = x.position == LAST
    f = x.f.copy()
    f[held] = Experience.at_rest(x.alpha[held] + turn, x.beta[held], G).f
    return np.hstack([f, x.w])


def linear_outputs(turn: float) -> Array:
    """The same if the force were linear in the angle."""
    step = 1e-6
    slope = (outputs(step) - outputs(-step)) / (2 * step)
    return outputs(0.0) + slope * turn


def about_nominal(y: Array) -> tuple[Dictionary, Search, GaussNewton, Rows]:
    x = ladder()
    d, rows = dictionary(x), rows_of(x, y)
    system = WindowSystem(rows, d)
    search = Search(Sets(d, gram(system.linearised(nominal()), d, np.zeros(d.width))))
    return d, search, GaussNewton(system, nominal()), rows


def member(d: Dictionary, key: str) -> Member:
    cause = next(c for c in d.causes if c.key == key)
    return cause, cause.variants[0]


def explained_by(y: Array, key: str) -> tuple[InferenceResult, Search, Member]:
    """A result about the nominal state, and the member of the last position's angles.

    Its best set has one cause.
    """
    d, search, fit, _ = about_nominal(y)
    best = search.sets.evaluate((member(d, key),))
    found = InferenceResult(
        fit, search, best, nominal(), np.zeros(d.width), [], (), frozenset()
    )
    return found, search, member(d, f"misset {LAST}")


@pytest.mark.parametrize("turn_deg", [0.1, -0.6, 3.0])
def test_the_error_of_a_mean_is_that_of_its_expansion(turn_deg: float) -> None:
    turn, d = np.deg2rad(turn_deg), about_nominal(outputs(0.0))[0]
    system = about_nominal(outputs(0.0))[2].system
    small = nominal().small_rotation.copy()
    small[0, 0] = turn
    step = np.zeros(d.width)
    step[d.rotations_of(0)] = turn, 0.0
    other = replace(nominal(), small_rotation=small)
    along = G * (1 - np.cos(turn))  # the first position has its force along one axis
    across = G * abs(np.sin(turn) - turn)
    mean = SD[0] / np.sqrt(3)
    assert system.linearisation_error(nominal(), other, step) == pytest.approx(
        max(along, across) / mean, rel=1e-6
    )


@pytest.mark.parametrize("turn_deg", [0.6, -1.5])
def test_a_set_has_the_score_that_it_would_have_if_rows_were_linear(
    turn_deg: float,
) -> None:
    turn, rng = np.deg2rad(turn_deg), np.random.default_rng(1)
    noise = SD * rng.standard_normal((len(ladder()), 6))
    found, search, angles = explained_by(outputs(turn) + noise, "base_tilt")
    there = search.sets.evaluate((angles,))
    found = replace(found, best=there)  # nearest of all, though not about its own state
    search.sets.evaluate(())
    correct_scores(found)
    assert not search.sets.corrections, "the best set is the one that rows are about"

    found, search, angles = explained_by(outputs(turn) + noise, "base_tilt")
    there = search.sets.evaluate((angles,))
    found = replace(found, best=replace(found.best, score=there.score))
    correct_scores(found)
    plain = about_nominal(linear_outputs(turn) + noise)[1].sets
    wanted = plain.evaluate((member(plain.dictionary, f"misset {LAST}"),)).score
    assert there.score < wanted - 2.0, "the square of the angle counts as scatter"
    assert search.sets.corrected_score(there) == pytest.approx(wanted, abs=0.3)


def test_a_small_angle_needs_no_correction() -> None:
    found, search, angles = explained_by(outputs(np.deg2rad(0.05)), "base_tilt")
    there = search.sets.evaluate((angles,))
    found = replace(found, best=replace(found.best, score=there.score))
    correct_scores(found)
    assert search.sets.corrections == {}
    assert search.sets.corrected_score(there) == there.score


def slip(angles: Array, whole: bool) -> tuple[Array, float]:
    """Outputs (n, 6) of a device that slips in its mount, and when it does, s.

    The turn is whole, or as far as it is linear in the angles, deg.
    """
    x, effect = ladder(), MountSlip()
    shape = {"at_s": float(x.t[x.position == LAST][1]) - 5.0}
    y = np.hstack([x.f, x.w])
    y += effect.change_of_outputs(x, angles, shape) if whole else (
        effect.design(x, shape) @ angles
    )  # fmt: skip
    return y, shape["at_s"]


def at_instant(d: Dictionary, key: str, at: float) -> Member:
    cause = next(c for c in d.causes if c.key == key)
    return cause, min(cause.variants, key=lambda g: abs(g.shape["at_s"] - at))


def test_a_step_of_the_bias_is_held_against_turns_of_its_size() -> None:
    """Along the force a slip is of second order: a bias has it, a linear turn has not.

    Without their own states, a step of the bias is 1e8 times as likely as either.
    """
    angles, rng = np.array([0.5, 0.7, 0.6]), np.random.default_rng(2)
    noise = SD * rng.standard_normal((len(ladder()), 6))
    y, at = slip(angles, whole=True)
    d, search, fit, _ = about_nominal(y + noise)
    best = search.sets.evaluate((at_instant(d, "bias_step:acc", at),))
    found = InferenceResult(
        fit, search, best, nominal(), np.zeros(d.width), [], (), frozenset()
    )
    correct_scores(found)
    slipped = (at_instant(d, "mount_slip", at),)
    there = search.sets.evaluate(slipped)
    plain = about_nominal(slip(angles, whole=False)[0] + noise)[1].sets
    wanted = plain.evaluate((at_instant(plain.dictionary, "mount_slip", at),)).score
    assert there.score < best.score - 18.0
    assert search.sets.corrected_score(there) == pytest.approx(wanted, abs=1.0)
    assert search.sets.corrected_score(there) > best.score - 5.0


def test_a_small_slip_needs_no_state_of_its_own() -> None:
    y, at = slip(np.array([0.02, -0.03, 0.02]), whole=True)
    d, search, fit, _ = about_nominal(y)
    best = search.sets.evaluate((at_instant(d, "bias_step:gyr", at),))
    found = InferenceResult(
        fit, search, best, nominal(), np.zeros(d.width), [], (), frozenset()
    )
    correct_scores(found)
    assert not search.sets.corrections
