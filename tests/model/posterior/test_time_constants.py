"""What fades, and the biases beside it, are as uncertain as its time constant."""

from __future__ import annotations

from functools import cache

import numpy as np
from small_sessions import LADDER, SD, dictionary, ladder, nominal, rows_of

from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model.posterior.common_axes import pick_columns
from fieldcal.model.posterior.model_average import (
    average_of_columns,
    average_over_sets,
    average_over_sizes,
)
from fieldcal.model.posterior.time_constants import sets_at_other_time_constants
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.inference import Inference, InferenceResult
from fieldcal.model.state import State, Term
from fieldcal.model.system.window_rows import WindowSystem

X = ladder(4)
TAU, SIZE = 9.0, 3e-3


@cache
def fading(seed: int, both: bool = False) -> InferenceResult:
    """A device that settles on one axis, and perhaps on one of the gyroscopes."""
    sizes = np.array([SIZE, 0.0, 0.0, SIZE / 20 * both, 0.0, 0.0])
    term = Term(catalogue()["settling"], sizes, {"tau_s": TAU})
    state = State(np.zeros(6), np.ones(6), np.zeros((len(LADDER), 2)), np.zeros(3),
                  (term,))  # fmt: skip
    d = dictionary(X)
    y = state.output(state.experienced(X), d.since)
    y += SD * np.random.default_rng(seed).standard_normal(y.shape)
    return Inference(GaussNewton(WindowSystem(rows_of(X, y), d), nominal())).run()


def fitted(y: Array, tau: float) -> tuple[Array, float]:
    """Bias, scale factor and amplitude of the x axis by least squares; the squares."""
    fade = np.exp(-X.since_turn / tau)
    design = np.column_stack([np.ones(len(X)), X.f[:, 0], fade])
    value = np.linalg.lstsq(design, y, rcond=None)[0]
    return value, float(((y - design @ value) ** 2).sum())


def test_each_time_constant_is_elsewhere_once_up_and_once_down() -> None:
    for both in (False, True):
        found = fading(3, both)
        n = len(found.best.members)
        moved = sets_at_other_time_constants(found)
        assert len(moved) == 2 * n == 2 * (1 + both)
        for i, (_, group) in enumerate(found.best.members):
            step = np.sqrt(n) * group.shape_sigma("tau_s") / group.shape["tau_s"]
            own = [s.members[i][1].shape["tau_s"] for s in moved]
            there = sorted({float(np.log(t / group.shape["tau_s"])) for t in own})
            np.testing.assert_allclose(there, [-step, 0.0, step][:: 1 + (n == 1)],
                                       rtol=1e-9, atol=1e-12)  # fmt: skip


def test_what_is_found_keeps_its_columns() -> None:
    found = fading(3)
    width = found.fit.dictionary.width
    sets_at_other_time_constants(found)
    assert found.fit.dictionary.width == width


def test_an_amplitude_is_uncertain_by_what_the_time_constant_moves_it() -> None:
    """By least squares at both ends of the time constant's interval."""
    found = fading(3)
    ((_, group),) = found.best.members
    at = group.columns[:1]
    own = average_over_sizes(found.search.sets, found.best)
    (alone,) = np.diag(average_of_columns([(own, 1.0)], at)[1])
    sets = [(s, 0.5) for s in sets_at_other_time_constants(found)]
    (whole,) = np.diag(average_over_sets(sets, lambda s: pick_columns(
        s, s.members[0][1].columns[:1]))[1])  # fmt: skip
    tau, sigma = group.shape["tau_s"], group.shape_sigma("tau_s")
    system = found.fit.system
    assert isinstance(system, WindowSystem)
    y = system.rows.y[:, 0]
    ends = [fitted(y, tau * np.exp(s * sigma / tau))[0][2] for s in (-1.0, 1.0)]
    moved = (ends[1] - ends[0]) / 2
    assert abs(moved) > 0.3 * np.sqrt(alone)
    np.testing.assert_allclose(np.sqrt(whole - alone), abs(moved), rtol=0.25)


def test_what_does_not_fade_is_nowhere_else() -> None:
    d = dictionary(X)
    y = np.hstack([X.f, X.w]) + SD * np.random.default_rng(1).standard_normal(
        (len(X), 6)
    )
    assert (
        sets_at_other_time_constants(
            Inference(GaussNewton(WindowSystem(rows_of(X, y), d), nominal())).run()
        )
        == []
    )
