"""The explanation of a recording: its best set of causes, and all that is compared.

`explain` searches for the set of causes with the highest evidence. The `Explanation`
holds the fit of that set, the fit of the calibration alone, and the probabilities.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fieldcal.calibration.names import TILTS
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.grade import Grade
from fieldcal.core.samples import Array
from fieldcal.core.sampling import sampling_rate
from fieldcal.diagnosis.factory_left import enlarge_to_shown_grade
from fieldcal.diagnosis.fit import build_fit, fit_calibration_only
from fieldcal.diagnosis.prepare import PreparedRecording
from fieldcal.effects import catalogue
from fieldcal.model import thresholds, tolerances
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.sinking import NAME as SINKING
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.held_out import (
    HeldOut,
    candidate_sets,
    held_out_turn_residuals,
)
from fieldcal.model.posterior.model_average import ModelAverage, average_over_sizes
from fieldcal.model.posterior.probabilities import Posterior, ProbableCause
from fieldcal.model.posterior.time_constants import sets_at_other_time_constants
from fieldcal.model.posterior.turn_force_information import turn_force_information
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.search.inference import Inference, InferenceResult, resume
from fieldcal.model.search.settled_scores import correct_scores
from fieldcal.model.state import State
from fieldcal.model.system.fitted import FittedSet
from fieldcal.model.turns.turn import Turn


@dataclass(frozen=True)
class Explanation:
    """The best set of causes of a recording, with fits and probabilities.

    Attributes
    ----------
    prepared : the recording, with its rows
    inferred : the best set, the state it was linearised about, and the search
    best : fit of the best set
    calibration_only : fit of bias and scale factor alone
    posterior : probabilities of all causes
    grade : grade that bias and scale factor of the best set show

    """

    prepared: PreparedRecording
    inferred: InferenceResult
    best: FittedSet
    calibration_only: FittedSet
    posterior: Posterior
    grade: Grade

    @property
    def source(self) -> RowSource:
        """The samples, and the description of the session."""
        return self.prepared.source

    @property
    def rows(self) -> Rows:
        """Rows of the windows."""
        return self.prepared.rows

    @property
    def dictionary(self) -> Dictionary:
        """Columns of all causes, and the rows they belong to."""
        return self.best.dictionary

    @property
    def state(self) -> State:
        """State that the best set was linearised about."""
        return self.inferred.state

    @cached_property
    def rival_sets(self) -> list[Set]:
        """Sets that may become the best when a position is held out."""
        visited = list(self.inferred.search.sets.visited.values())
        return candidate_sets(self.best.set, visited)

    @cached_property
    def held_out(self) -> HeldOut:
        """Predictions of each position from the others."""
        return HeldOut(self.best, self.rival_sets)

    @cached_property
    def model_average(self) -> ModelAverage:
        """Values averaged over all sets with a noticeable weight."""
        around = sets_at_other_time_constants(self.inferred)
        return ModelAverage(self.posterior, around or [self.best.set])

    @cached_property
    def filter_rows(self) -> tuple[Array, Array] | None:
        """Rows of the turns that determine filters; None without a filter cause."""
        group = self.dictionary.filters
        if group is None:
            return None
        return turn_force_information(
            self.best.set, self.inferred.turn_rows, group.columns
        )

    @cached_property
    def turns(self) -> list[Turn]:
        """The turns, integrated with the best set."""
        return self.inferred.fit.turns_at(self.state)

    @cached_property
    def turns_held_out(self) -> Array:
        """Whitened residuals of the turns, each predicted without itself."""
        return held_out_turn_residuals(self.best, self.inferred.turn_rows)

    @cached_property
    def probable_causes(self) -> tuple[ProbableCause, ...]:
        """Causes with a probability above one half.

        Effects are not among them if the rows took so many causes that none counts.
        """
        probable = self.posterior.probable_causes()
        if self.inferred.exhausted:
            probable = [c for c in probable if c.name not in catalogue()]
        return tuple(probable)

    @cached_property
    def untracked_turns(self) -> tuple[tuple[int, int], ...]:
        """Pairs of windows whose turn the gyroscopes probably did not measure."""
        share: dict[tuple[int, ...], float] = {}
        for some, p in self.posterior.weights:
            for cause, group in some.members:
                if cause.kind == "noise" and group.moved_positions:
                    share[group.moved_positions] = (
                        share.get(group.moved_positions, 0.0) + p
                    )
        return tuple((pair[0], pair[1]) for pair, p in sorted(share.items())
                     if p >= thresholds.NAMED)  # fmt: skip

    @property
    def base_sinks(self) -> bool:
        """Whether the base probably turned during the session."""
        return self.posterior.probability([SINKING]) >= thresholds.NAMED

    @property
    def undecided(self) -> bool:
        """Whether an effect is probably present, but no single cause is likely."""
        return (
            not self.probable_causes
            and self.posterior.probability_of_noise_alone < thresholds.NAMED
        )

    @cached_property
    def earth_rate_evidence(self) -> float:
        """Rise of ln Z by the Earth's rate of the model; 0 if the model has none."""
        groups = [g for g in self.dictionary.always if g.cause == "earth"]
        return self.evidence_gain([c for g in groups for c in g.columns])

    def evidence_gain(self, columns: list[int]) -> float:
        """Rise of ln Z by some columns of the best set."""
        if not columns:
            return 0.0
        whole = self.best.set.state
        return whole.score - whole.without(columns).score

    @property
    def shows_earth_rate(self) -> bool:
        """Whether the rows as a whole show the Earth's rate."""
        return self.earth_rate_evidence > thresholds.SHOWS_EARTH

    @property
    def each_window_shows_earth_rate(self) -> bool:
        """Whether the Earth's rate exceeds the noise of a single window's mean."""
        rows, d = self.rows, self.dictionary
        if not self.shows_earth_rate:
            return False
        seconds = rows.length.sum() / len(d.window_positions)
        samples = seconds * sampling_rate(self.source.block)
        ratio = EARTH_RATE / (np.nanmax(rows.noise[3:]) / np.sqrt(samples))
        return bool(ratio > thresholds.SEES_EARTH)


def explain(
    prepared: PreparedRecording, before: Explanation | None = None
) -> Explanation:
    """Find the best set of causes of a recording.

    The search begins with `before`, the explanation of a part of it, if that is given.
    """
    fit = build_fit(prepared)
    begin = None if before is None else _starting_causes(before)
    found = Inference(fit).run(begin)
    posterior = _calculate_posterior(found)
    for _ in range(0 if found.exhausted else tolerances.MAX_RESUMPTIONS):
        better, now = found.search.best_visited, found.best
        # the same causes, with shapes between the grid points, are no improvement
        if found.search.sets.corrected_score(better) <= now.score + (
            thresholds.SIGMA_LOG_LOSS
            if better.keys == now.keys
            else thresholds.MIN_LOG_RISE
        ):
            break
        # an alias explains the rows better than the cause that it was an alias of
        resumed = resume(better, found)
        if resumed.best.score < now.score:  # about its own state it does not
            break
        found, posterior = resumed, _calculate_posterior(resumed)
    fit = found.fit
    windows = fit.system.linearised(found.state)
    best = FittedSet(
        prepared.rows, fit.dictionary, windows, found.values,
        average_over_sizes(found.search.sets, found.best),
    )  # fmt: skip
    grade = enlarge_to_shown_grade(fit.dictionary, best.set, prepared.source.about)
    alone = fit_calibration_only(fit, prepared.rows)
    return Explanation(prepared, found, best, alone, posterior, grade)


def _calculate_posterior(found: InferenceResult) -> Posterior:
    """Probabilities of the causes found, and of their aliases."""
    posterior = Posterior(found.search, found.best, found.with_refined_shapes)
    correct_scores(found)
    return posterior


def _starting_causes(before: Explanation) -> tuple[Member, ...]:
    """Causes to begin with: those of a part of the recording, and the base tilt.

    Two positions do not show the tilt, so that another cause takes its place. Further
    positions contradict that cause; with the tilt in the set, the search need not begin
    from nothing.
    """
    members = before.best.set.members
    if {cause.name for cause, _ in members} & set(TILTS):
        return members
    tilts = [c for c in before.dictionary.causes if c.name == TILTS[-1]]
    return (*members, *((cause, cause.variants[0]) for cause in tilts))
