"""How a fit converges, of fits that are made up: which windows are left out, and when
turns are integrated again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from observed import observe, outputs

from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.core.samples import Array
from fieldcal.model.state import State
from fieldcal.solve import settling
from fieldcal.solve.observation_rows import rows_of_observations

WIDTH, SCALE = 12, 6


def state(*scale: float) -> State:
    wide = np.resize(scale, 6).astype(float)
    return State(np.zeros(6), wide, np.zeros((1, 2)), np.zeros(3))


@dataclass
class MadeUp:
    """A fit whose answers are known.

    Attributes
    ----------
    scales : of the states to which it settles, one after the other
    contradicted : number of contradicted turns, by the scale they are integrated with
    done : what was asked for, and with which scale

    """

    scales: list[float]
    contradicted: dict[float, int] = field(default_factory=dict)
    has_turns: bool = True
    done: list[tuple[str, float]] = field(default_factory=list)
    zeroed: list[bool] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.nominal = state(1.0, 1.0, 1.0, 2.0, 2.0, 2.0)
        self.turns = "turns" if self.has_turns else None
        self.contradicted_turns: tuple[None, ...] = ()

    def approach(self, start: State, values: Array, members: Any) -> Any:
        assert members == "members"
        self.done.append(("settle", float(start.scale[0])))
        self.zeroed.append(not values[SCALE + 3 : SCALE + 6].any())
        scale = self.scales.pop(0) if len(self.scales) > 1 else self.scales[0]
        return state(scale), np.ones(WIDTH), None

    def follow_turns(self, about: State, values: Array) -> None:
        self.done.append(("turns", float(about.scale[0])))
        if self.turns is not None:
            count = self.contradicted.get(float(about.scale[0]), 0)
            self.contradicted_turns = (None,) * count


THERE: Any = SimpleNamespace(width=WIDTH, scale=SCALE, members="members")


def settled(one: MadeUp) -> tuple[State, Array]:
    return settling._settled_state(cast(Any, one), THERE)


def test_windows_alone_settle_once() -> None:
    one = MadeUp([1.5], has_turns=False)
    found, values = settled(one)
    assert one.done == [("settle", 1.0)] and found.scale[0] == 1.5
    np.testing.assert_array_equal(values, np.ones(WIDTH))


def test_turns_begin_with_the_nominal_scale_factors_of_gyroscopes() -> None:
    one = MadeUp([1.5])
    followed = []
    real = one.follow_turns

    def follow(about: State, values: Array) -> None:
        followed.append((about.scale.tolist(), values.tolist()))
        real(about, values)

    cast(Any, one).follow_turns = follow
    settled(one)
    scale, values = followed[0]
    assert scale == [1.5, 1.5, 1.5, 2.0, 2.0, 2.0]
    assert values == [1.0] * 9 + [0.0] * 3
    assert one.zeroed[:2] == [True, True]


def test_turns_are_integrated_again_until_no_scale_factor_changes_by_a_percent() -> (
    None
):
    one = MadeUp([1.0, 1.0, 1.02, 1.03, 1.0301])
    cast(Any, one).nominal = state(1.0)
    found, _ = settled(one)
    # of the windows, then with the turns: 0 % at once
    assert one.done == [("settle", 1.0), ("turns", 1.0), ("settle", 1.0)]
    assert found.scale[0] == 1.0
    one = MadeUp([1.0, 1.1, 1.12, 1.13, 1.2])
    cast(Any, one).nominal = state(1.0)
    found, _ = settled(one)
    assert found.scale[0] == 1.13, "1.12 is 1.8 % from 1.1, and 1.13 is 0.9 % from it"
    assert [what for what, _ in one.done] == [
        "settle", "turns", "settle", "turns", "settle", "turns", "settle"
    ]  # fmt: skip


def test_a_state_that_never_rests_is_left_after_six_integrations() -> None:
    one = MadeUp([1.5**n for n in range(20)])
    settled(one)
    assert [what for what, _ in one.done].count("turns") == 6
    assert [what for what, _ in one.done].count("settle") == 1 + 6


@pytest.mark.parametrize(
    ("contradicted", "begins"),
    [
        ({}, 1.5),
        ({1.5: 2, 1.0: 1}, 1.0),
        ({1.5: 2, 1.0: 2}, 1.5),
        ({1.5: 1, 1.0: 3}, 1.5),
    ],
)
def test_the_fit_goes_on_from_where_fewer_turns_contradict_the_positions(
    contradicted: dict[float, int], begins: float
) -> None:
    one = MadeUp([1.5, 1.5], contradicted)
    settled(one)
    turned = [scale for what, scale in one.done if what == "turns"]
    if not contradicted:
        assert turned[0] == 1.5 and 1.0 not in turned
        return
    assert turned[:2] == [1.5, 1.0]
    after = one.done[one.done.index(("turns", 1.0)) + 1]
    assert after == (("settle", 1.0) if begins == 1.0 else ("turns", 1.5))


def test_a_window_without_weight_has_noise_beyond_all() -> None:
    rows = rows_of_observations(observe(FIVE_POSITIONS, outputs(FIVE_POSITIONS))).rows
    there: Any = SimpleNamespace(window_positions=np.array([0, 2, 4]))
    left = np.array([False, True, True])
    found = settling._without_windows(rows, there, left)
    np.testing.assert_allclose(found.sd[[0, 1, 3]], rows.sd[[0, 1, 3]])
    np.testing.assert_allclose(found.sd[[2, 4]], 1e5 * rows.sd[[2, 4]])
    np.testing.assert_array_equal(found.y, rows.y)


@dataclass(frozen=True)
class Posterior:
    """What a fit says of the windows."""

    bad: Array
    score: float


def fits_of(
    monkeypatch: pytest.MonkeyPatch, bad_by_left: Callable[[Array], Array], n: int
) -> tuple[settling.SettledSet, list[tuple[list[int], list[int]]]]:
    """Fit where the windows that are left out determine which look bad."""
    fits: list[tuple[list[int], list[int]]] = []

    def gauss_newton(system: Any, nominal: Any, turns: Any) -> Any:
        return SimpleNamespace(left=system, turn_rows=[])

    def fit(now: Any, about: Any, there: Any) -> Any:
        fits.append((np.flatnonzero(now.left).tolist(),
                     np.flatnonzero(about.left).tolist()))  # fmt: skip
        return "gram", Posterior(bad_by_left(now.left), -float(now.left.sum()))

    monkeypatch.setattr(settling, "GaussNewton", gauss_newton)
    monkeypatch.setattr(settling, "WindowSystem", lambda rows, there: rows)
    monkeypatch.setattr(
        settling, "_without_windows", lambda rows, there, left: left.copy()
    )
    monkeypatch.setattr(settling, "_settled_fit", fit)
    there: Any = SimpleNamespace(window_positions=np.arange(n))
    nothing = cast(Any, None)
    found = settling.settle_without_bad_windows(nothing, there, nothing, nothing)
    return found, fits


def test_windows_that_agree_are_fitted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    found, fits = fits_of(monkeypatch, lambda left: np.zeros(6), 6)
    assert fits == [([], [])] and found.score == 0.0
    assert not found.mixture.bad.any() and cast(Any, found.gram) == "gram"


def test_a_suspect_is_kept_but_does_not_move_the_state(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bad = np.array([0.0, 0.5, 0.2, 0, 0, 0])
    found, fits = fits_of(monkeypatch, lambda left: bad, 6)
    assert fits == [([], []), ([], [1])]
    np.testing.assert_array_equal(found.mixture.bad, bad)
    # a tenth is not enough
    _, fits = fits_of(monkeypatch, lambda left: 0.2 * bad, 6)
    assert fits == [([], [])]


@pytest.mark.parametrize(("n", "most"), [(3, 1), (11, 1), (12, 2), (18, 3)])
def test_of_six_windows_one_may_be_left_out(
    monkeypatch: pytest.MonkeyPatch, n: int, most: int
) -> None:
    """All look certainly bad, the first most of all until it is left out."""
    certain = 1.0 - 1e-3 * np.arange(n) / n
    found, fits = fits_of(monkeypatch, lambda left: np.where(left, 0.0, certain), n)
    left = found.mixture.bad == 1.0
    assert left.tolist() == [i < most for i in range(n)]
    assert found.score == 0.0, "of all windows"
    assert fits[-1][0] == list(range(most))


def test_windows_that_are_equally_bad_go_together(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bad = np.array([0.0, 0.995, 0.0, 0.995, 0.3, 0.0])
    found, fits = fits_of(monkeypatch, lambda left: np.where(left, 0.0, bad), 6)
    assert fits[1] == ([], [1, 3]) and fits[2][0] == [1, 3]
    np.testing.assert_array_equal(found.mixture.bad, [0, 1, 0, 1, 0.3, 0])
