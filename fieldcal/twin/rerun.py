"""Replays the session on the virtual device with its own physics.

The device is held in the session's positions, at the session's times, at the recorded
temperature, without noise. Its outputs are compared with the recorded ones over the
same stretches: rms over parts of windows, and

    chi^2 = sum |L^-1 (y - y_replayed)|^2

with the covariance L L^T of white noise and of the instability that the diagnosis found
for the windows. Three devices are compared: the one that session.toml describes, the
same with bias and scale factor refitted, and the twin. Random effects and causes that
are no effects are left out of the replay, and their estimates are subtracted from the
twin's differences. Angles are those that were found. Faults of samples have been
corrected in the recording. Lines are compared by their amplitude. From window to window
each device is moved along the turn that it reads from the recorded gyroscopes (`ways`).
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis import Diagnosis
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.agreement import rms_over_parts
from fieldcal.model.rows.averages import Rows
from fieldcal.model.state import State
from fieldcal.model.system.fitted import FittedSet
from fieldcal.model.turns.turn import Turn
from fieldcal.model.turns.turn_tracker import TurnTracker
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.replay import HeldWindow, simulate
from fieldcal.twin import device as twin
from fieldcal.twin import physical, schedule
from fieldcal.twin.agreement import ReplayFigures, ReplayResult
from fieldcal.twin.ways import turn_difference

RANDOM = ("random_walk", "angle_setting")
SAMPLES = (
    *("quantisation", "saturation", "stuck", "dropped", "clock_skew", "bump"),
    *("decode_fault", "noise_level", "mounting"),
)
"""Effects that are left out of the replay."""

LINES = ("hum", "sway")

VIBRATED_REPLAYS = 64
"""Replays that are averaged if the device vibrates, since vibration is random."""


def replay_session(
    explanation: Explanation, found: Diagnosis, raw: FittedSet
) -> ReplayResult:
    """Replay a session on the twin and on the devices that it is compared with.

    Parameters
    ----------
    explanation, found : of the session
    raw : fit of bias and scale factor alone to the samples as recorded

    Raises
    ------
    InputError
        If the session's windows overlap, so that no device could go through them.

    """
    known = physical.physical_twin_state(explanation)
    profile = twin.twin_profile(explanation, found, known)
    cases = _replay_cases(explanation, profile, known.state, raw)
    followed = [{t.positions for t in cases[n].turns} for n in ("refitted", "twin")]
    runs = {
        name: _replay(explanation, case.with_turns_between(set.intersection(*followed)))
        for name, case in cases.items()
    }
    held = np.unique(raw.rows.x.position)
    old, new = runs["refitted"].rms ** 2, runs["twin"].rms ** 2
    gain = np.nan_to_num((old - new) / np.where(new > 0, new, np.inf), nan=-1.0)
    return ReplayResult(
        profile,
        runs,
        explanation.prepared.source.about.indices_in_file(held),
        np.array([_time_span(raw.rows, p) for p in held]),
        tuple(e.id for e in profile.effects if e.id in RANDOM),
        int(np.argmax(gain)),
        tuple(cause.name for cause, _ in explanation.best.set.members),
    )


@dataclass(frozen=True, slots=True)
class _ReplayCase:
    """A device to be compared, and its orientations.

    Attributes
    ----------
    device : without random effects
    fitted : rows and their weights
    state : from which the orientations follow
    not_replayed : (n, 6) part of the rows that the replay leaves out
    turns : integrated from the gyroscopes with that state

    """

    device: Profile
    fitted: FittedSet
    state: State
    not_replayed: Array
    turns: tuple[Turn, ...]

    def with_turns_between(self, pairs: Set[tuple[int, int]]) -> _ReplayCase:
        """Keep the turns between some pairs of positions only."""
        return replace(self, turns=tuple(t for t in self.turns if t.positions in pairs))


def _replay_cases(
    explanation: Explanation, profile: Profile, found: State, raw: FittedSet
) -> dict[str, _ReplayCase]:
    """The three devices, by name, with equal weights of their differences."""
    best, nominal = explanation.best, explanation.inferred.fit.nominal
    start = float(explanation.prepared.source.block.t[0])
    effects = twin.effects_of_terms(nominal.terms, start)
    sizes = replace(raw.set.sizes, instability=best.set.sizes.instability)
    raw = replace(raw, set=replace(raw.set, sizes=sizes))
    refitted = physical.state_without_earth_rate(explanation, raw)

    def simulated(state: State) -> _ReplayCase:
        device = twin.device_profile(explanation, state, effects, raw.rows.x.latitude)
        return _replay_case(explanation, device, raw, state, np.zeros(raw.rows.y.shape))

    return {
        "simulation": simulated(nominal),
        "refitted": simulated(refitted),
        "twin": _replay_case(
            explanation, profile, best, found, _outputs_of_no_effect(best)
        ),
    }


def _replay_case(
    explanation: Explanation,
    device: Profile,
    fitted: FittedSet,
    state: State,
    off: Array,
) -> _ReplayCase:
    """A device with its turns, if the diagnosis uses turns."""
    made: tuple[Turn, ...] = ()
    if explanation.inferred.fit.turns is not None:
        source, since = explanation.prepared.source, fitted.dictionary.since
        made = tuple(TurnTracker(source, fitted.rows, since).turns(state))
    return _ReplayCase(_without_random_effects(device), fitted, state, off, made)


def _outputs_of_no_effect(fitted: FittedSet) -> Array:
    """Outputs by random effects and by causes that are no effects, (n, 6)."""
    taken = fitted.values.copy()
    for _, group in fitted.set.members:
        if not group.in_state:
            taken[group.columns] = fitted.estimate[group.columns]
    out: Array = fitted.residual(fitted.values) - fitted.residual(taken)
    return np.nan_to_num(out)


def _without_random_effects(profile: Profile) -> Profile:
    """The device without random effects and effects on samples."""
    kept = (e for e in profile.effects if e.id not in (*RANDOM, *SAMPLES))
    return replace(profile, effects=tuple(kept))


def _replay(explanation: Explanation, case: _ReplayCase) -> ReplayFigures:
    """Replay the session on a device, and compare it with the recording."""
    device, rows, turns = case.device, case.fitted.rows, case.turns
    source = explanation.prepared.source
    start = float(source.block.t[0])
    shaken = bool(device.every(twin.VIBRATION))
    level = twin.vibration_by_position(explanation) * shaken
    windows = schedule.replay_windows(
        explanation, case.state, case.fitted, level, turns
    )
    t = schedule.replay_instants(source.block.t, rows.span, schedule.ROW_SAMPLES, turns)
    plain = [e for e in device.effects if e.id not in LINES]
    blocks = [
        simulate(
            replace(device, effects=tuple(plain)), windows, t - start, None, k, False
        )
        for k in range(VIBRATED_REPLAYS if shaken else 1)
    ]
    block = replace(blocks[0], t=t)
    replayed = np.mean([_means(b, t, rows.span) for b in blocks], axis=0)
    off = np.where(rows.used, rows.y - replayed - case.not_replayed, np.nan)
    total = float(case.fitted.squares_of(off).sum())
    return ReplayFigures(
        _rms_by_triad(rms_over_parts(rows, off)),
        total / max(case.fitted.dof, 1),
        *_by_position(case.fitted, off),
        _line_remainders(explanation, device, windows, rows),
        turn_difference(turns, source.block, block),
    )


def _by_position(fitted: FittedSet, off: Array) -> tuple[Array, Array]:
    """Rms of each window, (p, 2), and its chi squared per mean, (p,)."""
    rows, places, chi2 = fitted.rows, [], []
    for p in np.unique(rows.x.position):
        at: NDArray[np.bool_] = rows.x.position == p
        places.append(
            _rms_by_triad(rms_over_parts(rows, np.where(at[:, None], off, np.nan)))
        )
        count = rows.used[at].sum()
        squares = fitted.squares_of(np.where(at[:, None], off, 0.0)).sum()
        chi2.append(float(squares / count) if count else np.nan)
    return np.array(places), np.array(chi2)


def _line_remainders(
    explanation: Explanation, device: Profile, windows: Sequence[HeldWindow], rows: Rows
) -> Array:
    """Rms of the remainder of each line, (k, 2)."""
    tones, t = explanation.prepared.spectral_lines, explanation.prepared.source.block.t
    if not tones:
        return np.empty((0, 2))
    inside = schedule.replay_instants(t, rows.span, len(t), [])
    block = simulate(device, windows, inside - t[0], noise=False)
    block = replace(block, t=inside)
    return np.array(
        [_line_remainder(explanation, block, rows, tone.hz) for tone in tones]
    )


def _line_remainder(
    explanation: Explanation, replayed: Block, rows: Rows, hz: float
) -> Array:
    """Rms of recording less replay at the frequency of a line, (2,)."""
    checked = explanation.prepared.checked
    squares, count = np.zeros(6), 0
    for p in np.unique(rows.x.position):
        span = rows.span[rows.x.position == p]
        low, high = span[0, 0], span[-1, 1]
        cut = slice(
            *np.searchsorted(checked.block.t, [low, np.nextafter(high, np.inf)])
        )
        same = slice(*np.searchsorted(replayed.t, [low, np.nextafter(high, np.inf)]))
        apart = checked.block[cut].six - replayed[same].six
        apart = np.where(checked.usable[cut], apart, np.nan)
        there = np.isfinite(apart)
        mean = np.nansum(apart, axis=0) / np.maximum(there.sum(axis=0), 1)
        apart = np.where(there, apart - mean, 0.0)
        wave = np.exp(-2j * np.pi * hz * checked.block.t[cut])
        squares += np.abs(2 * (wave @ apart) / len(wave)) ** 2 / 2
        count += 1
    return _rms_by_triad(
        np.where(rows.used.any(axis=0), np.sqrt(squares / count), np.nan)
    )


def _means(block: Block, t: Array, span: Array) -> Array:
    first = np.searchsorted(t, span[:, 0], side="left")
    last = np.searchsorted(t, span[:, 1], side="right")
    six = block.six
    return np.array([six[a:b].mean(axis=0) for a, b in zip(first, last, strict=True)])


def _rms_by_triad(six: Array) -> Array:
    """Root mean squares of the channels, triad by triad, (2,); nan where unknown."""
    out = np.full(2, np.nan)
    for i in (0, 1):
        known = six[3 * i : 3 * i + 3]
        known = known[np.isfinite(known)]
        if len(known):
            out[i] = np.sqrt(np.mean(known**2))
    return out


def _time_span(rows: Rows, position: int) -> tuple[float, float]:
    span = rows.span[rows.x.position == position]
    return float(span[0, 0]), float(span[-1, 1])
