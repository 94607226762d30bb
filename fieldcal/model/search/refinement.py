"""Finds the shape parameters, between their grid points, of the highest evidence.

An effect with an instant acts on both triads at that instant, so its members with the
same instant are moved together.
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
    """Refines the shapes of a set's members between their grid points."""

    def refine_shapes(
        self, state: State, values: Array, members: tuple[Member, ...], sizes: Sizes
    ) -> tuple[Member, ...]:
        """The members with their shapes refined between the points of the grid."""
        done: set[int] = set()
        for i, (_, group) in enumerate(members):
            if i in done or len(group.shape) != 1 or group.effect is None:
                continue
            both = [k for k, (c, g) in enumerate(members)
                    if k == i or g in c.simultaneous_variants(group)]  # fmt: skip
            members = self.refine_shape(state, values, members, both, sizes)
            done |= {*both}
        for _, group in members:
            self._add_to_other_triad(group, {c.key for c, _ in members})
        return members

    def _add_to_other_triad(self, group: Group, there: set[str]) -> None:
        """Add variants at the same instant to an effect's cause on the other triad."""
        for cause in self.dictionary.causes:
            if cause.key not in there:
                for one in cause.simultaneous_variants(group):
                    cause, _ = self.variants_near(cause, one, [*group.shape.values()])

    def refine_shape(
        self,
        state: State,
        values: Array,
        members: tuple[Member, ...],
        which: Sequence[int],
        sizes: Sizes,
    ) -> tuple[Member, ...]:
        """The members, with a shape that some of them share at the highest evidence.

        Sought in decreasing steps. For a time constant a parabola through the last
        three values of its logarithm gives the maximum and its uncertainty.
        """
        effect = members[which[0]][1].effect
        (shape,) = effect.shapes  # type: ignore[union-attr]
        found = dict.fromkeys(members[k][1].shape[shape.name] for k in which)
        scores: list[float] = []
        if len(found) > 1:
            tried = self._trial_sets(members, which, list(found))[1:]
            scores = self._scores(state, values, tried, sizes)
            members = tried[int(np.argmax(scores))]
        for ratio in shape.finer:
            here, at = members, members[which[0]][1].shape[shape.name]
            near = shape.near(self.dictionary.x, at, ratio)
            tried = self._trial_sets(members, which, near)
            scores = self._scores(state, values, tried, sizes)
            members = tried[int(np.argmax(scores))]
        if shape.kind != "instant" and len(scores) == 3:
            members = self._at_parabola_top(here, members, which[0], scores, shape.name)
        return members

    def _trial_sets(
        self, members: tuple[Member, ...], which: Sequence[int], near: Sequence[float]
    ) -> list[tuple[Member, ...]]:
        """The members unchanged, and with the shared shape at each of other values."""
        own, moved = list(members), dict[int, list[Group]]()
        for k in which:
            cause, moved[k] = self.variants_near(*members[k], near)
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
        """Scores of sets of the same causes at other values of their shapes."""
        search = self.search_among(state, values, tried)
        return [search.evaluate(members, sizes).score for members in tried]

    def _at_parabola_top(
        self,
        here: tuple[Member, ...],
        best: tuple[Member, ...],
        i: int,
        scores: list[float],
        name: str,
    ) -> tuple[Member, ...]:
        """The members with one shape at the maximum of the parabola, and its sigma."""
        middle, down, up = scores
        step = float(np.log(FINEST))
        bend = max(2 * middle - down - up, 1e-6) / step**2
        moved = float(np.clip((up - down) / (2 * step * bend), -step, step))
        at = here[i][1].shape[name] * float(np.exp(moved))
        cause, (group,) = self.variants_near(*best[i], [at])
        known = replace(group, shape_sigma=at / float(np.sqrt(bend)))
        variants = tuple(known if g is group else g for g in cause.variants)
        cause = self.dictionary.replace_variants(cause, variants)
        return (*best[:i], (cause, known), *best[i + 1 :])

    def variants_near(
        self, cause: Cause, group: Group, values: Sequence[float]
    ) -> tuple[Cause, list[Group]]:
        """A cause with variants of a group at some values of its shape, and these.

        Existing variants are reused. In the rows of turns, new ones have the columns of
        the group.
        """
        (name,) = group.shape
        known = {g.shape[name]: g for g in group.with_same_parameters(cause.variants)}
        others = [v for v in values if v not in known]
        cause, new = self.dictionary.add_shape_values(cause, group, others)
        for one in new:
            self.turn_rows = [
                t.with_copied_columns(group.columns, one.columns)
                for t in self.turn_rows
            ]
        known |= dict(zip(others, new, strict=True))
        return cause, [known[v] for v in values]

    def search_among(
        self, state: State, values: Array, sets: Sequence[tuple[Member, ...]]
    ) -> Search:
        """A search over the rows about a state, with the columns of some sets."""
        values = self.pad(values)
        wanted = values != 0
        for members in sets:
            wanted = wanted | self.wanted_columns(members)
        linear = self.system.linearised(state, wanted)
        return Search(self.dictionary, self.gram_of(linear, values, wanted))
