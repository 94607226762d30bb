"""Touches and gusts of up to two seconds that no single sample shows.

A push is found where its amplitude (`matched_filter`) goes further than noise goes in a
whole recording once in a thousand times. The most unusual one is taken first; what it
covers says nothing more, and the search begins again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.physics.matched_filter import (
    AmplitudeNoise,
    MatchedFilter,
    amplitude_noise,
)

LENGTHS_S = (0.5, 1.0, 2.0)
"""Lengths of the pushes that are looked for, s."""

CHANCE = 1e-3
"""Probability of finding a push in a recording without any."""

TRIADS = (ACC, GYR)


@dataclass(frozen=True, slots=True)
class GentlePush:
    """A push, as its matched filter sees it.

    Attributes
    ----------
    first, last : first and one past the last sample in the window
    channel : index in `samples.CHANNELS` of the output that shows it most
    amplitude : height of the half sine there, in standard deviations of a sample
    log_chance : ln P of (3) in `matched_filter`
    limit : ln P below which it is a push
    matched : the filter
    noise : of the amplitudes at this instant

    """

    first: int
    last: int
    channel: int
    amplitude: float
    log_chance: float
    limit: float
    matched: MatchedFilter
    noise: AmplitudeNoise

    def is_in(self, z: Array) -> bool:
        """Whether outputs (n, 6) have a push of this length, by the same noise."""
        log_chances = self.noise.log_chances(self.matched.amplitudes(z))
        return bool((log_chances < self.limit).any())

    @property
    def deviation(self) -> float:
        """Standard deviations of a normal variable whose density falls as far."""
        return float(np.sqrt(-2 * self.log_chance))


def gentle_pushes(windows: Sequence[Array], rate_hz: float) -> list[list[GentlePush]]:
    """Pushes in each window.

    Parameters
    ----------
    windows : outputs of each, (n, 6), in standard deviations of noise; nan where one
        is missing. Means of `block_length` samples will do
    rate_hz : outputs in a second

    """
    left = [z.copy() for z in windows]
    found: list[list[GentlePush]] = [[] for _ in windows]
    lengths = [n for n in (round(s * rate_hz) for s in LENGTHS_S) if n > 1]
    searches = [_Search(MatchedFilter.for_length(n), left) for n in lengths]
    looks = sum(search.looks for search in searches)
    if not looks:
        return found
    limit = float(np.log(CHANCE / looks))
    going = set(range(len(windows)))
    while going:
        best: dict[int, GentlePush] = {}
        for search in searches:
            for w, push in search.most_unusual(going, limit):
                if w not in best or push.log_chance < best[w].log_chance:
                    best[w] = push
        for w, push in best.items():
            found[w].append(push)
            left[w][push.first : push.last] = np.nan
        going = set(best)
        for search in searches:
            search.renew(left, going)
    return found


def block_length(rate_hz: float) -> int:
    """Samples whose mean shows the shortest push as well as each of them does."""
    return MatchedFilter.for_length(max(round(LENGTHS_S[0] * rate_hz), 2)).block


class _Search:
    """Search for pushes of one length in all windows."""

    def __init__(self, matched: MatchedFilter, windows: Sequence[Array]) -> None:
        self._matched = matched
        self._amplitudes = [matched.amplitudes(z) for z in windows]

    @property
    def looks(self) -> float:
        """Independent amplitudes of both triads."""
        each = len(TRIADS) / self._matched.amplitudes_per_dof
        return each * sum(len(a) for a in self._amplitudes)

    def renew(self, windows: Sequence[Array], changed: set[int]) -> None:
        """Calculate the amplitudes anew in the windows that changed."""
        for w in changed:
            self._amplitudes[w] = self._matched.amplitudes(windows[w])

    def most_unusual(
        self, going: set[int], limit: float
    ) -> Iterator[tuple[int, GentlePush]]:
        """The most unusual push of each window that has one."""
        noise = amplitude_noise(self._amplitudes, self._matched)
        for w in sorted(going):
            log_chances = noise[w].log_chances(self._amplitudes[w])
            if not (log_chances < limit).any():
                continue
            i, triad = divmod(int(np.argmin(log_chances)), len(TRIADS))
            chances = float(log_chances.min()), limit
            yield w, self._push(w, i, triad, chances, noise[w])

    def _push(
        self,
        w: int,
        i: int,
        triad: int,
        chances: tuple[float, float],
        noise: AmplitudeNoise,
    ) -> GentlePush:
        amplitudes = np.nan_to_num(self._amplitudes[w][i])[TRIADS[triad]]
        axis = int(np.argmax(np.abs(amplitudes)))
        first, last = self._matched.stretch(i)
        height = self._matched.sigma * float(amplitudes[axis])
        return GentlePush(
            first,
            last,
            TRIADS[triad].start + axis,
            height,
            *chances,
            self._matched,
            noise.at(i),
        )
