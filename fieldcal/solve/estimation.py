"""A given set fitted to rows: relinearised until it stays, then mixed.

The state is moved to the estimate of the set (`model.inference`), turns between windows
are followed about it, and the answer is taken there (`mixture`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model.causes import CLOSURE
from fieldcal.model.evidence import Gram
from fieldcal.model.inference import Inference
from fieldcal.model.mixture import Mixing, Mixture
from fieldcal.model.reduce import Rows, RowSource
from fieldcal.model.search import Search
from fieldcal.model.state import State
from fieldcal.model.system import System
from fieldcal.model.turn import Turning
from fieldcal.model.turn_rows import TurnRows, Turns
from fieldcal.solve.agreement import Fit, agreement
from fieldcal.solve.given import Given, Wanted
from fieldcal.solve.observations import Mask
from fieldcal.solve.words import CERTAIN, SUSPECT

OPEN = 0.25
"""Part of a variance before the rows from which they determined nothing."""


NO_WEIGHT = 1e5
"""Times its noise that a bad window is given where it must not bend the state."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """Rows of the windows, and the samples between them.

    Attributes
    ----------
    rows : of the windows
    since : (o, n) s since the turn
    source : the samples of turns that are to be followed

    """

    rows: Rows
    since: Array
    source: RowSource | None = None

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
    names : (k,) parameters that the rows determine
    values, covariance : (k,), (k, k)
    missing : parameters that they do not determine
    found : the mixture
    acc, gyr : how well the windows agree
    turns : rows of the turns

    """

    given: Given
    names: tuple[str, ...]
    values: Array
    covariance: Array
    missing: tuple[str, ...]
    found: Mixture
    acc: Fit
    gyr: Fit
    turns: tuple[TurnRows, ...]

    def mixed_with(self, one: Estimated, other: Estimated, weight: float) -> Estimated:
        """The same, with what another model of the tilt differs by in the uncertainty.

        `one` is this model fitted to what `other` is fitted to.
        alpha0 turns about z and beta0 about x: the same angles in the other order.
        """
        twin = {"angle_offset.alpha0_deg": "base_tilt.about_z_deg",
                "angle_offset.beta0_deg": "base_tilt.about_x_deg"}  # fmt: skip
        twin |= {b: a for a, b in twin.items()}
        ours, theirs = (dict(zip(e.names, e.values, strict=True)) for e in (one, other))
        apart = np.zeros(len(self.names))
        for i, name in enumerate(self.names):
            if name in ours and twin.get(name, name) in theirs:
                apart[i] = theirs[twin.get(name, name)] - ours[name]
        return replace(
            self, covariance=self.covariance + weight * np.outer(apart, apart)
        )

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


def estimated(
    recorded: Recorded, turning: Turning | None, nominal: State, wanted: Wanted
) -> Estimated:
    """Fit a set.

    Parameters
    ----------
    recorded : rows
    turning : of the same, if turns are to be used
    nominal : the state that is started from
    wanted : what the set is made of

    """
    rows, since = recorded.rows, recorded.since
    given = Given(rows, np.abs(nominal.scale), since, turning is not None, wanted)
    turns = None if turning is None else Turns(turning, given, False)
    bad = np.zeros(len(given.held), dtype=bool)
    # one bad window of six can be told from scatter, two of six cannot
    for _ in range(1 + max(1, len(bad) // 6)):
        inference = Inference(System(_without(rows, given, bad), given), nominal, turns)
        gram = inference.gram(*_settled(inference, given), None)
        found = _mixed(given, gram)
        worst = found.bad * ~bad == (found.bad * ~bad).max(initial=0.0)
        if worst.any() and (found.bad[worst] > SUSPECT).all():
            # a gross error bends the state so far that nothing is linear about it
            others = System(_without(rows, given, bad | worst), given)
            beside = Inference(others, nominal, turns)
            gram = inference.gram(*_settled(beside, given), None)
            found = _mixed(given, gram)
        worst &= (found.bad > CERTAIN) & ~bad
        if not worst.any() or bad.sum() >= max(1, len(bad) // 6):
            break
        bad |= worst
    found = replace(found, bad=np.where(bad, 1.0, found.bad))
    names, values, covariance, missing = _named(given, found, nominal)
    return Estimated(
        given, names, values, covariance, missing, found,
        agreement(gram, given, found, (0, 1, 2)),
        agreement(gram, given, found, (3, 4, 5)),
        tuple(inference.turned),
    )  # fmt: skip


def _without(rows: Rows, given: Given, bad: Mask) -> Rows:
    """Rows of which some windows (p,) have no weight."""
    left = np.isin(rows.x.position, given.held[bad])
    return replace(rows, sd=np.where(left[:, None], NO_WEIGHT * rows.sd, rows.sd))


def _settled(inference: Inference, given: Given) -> tuple[State, Array]:
    """The state where the set has settled, and the columns' values in it."""
    start: Array = np.zeros(given.width)
    state, values, _ = inference.settled(inference.nominal, start, given.members)
    if inference.turns is not None:
        inference.gram(state, values, None)
        state, values, _ = inference.settled(state, values, given.members)
    return state, values


def _mixed(given: Given, gram: Gram) -> Mixture:
    """The set at all its sizes, with each window perhaps being bad."""
    search = Search(given, gram)
    there = search.evaluated(given.members)
    return Mixing(given, gram, there, search.unstable).run()


def _named(
    given: Given, found: Mixture, nominal: State
) -> tuple[tuple[str, ...], Array, Array, tuple[str, ...]]:
    """Parameters that are determined, and the names of those that are not."""
    base = {}
    for c in range(6):
        sensor, axis = ("acc", "gyr")[c // 3], "xyz"[c % 3]
        base[f"{sensor}_bias.{axis}"] = float(nominal.bias[c])
        base[f"{sensor}_scale.{axis}"] = float(nominal.scale[c])
    before = np.concatenate([g.sizes(g.fixed or 1.0) for g in given.groups])
    at = [np.flatnonzero(found.columns == given.place(n)[0])[0] for n in given.names]
    told = np.sqrt(np.diag(found.covariance))
    limits = USEFUL | ({"gyr_scale": TURNED} if given.wanted.turned else {})
    useful = [limits.get(n.partition(".")[0], np.inf) for n in given.names]
    known = [
        i for i, (k, worst) in enumerate(zip(at, useful, strict=True))
        if told[k] ** 2 < OPEN * before[k] ** 2 and told[k] < worst
    ]  # fmt: skip
    rows = [at[i] for i in known]
    names = tuple(given.names[i] for i in known)
    values = found.mean[rows] + [base.get(n, 0.0) for n in names]
    missing = tuple(n for i, n in enumerate(given.names) if i not in known)
    return names, values, found.covariance[np.ix_(rows, rows)], missing


USEFUL = {
    "acc_bias": 1.0, "cross_coupling": 0.1, "gyr_scale": 0.1,
    "gyro_cross_coupling": 0.01, "angle_offset": 3.0, "base_tilt": 3.0,
}  # fmt: skip
"""Standard uncertainty from which a parameter is worse than a guess: no bias is a tenth
of gravity, an axis is put in by hand to some hundredths, and an eye sees a tilt of
three degrees."""

TURNED = 0.01
"""The same of the scale factor of gyroscopes where turns give it: makers do better."""


def scatter_of(found: Mixture, channels: tuple[int, ...]) -> float:
    """Rms of what windows of a triad are off by beside their noise; outputs."""
    return float(np.sqrt(np.mean(found.scatter[list(channels)] ** 2)))


def turns_scatter(found: Mixture) -> float:
    """The same of turns' closures, rad."""
    return float(found.scatter[CLOSURE])
