"""Shapes between the points of their grids: where the evidence of a set is highest.

What happens at an instant happens to both triads, so the members of an effect that are
at once are moved together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.sizing import Member, Sizes
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.selection import Search
from fieldcal.model.state import State
from fieldcal.physics.shape import FINEST


class Refinement(GaussNewton):
    """Sets at states of one session, with their shapes anywhere."""

    def shaped(
        self, state: State, values: Array, members: tuple[Member, ...], sizes: Sizes
    ) -> tuple[Member, ...]:
        """The members with their shapes refined between the points of the grid."""
        done: set[int] = set()
        for i, (_, group) in enumerate(members):
            if i in done or len(group.shape) != 1 or group.effect is None:
                continue
            both = [k for k, (c, g) in enumerate(members)
                    if k == i or g in c.at_once(group)]  # fmt: skip
            members = self.refined(state, values, members, both, sizes)
            done |= {*both}
        for _, group in members:
            self._share(group, {c.key for c, _ in members})
        return members

    def _share(self, group: Group, there: set[str]) -> None:
        """Let an effect on a triad that has it not happen when it does on the other."""
        for cause in self.dictionary.causes:
            if cause.key not in there:
                for one in cause.at_once(group):
                    cause, _ = self.near(cause, one, [*group.shape.values()])

    def refined(
        self,
        state: State,
        values: Array,
        members: tuple[Member, ...],
        which: Sequence[int],
        sizes: Sizes,
    ) -> tuple[Member, ...]:
        """The members with the shape that some share where the evidence is highest.

        By steps closer and closer; last by the parabola through three points of a time
        constant's logarithm, which gives its uncertainty as well.
        """
        effect = members[which[0]][1].effect
        (shape,) = effect.shapes  # type: ignore[union-attr]
        found = dict.fromkeys(members[k][1].shape[shape.name] for k in which)
        scores: list[float] = []
        if len(found) > 1:
            tried = self._moved(members, which, list(found))[1:]
            scores = self._scores(state, values, tried, sizes)
            members = tried[int(np.argmax(scores))]
        for ratio in shape.finer:
            here, at = members, members[which[0]][1].shape[shape.name]
            near = shape.near(self.dictionary.x, at, ratio)
            tried = self._moved(members, which, near)
            scores = self._scores(state, values, tried, sizes)
            members = tried[int(np.argmax(scores))]
        if shape.kind != "instant" and len(scores) == 3:
            members = self._at_top(here, members, which[0], scores, shape.name)
        return members

    def _moved(
        self, members: tuple[Member, ...], which: Sequence[int], near: Sequence[float]
    ) -> list[tuple[Member, ...]]:
        """The members as they are, and with a shape that some share at other values."""
        own, moved = list(members), dict[int, list[Group]]()
        for k in which:
            cause, moved[k] = self.near(*members[k], near)
            own[k] = (cause, members[k][1])
        out = [tuple(own)]
        for i in range(len(near)):
            there = own.copy()
            for k in which:
                there[k] = (own[k][0], moved[k][i])
            out.append(tuple(there))
        return out

    def _scores(
        self,
        state: State,
        values: Array,
        tried: Sequence[tuple[Member, ...]],
        sizes: Sizes,
    ) -> list[float]:
        """Weights of sets of the same causes at other values of their shapes."""
        search = self.search_among(state, values, tried)
        return [search.evaluated(members, sizes).score for members in tried]

    def _at_top(
        self,
        here: tuple[Member, ...],
        best: tuple[Member, ...],
        i: int,
        scores: list[float],
        name: str,
    ) -> tuple[Member, ...]:
        """The members with one at the top of the parabola through its last points."""
        middle, down, up = scores
        step = float(np.log(FINEST))
        bend = max(2 * middle - down - up, 1e-6) / step**2
        moved = float(np.clip((up - down) / (2 * step * bend), -step, step))
        at = here[i][1].shape[name] * float(np.exp(moved))
        cause, (group,) = self.near(*best[i], [at])
        known = replace(group, unsure=at / float(np.sqrt(bend)))
        variants = tuple(known if g is group else g for g in cause.variants)
        cause = self.dictionary.exchanged(cause, variants)
        return (*best[:i], (cause, known), *best[i + 1 :])

    def near(
        self, cause: Cause, group: Group, values: Sequence[float]
    ) -> tuple[Cause, list[Group]]:
        """A cause with variants of a group at some values of its shape, and these.

        On turns they are as the one they are near; what it has already is not made
        again, as it would count twice.
        """
        (name,) = group.shape
        known = {g.shape[name]: g for g in group.alike(cause.variants)}
        others = [v for v in values if v not in known]
        cause, new = self.dictionary.refined(cause, group, others)
        for one in new:
            self.turned = [t.copied(group.columns, one.columns) for t in self.turned]
        known |= dict(zip(others, new, strict=True))
        return cause, [known[v] for v in values]

    def search_among(
        self, state: State, values: Array, sets: Sequence[tuple[Member, ...]]
    ) -> Search:
        """What the rows about a state say of some sets."""
        values = self.padded(values)
        wanted = values != 0
        for members in sets:
            wanted = wanted | self.wanted(members)
        linear = self.system.linearised(state, wanted)
        return Search(self.dictionary, self.gram_of(linear, values, wanted))
