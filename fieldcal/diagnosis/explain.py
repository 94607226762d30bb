"""The explanation of a recording: its best set of causes, and all that is compared.

`explain` searches for the set of causes with the highest evidence. The `Explanation`
holds the fit of that set, the fit of the calibration alone, and the probabilities.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fieldcal.calibration.names import TILTS
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array
from fieldcal.core.sampling import sampling_rate
from fieldcal.diagnosis.factory_left import enlarge_to_shown_grade, factory_error_groups
from fieldcal.diagnosis.prepare import PreparedRecording
from fieldcal.model import thresholds
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.sinking import NAME as SINKING
from fieldcal.model.causes.wander import Wander
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.held_out import (
    HeldOut,
    candidate_sets,
    held_out_turn_residuals,
)
from fieldcal.model.posterior.model_average import ModelAverage
from fieldcal.model.posterior.probabilities import Posterior, ProbableCause
from fieldcal.model.posterior.size_average import average_over_sizes
from fieldcal.model.posterior.time_constants import sets_at_other_time_constants
from fieldcal.model.posterior.turn_force_information import turn_force_information
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.change_points import change_points
from fieldcal.model.rows.interruptions import interruptions
from fieldcal.model.rows.noise import rounding_noise
from fieldcal.model.rows.rest_onset import window_starts
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.inference import (
    TIME_CONSTANT_LOG_LOSS,
    Inference,
    InferenceResult,
    resume,
)
from fieldcal.model.search.selection import MIN_LOG_RISE
from fieldcal.model.search.settled_scores import correct_scores
from fieldcal.model.state import State
from fieldcal.model.system.fitted import FittedSet
from fieldcal.model.system.turn_rows import Turns
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.model.turns.turn import Turn
from fieldcal.model.turns.turn_tracker import TurnTracker
from fieldcal.session.description import Description

MAX_RESUMPTIONS = 2
"""Most times that a search is resumed from an alias that proved better."""


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

    """

    prepared: PreparedRecording
    inferred: InferenceResult
    best: FittedSet
    calibration_only: FittedSet
    posterior: Posterior

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
        """Causes with a probability above one half."""
        return tuple(self.posterior.probable_causes())

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

    def evidence_gain(self, columns: Sequence[int]) -> float:
        """Rise of ln Z by some columns of the best set."""
        if not columns:
            return 0.0
        posterior = self.best.set.state
        kept = ~np.isin(posterior.columns, columns)
        less = type(posterior).of(
            posterior.rows, posterior.columns[kept], posterior.prior_sigma[kept]
        )
        return posterior.score - less.score

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
        samples = (
            rows.length.sum()
            / len(d.window_positions)
            * sampling_rate(self.prepared.source.block)
        )
        ratio = EARTH_RATE / (np.nanmax(rows.noise[3:]) / np.sqrt(samples))
        return bool(ratio > thresholds.SEES_EARTH)


def explain(
    prepared: PreparedRecording, before: Explanation | None = None
) -> Explanation:
    """Find the best set of causes of a recording.

    The search begins with `before`, the explanation of a part of it, if that is given.
    """
    fit = build_fit(prepared.source, prepared.rows, prepared)
    begin = None if before is None else _starting_causes(before)
    found = Inference(fit).run(begin)
    posterior = _calculate_posterior(found)
    for _ in range(MAX_RESUMPTIONS):
        better, now = found.search.best_visited, found.best
        # the same causes, with shapes between the grid points, are no improvement
        if found.search.sets.corrected_score(better) <= now.score + (
            TIME_CONSTANT_LOG_LOSS if better.keys == now.keys else MIN_LOG_RISE
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
        prepared.rows,
        fit.dictionary,
        windows,
        found.values,
        average_over_sizes(found.search.sets, found.best),
    )
    enlarge_to_shown_grade(fit.dictionary, best.set, prepared.source.about)
    return Explanation(
        prepared, found, best, fit_calibration_only(fit, prepared.rows), posterior
    )


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


def build_fit(
    source: RowSource, rows: Rows, prepared: PreparedRecording
) -> GaussNewton:
    """Set up the fit of some rows: causes, turns and nominal state."""
    about = source.about
    swayed = any(t.effect.kind == "motion" for t in prepared.spectral_lines)
    turned = bool(about.positions) and not swayed  # a base that rocks turns it as well
    held = np.unique(rows.x.position)
    common = np.array([rows.window_error[rows.x.position == p][0] for p in held])
    nominal = nominal_state(about, int(rows.x.position.max()) + 1, prepared)
    unit = np.abs(nominal.scale)
    dictionary = Dictionary(
        rows.x, rows.used, times_since_turn(source, rows), common, unit, turned,
        Wander.of(rows, unit), rows.session_error,
    )  # fmt: skip
    dictionary.unfitted = tuple(factory_error_groups(dictionary, about, prepared))
    dictionary.add_instants(change_points(rows).tolist())
    dictionary.expect_within(interruptions(source.block, about))
    grain = rounding_noise(source.block, window_bounds(source.block, about))
    rough = bool((grain[:, :3] > thresholds.ROUNDING_SHARE * rows.noise[:3]).any())
    # swaying is removed from windows and closures, but not from samples within turns
    rough |= "sway" in prepared.checked.ids
    turning = TurnTracker(source, rows, dictionary.since)
    turns = Turns(turning, dictionary, not rough) if turned else None
    return GaussNewton(WindowSystem(rows, dictionary), nominal, turns)


def nominal_state(
    about: Description, places: int, prepared: PreparedRecording
) -> State:
    """The state that a simulation starts from."""
    nominal = about.nominal
    return State(
        np.concatenate([nominal["acc_bias"], nominal["gyr_bias"]]),
        np.concatenate([nominal["acc_scale"], nominal["gyr_scale"]]),
        np.zeros((places, 2)),
        np.zeros(3),
        prepared.known,
    )


def times_since_turn(source: RowSource, rows: Rows) -> Array:
    """Time since the turn, (o, n) s, for each possible origin of that time.

    The origin is the end of the motion, either as each window shows it, or a fixed time
    before each window: the usual time is the better guess where the end is hard to see.
    Each is given with and without a turn before the first window.
    """
    x, arrived = rows.x, source.rest_began
    if not source.about.positions:
        return np.full((1, len(x)), np.inf)
    starts = window_starts(source)
    lead = (starts - arrived)[np.isfinite(arrived)]
    usual = starts - (float(np.median(lead)) if len(lead) else 0.0)
    first = np.arange(len(starts)) == x.position.min()
    instants = [
        instant
        for arrivals in (arrived, usual)
        for instant in (arrivals, np.where(first, -np.inf, arrivals))
    ]
    return np.array([x.t - at[x.position] for at in instants])


def fit_calibration_only(whole: GaussNewton, rows: Rows) -> FittedSet:
    """Fit bias and scale factor alone to the windows."""
    d = whole.dictionary.calibration_only()
    fit = GaussNewton(WindowSystem(rows, d), whole.nominal)
    zeros: Array = np.zeros(d.width)
    state, values, _ = fit.settle(fit.nominal, zeros, ())
    wanted = fit.wanted_columns(())
    linear = fit.system.linearised(state, wanted)
    fitted = Sets(d, fit.gram_of(linear, values, wanted)).evaluate(())
    return FittedSet(rows, d, linear, values, fitted)
