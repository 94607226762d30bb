"""A given set fitted to rows, and the parameters that follow.

The set is fitted until it converges (`settling`). The result there is averaged over the
effects that may exist in addition to the requested parameters (`averaging`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.factory import FactoryErrors
from fieldcal.core.samples import Array
from fieldcal.model import thresholds
from fieldcal.model.causes.cause import CLOSURE
from fieldcal.model.causes.known import KnownRows
from fieldcal.model.evidence.of_two_grades import chances_of_coarser
from fieldcal.model.posterior.mixture import Mixture
from fieldcal.model.rows.reduce import Rows, RowSource
from fieldcal.model.search.selection import Search
from fieldcal.model.state import State
from fieldcal.model.system.turn_rows import TurnRows, Turns
from fieldcal.model.turns.turn import Turning
from fieldcal.solve.agreement import Fit, agreement
from fieldcal.solve.averaging import (
    Parameters,
    averaged_over,
    determined,
    known_rows,
    picked_by,
)
from fieldcal.solve.given import Given, Wanted
from fieldcal.solve.reliability import WrongAngles, wrong_angles
from fieldcal.solve.settling import without_bad_windows
from fieldcal.solve.shown import Shown, at_end


@dataclass(frozen=True, slots=True)
class Recorded:
    """Rows of the windows, and the samples between them.

    Attributes
    ----------
    rows : of the windows
    since : (o, n) s since the turn
    source : the samples of turns that are to be followed
    shown : explanations of the recording
    filters : rows of what filters of the sensors make of turns, as the accelerometers
        show it on the way: (m, 2) by s^2 of each triad, and (m,)
    cut : m/s^2, 1 sigma, what each accelerometer's values may have lost in size where
        they were cut toward zero

    """

    rows: Rows
    since: Array
    source: RowSource | None = None
    shown: tuple[Shown, ...] = ()
    filters: tuple[Array, Array] | None = None
    cut: tuple[float, ...] = ()

    def turning(self) -> Turning | None:
        """Whoever follows the turns, if there are any."""
        if self.source is None:
            return None
        found = Turning(self.source, self.rows, self.since)
        return found if found.legs else None


@dataclass(frozen=True, slots=True)
class Estimated:
    """A given set, estimated.

    Attributes
    ----------
    given : the set
    every : all parameters of the set, in its order
    names : (k,) parameters that the rows determine
    values, covariance : (k,), (k, k)
    missing : parameters that they do not determine
    found : the mixture of the likeliest explanation
    score : ln of the evidence of the set from all windows, before any is left out:
        sets that leave out others have nothing to compare
    moved : by how many sigmas what is carried moves each parameter, (k,)
    acc, gyr : how well the windows agree
    turns : rows of the turns
    contradicted : windows that count, between which the gyroscopes say that the device
        went elsewhere
    wrong_angles : what wrong angles would do without being noticed
    search : of the same rows

    """

    given: Given
    every: Parameters
    names: tuple[str, ...]
    values: Array
    covariance: Array
    missing: tuple[str, ...]
    found: Mixture
    score: float
    moved: Array
    search: Search
    acc: Fit
    gyr: Fit
    turns: tuple[TurnRows, ...]
    contradicted: tuple[tuple[int, int], ...] = ()
    wrong_angles: tuple[WrongAngles, ...] = ()

    def mixed_with(self, one: Estimated, other: Estimated, weight: float) -> Estimated:
        """The same, with what another model differs by in the uncertainty.

        `one` is this model fitted to what `other` is fitted to, a model of another
        tilt or of another rate of the Earth, as likely as `weight`.
        alpha0 turns about z and beta0 about x: the same angles in the other order.
        """
        twin = {"angle_offset.alpha0_deg": "base_tilt.about_z_deg",
                "angle_offset.beta0_deg": "base_tilt.about_x_deg"}  # fmt: skip
        twin |= {b: a for a, b in twin.items()}
        ours, theirs = (dict(zip(e.names, e.values, strict=True)) for e in (one, other))
        at = [i for i, n in enumerate(self.names)
              if n in ours and twin.get(n, n) in theirs]  # fmt: skip
        named = [self.names[i] for i in at]
        apart = np.array([theirs[twin.get(n, n)] - ours[n] for n in named])
        more = np.zeros_like(self.covariance)
        more[np.ix_(at, at)] = np.outer(apart, apart) + _wider(
            one.among(named), other.among([twin.get(n, n) for n in named])
        )
        return replace(self, covariance=self.covariance + weight * more)

    def among(self, names: Sequence[str]) -> Array:
        """Covariance of some of its parameters, in their order."""
        at = [self.names.index(name) for name in names]
        return self.covariance[np.ix_(at, at)]

    def coarser(self, stated: FactoryErrors) -> dict[str, float]:
        """How likely each kind of error is as in the set, and not as is stated."""
        state = self.search.evaluated(self.given.members).state
        left = [group for _, group in self.given.asked if group.cause == "factory"]
        return chances_of_coarser(state, left, self.given.wanted.factory, stated)

    @property
    def causes(self) -> dict[str, float]:
        """What the set has that was not asked for, with its probability."""
        out: dict[str, float] = {}
        for one in self.given.explanations:
            told = (cause.name for cause, _ in one.members if cause.told)
            for name in dict.fromkeys(told):
                out[name] = out.get(name, 0.0) + one.probability
        return dict(sorted(out.items(), key=lambda item: -item[1]))

    @property
    def sure(self) -> float:
        """Probability that something is there that was not asked for."""
        return sum(
            one.probability
            for one in self.given.explanations
            if any(cause.told for cause, _ in one.members)
        )

    @property
    def ended_s(self) -> float | None:
        """When biases that change are as stated, s since the start."""
        if not at_end(self.given, self.given.explanations).any():
            return None
        x = self.given.x
        return float((x.since_start + x.lasts / 2).max())

    @property
    def bad(self) -> Array:
        """Probability that each window is bad, (n,) in the order of the positions."""
        out = np.zeros(int(self.given.held.max()) + 1)
        out[self.given.held] = self.found.bad
        return out

    @property
    def closures(self) -> tuple[float, int]:
        """Sum of squares of the turns' closures, and how many there are."""
        full = np.zeros(self.given.width)
        np.add.at(full, self.found.columns, self.found.mean)
        off = [
            (t.closure - t.design @ full[t.columns]) ** 2 * t.info for t in self.turns
        ]
        white = np.concatenate([np.zeros(0), *off])
        return float(white.sum()), len(white)


def _wider(ours: Array, theirs: Array) -> Array:
    """By how much a covariance is larger, in directions in which it is."""
    sigma = np.sqrt(np.diag(ours))
    size, along = np.linalg.eigh((theirs - ours) / np.outer(sigma, sigma))
    along = along * sigma[:, None]
    larger: Array = (along * np.maximum(size, 0.0)) @ along.T
    return larger


def estimated(
    recorded: Recorded,
    turning: Turning | None,
    nominal: State,
    wanted: Wanted,
    averaged: bool = True,
) -> Estimated:
    """Fit a set.

    Parameters
    ----------
    recorded : rows
    turning : of the same, if turns are to be used
    nominal : the state that is started from
    wanted : what the set is made of
    averaged : whether over all explanations, or the likeliest is enough

    """
    given = Given(
        recorded.rows, np.abs(nominal.scale), recorded.since, turning is not None,
        wanted, recorded.shown, recorded.cut,
    )  # fmt: skip
    given.known = _known(given, recorded, nominal)
    turns = None if turning is None else Turns(turning, given, False)
    fit = without_bad_windows(recorded.rows, given, nominal, turns)
    found, gram = fit.found, fit.gram
    parameters = averaged_over(given, gram, found, nominal, averaged)
    picked = picked_by(given, found.columns)
    names, values, covariance, moved, missing = determined(given, parameters)
    at = [given.names.index(name) for name in names]
    elsewhere = turning.contradicted if turning else ()
    counts = set(given.held[found.bad <= thresholds.CERTAIN].tolist())
    return Estimated(
        given, parameters, names, values, covariance, missing, found, fit.score, moved,
        Search(given, gram),
        agreement(gram, given, found, (0, 1, 2)),
        agreement(gram, given, found, (3, 4, 5)),
        fit.turned,
        tuple(pair for pair in elsewhere if counts.issuperset(pair)),
        tuple(wrong_angles(given, found, names, picked[at])),
    )  # fmt: skip


def _known(given: Given, recorded: Recorded, nominal: State) -> KnownRows | None:
    """What the lot and the way between the windows say of columns."""
    lot, rows = given.wanted.lot, []
    if lot is not None and (known := known_rows(given, lot, nominal)) is not None:
        rows.append(known)
    group, seen = given.filters, recorded.filters
    if group is not None and seen is not None and len(seen[1]):
        rows.append(KnownRows(group.columns, *seen))
    return KnownRows.joined(rows) if rows else None


def scatter_of(found: Mixture, channels: tuple[int, ...]) -> float:
    """Rms of what windows of a triad are off by beside their noise; outputs."""
    return float(np.sqrt(np.mean(found.scatter[list(channels)] ** 2)))


def turns_scatter(found: Mixture) -> float:
    """The same of turns' closures, rad."""
    return float(found.scatter[CLOSURE])
