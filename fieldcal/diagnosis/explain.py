"""The explanation of a recording: the best set of causes, and the simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fieldcal.calibration.names import TILTS
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array
from fieldcal.core.sampling import rate_of
from fieldcal.diagnosis.factory_left import as_good_as_shown, left_by_factory
from fieldcal.diagnosis.prepare import Prepared
from fieldcal.model import thresholds
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.sinking import NAME as SINKING
from fieldcal.model.causes.wander import Wander
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.held_out import HeldOut, in_question, turns_held_out
from fieldcal.model.posterior.model_average import ModelAverage
from fieldcal.model.posterior.on_the_way import remaining
from fieldcal.model.posterior.probabilities import Posterior, Standing
from fieldcal.model.posterior.reported import reported
from fieldcal.model.posterior.time_constants import elsewhere
from fieldcal.model.rows.bounds import spans
from fieldcal.model.rows.change_points import change_points
from fieldcal.model.rows.interruptions import interruptions
from fieldcal.model.rows.noise import grain_of
from fieldcal.model.rows.reduce import Rows, RowSource
from fieldcal.model.rows.rest_onset import beginnings
from fieldcal.model.search.inference import OWN_SIGMA, Inference, Inferred
from fieldcal.model.search.selection import SETTLED, Search
from fieldcal.model.state import State
from fieldcal.model.system.fitted import Fitted
from fieldcal.model.system.turn_rows import Turns
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.model.turns.turn import Turn, Turning
from fieldcal.session.description import Description

RESUMED = 2
"""Times that a search goes on with what it looked at only as another name."""


@dataclass(frozen=True)
class Explanation:
    """What was found.

    Attributes
    ----------
    prepared : the rows it was found in
    inferred : set, state and search
    best, base : with what was found, and bias and scale factor alone
    posterior : probabilities

    """

    prepared: Prepared
    inferred: Inferred
    best: Fitted
    base: Fitted
    posterior: Posterior

    @property
    def rows(self) -> Rows:
        """Rows of the windows."""
        return self.prepared.rows

    @property
    def dictionary(self) -> Dictionary:
        """What rows were laid to."""
        return self.best.dictionary

    @property
    def state(self) -> State:
        """Where what was found stands."""
        return self.inferred.state

    @cached_property
    def in_question(self) -> list[Set]:
        """Sets that may turn out the best where a position is left out."""
        visited = list(self.inferred.search.visited.values())
        return in_question(self.best.set, visited)

    @cached_property
    def held_out(self) -> HeldOut:
        """The rows without each of their parts."""
        return HeldOut(self.best, self.in_question)

    @cached_property
    def average(self) -> ModelAverage:
        """Numbers over all sets that count."""
        around = elsewhere(self.inferred)
        return ModelAverage(self.posterior, around or [self.best.set])

    @cached_property
    def filters(self) -> tuple[Array, Array] | None:
        """What the way between windows says of filters, as rows; None without it."""
        group = self.dictionary.filters
        if group is None:
            return None
        return remaining(self.best.set, self.inferred.turned, group.columns)

    @cached_property
    def turns(self) -> list[Turn]:
        """The turns as what was found follows them."""
        return self.inferred.inference.turns_by(self.state)

    @cached_property
    def turns_held_out(self) -> Array:
        """Whitened residuals of the turns, each predicted without itself."""
        return turns_held_out(self.best, self.inferred.turned)

    @cached_property
    def standing(self) -> tuple[Standing, ...]:
        """Causes that are likelier there than not."""
        return tuple(self.posterior.standing())

    @cached_property
    def lost_ways(self) -> tuple[tuple[int, int], ...]:
        """Windows between which the gyroscopes did not follow, likelier than not."""
        share: dict[tuple[int, ...], float] = {}
        for some, p in self.posterior.weights:
            for cause, group in some.members:
                if cause.kind == "noise" and group.together:
                    share[group.together] = share.get(group.together, 0.0) + p
        return tuple((pair[0], pair[1]) for pair, p in sorted(share.items())
                     if p >= thresholds.NAMED)  # fmt: skip

    @property
    def sinks(self) -> bool:
        """Whether the base turned while it was used, likelier than not."""
        return self.posterior.probability([SINKING]) >= thresholds.NAMED

    @property
    def undecided(self) -> bool:
        """Whether something is there, likelier than not, and no cause likely enough."""
        return not self.standing and self.posterior.nothing < thresholds.NAMED

    @cached_property
    def earth(self) -> float:
        """By how much the Earth's rate of the model raises ln Z; 0 without it."""
        groups = [g for g in self.dictionary.always if g.cause == "earth"]
        return self.raised([c for g in groups for c in g.columns])

    def raised(self, columns: Sequence[int]) -> float:
        """By how much some columns raise ln Z."""
        if not columns:
            return 0.0
        found = self.best.set.state
        kept = ~np.isin(found.columns, columns)
        less = type(found).of(found.rows, found.columns[kept], found.sizes[kept])
        return found.score - less.score

    @property
    def shows_earth(self) -> bool:
        """Whether the rows show the Earth's rate at all."""
        return self.earth > thresholds.SHOWS_EARTH

    @property
    def sees_earth(self) -> bool:
        """Whether tactical gyroscopes see the Earth's rate in a single window."""
        rows, d = self.rows, self.dictionary
        if not self.shows_earth:
            return False
        samples = rows.length.sum() / len(d.held) * rate_of(self.prepared.source.block)
        ratio = EARTH_RATE / (np.nanmax(rows.noise[3:]) / np.sqrt(samples))
        return bool(ratio > thresholds.SEES_EARTH)


def explain(prepared: Prepared, before: Explanation | None = None) -> Explanation:
    """Find what explains a recording, beginning with what explained a part of it."""
    inference = inference_of(prepared.source, prepared.rows, prepared)
    found = inference.run(None if before is None else _begun(before))
    posterior = _posterior(found)
    for _ in range(RESUMED):
        better, now = found.search.highest, found.best
        # the same causes between the points of their grids are as good
        if better.score <= now.score + (
            OWN_SIGMA if better.keys == now.keys else SETTLED
        ):
            break
        # what may stand in the place of a cause does so better than the cause itself
        found = found.inference.resumed(better, found)
        posterior = _posterior(found)
    inference = found.inference
    windows = inference.system.linearised(found.state)
    best = Fitted(
        prepared.rows,
        inference.dictionary,
        windows,
        found.values,
        reported(found.search, found.best),
    )
    as_good_as_shown(inference.dictionary, best.set, prepared.source.about)
    return Explanation(
        prepared, found, best, base_of(inference, prepared.rows), posterior
    )


def _posterior(found: Inferred) -> Posterior:
    """Probabilities of what was found, and of what may stand in its place."""
    return Posterior(
        found.search, found.best, lambda there: found.inference.beside(found, there)
    )


def _begun(before: Explanation) -> tuple[Member, ...]:
    """What explained a part of a recording, and the tilt that every base has.

    Two positions do not show it. Then something else did instead, which more positions
    contradict, and it would be searched for from nothing.
    """
    members = before.best.set.members
    if {cause.name for cause, _ in members} & set(TILTS):
        return members
    tilts = [c for c in before.dictionary.causes if c.name == TILTS[-1]]
    return (*members, *((cause, cause.variants[0]) for cause in tilts))


def inference_of(source: RowSource, rows: Rows, prepared: Prepared) -> Inference:
    """The inference of some rows, ready to run."""
    about = source.about
    swayed = any(t.effect.kind == "motion" for t in prepared.tones)
    turned = bool(about.positions) and not swayed  # a base that rocks turns it as well
    held = np.unique(rows.x.position)
    common = np.array([rows.common[rows.x.position == p][0] for p in held])
    nominal = nominal_of(about, int(rows.x.position.max()) + 1, prepared)
    unit = np.abs(nominal.scale)
    dictionary = Dictionary(
        rows.x, rows.used, origins(source, rows), common, unit, turned,
        Wander.of(rows, unit), rows.alike,
    )  # fmt: skip
    dictionary.unfitted = tuple(left_by_factory(dictionary, about, prepared))
    dictionary.tried_at(change_points(rows).tolist())
    dictionary.expected_within(interruptions(source.block, about))
    grain = grain_of(source.block, spans(source.block, about))
    rough = bool((grain[:3] > thresholds.ROUGH * rows.noise[:3]).any())
    # what sways is taken out of windows and closures; on the way it shakes
    rough |= "sway" in prepared.checked.ids
    turning = Turning(source, rows, dictionary.since)
    turns = Turns(turning, dictionary, not rough) if turned else None
    return Inference(WindowSystem(rows, dictionary), nominal, turns)


def nominal_of(about: Description, places: int, prepared: Prepared) -> State:
    """The state that a simulation starts from."""
    nominal = about.nominal
    return State(
        np.concatenate([nominal["acc_bias"], nominal["gyr_bias"]]),
        np.concatenate([nominal["acc_scale"], nominal["gyr_scale"]]),
        np.zeros((places, 2)),
        np.zeros(3),
        prepared.known,
    )


def origins(source: RowSource, rows: Rows) -> Array:
    """Time since the turn, (o, n) s, from each instant that it may count from.

    That is the end of the motion, as each window shows it or a fixed time before each:
    where it is hard to see, what is usual is the better guess. And before the first
    window the device may have been turned, or not.
    """
    x, arrived = rows.x, source.arrived
    if not source.about.positions:
        return np.full((1, len(x)), np.inf)
    starts = beginnings(source)
    lead = (starts - arrived)[np.isfinite(arrived)]
    usual = starts - (float(np.median(lead)) if len(lead) else 0.0)
    first = np.arange(len(starts)) == x.position.min()
    instants = [
        one
        for each in (arrived, usual)
        for one in (each, np.where(first, -np.inf, each))
    ]
    return np.array([x.t - at[x.position] for at in instants])


def base_of(whole: Inference, rows: Rows) -> Fitted:
    """Bias and scale factor alone, refitted to the windows."""
    d = whole.dictionary.plain()
    inference = Inference(WindowSystem(rows, d), whole.nominal)
    start: Array = np.zeros(d.width)
    state, values, _ = inference.settled(inference.nominal, start, ())
    wanted = inference.wanted(())
    linear = inference.system.linearised(state, wanted)
    found = Search(d, inference.gram_of(linear, values, wanted)).evaluated(())
    return Fitted(rows, d, linear, values, found)
