"""Explains a recording by the motion of a reference, with the model of the diagnosis.

Alignment, noise spectrum and causes depend on each other. Beginning with the alignment
by correlation, bias, scale factor and alignment are fitted until convergence; then
causes are searched; then both are repeated with the causes found. The error of the
alignment is a column of every fit, so its uncertainty is part of all results.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.against.motion.alignment import CommonMotion
from fieldcal.against.motion.explanation import (
    MotionExplanation,
    Rival,
    reportable_names,
)
from fieldcal.against.motion.fit import MotionFit, lag_of
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.model import thresholds
from fieldcal.model.causes.motion_dictionary import MotionDictionary
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.probabilities import Posterior
from fieldcal.model.rows.coloured_noise import Bands
from fieldcal.model.rows.motion import Alignment, MotionRows
from fieldcal.model.rows.motion_reduction import common_samples, rows_in_motion
from fieldcal.model.rows.reference import Reference
from fieldcal.model.search.inference import InferenceResult
from fieldcal.model.state import State
from fieldcal.model.system.motion_rows import MotionSystem
from fieldcal.physics.lag import Lag
from fieldcal.session.description import Description

STRETCHES, SHORTEST_S = 24, 5.0
"""Number of stretches of a recording, and shortest stretch, s."""

MAX_ROWS = 40_000
"""Most rows; of longer recordings more samples are combined in a row."""

SLOWEST_HZ, QUICKEST_HZ = 10.0, 50.0
"""Least and largest number of rows a second."""

FAST_POWER_SHARE, ROWS_PER_PERIOD = 1e-3, 8.0
"""Part of a motion's power above its highest frequency, and rows in its period."""

MARGIN_S = 1.0
"""Time left out at both ends of a reference, so that a shift stays within it, s."""

FEWEST_S = 20.0
"""Shortest common motion that is evaluated, s."""

MAX_SEARCHES = 3
"""Most searches."""

LAG_ORDER = 3
"""Highest power of its time constant that the effect of a filter is proportional to. A
linear prediction of its absence is too large by this factor, chi^2 by its square."""


@dataclass(frozen=True, slots=True)
class _Start:
    """A fit to begin a search with, its causes, and their ln evidence."""

    fit: MotionFit
    members: tuple[Member, ...]
    evidence: float


def explain_motion(
    block: Block, about: Description, reference: Reference, start: CommonMotion
) -> MotionExplanation:
    """Fit a recording to the motion of a reference.

    Parameters
    ----------
    block, about : the recording
    reference : of the motion
    start : rough alignment, and the frequencies up to which the motion is common

    Raises
    ------
    InputError
        If both cover too little of the same motion.

    """
    rows = _motion_rows(block, reference, start.alignment)
    nominal = _nominal_state(about, int(rows.part[-1]) + 1)
    dictionary = MotionDictionary(rows, np.abs(nominal.scale))
    system = MotionSystem(dictionary, _starting_power(rows, nominal))
    plain = MotionFit(system, nominal, Bands.between(rows.frequency), start.hz)
    starts = _likely_starts(plain, dictionary)
    every = [Rival(reportable_names(one.members), one.evidence) for one in starts]
    explained = [_explained(one.fit) for one in starts]
    best = max(explained, key=lambda one: one.evidence)
    every += [Rival(one.names, one.evidence) for one in explained]
    return best.beside(every)


def _explained(fit: MotionFit) -> MotionExplanation:
    """Search from a fit, and repeat both with the causes found.

    A search is linear about its fit, where a filter is nearly a delay: it may end at
    causes that a fit of their own makes less likely than those before. The likeliest
    of the fits counts.
    """
    found = fit.search(())
    tried: list[_Start] = []
    for _ in range(MAX_SEARCHES):
        fit = fit.copy()
        fit.settle(found.best.members)
        fit, members = _without_idle_lags(fit, found.best.members)
        tried.append(_Start(fit, members, fit.evidence(members)))
        found = fit.search(members)
        if found.best.keys == fit.settled_keys:
            break
    best = max(tried, key=lambda one: one.evidence)
    if best is not tried[-1] or found.best.keys != best.fit.settled_keys:
        found = best.fit.hold(best.members)
    _correct_scores(found, best, tried)
    posterior = Posterior(found.search, found.best)
    return MotionExplanation(best.fit, found, posterior, best.evidence)


def _correct_scores(
    found: InferenceResult, best: _Start, tried: Sequence[_Start]
) -> None:
    """Give sets that had a fit of their own the evidence of that fit."""
    sets = found.search.sets
    for one in tried:
        own = sets.evaluate(sets.dictionary.match_members(one.members))
        if own.keys != found.best.keys and own.keys_in_state:
            behind = best.evidence - one.evidence
            sets.corrections[own.keys_in_state] = found.best.score - behind - own.score


def _likely_starts(fit: MotionFit, dictionary: MotionDictionary) -> list[_Start]:
    """Fits to begin a search with: with a filter or another effect of motion.

    The effect of a filter is linear about a similar filter, but not about none, where
    it may even seem to explain nothing beside a delay. So filters of first and of
    second order are both tried always; of other effects that show only in motion,
    those that explain something. The likeliest is taken, and those that come near it;
    those that explain most are tried first. An effect other than a filter is skipped if
    it explains nothing beside the one just tried.
    """
    every = [(c, g) for c in dictionary.causes for g in c.variants[:1]]
    delays = tuple(m for m in every if lag_of(m).delay or m[0].kind == "noise")
    fit.settle(delays)
    tried = [_Start(fit, delays, nothing := fit.evidence(delays))]
    explains = {
        i: evidence
        for i, member in enumerate(every)
        if member[1].effect is not None
        and member[1].effect.while_moving
        and (
            (evidence := fit.evidence((*delays, member))) > nothing
            or lag_of(member) != Lag()
        )
    }
    remain = sorted(explains, key=lambda i: -explains[i])
    while remain:
        one, *remain = remain
        other, members = fit.copy(), (*delays, every[one])
        other.settle(members)
        own = other.evidence(members)
        tried.append(_Start(other, members, own))
        remain = [
            i
            for i in remain
            if lag_of(every[i]) != Lag() or other.evidence((*members, every[i])) > own
        ]
    most = max(one.evidence for one in tried)
    return [
        one
        for one in tried
        if one.evidence > most - thresholds.ALTERNATIVE_LOG_DISTANCE
    ]


def _without_idle_lags(
    fit: MotionFit, members: tuple[Member, ...]
) -> tuple[MotionFit, tuple[Member, ...]]:
    """Remove filters and delays without which a new fit is at least as likely.

    Linearised about a filter, its absence looks worse than it is, since its effect is
    proportional to the square or cube of its time constant. `members` are settled.
    """
    lags = [m for m in members if lag_of(m) != Lag()]
    if not lags:
        return fit, members
    most = fit.evidence(members)
    loss = [most - fit.evidence(_without(members, m)) for m in lags]
    if max(loss) > LAG_ORDER**2 * thresholds.ALTERNATIVE_LOG_DISTANCE:
        lags.pop(loss.index(max(loss)))  # without it the others would have to grow
    for member in lags:
        lean, others = fit.copy(), _without(members, member)
        lean.settle(others)
        if (left := lean.evidence(others)) >= most:
            fit, members, most = lean, others, left
    return fit, members


def _without(members: tuple[Member, ...], one: Member) -> tuple[Member, ...]:
    return tuple(m for m in members if m[0].key != one[0].key)


def _motion_rows(block: Block, reference: Reference, start: Alignment) -> MotionRows:
    """Rows of the common motion, at the rate that the motion needs."""
    block = common_samples(block, reference)
    step = float(np.median(np.diff(block.t)))
    length = float(np.ptp(block.t))
    per_row = max(int(1 / _row_rate(reference) / step), -(-len(block) // MAX_ROWS), 1)
    stretch = max(length / STRETCHES, SHORTEST_S)
    rows = rows_in_motion(block, reference, start, per_row, stretch, MARGIN_S)
    if len(rows) * rows.step < FEWEST_S:
        raise InputError(
            f"both recordings cover {len(rows) * rows.step:.0f} s of the same motion"
            f" without gaps; at least {FEWEST_S:.0f} s in one piece are needed: let"
            " the simulator follow all of the recording"
        )
    return rows


def _row_rate(reference: Reference) -> float:
    """Rows a second that a motion needs, Hz."""
    t = np.arange(reference.start, reference.end, 0.5 / QUICKEST_HZ)
    six = reference.at(t)[:, reference.observed]
    power = np.abs(np.fft.rfft((six - six.mean(axis=0)) * np.hanning(len(t))[:, None],
                               axis=0)) ** 2  # fmt: skip
    slower = np.cumsum(power, axis=0) / np.maximum(power.sum(axis=0), 1e-300)
    most = int((slower < 1 - FAST_POWER_SHARE).sum(axis=0).max())
    hz = most * QUICKEST_HZ * 2 / len(t)
    return float(np.clip(ROWS_PER_PERIOD * hz, SLOWEST_HZ, QUICKEST_HZ))


def _nominal_state(about: Description, places: int) -> State:
    nominal = about.nominal
    return State(
        np.concatenate([nominal["acc_bias"], nominal["gyr_bias"]]),
        np.concatenate([nominal["acc_scale"], nominal["gyr_scale"]]),
        np.zeros((places, 2)),
        np.zeros(3),
    )


def _starting_power(rows: MotionRows, nominal: State) -> Array:
    """Initial power of the noise: the variance of all that differs."""
    off = rows.y - nominal.bias - nominal.scale * rows.motion(rows.acc)
    power = np.nanvar(np.where(rows.used, off, 0.0), axis=0)
    return np.tile(np.maximum(power, 1e-12), (len(rows), 1))
