"""Makes the fitted state one that a device can have.

In the model the rate of the base is three free parameters e. A device measures the
Earth's rate at its latitude, rotated about the vertical by its heading, or none. If no
latitude is stated, it is that of the vertical part of the estimate. Given the rate e',
the other estimates become

    m' = m + C_e C_ee^-1 (e' - m_e)                                                (1)

with the estimates m and their covariance C. In the model the settling of one triad may
count from the end of the motion, and that of the other from the start of the window. A
device settles from one instant, the later of them. An amplitude that counts from d
earlier becomes

    A' = A exp(-d / tau)                                                           (2)

Source: (1) the mean of a normal distribution, given some of its components.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.frames import EARTH_RATE, earth_rate_at_home
from fieldcal.core.samples import Array, Index
from fieldcal.diagnosis.explain import Explanation
from fieldcal.model.search.gauss_newton import state_at_estimate
from fieldcal.model.state import State
from fieldcal.model.system.fitted import FittedSet
from fieldcal.physics.experience import Experience

STANDS = 3.0
"""Standard deviations from which the fixture does not point north."""

HEADINGS = np.linspace(-np.pi, np.pi, 3601)


@dataclass(frozen=True, slots=True)
class TwinState:
    """State of the twin.

    Attributes
    ----------
    state : its calibration and effects
    heading : of the fixture, rad; None if no Earth's rate was fitted
    latitude : rad; nan if it is neither stated nor fitted

    """

    state: State
    heading: float | None = None
    latitude: float = float("nan")


def physical_twin_state(explanation: Explanation) -> TwinState:
    """State of the twin with all causes that were found."""
    best, heading, rate = explanation.best, None, np.zeros(3)
    x = best.rows.x
    if explanation.shows_earth_rate:
        if np.isnan(x.latitude):
            x = replace(x, latitude=_fitted_latitude(best))
        heading = _best_heading(best, x)
        rate = _earth_rates_by_heading(x, np.array([heading]))[0]
    state = _state_given_rate(explanation, best, rate)
    state = from_one_instant(state, best.dictionary.since)
    return TwinState(state, heading, x.latitude)


def state_without_earth_rate(explanation: Explanation, fitted: FittedSet) -> State:
    """The fitted state, given that the fitted rate of the base is zero."""
    return _state_given_rate(explanation, fitted, np.zeros(3))


def _state_given_rate(
    explanation: Explanation, fitted: FittedSet, rate: Array
) -> State:
    """The fitted state, given the rate of the base, (3,) rad/s (1)."""
    nominal = explanation.inferred.fit.nominal
    found, at = fitted.set.state, _base_rate_columns(fitted)
    if len(at):
        shared = found.inverse[:, at]
        off = np.linalg.solve(shared[at], rate - found.estimate[at])
        found = replace(found, estimate=found.estimate + shared @ off)
    given = replace(fitted.set, state=found)
    return state_at_estimate(fitted.dictionary, nominal, given)[0]


def from_one_instant(state: State, since: Array) -> State:
    """Count all settling from the same instant (2).

    `since` (o, n) is the time since the turn in each row, for each origin.
    """
    last, terms = max((t.origin for t in state.terms), default=0), []
    for term in state.terms:
        for shape in term.effect.shapes:
            if shape.kind == "turn" and term.origin != last:
                known = np.isfinite(since[[term.origin, last]]).all(axis=0)
                ahead = np.median((since[term.origin] - since[last])[known])
                left = np.exp(-ahead / term.shape[shape.name])
                term = replace(term, values=left * term.values, origin=last)
        terms.append(term)
    return replace(state, terms=tuple(terms))


def _base_rate_columns(fitted: FittedSet) -> Index:
    """Indices of the rate of the base among the estimates, (3,) or (0,)."""
    first = fitted.dictionary.earth
    if first < 0:
        return np.zeros(0, dtype=np.intp)
    return np.flatnonzero(np.isin(fitted.set.state.columns, first + np.arange(3)))


def _fitted_latitude(fitted: FittedSet) -> float:
    """Latitude of the vertical part of the fitted rate, rad (39)."""
    down = float(fitted.set.state.estimate[_base_rate_columns(fitted)][1])
    return float(np.arcsin(np.clip(-down / EARTH_RATE, -1.0, 1.0)))


def _best_heading(fitted: FittedSet, x: Experience) -> float:
    """Heading that best agrees with the fitted rate, rad; 0 if north agrees with it."""
    found, at = fitted.set.state, _base_rate_columns(fitted)
    off = _earth_rates_by_heading(x, HEADINGS) - found.estimate[at]
    known = np.linalg.inv(found.inverse[np.ix_(at, at)])
    square = np.einsum("ni,ij,nj->n", off, known, off)
    north = float(np.interp(0.0, HEADINGS, square))
    best = int(np.argmin(square))
    return float(HEADINGS[best]) if north - square[best] > STANDS**2 else 0.0


def _earth_rates_by_heading(x: Experience, headings: Array) -> Array:
    """The Earth's rate in base axes for each heading, (n, 3) rad/s."""
    east, down, north = earth_rate_at_home(x.latitude) + x.transport
    c, s = np.cos(headings), np.sin(headings)
    return np.column_stack(
        [c * east + s * north, np.full(len(c), down), c * north - s * east]
    )
