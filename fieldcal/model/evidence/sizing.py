"""The most probable sizes of one set, each found with the others fixed.

Once a set is eliminated with sizes v_0, its covariance gives the evidence at any other
size of one group: with C = U diag(c) U^T the posterior covariance of the group in units
of its prior covariance, lambda = (1 / c - 1) / v_0^2 and q = U^T u / (c v_0) are those
of (2) of `eliminated`. The same holds for an instability of the means of windows, (1).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors, tolerances
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.eliminated import Eliminated, gains_from_eigenvalues
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.tridiagonal import tridiagonal_gains

LOG_DENSITY = priors.log_density()
INSTABILITY_LOG_DENSITY = np.log(priors.density(priors.INSTABILITY_TAIL))
"""Log prior of the sizes of instabilities."""

UNIT_INDEX = int(np.argmin(np.abs(np.log(priors.SIZES))))
"""Index of v = 1."""

LOG_SIZE_STEP = float(np.log(priors.SIZES[1] / priors.SIZES[0]))
"""Step of ln v between neighbouring sizes."""


TRIADS = ((0, 1, 2), (3, 4, 5), (6,))
"""Instabilities with similar sizes: those of a triad's axes, and that of closures."""

Member = tuple[Cause, Group]


def keys_of(members: Iterable[Member]) -> frozenset[str]:
    """Keys of the causes of some members."""
    return frozenset(cause.key for cause, _ in members)


@dataclass(frozen=True, slots=True)
class Sizes:
    """Indices in `priors.SIZES`.

    `calibration` of the groups that are always present, `instability` of the six
    channels and of closures, `members` of the causes of a set, in their order.
    """

    calibration: tuple[int, ...]
    instability: tuple[int, ...]
    members: tuple[int, ...] = ()


def instability_log_prior(
    instability: Sequence[int] | Array,
    typical_instability: Array,
    density: Array = INSTABILITY_LOG_DENSITY,
) -> Any:
    """Log prior of instabilities (..., 7): those of a triad's axes are similar.

    Parameters
    ----------
    instability : indices in `priors.SIZES`
    typical_instability : (7,), 0 where there is none
    density : log prior of each of `priors.SIZES`

    """
    sizes = np.asarray(instability, dtype=float)
    total = np.zeros(sizes.shape[:-1])
    for triad in TRIADS:
        if on := [c for c in triad if typical_instability[c] > 0]:
            total = total + triad_log_prior(sizes[..., on], density)
    return total if total.ndim else float(total)


def triad_log_prior(sizes: Array, density: Array = INSTABILITY_LOG_DENSITY) -> Array:
    """Log prior of the instabilities (..., n) of the axes of one triad, (...)."""
    middle = sizes.sum(axis=-1) / sizes.shape[-1]
    distance = (sizes - middle[..., None]) * (LOG_SIZE_STEP / priors.AXES_LOG_SPREAD)
    likely = np.interp(middle, np.arange(len(density)), density)
    out: Array = likely - 0.5 * (distance * distance).sum(axis=-1)
    return out


def gain_terms(state: Eliminated, at: Index, v: float | Array) -> tuple[Array, Array]:
    """Eigenvalues lambda and q^2 of (3) for groups in a set, (..., k) each.

    `at` (..., k) are their indices in the state, `v` their sizes in it.
    """
    prior_sigma, size = state.prior_sigma[at], np.asarray(v)[..., None]
    cov = state.inverse[at[..., :, None], at[..., None, :]]
    part, axes = np.linalg.eigh(
        cov / prior_sigma[..., :, None] / prior_sigma[..., None, :]
    )
    part = np.clip(part, tolerances.ROUNDING, 1.0)
    along = (np.swapaxes(axes, -1, -2) @ (state.estimate[at] / prior_sigma)[..., None])[
        ..., 0
    ]
    return (1 / part - 1) / size**2, (along / (part * size)) ** 2


class Sizing:
    """Finds the most probable sizes of one set.

    Parameters
    ----------
    dictionary, gram : columns, and their Gram matrix
    typical_instability : (7,) typical instability, 0 where there is none
    members : of the set
    start : sizes to begin with

    Attributes
    ----------
    columns : (a,) columns of all groups, of the dictionary

    """

    def __init__(
        self,
        dictionary: Dictionary,
        gram: Gram,
        typical_instability: Array,
        members: tuple[Member, ...],
        start: Sizes | None,
    ) -> None:
        self.groups: list[Group] = [*dictionary.always, *(g for _, g in members)]
        self.count = len(dictionary.always)
        self.typical_instability = typical_instability
        # what anything else explains is no noise
        small = tuple(0 if g.random else UNIT_INDEX for g in dictionary.always)
        begin = start or Sizes(small, (UNIT_INDEX,) * 7, (UNIT_INDEX,) * len(members))
        self.sizes = [*begin.calibration, *begin.members]
        self.instability = list(begin.instability)
        none = np.empty(0, dtype=np.intp)
        self.columns = np.concatenate([none, *(g.columns for g in self.groups)])
        widths = np.cumsum([0, *(len(g.columns) for g in self.groups)]).tolist()
        self.places = [slice(a, b) for a, b in pairwise(widths)]
        self.gram = gram.select_columns(self.columns)
        self._states: dict[tuple[int, ...], Eliminated] = {}
        self._gains_by_channel: dict[tuple[int, ...], Array] = {}

    def run(self) -> tuple[Sizes, float]:
        """Iterate until no size changes; the sizes, and ln Z summed over them."""
        free = [i for i, g in enumerate(self.groups) if g.fixed_size is None]
        free.sort(key=lambda i: self.groups[i].random)
        channels = np.flatnonzero(self.typical_instability > 0).tolist()
        profiles: list[Array] = []
        for _ in range(tolerances.MAX_SIZE_ROUNDS):
            before = (*self.sizes, *self.instability)
            profiles = self._maximise_groups(free)
            for triad in TRIADS:
                if free_channels := [c for c in triad if c in channels]:
                    profiles += self._maximise_triad(free_channels)
            if (*self.sizes, *self.instability) == before:
                break
        score = self.eliminated().score
        score += sum(self.groups[i].log_density[self.sizes[i]] for i in free)
        score += instability_log_prior(self.instability, self.typical_instability)
        for profile in profiles:
            score += float(np.logaddexp.reduce(profile - profile.max()))
        k = self.count
        sizes = Sizes(
            tuple(self.sizes[:k]), tuple(self.instability), tuple(self.sizes[k:])
        )
        return sizes, score

    def eliminated(self) -> Eliminated:
        """The set eliminated at the current sizes; cached."""
        key = (*self.sizes, *self.instability)
        if key not in self._states:
            tau = priors.SIZES[self.instability] * self.typical_instability
            rows = self.gram.with_instability(tau)
            self._states[key] = Eliminated.of(rows, self.columns, self._prior_sigma())
        return self._states[key]

    def _prior_sigma(self) -> Array:
        parts = []
        for group, size in zip(self.groups, self.sizes, strict=True):
            parts.append(group.own_sigma(float(priors.SIZES[size])))
        return np.concatenate([np.empty(0), *parts])

    def _maximise_groups(self, free: Sequence[int]) -> list[Array]:
        """F over the sizes of each of some groups; each size is set to the maximum.

        Each is sought with the others at their current sizes. Gains calculated for all
        groups at once are used until a size changes.
        """
        start, profiles = self.eliminated(), []
        gains = self._gains(start, free)
        for i in free:
            state = self.eliminated()
            gain = gains[i] if state is start else self._gains(state, [i])[i]
            change = gain - gain[self.sizes[i]]
            profile: Array = state.score + change + self.groups[i].log_density
            self.sizes[i] = int(np.argmax(profile))
            profiles.append(profile)
        return profiles

    def _gains(self, state: Eliminated, numbers: Sequence[int]) -> dict[int, Array]:
        """Gain over the sizes of each of some groups, calculated by width."""
        by_width: dict[int, list[int]] = {}
        for i in numbers:
            place = self.places[i]
            by_width.setdefault(place.stop - place.start, []).append(i)
        out: dict[int, Array] = {}
        for width, alike in by_width.items():
            first = np.array([self.places[i].start for i in alike])
            at = first[:, None] + np.arange(width)
            v = priors.SIZES[[self.sizes[i] for i in alike]]
            gains = gains_from_eigenvalues(*gain_terms(state, at, v))
            out |= dict(zip(alike, gains, strict=True))
        return out

    def _maximise_triad(self, channels: Sequence[int]) -> list[Array]:
        """F over the instabilities of some channels of a triad; sets them.

        They are set together, since their prior keeps a single one near the others. If
        this lowers F, they are set one by one: in positions of unknown orientation
        several instabilities may explain the same scatter, so each alone could be
        small, but not all of them.
        """
        before, state = list(self.instability), self.eliminated()
        profiles = self._maximise_jointly(channels)
        if self.instability == before or self._score_of_instability() >= (
            state.score
            + float(instability_log_prior(before, self.typical_instability))
            - tolerances.ACCUMULATED_ROUNDING
        ):
            return profiles
        self.instability = before
        return [self._maximise_channel(c, channels) for c in channels]

    def _score_of_instability(self) -> float:
        """F at the current sizes, without the priors of the groups' sizes."""
        return self.eliminated().score + float(
            instability_log_prior(self.instability, self.typical_instability)
        )

    def _maximise_channel(self, c: int, channels: Sequence[int]) -> Array:
        """F over the instabilities of one channel; sets it to the maximum."""
        (gain,) = self._channel_gains([c])
        profile = self._profile_with_prior(c, channels, gain)
        self.instability[c] = int(np.argmax(profile))
        return profile

    def _maximise_jointly(self, channels: Sequence[int]) -> list[Array]:
        """F over the instabilities of each channel; sets all to the joint maximum."""
        separate = self._channel_gains(channels)
        index = np.arange(len(LOG_DENSITY))
        distance = (
            np.subtract.outer(index, index) * LOG_SIZE_STEP / priors.AXES_LOG_SPREAD
        )
        by_middle = [gain - 0.5 * distance**2 for gain in separate]  # (middle, size)
        total = sum(b.max(axis=1) for b in by_middle) + INSTABILITY_LOG_DENSITY
        middle = int(np.argmax(total))
        for c, of_channel in zip(channels, by_middle, strict=True):
            self.instability[c] = int(np.argmax(of_channel[middle]))
        return [
            self._profile_with_prior(c, channels, gain)
            for c, gain in zip(channels, separate, strict=True)
        ]

    def _profile_with_prior(
        self, c: int, channels: Sequence[int], gain: Array
    ) -> Array:
        """F over the instabilities of channel c, except for a constant.

        `gain` is its gain. The others among `channels`, which are similar, are fixed.
        """
        sizes = np.tile([float(self.instability[i]) for i in channels], (len(gain), 1))
        sizes[:, channels.index(c)] = np.arange(len(gain))
        return gain + triad_log_prior(sizes)

    def _channel_gains(self, channels: Sequence[int]) -> Array:
        """Gain over the instabilities of each of some channels, (c, sizes); cached.

        The others are fixed. A gain is that over the present instability tau of the
        channel. With S and r of `schur_complement_of_means` there, another instability
        v adds v^2 - tau^2 to the variance of each mean,

            gain = [ d r^T (I + d S)^-1 r - ln |I + d S| ] / 2,  d = v^2 - tau^2    (1)
        """
        key = (*channels, *self.sizes, *self.instability)
        if key not in self._gains_by_channel:
            state = self.eliminated()
            each = [state.schur_complement_of_means(c) for c in channels]
            width = max(len(rhs) for _, rhs in each)
            inner, rhs = (
                np.zeros((len(each), width, width)),
                np.zeros((len(each), width)),
            )
            for i, (own, right) in enumerate(each):
                inner[i, : len(right), : len(right)], rhs[i, : len(right)] = own, right
            typical = self.typical_instability[list(channels)][:, None] ** 2
            present = priors.SIZES[[self.instability[c] for c in channels]][:, None]
            more = typical * (priors.SIZES**2 - present**2)
            gains = tridiagonal_gains(inner, rhs, more, tolerances.ROUNDING)
            self._gains_by_channel[key] = gains
        return self._gains_by_channel[key]
