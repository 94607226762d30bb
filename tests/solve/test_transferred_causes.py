"""Which causes of an explanation a given set takes over, of causes that are made up."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_explanations import TIMES, member, seen

from fieldcal.calibration.names import TILTS
from fieldcal.effects import catalogue
from fieldcal.model import priors
from fieldcal.model.causes.cause import Group
from fieldcal.physics.effect import Scatter, Sensor
from fieldcal.solve import explanations
from fieldcal.solve.explanations import WeightedExplanation
from fieldcal.solve.observation_rows import rows_of_observations
from fieldcal.solve.parameter_set import ParameterSet, ParameterSetOptions

OFFSET, BASE = TILTS


def made(
    name: str, kind: str = "effect", effect: Any = None, by_window: bool = False
) -> Any:
    """A member: a cause and its group, with no effect unless given."""
    cause = SimpleNamespace(
        name=name, kind=kind, by_window=by_window, key=f"{name}:acc"
    )
    return cause, SimpleNamespace(effect=effect)


def effect_of(base: type, *params: str, **known: Any) -> Any:
    """An effect of a kind, of which nothing is calculated."""
    known = {"like_calibration": False, "carried_by": ""} | known
    named = [SimpleNamespace(name=name) for name in params]
    kind: Any = type("Made", (base,), known | {"params": named, "design": None})
    return kind()


@pytest.mark.parametrize(
    ("member", "missing"),
    [
        (made("drift", effect=effect_of(Sensor, "ax")), True),
        (made("drift", effect=effect_of(Sensor, "ax", like_calibration=True)), False),
        (made("cross_coupling", effect=effect_of(Sensor, "k12")), False),
        (made("skew", effect=effect_of(Sensor, "k", carried_by="cross_coupling")),
         False),
        (made("skew", effect=effect_of(Sensor, "k", carried_by="drift")), True),
        (made("walk", "random", effect_of(Scatter, "ax", "gz")), True),
        (made("loose", "random", effect_of(Scatter, "alpha", "beta")), False),
        (made("loose", "random", effect_of(Scatter, "ax", "alpha")), False),
        (made("window", "random", by_window=True), False),
        (made("misset", "position", by_window=True), True),
        (made("time", "unknown"), True),
        (made("cross_coupling", "unknown"), False),
    ],
)  # fmt: skip
def test_what_a_set_of_cross_coupling_has_to_take_over(
    member: Any, missing: bool
) -> None:
    assert explanations._is_missing(member, {"cross_coupling", "acc_bias"}) is missing


def shown(*each: tuple[float, tuple[str, ...]]) -> list[WeightedExplanation]:
    return [
        WeightedExplanation(tuple(made(name) for name in names), p) for p, names in each
    ]


def test_tilts_are_seen_from_one_half_on_unless_the_set_has_one() -> None:
    some = shown((0.3, (BASE, "hum")), (0.2, (BASE,)), (0.4, (OFFSET,)), (0.1, ()))
    assert explanations._unseen_tilts(some, {"acc_bias"}) == {OFFSET}
    fewer = shown((0.49, (BASE, OFFSET)), (0.51, ("hum",)))
    assert explanations._unseen_tilts(fewer, set()) == {BASE, OFFSET}
    assert explanations._unseen_tilts(some, {BASE}) == {BASE, OFFSET}
    both = shown((0.6, (BASE, OFFSET)), (0.4, ()))
    assert explanations._unseen_tilts(both, set()) == set()


def test_sizes_belong_to_the_causes_of_an_explanation() -> None:
    members = made("hum"), made("drift")
    assert WeightedExplanation(members, 0.5).sizes_by_key == {}
    sized = WeightedExplanation(members, 0.5, sizes=(2.0, 0.5))
    assert sized.sizes_by_key == {"hum:acc": 2.0, "drift:acc": 0.5}
    with pytest.raises(ValueError, match="zip"):
        _ = WeightedExplanation(members, 0.5, sizes=(2.0,)).sizes_by_key


def test_an_explanation_takes_the_sizes_of_its_set() -> None:
    members = made("hum"), made("drift")
    one: Any = SimpleNamespace(
        members=members, sizes=SimpleNamespace(members=(3, 1), instability=())
    )
    found = WeightedExplanation.of(one, 0.25)
    assert found.members == members and found.probability == 0.25
    assert found.sizes == (float(priors.SIZES[3]), float(priors.SIZES[1]))
    assert found.possible_members == ()


def test_some_parameters_of_a_group_keep_their_columns_and_sizes() -> None:
    whole = Group("drift", "acc", np.array([10, 11, 12]), np.array([1.0, 2.0, 3.0]),
                  params=(0, 2, 5))  # fmt: skip
    some = explanations._with_parameters(whole, (5, 0))
    assert some.params == (5, 0) and some.cause == "drift"
    assert some.columns.tolist() == [12, 10] and some.typical.tolist() == [3.0, 1.0]


def test_a_group_without_an_equation_has_no_variants() -> None:
    nothing: Any = None
    group: Any = SimpleNamespace(effect=None, cause="time")
    with pytest.raises(TypeError, match="^time has no equation$"):
        explanations._group_variants(nothing, group)


@pytest.mark.parametrize("oriented", [True, False])
def test_parameters_that_a_rotation_makes_of_others_are_those_others(
    oriented: bool,
) -> None:
    """Of k21, which a rotation turns into k12, where no orientation is known."""
    effect = SimpleNamespace(
        params=[SimpleNamespace(name=n) for n in ("k12", "k21", "k13")],
        turned_into={"k21": "k12"},
    )
    d: Any = SimpleNamespace(x=SimpleNamespace(oriented=np.array([False, oriented])))
    group: Any = SimpleNamespace(effect=effect, params=(1, 2, 0))
    found = explanations._in_axes_of(d, group)
    assert found == ((1, 2, 0) if oriented else (0, 2))
    without: Any = SimpleNamespace(effect=None, params=(4,))
    assert explanations._in_axes_of(d, without) == (4,)


def test_where_gyroscopes_were_measured_they_may_drift_with_the_accelerometers() -> (
    None
):
    rows = rows_of_observations(replace(seen(), mean=np.nan_to_num(seen().mean)))
    x = replace(rows.rows.x, since_start=TIMES)
    shown = [WeightedExplanation((member("bias_drift"),), 1.0)]
    d = ParameterSet(
        replace(rows.rows, x=x), np.ones(6), rows.since_turn, False,
        ParameterSetOptions(), shown,
    )  # fmt: skip
    (one,) = d.explanations
    ((cause, _),) = one.members
    assert cause.key == "bias_drift:acc"
    ((other, group),) = one.possible_members
    assert other.key == "bias_drift:gyr" and group is other.variants[0]
    axes = {(3,), (4,), (5,), (3, 4), (3, 5), (4, 5), (3, 4, 5)}
    assert {g.params for g in other.variants} == axes and group.params == (3, 4, 5)
    both = [member("bias_drift"), (other, group)]
    again = ParameterSet(
        replace(rows.rows, x=x), np.ones(6), rows.since_turn, False,
        ParameterSetOptions(), [WeightedExplanation(tuple(both), 1.0)],
    )  # fmt: skip
    assert again.explanations[0].possible_members == (), "both are there already"


def test_what_comes_of_the_same_event_is_possible_with_sizes_of_a_restart() -> None:
    """On all axes, at the instant that rows of another effect show."""
    rows = rows_of_observations(seen())
    x = replace(rows.rows.x, since_start=TIMES)
    cause, group = member("bias_step", (0,))
    d = ParameterSet(
        replace(rows.rows, x=x), np.ones(6), rows.since_turn, False,
        ParameterSetOptions(), [WeightedExplanation(((cause, group),), 1.0)],
    )  # fmt: skip
    (one,) = d.explanations
    scale = next(c for c, _ in one.possible_members if c.name == "scale_step")
    assert scale.chance == catalogue()["scale_step"].chance(x)
    assert {g.params for g in scale.variants} == {(0, 1, 2)}
    at = [g for g in scale.variants if g.shape == group.shape]
    sizes = 3e-3 * priors.RESTART_SIZES
    found = sorted(float(g.own_sigma()[0]) for g in at)
    np.testing.assert_allclose(found, sizes)
    other = WeightedExplanation((member("bias_drift"),), 1.0)
    calm = ParameterSet(
        replace(rows.rows, x=x), np.ones(6), rows.since_turn, False,
        ParameterSetOptions(), [other],
    )  # fmt: skip
    (one,) = calm.explanations
    assert all(c.name == "bias_drift" for c, _ in one.possible_members)
