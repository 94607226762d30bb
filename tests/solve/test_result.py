"""What a user is told of an estimate, whole sentences of estimates made up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from observed import GYR_BIAS, observe, outputs

from fieldcal.core.errors import NotObservable
from fieldcal.core.factory import FactoryErrors
from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS, Position
from fieldcal.solve import result, solve
from fieldcal.solve.coupling_left_out import largest_coupling_left_out
from fieldcal.solve.end_values import EndValues
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
    end = EndValues(np.zeros((6, 1)), np.zeros((6, 6, 1)), np.array([False]))
    given = SimpleNamespace(
        options=options, unoriented=np.zeros(5, dtype=bool), names=("acc_bias.x",),
        width=1, end_values=end, x=SimpleNamespace(clock_sigma=0.0),
    )  # fmt: skip
    nothing: dict[str, Any] = {
        "names": ("acc_bias.x",), "undetermined": (), "parameter_set": given,
        "acc": fit(), "score": -12.5, "valid_at_s": None, "changing_causes": {},
        "gyr": fit(rms=np.nan), "closure_squares": (0.0, 0),
        "mixture": SimpleNamespace(
            scatter=np.array([3, 4, 0, 2, 1, 0, 5.0]),
            columns=np.array([0]), mean=np.ones(1), covariance=np.eye(1),
        ),
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
        "changing_causes": {},
    }
    vars(none).update(carried | {"values": np.zeros(0), "sigma": np.zeros(0)})
    with pytest.raises(NotObservable) as error:
        result.build_calibration(
            "joint", observed(TWO_POSITIONS, False), SolveOptions(), none, ["a note"]
        )
    text = str(error.value)
    assert text.startswith("these positions determine nothing: acc_bias.x and")
    assert text.endswith("; a note")


def test_wrong_angles_harm_where_they_move_more_than_the_margin() -> None:
    found = estimated(names=("acc_bias.x", "acc_bias.y"))
    vars(found)["sigma"] = np.array([2.0, 1.0])
    for moves, harms in (((9.9, -4.9), False), ((10.1, 0.0), True), ((0, -5.1), True)):
        both = dict(zip(found.names, moves, strict=True))
        assert result._is_harmful(WrongAngles(0, None, 1, 0.5, both), found) == harms


def test_what_is_carried_says_when_and_at_which_temperature() -> None:
    known = {
        "shift_sigmas": np.array([1.5]),
        "causes": {"bias_drift": 0.9},
        "valid_at_s": 300.0,
        "changing_causes": {"bias_drift": 0.9},
    }
    seen = observed(temperature=np.array([20.0, 21.0, 22.0, 23.0, 24.0]))
    assert result._carried_info(seen, estimated(**known)) == {
        "causes": {"bias_drift": 0.9}, "moved_sigmas": {"acc_bias.x": 1.5},
        "as_of": {
            "since_start_s": 300.0, "temperature_degc": 24.0,
            "because": {"bias_drift": 0.9},
        },
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


def whole(**known: Any) -> ParameterEstimate:
    """An estimate of two parameters in which nothing is odd."""
    nothing: dict[str, Any] = {
        "names": ("acc_bias.x", "gyr_bias.y"), "values": np.array([0.1, 0.01]),
        "covariance": np.diag([1e-6, 1e-10]), "causes": {}, "turn_rows": (),
        "bad_probability": np.array([0.0, 0.01234, 0.5, 0.0, 0.0]),
        "any_cause_probability": 0.0, "shift_sigmas": np.zeros(2), "wrong_angles": (),
        "contradicted_turns": (), "sets": None,
        "acc": fit(rejects_model=False), "gyr": fit(chi2=5.0, rejects_model=False),
    }  # fmt: skip
    told = nothing | known
    found = estimated(**told, sigma=np.sqrt(np.diag(told["covariance"])))
    found.parameter_set.omitted_cross_coupling = None
    cast(Any, found.parameter_set).earth = -1
    return found


def test_the_object_of_the_result_has_every_number_in_its_place() -> None:
    wanted: Any = SimpleNamespace(
        turned=True, gyr_scale=True, level_deg=0.3, cross=False, tilt="base_tilt",
        beside_tilt_deg=0.7, factory=FactoryErrors(1e-4, 2e-5, 3e-6, 4e-3, 5e-5, 6e-4),
    )  # fmt: skip
    harmful = WrongAngles(0, None, 1, 0.5, {"acc_bias.x": 1.0, "gyr_bias.y": 0.0})
    harmless = WrongAngles(1, None, 1, 0.5, {"acc_bias.x": 0.0, "gyr_bias.y": 0.0})
    found = whole(
        wrong_angles=(harmless, harmful), closure_squares=(9.0, 6), turn_rows=("one",),
        acc=fit(held_out_rms=2e-3), causes={"hum": 0.7}, score=-12.5,
    )  # fmt: skip
    cast(Any, found.parameter_set).options = wanted
    seen = observed(latitude=0.5, temperature=np.arange(5.0), grade="navigation")
    told = result._info("joint", seen, SolveOptions(angles_deg=0.05), found)
    assert told == {
        "conditions": {
            "positions": 5, "gravity": 9.81,
            "latitude_deg": pytest.approx(28.6478898), "temperature_degc": 2.0,
            "temperature_sd_k": pytest.approx(2**0.5), "grade": "navigation",
        },
        "bad_position": [0.0, 0.0123, 0.5, 0.0, 0.0],
        "extra_scatter": pytest.approx((25 / 3) ** 0.5), "log_evidence": -12.5,
        "angle_sigma_deg": 0.05, "square_sigma": 1e-4, "quadratic_sigma": 2e-5,
        "g_sensitivity_sigma": 3e-6, "acc_bias_per_k_sigma": 4e-3,
        "gyr_bias_per_k_sigma": 5e-5, "acc_hysteresis_sigma": 6e-4,
        "doubtful_position": {"name": FIVE_POSITIONS[2].name, "probability": 0.5},
        "left_out_rms": 2e-3, "level_sigma_deg": 0.3, "beside_tilt_sigma_deg": 0.7,
        "gyroscopes": {
            "chi2": 5.0, "dof": 6, "unit": "rad/s", "rms": 1e-3,
            "extra_scatter": pytest.approx((5 / 3) ** 0.5),
        },
        "wrong_angles": [harmful.to_json()],
        "carried": {
            "causes": {"hum": 0.7},
            "moved_sigmas": {"acc_bias.x": 0.0, "gyr_bias.y": 0.0},
        },
        "turns": {"chi2": 9.0, "dof": 6, "scatter_rad": 5.0},
    }  # fmt: skip
    wanted.cross, wanted.tilt = True, "none"
    more = result._info("joint", seen, SolveOptions(), found)
    assert more["square_sigma"] == 0.0 and "beside_tilt_sigma_deg" not in more


def test_what_is_not_there_has_no_key() -> None:
    found = whole(bad_probability=np.zeros(5))
    cast(Any, found.parameter_set.options).beside_tilt_deg = 0.0
    told = result._info("joint", observed(gyr=False), SolveOptions(), found)
    assert not {
        "doubtful_position",
        "left_out_rms",
        "level_sigma_deg",
        "gyroscopes",
        "beside_tilt_sigma_deg",
        "wrong_angles",
        "carried",
        "turns",
    } & set(told)
    assert "carried" in result._info(
        "joint", observed(), SolveOptions(), whole(valid_at_s=30.0)
    )


def test_a_calibration_begins_with_what_makes_it_bad(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(result, "largest_cross_coupling_effect", lambda one: None)
    monkeypatch.setattr(result, "agreement_warnings", lambda *told: ["", "scatter"])
    note = ["a note", "a note", ""]
    good = result.build_calibration("joint", observed(), SolveOptions(), whole(), note)
    assert good.good and good.warnings == ("a note", "scatter")
    assert good.names == ("acc_bias.x", "gyr_bias.y")
    assert good.units == ("m/s^2", "rad/s") and good.method == "joint"
    assert (good.chi2, good.dof, good.rms) == (3.0, 6, 1e-3)
    assert "borrowed" not in good.info
    wrong = SimpleNamespace(latitude_wrong=True, sentence="latitude")
    monkeypatch.setattr(
        result, "VerticalEarthRate", SimpleNamespace(of=lambda *told: wrong)
    )
    found = whole(values=np.array([60.0, 0.01]), contradicted_turns=((0, 2),))
    lot: Any = SimpleNamespace(sentence="a lot", to_json=lambda: {"lot": 7})
    bad = result.build_calibration("joint", observed(), SolveOptions(), found, [], lot)
    assert not bad.good and bad.info["borrowed"] == {"lot": 7}
    assert bad.warnings[0].startswith("acc_bias.x ")
    assert FIVE_POSITIONS[0].name in bad.warnings[1]
    assert FIVE_POSITIONS[2].name in bad.warnings[1]
    assert bad.warnings[2:] == ("latitude", "a lot", "scatter")
    wrong.latitude_wrong = False
    again = result.build_calibration("joint", observed(), SolveOptions(), whole(), [])
    assert again.good and again.warnings == ("scatter",)


def test_without_accelerometers_the_gyroscopes_are_what_agrees() -> None:
    found = whole(names=("gyr_bias.y",), values=np.array([0.01]),
                  covariance=np.array([[1e-10]]), shift_sigmas=np.zeros(1))  # fmt: skip
    made = result.build_calibration("joint", observed(), SolveOptions(), found, [])
    assert made.chi2 == 5.0


def test_the_largest_coupling_that_is_left_out_has_its_axes_and_uncertainty() -> None:
    found = estimated()
    slopes = found.parameter_set.end_values.slopes
    slopes[1, 2, 0], slopes[0, 1, 0] = -0.03, 0.02
    slopes[0, 0, 0], slopes[1, 4, 0], slopes[3, 4, 0] = 1.0, 0.5, 0.5
    shown = largest_coupling_left_out(found)
    assert shown is not None
    assert shown.to_json() == {
        "axis": "y", "of": "z", "value": pytest.approx(-0.03),
        "sigma": pytest.approx(0.03),
    }  # fmt: skip
    end = found.parameter_set.end_values
    found.parameter_set.end_values = replace(end, sudden=np.array([True]))
    assert largest_coupling_left_out(found) is None
    found.parameter_set.end_values = end
    slopes[1, 2, 0] = slopes[0, 1, 0] = 0.0
    assert largest_coupling_left_out(found) is None
