"""What a user is told of an estimate, whole sentences of estimates made up."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from observed import GYR_BIAS, observe, outputs

from fieldcal.core.errors import InputError, NotObservable
from fieldcal.core.factory import FactoryErrors
from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS, Position
from fieldcal.solve import observations, result, solve
from fieldcal.solve.estimation import ParameterEstimate
from fieldcal.solve.observations import Observations
from fieldcal.solve.options import SolveOptions
from fieldcal.solve.reliability import WrongAngles

HOME = "α = 0°, β = 0°"


def fit(**known: Any) -> SimpleNamespace:
    nothing = {"chi2": 3.0, "dof": 6, "rms": 1e-3, "held_out_rms": np.nan}
    return SimpleNamespace(**(nothing | known))


def estimated(**known: Any) -> ParameterEstimate:
    """An estimate of which only what is asked for is known."""
    options = SimpleNamespace(
        turned=False, gyr_scale=True, level_deg=None, cross=False, tilt="none",
        factory=FactoryErrors(),
    )  # fmt: skip
    given = SimpleNamespace(
        options=options, unoriented=np.zeros(5, dtype=bool), names=("acc_bias.x",)
    )
    nothing: dict[str, Any] = {
        "names": ("acc_bias.x",), "undetermined": (), "parameter_set": given,
        "acc": fit(), "score": -12.5, "valid_at_s": None,
        "gyr": fit(rms=np.nan), "closure_squares": (0.0, 0),
        "mixture": SimpleNamespace(scatter=np.array([3, 4, 0, 2, 1, 0, 5.0])),
    }  # fmt: skip
    return cast(ParameterEstimate, SimpleNamespace(**(nothing | known)))


def observed(
    places: Sequence[Position] = FIVE_POSITIONS, gyr: bool = True, **known: Any
) -> Observations:
    still = [p if p.oriented else FIVE_POSITIONS[0] for p in places]
    rates = np.tile(GYR_BIAS, (len(places), 1)) if gyr else None
    return observe(places, outputs(still), gyr=rates, **known)


def test_what_nothing_determines_is_an_error_with_the_reason() -> None:
    none = estimated(names=(), undetermined=("acc_bias.x", "acc_scale.x"), mixture=None)
    none.parameter_set.names, none.parameter_set.omitted_cross_coupling = (
        ("acc_bias.x", "acc_scale.x"),
        None,
    )
    carried = {
        "any_cause_probability": 0.0,
        "causes": {},
        "shift_sigmas": np.zeros(0),
        "valid_at_s": None,
    }
    vars(none).update(carried | {"values": np.zeros(0), "covariance": np.zeros((0, 0))})
    with pytest.raises(NotObservable) as error:
        result.build_calibration(
            "joint", observed(TWO_POSITIONS, False), SolveOptions(), none, ["a note"]
        )
    text = str(error.value)
    assert text.startswith("these positions determine nothing: acc_bias.x and")
    assert text.endswith("; a note")


def test_wrong_angles_harm_where_they_move_more_than_the_margin() -> None:
    found = estimated(names=("acc_bias.x", "acc_bias.y"))
    vars(found)["covariance"] = np.diag([4.0, 1.0])
    for moves, harms in (((9.9, -4.9), False), ((10.1, 0.0), True), ((0, -5.1), True)):
        both = dict(zip(found.names, moves, strict=True))
        assert result._is_harmful(WrongAngles(0, None, 1, 0.5, both), found) == harms


def test_what_is_carried_says_when_and_at_which_temperature() -> None:
    known = {
        "shift_sigmas": np.array([1.5]),
        "causes": {"bias_drift": 0.9},
        "valid_at_s": 300.0,
    }
    seen = observed(temperature=np.array([20.0, 21.0, 22.0, 23.0, 24.0]))
    assert result._carried_info(seen, estimated(**known)) == {
        "causes": {"bias_drift": 0.9}, "moved_sigmas": {"acc_bias.x": 1.5},
        "as_of": {"since_start_s": 300.0, "temperature_degc": 24.0},
    }  # fmt: skip
    unknown = result._carried_info(observed(), estimated(**known))
    assert unknown["as_of"]["temperature_degc"] is None
    assert "as_of" not in result._carried_info(
        seen, estimated(**known | {"valid_at_s": None})
    )


@pytest.mark.parametrize("missed", [0.0, 0.2])
def test_evidence_tells_how_well_angles_are_set(missed: float) -> None:
    off = np.random.default_rng(2).normal(0.0, missed, (9, 2))
    stated = [(a, b) for a in (-45, 0, 45) for b in (-5, 0, 5)]
    places = [Position.deg(a, b) for a, b in np.array(stated) + off]
    rates = np.tile(GYR_BIAS, (9, 1))
    seen = observe([Position.deg(*p) for p in stated], outputs(places), gyr=rates)
    well, badly = (
        solve(seen, tilt="none", angle_sigma_deg=size).info["log_evidence"]
        for size in (0.01, 0.2)
    )
    assert badly > well + 5 if missed else well > badly + 5


def test_conditions_are_those_that_were_given() -> None:
    temperature = np.array([20.0, np.nan, 22.0, 24.0, 26.0])
    seen = observed(latitude=0.7, temperature=temperature, gyr=False)
    found = solve(seen, tilt="none", angle_sigma_deg=0.2).info
    assert found["conditions"] == {
        "positions": 5, "gravity": 9.81,
        "latitude_deg": pytest.approx(40.107, abs=1e-3),
        "temperature_degc": 23.0, "temperature_sd_k": pytest.approx(5**0.5),
        "grade": "tactical",
    }  # fmt: skip
    assert found["angle_sigma_deg"] == 0.2 and "gyroscopes" not in found
    plain = solve(observed(), tilt="none").info
    assert plain["conditions"]["latitude_deg"] is None
    assert plain["conditions"]["temperature_degc"] is None
    assert plain["gyroscopes"]["unit"] == "rad/s" and plain["gyroscopes"]["dof"] == 12
    assert plain["gyroscopes"]["rms"] == pytest.approx(0.0, abs=1e-9)
    unknown = estimated(
        bad_probability=np.zeros(5), wrong_angles=(), causes={}, turn_rows=()
    )
    said = result._info("joint", observed(), SolveOptions(), unknown)
    assert said["gyroscopes"]["rms"] is None, "JSON has no nan"
    assert "level_sigma_deg" not in plain
    two = solve(observed(TWO_POSITIONS, gyr=False), level_sigma_deg=0.3).info
    assert two["level_sigma_deg"] == 0.3
    more = solve(observed(), level_sigma_deg=0.3).info
    assert more["level_sigma_deg"] == 0.3, "what is stated counts whatever the method"


def test_a_window_that_is_off_for_certain_has_no_weight_and_is_named() -> None:
    places = (
        *FIVE_POSITIONS,
        Position.deg(-30, 10),
        Position.deg(60, -20),
        Position.deg(90, 0),
    )
    acc = outputs(places)
    acc[3] += [0.5, -0.4, 0.6]
    noise = 1e-3 * np.random.default_rng(2).standard_normal(acc.shape)
    found = solve(observe(places, acc + noise), tilt="none")
    bad = found.info["bad_position"]
    assert bad[3] == 1.0 and max(bad[:3] + bad[4:]) < 0.1
    assert found.info["doubtful_position"] == {
        "name": FIVE_POSITIONS[3].name,
        "probability": 1.0,
    }
    assert any(FIVE_POSITIONS[3].name in w and "no weight" in w for w in found.warnings)
    others = [i for i in range(len(places)) if i != 3]
    left = solve(observe(places, acc + noise)[others], tilt="none")
    np.testing.assert_allclose(found.values, left.values, atol=0.3 * left.sigma.max())


# --- what estimators are given


def test_correlations_that_a_window_is_too_short_to_know_are_dropped() -> None:
    size = np.array([1.0, 2.0, 3.0, 1e-3, 2e-3, 3e-3])
    alike = np.full((6, 6), 0.5) + 0.5 * np.eye(6)
    kept = alike * np.outer(size, size)
    np.testing.assert_array_equal(observations._regularised(kept), kept)
    one = alike.copy()
    one[0, 1] = one[1, 0] = 1.0
    one[0, 2] = one[1, 2] = one[2, 0] = one[2, 1] = 0.5
    singular = one * np.outer(size, size)
    found = observations._regularised(singular)
    np.testing.assert_allclose(found[:3, :3], np.diag(size[:3] ** 2))
    np.testing.assert_array_equal(found[3:, 3:], singular[3:, 3:])
    assert not found[:3, 3:].any() and not found[3:, :3].any()
    nowhere = kept.copy()
    nowhere[3:, :] = nowhere[:, 3:] = np.nan
    np.testing.assert_array_equal(observations._regularised(nowhere), nowhere)
    still = kept.copy()
    still[1, :] = still[:, 1] = 0.0
    np.testing.assert_array_equal(observations._regularised(still), still)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"gravity": 0.0}, "gravity is 0 m/s^2: give the local value, about 9.8, or the"
         " latitude and height of the site"),
        ({"mean": np.zeros((5, 5))}, "mean is (5, 5) where 5 positions need (5, 6)"),
        ({"time": np.zeros(4)}, "time is (4,) where 5 positions need (5,)"),
        ({"covariance": np.zeros((5, 6, 6))}, "the accelerometers' means have no"
         " uncertainty above 0 m/s^2: a window of repeated equal values tells nothing"
         " about its noise"),
    ],
)  # fmt: skip
def test_observations_that_cannot_be_are_refused(
    change: dict[str, Any], says: str
) -> None:
    seen = observed()
    known: dict[str, Any] = {"positions": seen.positions, "mean": seen.mean,
                             "covariance": seen.covariance, "gravity": 9.8}  # fmt: skip
    with pytest.raises(InputError) as error:
        Observations(**(known | change))
    assert str(error.value) == says


def test_a_mean_that_is_missing_is_named() -> None:
    seen = observed()
    mean = seen.mean.copy()
    mean[3, 4] = np.nan
    with pytest.raises(InputError) as error:
        Observations(seen.positions, mean, seen.covariance, 9.8)
    assert str(error.value) == (
        f"position 4 ({FIVE_POSITIONS[3].name}) has no mean of gy: take its window"
        " again or leave it out"
    )
    with pytest.raises(InputError, match="there is no position with a window: take at"):
        Observations.of((), (), 9.8)
    with pytest.raises(InputError, match="the latitude is not known, so the Earth's"):
        _ = seen.known_latitude
    assert observed(latitude=0.7).known_latitude == 0.7


def test_of_some_positions_everything_is_theirs() -> None:
    seen = observed(temperature=np.arange(5.0), time=10 * np.arange(5.0))
    some = seen[[3, 1]]
    assert [p.name for p in some.positions] == [
        FIVE_POSITIONS[3].name,
        FIVE_POSITIONS[1].name,
    ]
    np.testing.assert_array_equal(some.mean, seen.mean[[3, 1]])
    np.testing.assert_array_equal(some.temperature, [3.0, 1.0])
    np.testing.assert_array_equal(some.time, [30.0, 10.0])
    assert len(some.covariance) == 2 and len(some) == 2
