"""A recording fitted to the motion that a reference says, by the one model.

Alignment, noise spectrum and causes hang on each other: with the alignment of
correlation bias, scale factor and alignment are fitted until they stay, then causes are
searched, and both again with what was found. What the alignment is off by is a column
of every fit, so its uncertainty is in all numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.against.motion.alignment import CommonMotion
from fieldcal.core.errors import InputError
from fieldcal.core.rotation import exponential
from fieldcal.core.samples import Array, Block, Index
from fieldcal.model.causes.followed import MotionDictionary
from fieldcal.model.evidence.gram import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.probabilities import Posterior
from fieldcal.model.rows.coloured import Bands
from fieldcal.model.rows.motion import Alignment, MotionRows, rows_in_motion
from fieldcal.model.rows.reference import LEAST, Reference, Response
from fieldcal.model.search.inference import Inference, Inferred
from fieldcal.model.state import State
from fieldcal.model.system.linear_rows import Linear
from fieldcal.model.system.motion_rows import MotionSystem, noise_levels
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

SETTLED, AGAIN = 12, 3
"""Linearisations of one set at most, and searches."""

NOTHING = 1e-12
"""Weight of coefficients of which the reference says nothing."""

FINEST = 1e-6
"""Part of what an output is that nothing is known better than."""

STAYS, STEADY = 0.1, 0.1
"""Largest step of the alignment, in standard deviations, that counts as none, and
largest change of ln power."""


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
    fit = MotionFit(system, nominal, Bands.between(rows.frequency), start.hz)
    fit.settle(_delays(dictionary))
    found = fit.searched(())
    for _ in range(AGAIN if found.best.members else 0):
        before, members = found.best.keys, found.best.members
        fit.settle(members)
        found = fit.searched(members)
        if found.best.keys == before:
            break
    return Following(fit, found, Posterior(found.search, found.best))


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


def _delays(dictionary: MotionDictionary) -> tuple[Member, ...]:
    """Causes that make the gyroscopes late; once they are looked up, all is linear."""
    return tuple(
        (cause, group)
        for cause in dictionary.causes
        for group in cause.variants[:1]
        if group.effect is not None
        and group.effect.lag(np.ones(len(group.params))).delay
    )


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


class MotionFit:
    """Alignment, noise and causes of one recording, fitted in turn.

    Parameters
    ----------
    system : rows at the alignment, and the power of their noise
    nominal : the state that a simulation starts from
    bands : of the noise
    hz : (6,) frequency up to which the reference is one

    Attributes
    ----------
    levels : ln of the noise's power in each band, by channel

    """

    def __init__(
        self, system: MotionSystem, nominal: State, bands: Bands, hz: Array
    ) -> None:
        self.system, self.nominal, self.bands, self.hz = system, nominal, bands, hz
        self.levels: dict[int, Array] = {}
        self._finest = FINEST**2 * np.mean(np.nan_to_num(system.motion.y) ** 2, axis=0)

    @property
    def rows(self) -> MotionRows:
        """The rows at the alignment as it is."""
        return self.system.motion

    def searched(self, members: Sequence[Member]) -> Inferred:
        """The best set of causes, beginning with some."""
        found = Inference(self.system, self.nominal).run(members or None)
        # a search for effects first has columns of its own
        system = found.inference.system
        if isinstance(system, MotionSystem):
            self.system = system
        return found

    def settle(self, members: tuple[Member, ...]) -> None:
        """Fit some causes, the alignment and the noise in turn until all stay."""
        for _ in range(SETTLED):
            fit = Inference(self.system, self.nominal)
            none: Array = np.zeros(fit.dictionary.width)
            state, values, found = fit.settled(self.nominal, none, members)
            wanted = fit.wanted(members) | (values != 0)
            linear = self.system.linearised(state, wanted)
            rows, power = self.rows, self.system.power.copy()
            self._weigh(linear, values, found)
            self._align(found, state)
            change = np.abs(np.log(self.system.power / power)).max()
            if self._step(found, rows) < STAYS and change < STEADY:
                break

    def _weigh(self, linear: Sequence[Linear], values: Array, found: Set) -> None:
        """Give the rows the noise that a fit leaves."""
        frequency = self.rows.frequency
        self.levels = noise_levels(self.bands, frequency, linear, values, found.state)
        for c, level in self.levels.items():
            self.system.power[:, c] = self.power(c, level, frequency)

    def power(self, c: int, level: Array, frequency: Array) -> Array:
        """Power of the noise of one channel's coefficients, (n,).

        What is quicker than the reference tells has none to speak of left to say.
        """
        power: Array = np.maximum(self.bands.power(level, frequency), self._finest[c])
        power[frequency > self.hz[c]] /= NOTHING
        return power

    def _align(self, found: Set, there: State) -> None:
        """Move the rows to the alignment of a fit, and to how its state lags."""
        acc, gyr = self._responses(there)
        alignment = self._alignment(found)
        now = replace(self.rows, alignment=alignment, acc=acc, gyr=gyr)
        self.system.dictionary.moved(now)

    def _alignment(self, found: Set) -> Alignment:
        """The alignment that a fit has."""
        d, now = self.system.dictionary, self.rows.alignment
        (delay, drift), _ = told(found, d.clock, 2)
        turn, _ = told(found, d.turn, 3)
        return replace(
            now,
            delay=now.delay + float(delay),
            drift=now.drift + float(drift),
            rotation=exponential(turn) @ now.rotation,
            unseen=now.unseen + self._unseen(found),
        )

    def _step(self, found: Set, before: MotionRows) -> float:
        """How far a fit has moved the rows, in its sigmas.

        Time constants count in parts of the least that shows.
        """
        d, now = self.system.dictionary, self.rows
        steps = [told(found, d.clock, 2), told(found, d.turn, 3)]
        moved = [np.abs(step / np.sqrt(np.diag(cov))).max() for step, cov in steps]
        both = ((now.acc, before.acc), (now.gyr, before.gyr))
        followed = [abs(one.tau - other.tau) / LEAST for one, other in both]
        return float(max(moved + followed))

    def _responses(self, there: State) -> tuple[Response, Response]:
        """How a state has the triads follow the motion; one and the same if alike."""
        lag = there.lag
        first = self.rows.acc.towards(self.rows.reference, 0.0, lag.acc)
        if not lag.delay and lag.acc == lag.gyr:
            return first, first
        return first, self.rows.gyr.towards(self.rows.reference, lag.delay, lag.gyr)

    def _unseen(self, found: Set) -> Array:
        """What a fit adds to gravity along an axis that the reference lacks."""
        d = self.system.dictionary
        out: Array = np.zeros(6)
        if len(d.lost):
            out[d.lost], _ = told(found, d.unseen, len(d.lost))
        out[self.rows.alignment.unseen == 0] = 0.0
        return out


def told(found: Set, first: int, count: int) -> tuple[Array, Array]:
    """Values (k,) and covariance (k, k) of columns that are always there."""
    state = found.state
    at = [int(np.flatnonzero(state.columns == c)[0])
          for c in range(first, first + count)]  # fmt: skip
    return state.estimate[at], state.inverse[np.ix_(at, at)]


def estimates(state: Eliminated, columns: Index) -> tuple[Array, Array, Array]:
    """Values, covariance and sizes before the rows, of some columns."""
    at = np.array([int(np.flatnonzero(state.columns == c)[-1]) for c in columns])
    return state.estimate[at], state.inverse[np.ix_(at, at)], state.sizes[at]
