"""The order in which effects are told: by what they do to the calibration."""

from __future__ import annotations

from fieldcal.diagnosis.result import FoundEffect, Quantity
from fieldcal.diagnosis.wording.lines import by_impact, effect_lines


def _found(name: str, **moves: tuple[float, float]) -> FoundEffect:
    moved = {n: Quantity(v, s, "m/s^2") for n, (v, s) in moves.items()}
    return FoundEffect(name, {}, moves={f"acc_bias.{n}": q for n, q in moved.items()})


def test_what_moves_the_calibration_is_told_before_what_is_left_out_of_it() -> None:
    found = [
        _found("bump"),
        _found("hum"),
        _found("random_walk"),
        _found("quadratic", x=(0.002, 0.001)),
        _found("cross_coupling", x=(0.001, 0.001), y=(-0.009, 0.001)),
        _found("stuck"),
        _found("gyro_scale"),
    ]
    assert [one.id for one in by_impact(found)] == [
        "cross_coupling", "quadratic", "gyro_scale", "random_walk",
        "bump", "hum", "stuck",
    ]  # fmt: skip


def test_one_that_happened_often_stays_one_line_in_its_place() -> None:
    found = [_found("bump"), _found("bump"), _found("quadratic", z=(0.01, 0.001))]
    told = effect_lines(by_impact(found))
    assert [one.what for one in told] == ["quadratic", "bump (2 times)"]
    assert [one.does for one in told] == [
        "acc bias z +0.01 m/s² (10 σ)", "nothing: left out",
    ]  # fmt: skip


def test_a_bias_that_changes_is_told_with_when_it_holds() -> None:
    """Its value at the start may differ from the mean the other way than at the end."""
    found = [_found("temperature_bias", x=(0.01, 0.001)), _found("warm_up")]
    does = [one.does for one in effect_lines(found)]
    assert does == [
        "acc bias x +0.01 m/s² (10 σ) at the start's temperature",
        "nothing that shows",
    ]
