"""Which variants stand for all of them."""

from __future__ import annotations

import doctest
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fieldcal.model import tolerances
from fieldcal.solve import variants
from fieldcal.solve.explanations import WeightedExplanation
from fieldcal.solve.variants import choice_at, spread_points


def test_rounding_does_not_decide_between_variants_that_mirror_one_another() -> None:
    """Half of the probability ends between the second and the third."""
    rng = np.random.default_rng(1)
    weight = np.array([0.3, 0.2, 0.2, 0.3])
    for _ in range(100):
        rounded = weight * (1 + 1e-13 * rng.standard_normal(4))
        assert choice_at(rounded / rounded.sum(), 0.5) == 1


@pytest.mark.parametrize("weight", [[1.0], [0.5, 0.5], [0.25, 0.25, 0.125, 0.375]])
def test_each_is_reached_as_often_as_it_is_likely(weight: list[float]) -> None:
    (points,) = spread_points(1).T
    at = [choice_at(np.array(weight), float(u)) for u in points]
    share = np.bincount(at, minlength=len(weight)) / tolerances.REPRESENTATIVE_POINTS
    np.testing.assert_allclose(share, weight, atol=1e-12)


@pytest.mark.parametrize("count", [1, 2, 3, 20, 25])
def test_points_spread_evenly_over_every_cause(count: int) -> None:
    points = spread_points(count)
    assert points.shape == (tolerances.REPRESENTATIVE_POINTS, count)
    assert ((points >= 0) & (points < 1)).all()
    for column in points.T:
        gaps = np.diff(np.concatenate([[0.0], np.sort(column), [1.0]]))
        assert gaps.max() < 5 / tolerances.REPRESENTATIVE_POINTS
        assert abs(column.mean() - 0.5) < 0.12


def test_points_of_two_causes_fill_the_square() -> None:
    """As many in each quarter as its area, to within the scatter of an even spread."""
    points = spread_points(3, 400)
    for i, j in ((0, 1), (0, 2), (1, 2)):
        counted, _, _ = np.histogram2d(points[:, i], points[:, j], 4, [[0, 1], [0, 1]])
        assert (np.abs(counted - 25) <= 6).all()
    np.testing.assert_allclose(np.sort(points[:, 0]), (np.arange(400) + 0.5) / 400)


def test_nothing_to_choose_is_one_point() -> None:
    assert spread_points(0).shape == (1, 0)
    assert spread_points(1, 1).tolist() == [[0.5]]
    assert doctest.testmod(variants, extraglobs={"np": np}).failed == 0


def chosen(monkeypatch: pytest.MonkeyPatch, probability: float) -> dict[Any, float]:
    """Variants of a cause of two, beside a possible one of the other triad."""

    def choices(search: Any, members: Any, member: Any) -> Any:
        assert members == ("known", "drift")
        return [(f"{member} 1",), (f"{member} 2",)], np.array([0.25, 0.75])

    def maybe(search: Any, members: Any, member: Any) -> Any:
        assert members == ("known", "drift")
        return [(), (f"{member} 3",)], np.array([0.5, 0.5])

    monkeypatch.setattr(variants, "_choices", choices)
    monkeypatch.setattr(variants, "_with_and_without", maybe)
    one = WeightedExplanation(cast(Any, ("drift",)), probability, cast(Any, ("too",)))
    found = variants.variants(cast(Any, None), cast(Any, ("known",)), one)
    assert len({w.members for w in found}) == len(found)
    return {w.members: w.probability for w in found}


def test_variants_are_as_likely_as_their_choices_together(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = chosen(monkeypatch, 1.0)
    assert sum(found.values()) == pytest.approx(1.0)
    for members, expected in {
        ("drift 1",): 0.125, ("drift 1", "too 3"): 0.125,
        ("drift 2",): 0.375, ("drift 2", "too 3"): 0.375,
    }.items():  # fmt: skip
        assert found[members] == pytest.approx(expected, abs=2.01 / 24)
    # multiples of a point's share
    shares = np.array(list(found.values())) * tolerances.REPRESENTATIVE_POINTS
    np.testing.assert_allclose(shares, shares.round(), atol=1e-9)


def test_an_unlikely_explanation_has_fewer_variants(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (share,) = set(chosen(monkeypatch, 1e-3).values())
    assert share == 1.0, "one point at least"
    half = np.array(list(chosen(monkeypatch, 0.5).values())) * 12
    np.testing.assert_allclose(half, half.round(), atol=1e-9)


def test_choices_are_weighed_by_their_evidence(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of those with the axes that the search named."""
    odds = np.array([1.0, 50.0, 6.0, 3.0])
    monkeypatch.setattr(variants, "_scores", lambda *told: np.log(odds) - 1000)
    monkeypatch.setattr(variants, "has_equation", lambda group: group.params != ())
    alone, other, both, every, none = (
        SimpleNamespace(params=params) for params in ((0,), (1,), (0, 1), (0, 1, 2), ())
    )
    cause: Any = SimpleNamespace(variants=(alone, other, both, every))
    search: Any = SimpleNamespace()
    choices: Any = variants._choices
    made, weight = choices(search, (), (cause, alone))
    assert made == [((cause, one),) for one in (alone, both, every)]
    np.testing.assert_allclose(weight, [0.1, 0.6, 0.3])
    made, weight = choices(search, (), (cause, none))
    assert made == [((cause, none),)] and weight.tolist() == [1.0]
    cause.variants = (other, every)
    made, weight = choices(search, (), (cause, every))
    assert made == [((cause, every),)] and weight.tolist() == [1.0]


def test_a_cause_that_may_be_absent_is_weighed_by_its_best_variant(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Odds of 1 without, 6 with the best, and the others in proportion to it."""
    odds = np.array([1.0, 6.0, 3.0])
    monkeypatch.setattr(variants, "_scores", lambda *told: np.log(odds) + 50)
    cause: Any = SimpleNamespace(variants=("a", "b", "c"))

    def evaluate(members: Any) -> Any:
        assert members in (("m",), ("m", (cause, "b")))
        return SimpleNamespace(score=3.0 + np.log(6.0) * (len(members) - 1))

    search: Any = SimpleNamespace(evaluate=evaluate)
    maybe: Any = variants._with_and_without
    made, weight = maybe(search, ("m",), (cause, "a"))
    assert made == [(), *(((cause, one),) for one in "abc")]
    np.testing.assert_allclose(weight, np.array([1.0, 1.0, 6.0, 3.0]) / 11)
