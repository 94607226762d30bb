"""A recording fitted to the motion that a reference says, by the one model.

Alignment, noise spectrum and causes hang on each other: with the alignment of
correlation bias, scale factor and alignment are fitted until they stay, then causes are
searched, and both again with what was found. What the alignment is off by is a column
of every fit, so its uncertainty is in all numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.against.motion.alignment import CommonMotion
from fieldcal.against.motion.fit import MotionFit, lag_of
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.model.causes.followed import MotionDictionary
from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior.probabilities import Posterior
from fieldcal.model.rows.coloured import Bands
from fieldcal.model.rows.motion import Alignment, MotionRows, rows_in_motion
from fieldcal.model.rows.reference import Reference
from fieldcal.model.search.inference import Inferred
from fieldcal.model.state import State
from fieldcal.model.system.motion_rows import MotionSystem
from fieldcal.physics.lag import Lag
from fieldcal.session.description import Description

STRETCHES, SHORTEST_S = 24, 5.0
"""Stretches of a recording, and how short one is at least, s."""

MOST = 40_000
"""Rows at most: of more, samples are put together."""

SLOWEST_HZ, QUICKEST_HZ = 10.0, 50.0
"""Rows a second: what moves by more than half of that is no motion of a body."""

MOVES, OFTEN = 1e-3, 8.0
"""Part of a motion's power that may be quicker than what counts as its frequency, and
rows in a period of that."""

MARGIN_S = 1.0
"""What is left out at both ends of a reference, where a shift would leave it, s."""

FEWEST_S = 20.0
"""Shortest common motion that tells anything, s."""

AGAIN = 3
"""Searches at most."""


@dataclass(frozen=True)
class Following:
    """A recording beside its reference, explained.

    Attributes
    ----------
    fit : alignment and noise
    inferred : set, state and search
    posterior : probabilities

    """

    fit: MotionFit
    inferred: Inferred
    posterior: Posterior

    @property
    def rows(self) -> MotionRows:
        """At the alignment that was found."""
        return self.fit.rows

    @property
    def dictionary(self) -> MotionDictionary:
        """What rows were laid to."""
        return self.fit.system.dictionary

    @property
    def set(self) -> Set:
        """The best set of causes."""
        return self.inferred.best


def follow(
    block: Block, about: Description, reference: Reference, start: CommonMotion
) -> Following:
    """Fit a recording to the motion of a reference.

    Parameters
    ----------
    block, about : the recording
    reference : of the motion
    start : where the two stand beside each other, roughly, and what they share

    Raises
    ------
    InputError
        If both cover too little of the same motion.

    """
    rows = _rows(block, reference, start.alignment)
    nominal = _nominal(about, int(rows.part[-1]) + 1)
    dictionary = MotionDictionary(rows, np.abs(nominal.scale))
    system = MotionSystem(dictionary, _flat(rows, nominal))
    plain = MotionFit(system, nominal, Bands.between(rows.frequency), start.hz)
    fit = _likeliest(plain, dictionary)
    found = fit.searched(())
    for _ in range(AGAIN):
        before, members = found.best.keys, found.best.members
        fit.settle(members)
        found = fit.searched(members)
        if found.best.keys == before:
            break
    fit, found = _without_idle_lags(fit, found)
    return Following(fit, found, Posterior(found.search, found.best))


def _likeliest(fit: MotionFit, dictionary: MotionDictionary) -> MotionFit:
    """A fit settled with late gyroscopes, or with what only motion shows besides.

    What a filter does is linear about a filter like it and not about none. Of those
    that explain something about none the likeliest is taken, beginning with the one
    that explains most. An effect that is no filter is passed over if nothing is left
    for it. Filters of first and second order are both tried, since one leaves little of
    the other.
    """
    every = [(c, g) for c in dictionary.causes for g in c.variants[:1]]
    delays = tuple(m for m in every if lag_of(m).delay)
    fit.settle(delays)
    best, most = fit, (nothing := fit.evidence(delays))
    explains = {
        i: evidence
        for i, member in enumerate(every)
        if member[1].effect is not None
        and member[1].effect.while_moving
        and (evidence := fit.evidence((*delays, member))) > nothing
    }
    remain = sorted(explains, key=lambda i: -explains[i])
    while remain:
        one, *remain = remain
        other, members = fit.apart(), (*delays, every[one])
        other.settle(members)
        own = other.evidence(members)
        if own > most:
            best, most = other, own
        remain = [
            i
            for i in remain
            if lag_of(every[i]) != Lag() or other.evidence((*members, every[i])) > own
        ]
    return best


def _without_idle_lags(fit: MotionFit, found: Inferred) -> tuple[MotionFit, Inferred]:
    """The same without filters and delays that are no better than none.

    About a filter its absence looks worse than it is: what it does goes as the square
    or cube of its time constant.
    """
    for member in [m for m in found.best.members if lag_of(m) != Lag()]:
        members = found.best.members
        if member[0].key not in found.best.keys:
            continue
        others = tuple(m for m in members if m[0].key != member[0].key)
        full, lean = fit.apart(), fit.apart()
        full.settle(members)
        lean.settle(others)
        if lean.evidence(others) >= full.evidence(members):
            fit, found = lean, lean.searched(others)
    return fit, found


def _rows(block: Block, reference: Reference, start: Alignment) -> MotionRows:
    """Rows of about as many a second as a body moves by."""
    step = float(np.median(np.diff(block.t)))
    length = float(np.ptp(block.t))
    per_row = max(int(1 / _rate(reference) / step), -(-len(block) // MOST), 1)
    stretch = max(length / STRETCHES, SHORTEST_S)
    rows = rows_in_motion(block, reference, start, per_row, stretch, MARGIN_S)
    if len(rows) * rows.step < FEWEST_S:
        raise InputError(
            f"both recordings cover {len(rows) * rows.step:.0f} s of the same motion"
            f" without gaps; at least {FEWEST_S:.0f} s in one piece are needed: let"
            " the simulator follow all of the recording"
        )
    return rows


def _rate(reference: Reference) -> float:
    """Rows a second that a motion needs, Hz."""
    t = np.arange(reference.start, reference.end, 0.5 / QUICKEST_HZ)
    six = reference.at(t)[:, reference.observed]
    power = np.abs(np.fft.rfft((six - six.mean(axis=0)) * np.hanning(len(t))[:, None],
                               axis=0)) ** 2  # fmt: skip
    slower = np.cumsum(power, axis=0) / np.maximum(power.sum(axis=0), 1e-300)
    most = int((slower < 1 - MOVES).sum(axis=0).max())
    hz = most * QUICKEST_HZ * 2 / len(t)
    return float(np.clip(OFTEN * hz, SLOWEST_HZ, QUICKEST_HZ))


def _nominal(about: Description, places: int) -> State:
    nominal = about.nominal
    return State(
        np.concatenate([nominal["acc_bias"], nominal["gyr_bias"]]),
        np.concatenate([nominal["acc_scale"], nominal["gyr_scale"]]),
        np.zeros((places, 2)),
        np.zeros(3),
    )


def _flat(rows: MotionRows, nominal: State) -> Array:
    """White noise as large as all that differs, to begin with."""
    off = rows.y - nominal.bias - nominal.scale * rows.motion(rows.acc)
    power = np.nanvar(np.where(rows.used, off, 0.0), axis=0)
    return np.tile(np.maximum(power, 1e-12), (len(rows), 1))
