"""Alignment, noise and causes of one recording in motion, fitted in turn.

Where the two stand beside each other, how the sensors follow, the noise's spectrum and
the values of the causes hang on each other. A set of causes is therefore fitted until
all of them stay. What the alignment is off by is a column of every fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Self

import numpy as np

from fieldcal.core.rotation import exponential
from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.followed import MotionDictionary
from fieldcal.model.evidence.gram import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.rows.coloured import Bands
from fieldcal.model.rows.motion import Alignment, MotionRows
from fieldcal.model.rows.response import Response
from fieldcal.model.search.inference import Inference, Inferred
from fieldcal.model.state import State
from fieldcal.model.system.linear_rows import Linear
from fieldcal.model.system.motion_rows import MotionSystem, noise_levels
from fieldcal.physics.lag import Lag

SETTLED = 12
"""Linearisations of one set at most."""

NOTHING = 1e-12
"""Weight of coefficients of which the reference says nothing."""

FINEST = 1e-6
"""Part of what an output is that nothing is known better than."""

STAYS, STEADY = 0.1, 0.1
"""Largest step of the alignment, in standard deviations, that counts as none, and
largest change of ln power."""


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

    def apart(self) -> Self:
        """The same with columns, rows and noise of its own, as they are now."""
        dictionary = MotionDictionary(self.rows, np.abs(self.nominal.scale))
        dictionary.moved(self.rows)
        system = MotionSystem(dictionary, self.system.power.copy())
        return type(self)(system, self.nominal, self.bands, self.hz)

    def evidence(self, members: tuple[Member, ...]) -> float:
        """Ln evidence of causes about which all has settled, the noise's counted."""
        fit = Inference(self.system, self.nominal)
        members = fit.dictionary.like(members)
        *_, found = fit.settled(self.nominal, np.zeros(fit.dictionary.width), members)
        frequency, power = self.rows.frequency, self.system.power
        told = [np.log(power[frequency <= self.hz[c], c]).sum() for c in self.levels]
        return found.score - 0.5 * float(sum(told))

    def settle(self, members: tuple[Member, ...]) -> None:
        """Fit some causes, the alignment and the noise in turn until all stay."""
        for _ in range(SETTLED):
            fit = Inference(self.system, self.nominal)
            members = fit.dictionary.like(members)
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
        free = any(lag_of(m).delay for m in found.members)
        acc, gyr = self._responses(there, free)
        alignment = self._alignment(found)
        # what the accelerometers are late by is the clocks' delay
        shared, alike = acc.late, gyr is acc
        alignment = replace(alignment, delay=alignment.delay + shared)
        acc = replace(acc, late=0.0)
        gyr = acc if alike else replace(gyr, late=gyr.late - shared)
        now = replace(
            self.rows, alignment=alignment, acc=acc, gyr=gyr, share=there.lag.stamps
        )
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
        followed = [now.acc.apart(before.acc), now.gyr.apart(before.gyr)]
        return float(max(*moved, *followed, abs(now.share - before.share)))

    def _responses(self, there: State, free: bool) -> tuple[Response, Response]:
        """How a state has the triads follow the motion; one and the same if alike."""
        lag, rows = there.lag, self.rows
        acc, gyr = (lag.acc, lag.acc_second), (lag.gyr, lag.gyr_second)
        first = rows.acc.towards(rows.reference, 0.0, *acc, free)
        if not lag.delay and acc == gyr:
            return first, first
        return first, rows.gyr.towards(rows.reference, lag.delay, *gyr, free)

    def _unseen(self, found: Set) -> Array:
        """What a fit adds to gravity along an axis that the reference lacks."""
        d = self.system.dictionary
        out: Array = np.zeros(6)
        if len(d.lost):
            out[d.lost], _ = told(found, d.unseen, len(d.lost))
        out[self.rows.alignment.unseen == 0] = 0.0
        return out


def lag_of(member: Member) -> Lag:
    """By how much a cause would make the sensors lag, for one of each parameter."""
    _, group = member
    if group.effect is None:
        return Lag()
    return group.effect.lag(np.ones(len(group.effect.params)))


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
