"""Scale factors of gyroscopes that turns show, and those that no sensor has."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from small_sessions import Session, ladder

from fieldcal.calibration import Calibration
from fieldcal.core.samples import Array
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.calibrated import (
    impossible_turn_scales,
    turn_scale_factors,
)
from fieldcal.evaluation.omitted_effects import with_impossible_explanation
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.sets import Set
from fieldcal.model.state import State

SIGMA = np.array([0.0045, 1e-3, 0.02])


def told_by(change: Array, nominal: float = 1.0) -> tuple[Set, State]:
    """A set with an error of the scale factors, beside a bias of one column."""
    group = Group(
        "gyro_scale", "gyr", np.array([7, 8, 9]), np.full(3, 0.03), params=(0, 1, 2)
    )
    cause = Cause("gyro_scale", "gyr", 0.01, (group,))
    state = SimpleNamespace(
        places_of=lambda columns: columns - 6,
        estimate=np.array([0.02, *(nominal * change)]),
        inverse=np.diag([1e-6, *(nominal * SIGMA) ** 2]),
    )
    scale = np.repeat([1.0, nominal], 3)
    return (
        cast(Set, SimpleNamespace(members=((cause, group),), state=state)),
        State(np.zeros(6), scale, np.zeros((1, 2)), np.zeros(3)),
    )


def explained(change: Array, nominal: float = 1.0) -> Explanation:
    fitted, state = told_by(change, nominal)
    about = SimpleNamespace(
        nominal={
            "acc_bias": np.zeros(3), "acc_scale": np.ones(3),
            "gyr_bias": np.zeros(3), "gyr_scale": np.full(3, nominal),
        }
    )  # fmt: skip
    parts: dict[str, Any] = {
        "best": SimpleNamespace(set=fitted),
        "inferred": SimpleNamespace(
            fit=SimpleNamespace(nominal=state), exhausted=False
        ),
        "source": SimpleNamespace(about=about),
        "probable_causes": (),
    }
    return cast(Explanation, SimpleNamespace(**parts))


@pytest.mark.parametrize("nominal", [1.0, 7505.7])
def test_they_are_of_the_turns_in_units_of_the_output(nominal: float) -> None:
    found = turn_scale_factors(*told_by(np.array([0.01, -0.02, 0.0]), nominal))
    expected = {"gyr_scale.x": 1.01, "gyr_scale.y": 0.98, "gyr_scale.z": 1.0}
    assert found.keys() == expected.keys()
    for (value, sigma), one, own in zip(
        found.values(), expected.values(), SIGMA, strict=True
    ):
        assert value == pytest.approx(nominal * one)
        assert sigma == pytest.approx(nominal * own)


def test_a_set_without_an_error_of_them_has_none() -> None:
    session = Session.of(ladder(), ("quadratic",))
    fitted = session.search(session.noise(np.random.default_rng(1))).sets.evaluate(())
    assert not turn_scale_factors(fitted, told_by(np.zeros(3))[1])


@pytest.mark.parametrize("nominal", [1.0, 7505.7])
@pytest.mark.parametrize(
    ("change", "impossible"),
    [
        ([7.95, 0.002, 0.01], ["gyr_scale.x"]),
        ([0.04, -0.05, 0.09], []),
        ([0.0, -2.0, 0.15], ["gyr_scale.y", "gyr_scale.z"]),
    ],
)
def test_what_no_sensor_has_is_no_explanation(
    change: list[float], impossible: list[str], nominal: float
) -> None:
    """A gyroscope eight times as sensitive only takes away what contradicts it."""
    explanation = explained(np.array(change), nominal)
    assert list(impossible_turn_scales(explanation)) == impossible
    calibration = Calibration(
        "joint", ("acc_bias.x",), np.zeros(1), np.eye(1), ("m/s^2",), 1.0, 1, 0.0,
        ("before",),
    )  # fmt: skip
    judged = with_impossible_explanation(explanation, calibration)
    assert judged.good == (not impossible)
    assert judged.warnings[-1] == "before"
    assert len(judged.warnings) == 1 + len(impossible)
    for name, warning in zip(impossible, judged.warnings, strict=False):
        assert name in warning and "take the positions again" in warning
