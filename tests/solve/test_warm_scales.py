"""What the temperature makes of scale factors while it changes the biases."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from observed import SCALE, observe, outputs

from fieldcal.core.factory import FactoryErrors
from fieldcal.core.positions import SIX_FACES, Position
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model.causes.basis import RowView
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.effect_causes import effect_causes
from fieldcal.model.causes.unknown_causes import unknown_causes
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.state import State
from fieldcal.solve.estimation import (
    ParameterEstimate,
    RecordedRows,
    estimate_parameters,
)
from fieldcal.solve.explanations import WeightedExplanation
from fieldcal.solve.observation_rows import rows_of_observations
from fieldcal.solve.parameter_set import ParameterSet, ParameterSetOptions
from fieldcal.solve.warm_scales import WARM_SCALE, warm_scale

PLACES = (*SIX_FACES, *(Position.deg(a, b) for a, b in [(45, 0), (0, 45), (0, 0)]))
COUNT = len(PLACES)
TIMES = 40.0 * np.arange(COUNT)
DRIFT = np.array([3e-4, -2e-4, 4e-4])
SIZE = float(np.sqrt(np.mean(DRIFT**2)))
NOMINAL = State(np.zeros(6), np.ones(6), np.zeros((COUNT, 2)), np.zeros(3))


def recording(change: Array, noise: Array, drift: Array = DRIFT) -> RecordedRows:
    """Windows of a device that changes with time: biases, and scale factors."""
    force = (outputs(PLACES, bias=np.zeros(3)) / SCALE) * TIMES[:, None]
    acc = outputs(PLACES) + drift * TIMES[:, None] + change * force + noise
    return rows_of_observations(replace(observe(PLACES, acc), time=TIMES))


CALM = recording(np.zeros(3), np.zeros((COUNT, 3)))


def given(wanted: ParameterSetOptions | None = None) -> ParameterSet:
    return ParameterSet(
        CALM.rows, np.ones(6), CALM.since_turn, False, wanted or ParameterSetOptions()
    )


def with_gyroscopes() -> ParameterSet:
    seen = observe(PLACES, outputs(PLACES), gyr=np.zeros((COUNT, 3)))
    rows = rows_of_observations(replace(seen, time=TIMES))
    return ParameterSet(
        rows.rows, np.ones(6), rows.since_turn, False, ParameterSetOptions()
    )


def drift(d: ParameterSet) -> Member:
    """A cause on all accelerometers, as large as the biases drift."""
    cause = next(c for c in effect_causes(d) if c.key == "bias_drift:acc")
    group = next(g for g in cause.variants if len(g.params) == 3)
    cause = replace(cause, variants=(group,)).with_size(SIZE / group.typical[0])
    return cause, cause.variants[0]


def fitted(recorded: RecordedRows) -> ParameterEstimate:
    cause, group = drift(given())
    shown = (
        WeightedExplanation(((cause, group),), 1.0, sizes=(group.fixed_size or 0.0,)),
    )
    return estimate_parameters(
        replace(recorded, explanations=shown), None, NOMINAL, ParameterSetOptions()
    )


def test_columns_are_the_course_times_the_force_and_as_large_as_the_biases() -> None:
    d = given()
    _, group = drift(d)
    found = warm_scale(d, group)
    assert found is not None
    cause, one = found
    assert one.effect is group.effect and one.shape == group.shape
    assert one.params == (0, 1, 2) and not cause.reportable
    first, end, basis = list(d.basis_ranges())[-1]
    assert one.columns.tolist() == list(range(first, end))
    columns = basis.evaluate(RowView.of(d.x, d.since, NOMINAL))
    expected = np.zeros((COUNT, 6, 3))
    for c in range(3):
        expected[:, c, c] = TIMES * d.x.f[:, c]
    np.testing.assert_allclose(columns, expected)
    each = 0.25 * SIZE / 9.80665
    np.testing.assert_allclose(one.prior_sigma(one.fixed_size or 0.0), each, rtol=1e-6)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("warm_up", True),
        ("bias_drift", True),
        ("temperature_bias", True),
        ("thermal_hysteresis", True),
        ("settling", False),
        ("bias_step", True),
    ],
)
def test_the_temperature_and_restarts_change_scale_factors(
    name: str, changes: bool
) -> None:
    effect = catalogue()[name]
    d = given()
    group = replace(drift(d)[1], effect=effect)
    assert (warm_scale(d, group) is not None) == changes


def test_nothing_comes_of_gyroscopes_or_of_what_is_no_bias() -> None:
    d = with_gyroscopes()
    _, group = drift(d)
    cause = next(c for c in effect_causes(d) if c.key == "bias_drift:gyr")
    assert warm_scale(d, cause.variants[0]) is None
    assert warm_scale(d, replace(group, effect=None)) is None


def unknown(d: ParameterSet, name: str, part: str) -> Group:
    """A function without physics."""
    causes = unknown_causes(d)
    return next(c for c in causes if (c.name, c.part) == (name, part)).variants[0]


@pytest.mark.parametrize(("part", "axes"), [("acc", 3), ("ay", 1)])
def test_a_course_without_physics_may_be_the_temperatures(part: str, axes: int) -> None:
    """All scale factors by each of its cosines, however many biases follow it."""
    d = given()
    group = replace(unknown(d, "time", part), fixed_size=2.0)
    found = warm_scale(d, group)
    assert found is not None
    _, one = found
    count = len(group.columns) // axes
    sizes = 0.25 * group.prior_sigma(2.0)[:count] / 9.80665
    np.testing.assert_allclose(one.prior_sigma(1.0), np.tile(sizes, 3))
    first, _, basis = list(d.basis_ranges())[-1]
    assert one.columns[0] == first
    columns = basis.evaluate(RowView.of(d.x, d.since, NOMINAL))
    expected = d.span.waves(d.x)[:, None, :count] * d.x.f[:, :, None]
    for c in range(3):
        own = columns[:, :, c * count : (c + 1) * count]
        np.testing.assert_allclose(own[:, c], expected[:, c])
        assert not np.delete(own, c, axis=1).any()


def test_columns_that_follow_no_course_cannot_be_the_temperatures() -> None:
    general = [(0, 2, None), (2, 4, "columns of another kind")]
    table: Any = SimpleNamespace(basis_ranges=lambda: general, unit=np.ones(6))
    group = Group("time", "acc", np.array([2]), np.ones(1))
    with pytest.raises(TypeError, match="^time is no course of biases$"):
        warm_scale(table, group)


def test_other_functions_without_physics_change_no_scale_factor() -> None:
    d = with_gyroscopes()
    assert warm_scale(d, unknown(d, "time", "gyr")) is None
    for name in ("window", "position", "alpha", "force and time"):
        assert warm_scale(d, unknown(d, name, "ax")) is None


@pytest.mark.thorough
def test_scale_factors_beside_a_course_without_physics_are_those_at_the_end() -> None:
    """Drawn from the prior, all of what is said of the end is as far off as stated."""
    rng = np.random.default_rng(20)
    d, pulls = given(), []
    cause = next(c for c in unknown_causes(d) if c.key == "time:acc")
    group = cause.variants[0]
    count = len(group.columns) // 3
    size = group.prior_sigma(1.0)[:count]
    shown = (WeightedExplanation(((cause, group),), 1.0, sizes=(1.0,)),)
    waves, force = d.span.waves(d.x)[:, :count], outputs(PLACES, bias=np.zeros(3))
    end = np.cos(np.pi * np.arange(1, count + 1))
    for _ in range(40):
        bias, scales = rng.normal(size=(2, 3, count)) * size
        scales *= 0.25 / 9.80665
        noise = 1e-4 * rng.standard_normal((COUNT, 3))
        acc = outputs(PLACES) + waves @ bias.T + waves @ scales.T * force / SCALE
        rows = rows_of_observations(
            replace(observe(PLACES, acc + noise, sigma=1e-4), time=TIMES)
        )
        one = estimate_parameters(
            replace(rows, explanations=shown), None, NOMINAL, ParameterSetOptions()
        )
        at = [one.names.index(f"acc_scale.{a}") for a in "xyz"]
        truth = SCALE + scales @ end
        sigma = np.sqrt(np.diag(one.covariance)[at])
        pulls.append((np.array(one.values)[at] - truth) / sigma)
    assert 0.8 < np.sqrt(np.mean(np.square(pulls))) < 1.2


def test_what_the_device_warms_up_by_unseen_is_in_its_scale_factors() -> None:
    """0.01 m/s^2/K and 2 K of a device that nobody saw to warm up."""
    left = FactoryErrors(acc_per_k=0.01, warming_k=2.0)
    names = [
        cause.name for cause, _ in given(ParameterSetOptions(factory=left)).base_members
    ]
    assert WARM_SCALE in names
    nothing = np.zeros((COUNT, 3))
    still = recording(nothing[0], nothing, nothing[0])
    before, after = (
        estimate_parameters(still, None, NOMINAL, ParameterSetOptions(factory=one))
        for one in (FactoryErrors(), left)
    )
    at = before.names.index("acc_scale.x")
    more = np.sqrt(after.covariance[at, at] - before.covariance[at, at])
    assert 0.1 < more / (0.25 * 0.02 / 9.80665) < 1.0


@pytest.mark.parametrize("count", [8, pytest.param(20, marks=pytest.mark.thorough)])
def test_scale_factors_at_the_end_are_within_their_uncertainty(count: int) -> None:
    """Over devices whose scale factors change as the module says."""
    pulls = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        change = rng.normal(0.0, 0.25 * SIZE / 9.80665, 3)
        found = fitted(recording(change, rng.normal(0.0, 1e-3, (COUNT, 3))))
        truth = SCALE + change * TIMES[-1]
        for c, name in enumerate("xyz"):
            at = found.names.index(f"acc_scale.{name}")
            sigma = np.sqrt(found.covariance[at, at])
            pulls.append((found.values[at] - truth[c]) / sigma)
    assert 0.85 < np.sqrt(np.mean(np.square(pulls))) < 1.15
