"""Finds the shape parameters, between their grid points, of the highest evidence.

An effect with an instant acts on both triads at that instant, so its members with the
same instant are moved together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import tolerances
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.sizing import Member, Sizes
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.state import State
from fieldcal.physics.shape import FINEST


@dataclass(frozen=True, slots=True)
class Refinement:
    """Refines the shapes of members between their grid points, about one state.

    New variants are added to the dictionary of the fit.

    Attributes
    ----------
    fit : linearises the rows
    state, values : state to linearise about, and the columns' values in it
    sizes : from which sets are evaluated

    """

    fit: GaussNewton
    state: State
    values: Array
    sizes: Sizes

    def refine_shapes(self, members: tuple[Member, ...]) -> tuple[Member, ...]:
        """The members with their shapes refined between the points of the grid."""
        done: set[int] = set()
        for i, (_, group) in enumerate(members):
            if i in done or len(group.shape) != 1 or group.effect is None:
                continue
            together = [k for k, (c, g) in enumerate(members)
                        if k == i or g in c.simultaneous_variants(group)]  # fmt: skip
            members = self.refine_shape(members, together)
            done |= {*together}
        for _, group in members:
            self._add_to_others(group, {c.key for c, _ in members})
        return members

    def refine_shape(
        self, members: tuple[Member, ...], sharing: Sequence[int]
    ) -> tuple[Member, ...]:
        """The members, with the shape that some share at the highest evidence.

        `sharing` are the numbers of those members. The shape is sought in decreasing
        steps. For a time constant, a parabola through the last three values of its
        logarithm gives the maximum and its uncertainty.
        """
        first = sharing[0]
        effect = members[first][1].effect
        (shape,) = effect.shapes  # type: ignore[union-attr]
        values = dict.fromkeys(members[k][1].shape[shape.name] for k in sharing)
        scores: list[float] = []
        if len(values) > 1:
            tried = self._trial_sets(members, sharing, list(values))[1:]
            scores = self._scores(tried)
            members = tried[int(np.argmax(scores))]
        for ratio in shape.finer:
            at = members[first][1].shape[shape.name]
            near = shape.near(self.fit.dictionary.x, at, ratio)
            tried = self._trial_sets(members, sharing, near)
            scores = self._scores(tried)
            members = tried[int(np.argmax(scores))]
        if shape.kind != "instant" and len(scores) == 3:
            members = self._at_parabola_top(at, members, first, scores)
        return members

    def _add_to_others(self, group: Group, present: set[str]) -> None:
        """Add variants at a member's instant to other causes that begin at one.

        What happened then may be of another kind, or on the other triad too; where the
        grid has no instant as near, the rows would seem to tell them apart. Causes
        whose keys are `present` in the set already have them.
        """
        if not group.begins_at_instant:
            return
        (at,) = group.shape.values()
        for cause in self.fit.dictionary.causes:
            if cause.key not in present:
                for variant in _nearest_by_parameters(cause, at):
                    cause, _ = self.fit.variants_near(cause, variant, [at])

    def _trial_sets(
        self,
        members: tuple[Member, ...],
        sharing: Sequence[int],
        values: Sequence[float],
    ) -> list[tuple[Member, ...]]:
        """The members unchanged, and with the shared shape at each of some values."""
        unchanged, variants = list(members), dict[int, list[Group]]()
        for k in sharing:
            cause, variants[k] = self.fit.variants_near(*members[k], values)
            unchanged[k] = (cause, members[k][1])
        trials = [tuple(unchanged)]
        for i in range(len(values)):
            trial = unchanged.copy()
            for k in sharing:
                trial[k] = (unchanged[k][0], variants[k][i])
            trials.append(tuple(trial))
        return trials

    def _scores(self, trials: Sequence[tuple[Member, ...]]) -> list[float]:
        """Scores of sets of the same causes at other values of their shapes."""
        sets = self.fit.sets_with_columns_of(self.state, self.values, trials)
        return [sets.evaluate(members, self.sizes).score for members in trials]

    def _at_parabola_top(
        self, at: float, best: tuple[Member, ...], i: int, scores: Sequence[float]
    ) -> tuple[Member, ...]:
        """The members with the shape of one at the maximum of the parabola.

        `scores` are those at the shape `at`, one step below and one step above it.
        """
        middle, down, up = scores
        step = float(np.log(FINEST))
        bend = max(2 * middle - down - up, tolerances.ACCUMULATED_ROUNDING)
        curvature = bend / step**2
        moved = float(np.clip((up - down) / (2 * step * curvature), -step, step))
        top = at * float(np.exp(moved))
        cause, (group,) = self.fit.variants_near(*best[i], [top])
        refined = replace(group, shape_sigma=top / float(np.sqrt(curvature)))
        variants = tuple(refined if g is group else g for g in cause.variants)
        cause = self.fit.dictionary.replace_variants(cause, variants)
        return (*best[:i], (cause, refined), *best[i + 1 :])


def _nearest_by_parameters(cause: Cause, at: float) -> list[Group]:
    """The variants that begin nearest to an instant, with each choice of parameters."""
    begin = [g for g in cause.variants if g.begins_at_instant]
    begin.sort(key=lambda g: -abs(next(iter(g.shape.values())) - at))
    return list({g.params: g for g in begin}.values())
