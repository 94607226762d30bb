"""Finds the shape parameters, between their grid points, of the highest evidence.

An effect with an instant acts on both triads at that instant, so its members with the
same instant are moved together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, count

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import tolerances
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.sizing import Member, Sizes
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.state import State
from fieldcal.physics.shape import instants_near


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
            if i in done or not group.shape or group.effect is None:
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

        `sharing` are the numbers of those members. Each shape parameter is sought in
        decreasing steps, several together. At the last, a parabola of the natural
        coordinates gives the maximum and its uncertainty, except of an instant.
        """
        effect = members[sharing[0]][1].effect
        shapes = effect.shapes if effect else ()
        own = [members[k][1].shape for k in sharing]
        if any(shape != own[0] for shape in own):
            members = self._likeliest(members, sharing, own, unchanged=False)
        x = self.fit.dictionary.x
        if shapes[0].kind == "instant":
            (shape,) = shapes
            for part in shape.finer:
                near = instants_near(x, members[sharing[0]][1].shape[shape.name], part)
                shared = [{shape.name: at} for at in near]
                members = self._likeliest(members, sharing, shared)
            return members
        finer = [[s.natural_step(x, step) for step in s.finer] for s in shapes]
        for steps in np.transpose(finer):
            members = self._climbed(members, sharing, steps)
        return self._at_top(members, sharing, steps)

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
                    shape = dict.fromkeys(variant.shape, at)
                    cause, _ = self.fit.variants_near(cause, variant, [shape])

    def _likeliest(
        self,
        members: tuple[Member, ...],
        sharing: Sequence[int],
        shapes: Sequence[Mapping[str, float]],
        unchanged: bool = True,
    ) -> tuple[Member, ...]:
        """The likeliest of the members `unchanged`, and with each shared shape."""
        tried = self._trial_sets(members, sharing, shapes)[not unchanged :]
        return tried[int(np.argmax(self._scores(tried)))]

    def _trial_sets(
        self,
        members: tuple[Member, ...],
        sharing: Sequence[int],
        shapes: Sequence[Mapping[str, float]],
    ) -> list[tuple[Member, ...]]:
        """The members unchanged, and with each of some shapes in `sharing`."""
        unchanged, variants = list(members), dict[int, list[Group]]()
        for k in sharing:
            cause, variants[k] = self.fit.variants_near(*members[k], shapes)
            unchanged[k] = (cause, members[k][1])
        trials = [tuple(unchanged)]
        for i in range(len(shapes)):
            trial = unchanged.copy()
            for k in sharing:
                trial[k] = (unchanged[k][0], variants[k][i])
            trials.append(tuple(trial))
        return trials

    def _scores(self, trials: Sequence[tuple[Member, ...]]) -> list[float]:
        """Scores of sets of the same causes at other values of their shapes."""
        sets = self.fit.sets_with_columns_of(self.state, self.values, trials)
        return [sets.evaluate(members, self.sizes).score for members in trials]

    def _at_top(
        self, members: tuple[Member, ...], sharing: Sequence[int], steps: Array
    ) -> tuple[Member, ...]:
        """The members with the shape of some at the maximum of a parabola.

        `steps` (m,) are those of the last search. A parabola with such steps gives the
        uncertainty; one with steps twice as long as that, beside which the grid of the
        sizes is fine, gives both.
        """
        for _ in range(2):
            tried, _, top, covariance = self._parabola(members, sharing, steps)
            members = self._trial_sets(tried[0], sharing, [top])[1]
            steps = np.minimum(steps, 2 * np.sqrt(np.diag(covariance)))
        out = list(members)
        for k in sharing:
            cause, group = out[k]
            refined = replace(group, shape_covariance=covariance)
            variants = tuple(refined if g is group else g for g in cause.variants)
            cause = self.fit.dictionary.replace_variants(cause, variants)
            out[k] = (cause, refined)
        return tuple(out)

    def _climbed(
        self, members: tuple[Member, ...], sharing: Sequence[int], steps: Array
    ) -> tuple[Member, ...]:
        """The members at the likeliest shape that steps of one length lead to."""
        for _ in range(tolerances.MAX_CORRECTIONS):
            tried, scores, top, _ = self._parabola(members, sharing, steps)
            best = tried[int(np.argmax(scores))]
            members = self._likeliest(best, sharing, [top])
            if best is tried[0]:
                break
        return members

    def _parabola(
        self, members: tuple[Member, ...], sharing: Sequence[int], steps: Array
    ) -> tuple[list[tuple[Member, ...]], list[float], dict[str, float], Array]:
        """Parabola of the score about a shared shape of m parameters.

        Parameters
        ----------
        members, sharing : as those of `refine_shape`
        steps : (m,) in natural coordinates

        Returns
        -------
        tried, scores : the members, and those at the points `around` the shape
        top : shape of its maximum, at most a step away
        covariance : (m, m) inverse of its curvature, in natural coordinates

        """
        _, first = members[sharing[0]]
        near = [first.moved_shape(step) for step in around(len(steps)) * steps]
        tried = self._trial_sets(members, sharing, near)
        scores = self._scores(tried)
        moved, curvature = parabola_top(scores)
        covariance = np.linalg.inv(curvature) * np.outer(steps, steps)
        return tried, scores, first.moved_shape(moved * steps), covariance


def around(m: int) -> Array:
    """Points about the origin that determine a parabola in m coordinates, (n, m).

    One step down and up in each, and up in each two together.
    """
    unit = np.eye(m)
    single = np.stack([-unit, unit], axis=1).reshape(-1, m)
    return np.array([*single, *(a + b for a, b in combinations(unit, 2))])


def parabola_top(scores: Sequence[float]) -> tuple[Array, Array]:
    """Maximum (m,) of a parabola, at most one step away, and its curvature (m, m).

    `scores` are those at the origin and at the points `around` it. Between two
    coordinates whose scores are not those of a maximum, no correlation is assumed.
    """
    middle, *outer = scores
    m = next(m for m in count(1) if m * (m + 3) // 2 == len(outer))
    down, up = np.reshape(outer[: 2 * m], (m, 2)).T
    bend = np.maximum(2 * middle - down - up, tolerances.ACCUMULATED_ROUNDING)
    curvature = np.diag(bend)
    for (i, j), both in zip(combinations(range(m), 2), outer[2 * m :], strict=True):
        cross = float(up[i] + up[j] - middle - both)
        if cross**2 < bend[i] * bend[j]:
            curvature[i, j] = curvature[j, i] = cross
    top: Array = np.linalg.solve(curvature, (up - down) / 2)
    return np.clip(top, -1.0, 1.0), curvature


def _nearest_by_parameters(cause: Cause, at: float) -> list[Group]:
    """The variants that begin nearest to an instant, with each choice of parameters."""
    begin = [g for g in cause.variants if g.begins_at_instant]
    begin.sort(key=lambda g: -abs(next(iter(g.shape.values())) - at))
    return list({g.params: g for g in begin}.values())
