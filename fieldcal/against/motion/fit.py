"""Alignment, noise and causes of one recording in motion, fitted in turn.

The alignment, the lag of the sensors, the spectrum of the noise and the values of the
causes depend on each other, so they are fitted in turn until all of them converge. The
error of the alignment is a column of every fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Self

import numpy as np

from fieldcal.core.rotation import rotation_matrices
from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.motion_dictionary import MotionDictionary
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member, keys_of
from fieldcal.model.rows.coloured_noise import Bands
from fieldcal.model.rows.motion import Alignment, MotionRows
from fieldcal.model.rows.response import Response
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.inference import Inference, InferenceResult
from fieldcal.model.state import State
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.motion_rows import MotionSystem, noise_levels
from fieldcal.physics.lag import Lag

SETTLED = 12
"""Most linearisations of one set."""

NOTHING = 1e-12
"""Weight of coefficients at frequencies that the reference does not explain."""

FINEST = 1e-6
"""Least noise, as a part of the rms of an output."""

STAYS, STEADY = 0.1, 0.1
"""Convergence: largest step of the alignment, in standard deviations, and largest
change of ln power."""


class MotionFit:
    """Alignment, noise and causes of one recording, fitted in turn.

    Parameters
    ----------
    system : rows at the alignment, and the power of their noise
    nominal : the state that a simulation starts from
    bands : of the noise
    hz : (6,) frequency up to which the reference explains each output

    Attributes
    ----------
    levels : ln of the noise's power in each band, by channel
    state, values : at the estimate that was settled last, and (k,) of its columns
    settled_keys : of the causes that were settled last

    """

    def __init__(
        self, system: MotionSystem, nominal: State, bands: Bands, hz: Array
    ) -> None:
        self.system, self.nominal, self.bands, self.hz = system, nominal, bands, hz
        self.levels: dict[int, Array] = {}
        self.state = nominal
        self.values: Array = np.zeros(system.dictionary.width)
        self.settled_keys = frozenset[str]()
        self._finest = FINEST**2 * np.mean(np.nan_to_num(system.motion.y) ** 2, axis=0)

    @property
    def rows(self) -> MotionRows:
        """The rows at the present alignment."""
        return self.system.motion

    def search(self, members: Sequence[Member]) -> InferenceResult:
        """Search for the best set of causes, beginning with some."""
        fit = GaussNewton(self.system, self.nominal)
        found = Inference(fit).run(members or None)
        # a search for effects first has columns of its own
        system = found.fit.system
        if isinstance(system, MotionSystem):
            self.system = system
        return found

    def hold(self, members: Sequence[Member]) -> InferenceResult:
        """The result with some causes, about their own state."""
        return Inference(GaussNewton(self.system, self.nominal)).hold(members)

    def copy(self) -> Self:
        """A copy with columns, rows and noise of its own."""
        dictionary = MotionDictionary(self.rows, np.abs(self.nominal.scale))
        dictionary.realign(self.rows)
        system = MotionSystem(dictionary, self.system.power.copy())
        return type(self)(system, self.nominal, self.bands, self.hz)

    def evidence(self, members: tuple[Member, ...]) -> float:
        """Ln evidence of causes after `settle`, including that of the noise.

        `members` need not be those that were settled: the effects of filters are
        linear about these.
        """
        fit = GaussNewton(self.system, self.nominal)
        members = fit.dictionary.match_members(members)
        *_, found = fit.settle(self.state, self.values, members)
        frequency, power = self.rows.frequency, self.system.power
        told = [np.log(power[frequency <= self.hz[c], c]).sum() for c in self.levels]
        return found.score - 0.5 * float(sum(told))

    def settle(self, members: tuple[Member, ...]) -> None:
        """Fit some causes, the alignment and the noise in turn until convergence."""
        fit = GaussNewton(self.system, self.nominal)
        members = fit.dictionary.match_members(members)
        state, sizes = self.nominal, None
        values: Array = np.zeros(fit.dictionary.width)
        for _ in range(SETTLED):
            rows, power, before = self.rows, self.system.power.copy(), values
            found, linear = fit.estimate(state, values, members, sizes)
            self._weigh(linear, values, found)
            (state, values), sizes = fit.state_at_estimate(found), found.sizes
            self._align(found, state)
            change = np.abs(np.log(self.system.power / power)).max()
            step = max(self._step(found, rows), fit.largest_step(found, before, values))
            if step < STAYS and change < STEADY:
                break
        self.state, self.values = state, values
        self.settled_keys = keys_of(members)

    def _weigh(self, linear: Sequence[LinearRows], values: Array, found: Set) -> None:
        """Set the noise of the rows to that of a fit's residuals."""
        frequency = self.rows.frequency
        self.levels = noise_levels(self.bands, frequency, linear, values, found.state)
        for c, level in self.levels.items():
            self.system.power[:, c] = self.power(c, level, frequency)

    def power(self, c: int, level: Array, frequency: Array) -> Array:
        """Power of the noise of one channel's coefficients, (n,).

        Above the frequency that the reference explains, coefficients have no weight.
        """
        power: Array = np.maximum(self.bands.power(level, frequency), self._finest[c])
        power[frequency > self.hz[c]] /= NOTHING
        return power

    def _align(self, found: Set, there: State) -> None:
        """Move the rows to the alignment of a fit, and to the lags of its state."""
        free = any(lag_of(m).delay for m in found.members)
        acc, gyr = self._responses(there, free)
        alignment = self._alignment(found)
        # the lag of the accelerometers counts as delay of the clock
        shared, alike = acc.late, gyr is acc
        alignment = replace(alignment, delay=alignment.delay + shared)
        acc = replace(acc, late=0.0)
        gyr = acc if alike else replace(gyr, late=gyr.late - shared)
        now = replace(
            self.rows, alignment=alignment, acc=acc, gyr=gyr, share=there.lag.stamps
        )
        self.system.dictionary.realign(now)

    def _alignment(self, found: Set) -> Alignment:
        """The present alignment, corrected by a fit."""
        d, now = self.system.dictionary, self.rows.alignment
        (delay, drift), _ = fixed_column_estimates(found, d.clock, 2)
        turn, _ = fixed_column_estimates(found, d.turn, 3)
        return replace(
            now,
            delay=now.delay + float(delay),
            drift=now.drift + float(drift),
            rotation=rotation_matrices(turn) @ now.rotation,
            unseen_gravity=now.unseen_gravity + self._unseen(found),
        )

    def _step(self, found: Set, before: MotionRows) -> float:
        """Largest step of the rows by a fit, in its sigmas.

        Changes of time constants are in units of the least one that shows.
        """
        d, now = self.system.dictionary, self.rows
        steps = [
            fixed_column_estimates(found, d.clock, 2),
            fixed_column_estimates(found, d.turn, 3),
        ]
        moved = [np.abs(step / np.sqrt(np.diag(cov))).max() for step, cov in steps]
        followed = [now.acc.distance_to(before.acc), now.gyr.distance_to(before.gyr)]
        return float(max(*moved, *followed, abs(now.share - before.share)))

    def _responses(self, there: State, free: bool) -> tuple[Response, Response]:
        """Responses of both triads to the motion; the same object if they are equal."""
        lag, rows = there.lag, self.rows
        acc, gyr = (lag.acc, lag.acc_second), (lag.gyr, lag.gyr_second)
        if not lag.delay and acc == gyr:
            both = rows.acc.step_towards(rows.reference, 0.0, *acc, free)
            return both, both
        return (
            rows.acc.step_towards(rows.reference, 0.0, *acc, free, range(3)),
            rows.gyr.step_towards(rows.reference, lag.delay, *gyr, free, range(3, 6)),
        )

    def _unseen(self, found: Set) -> Array:
        """Correction of gravity along an axis that the reference lacks, (6,)."""
        d = self.system.dictionary
        out: Array = np.zeros(6)
        if len(d.missing_channels):
            out[d.missing_channels], _ = fixed_column_estimates(
                found, d.unseen, len(d.missing_channels)
            )
        out[self.rows.alignment.unseen_gravity == 0] = 0.0
        return out


def lag_of(member: Member) -> Lag:
    """Lag of the sensors by a cause, with each parameter equal to 1."""
    _, group = member
    if group.effect is None:
        return Lag()
    return group.effect.lag(np.ones(len(group.effect.params)))


def fixed_column_estimates(found: Set, first: int, count: int) -> tuple[Array, Array]:
    """Values (k,) and covariance (k, k) of `count` columns that every set has."""
    state = found.state
    at = [int(np.flatnonzero(state.columns == c)[0])
          for c in range(first, first + count)]  # fmt: skip
    return state.estimate[at], state.inverse[np.ix_(at, at)]


def column_estimates(state: Eliminated, columns: Index) -> tuple[Array, Array, Array]:
    """Values, covariance and prior standard deviations of some columns."""
    at = np.array([int(np.flatnonzero(state.columns == c)[-1]) for c in columns])
    return state.estimate[at], state.inverse[np.ix_(at, at)], state.prior_sigma[at]
