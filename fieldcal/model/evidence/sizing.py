"""The likeliest sizes of one set, each sought beside the others.

Once a set is eliminated with sizes v_0, its covariance says what the evidence would be
at any other size of one group: with C = U diag(c) U^T the covariance of the group in
units of what it was before, lambda = (1 / c - 1) / v_0^2 and q = U^T u / (c v_0) are
those of (3) of `gram`. What the means of windows share likewise: with S = U diag(s)
U^T the information on them with tau in it, s / (1 - tau^2 s) is that without.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.gram import Eliminated, Gram, gained

DENSITY = np.log(priors.density())
UNSTEADY = np.log(priors.density(priors.STEEP))
"""The same of instabilities."""

EVEN = int(np.argmin(np.abs(np.log(priors.SIZES))))
"""Index of v = 1."""

STEP = float(np.log(priors.SIZES[1] / priors.SIZES[0]))
"""From one size to the next, ln."""

FINER = 129
"""Sizes that are tried between one size's neighbours, once it is to be told."""

PRIOR_INFO = 0.1
"""Information on ln v that there is at least."""

ROUNDS = 5
"""Times that every size is sought beside the others."""

LEAST = 1e-14
"""Part of its variance before the rows that rounding leaves of a column."""

TRIADS = ((0, 1, 2), (3, 4, 5), (6,))
"""Kinds of instability that are alike: those of a triad's axes; the turns' closures."""

Member = tuple[Cause, Group]


@dataclass(frozen=True, slots=True)
class Sizes:
    """Indices in `priors.SIZES`.

    `calibration` of the always-there groups, `instability` of the channels and the
    turns, and `members` of the causes, in their order.
    """

    calibration: tuple[int, ...]
    instability: tuple[int, ...]
    members: tuple[int, ...] = ()


def alike(
    instability: Sequence[int] | Array, unstable: Array, density: Array = UNSTEADY
) -> Any:
    """Log prior of instabilities (..., 7): those of a triad's axes are alike.

    `unstable` (7,) is their typical size, 0 where there is none; `density` is ln of how
    likely each of `priors.SIZES` is.
    """
    sizes = np.asarray(instability, dtype=float)
    total = np.zeros(sizes.shape[:-1])
    for triad in TRIADS:
        if on := [c for c in triad if unstable[c] > 0]:
            total = total + alike_in(sizes[..., on], density)
    return total if total.ndim else float(total)


def alike_in(some: Array, density: Array = UNSTEADY) -> Array:
    """How likely instabilities (..., n) of a triad are, ln, (...)."""
    middle = some.sum(axis=-1) / some.shape[-1]
    apart = (some - middle[..., None]) * (STEP / priors.UNLIKE)
    likely = np.interp(middle, np.arange(len(density)), density)
    out: Array = likely - 0.5 * (apart * apart).sum(axis=-1)
    return out


def told_of(state: Eliminated, at: Index, v: float | Array) -> tuple[Array, Array]:
    """What (3) needs of groups alike in width, columns (..., k) of a set, of size v."""
    wide, size = state.sizes[at], np.asarray(v)[..., None]
    cov = state.inverse[at[..., :, None], at[..., None, :]]
    part, axes = np.linalg.eigh(cov / wide[..., :, None] / wide[..., None, :])
    part = np.clip(part, LEAST, 1.0)
    along = (np.swapaxes(axes, -1, -2) @ (state.estimate[at] / wide)[..., None])[..., 0]
    return (1 / part - 1) / size**2, (along / (part * size)) ** 2


def likeliest(state: Eliminated, at: Index, v: float) -> tuple[float, float]:
    """The likeliest size of a group between those tried, and what ln v is uncertain by.

    The information on ln v is that of the shares lambda v^2 / (1 + lambda v^2).
    """
    strength, power = told_of(state, at, v)
    near = v * np.exp(np.linspace(-STEP, STEP, FINER))
    before = np.interp(np.log(near), np.log(priors.SIZES), DENSITY)
    best = float(near[np.argmax(gained(strength, power, near) + before)])
    share = best**2 * strength / (1 + best**2 * strength)
    return best, float(np.maximum(2 * (share**2).sum(), PRIOR_INFO) ** -0.5)


def likeliest_of_axis(
    state: Eliminated, at: Index, v: float, triad: tuple[float, float]
) -> tuple[float, float]:
    """The same of one axis of a group, whose size is v in a set.

    The axes are alike within `UNLIKE`; `triad` is what was found of all of them.
    """
    strength, power = told_of(state, at, v)
    middle, part = triad
    apart = np.linspace(-4.0, 4.0, FINER)
    near = middle * np.exp(priors.UNLIKE * apart)
    top = int(np.argmax(gained(strength, power, near) - 0.5 * apart**2))
    best = float(near[top])
    share = best**2 * strength / (1 + best**2 * strength)
    alike = priors.UNLIKE**-2
    info = alike + 2 * float((share**2).sum())
    return best, float(np.hypot(info**-0.5, alike / info * part))


ROUNDED = 1e-6
"""Part of F that rounding makes, ln."""


class Sizing:
    """The sizes of one set.

    Parameters
    ----------
    dictionary, gram : what the rows say
    unstable : (7,) typical instability, 0 where there is none
    members : of the set
    start : sizes to begin with

    Attributes
    ----------
    every : (a,) columns of all groups, of the dictionary

    """

    def __init__(
        self,
        dictionary: Dictionary,
        gram: Gram,
        unstable: Array,
        members: tuple[Member, ...],
        start: Sizes | None,
    ) -> None:
        self.groups: list[Group] = [*dictionary.always, *(g for _, g in members)]
        self.count, self.unstable = len(dictionary.always), unstable
        begin = start or Sizes(
            (EVEN,) * self.count, (EVEN,) * 7, (EVEN,) * len(members)
        )
        self.sizes = [*begin.calibration, *begin.members]
        self.instability = list(begin.instability)
        none = np.empty(0, dtype=np.intp)
        self.every = np.concatenate([none, *(g.columns for g in self.groups)])
        widths = np.cumsum([0, *(len(g.columns) for g in self.groups)]).tolist()
        self.places = [slice(a, b) for a, b in pairwise(widths)]
        self.gram = gram.only(self.every)
        self._states: dict[tuple[int, ...], Eliminated] = {}
        self._gained: dict[tuple[int, ...], Array] = {}

    def run(self) -> tuple[Sizes, float, Array]:
        """Seek sizes until they stay: sizes, ln Z summed over them, all columns'."""
        free = [i for i, g in enumerate(self.groups) if g.fixed is None]
        channels = np.flatnonzero(self.unstable > 0).tolist()
        profiles: list[Array] = []
        for _ in range(ROUNDS):
            before = (*self.sizes, *self.instability)
            profiles = self._groups(free)
            for triad in TRIADS:
                if some := [c for c in triad if c in channels]:
                    profiles += self._triad(some)
            if (*self.sizes, *self.instability) == before:
                break
        score = self.eliminated().score
        score += sum(DENSITY[self.sizes[i]] for i in free)
        score += alike(self.instability, self.unstable)
        for profile in profiles:
            score += float(np.logaddexp.reduce(profile - profile.max()))
        k = self.count
        found = Sizes(
            tuple(self.sizes[:k]), tuple(self.instability), tuple(self.sizes[k:])
        )
        return found, score, self._wide()

    def eliminated(self) -> Eliminated:
        """The set at the sizes as they are."""
        key = (*self.sizes, *self.instability)
        if key not in self._states:
            tau = priors.SIZES[self.instability] * self.unstable
            rows = self.gram.weighed(tau)
            self._states[key] = Eliminated.of(rows, self.every, self._wide())
        return self._states[key]

    def _wide(self) -> Array:
        parts = []
        for group, size in zip(self.groups, self.sizes, strict=True):
            free = float(priors.SIZES[size])
            parts.append(group.sizes(free if group.fixed is None else group.fixed))
        return np.concatenate([np.empty(0), *parts])

    def _groups(self, free: Sequence[int]) -> list[Array]:
        """F over the sizes of each of some groups, and their sizes at the top.

        Each is sought beside the others as they are then; until one of them changes,
        what is told of all at once holds.
        """
        start, profiles = self.eliminated(), []
        gains = self._gains(start, free)
        for i in free:
            state = self.eliminated()
            gain = gains[i] if state is start else self._gains(state, [i])[i]
            profile: Array = state.score + gain - gain[self.sizes[i]] + DENSITY
            self.sizes[i] = int(np.argmax(profile))
            profiles.append(profile)
        return profiles

    def _gains(self, state: Eliminated, some: Sequence[int]) -> dict[int, Array]:
        """Gain over the sizes of each of some groups, those of one width at once."""
        by_width: dict[int, list[int]] = {}
        for i in some:
            place = self.places[i]
            by_width.setdefault(place.stop - place.start, []).append(i)
        out: dict[int, Array] = {}
        for width, alike in by_width.items():
            first = np.array([self.places[i].start for i in alike])
            at = first[:, None] + np.arange(width)
            v = priors.SIZES[[self.sizes[i] for i in alike]]
            out.update(zip(alike, gained(*told_of(state, at, v)), strict=True))
        return out

    def _triad(self, channels: Sequence[int]) -> list[Array]:
        """F over the instabilities of each of some channels that are much alike.

        They are set together: one by one none could leave the others behind. Where
        several scatter what one of them could as well, as of a position of unknown
        orientation, each alone would fall, and all together leave it unexplained:
        then they are set one by one.
        """
        before, state = list(self.instability), self.eliminated()
        profiles = self._together(channels)
        if self.instability == before or self._level() >= (
            state.score + float(alike(before, self.unstable)) - ROUNDED
        ):
            return profiles
        self.instability = before
        return [self._one(c, channels) for c in channels]

    def _level(self) -> float:
        """F at the sizes as they are, but for what is known of groups' sizes."""
        return self.eliminated().score + float(alike(self.instability, self.unstable))

    def _one(self, c: int, channels: Sequence[int]) -> Array:
        """F over the instabilities of one channel, and its own at the top."""
        profile = self._beside(c, channels, self._channel(c))
        self.instability[c] = int(np.argmax(profile))
        return profile

    def _together(self, channels: Sequence[int]) -> list[Array]:
        """F over the instabilities of each channel, all at the top of their sum."""
        alone = [self._channel(c) for c in channels]
        index = np.arange(len(DENSITY))
        apart = np.subtract.outer(index, index) * STEP / priors.UNLIKE
        best = [gain - 0.5 * apart**2 for gain in alone]  # by middle, size
        total = sum(b.max(axis=1) for b in best) + UNSTEADY
        middle = int(np.argmax(total))
        for c, one in zip(channels, best, strict=True):
            self.instability[c] = int(np.argmax(one[middle]))
        return [
            self._beside(c, channels, one)
            for c, one in zip(channels, alone, strict=True)
        ]

    def _beside(self, c: int, channels: Sequence[int], gain: Array) -> Array:
        """F over the sizes of one channel, of its gain, but for a constant.

        Some channels are alike, it among them; the others of them stay.
        """
        every = np.tile([float(self.instability[i]) for i in channels], (len(gain), 1))
        every[:, channels.index(c)] = np.arange(len(gain))
        return gain + alike_in(every)

    def _channel(self, c: int) -> Array:
        """Gain over the instabilities of one channel, the others as they are."""
        key = (c, *self.sizes, *self.instability)
        if key not in self._gained:
            self._gained[key] = self._gained_by(c)
        return self._gained[key]

    def _gained_by(self, c: int) -> Array:
        """The same, not known yet."""
        inner, pull = self.eliminated().of_means(c, 1.0)
        tau = float(priors.SIZES[self.instability[c]] * self.unstable[c])
        told, axes = np.linalg.eigh(inner)
        told = np.clip(told, 0.0, (1 - LEAST) / tau**2)
        left = 1 - tau**2 * told
        size = float(self.unstable[c])
        power = (axes.T @ pull / left * size) ** 2
        return gained(told / left * size**2, power)
