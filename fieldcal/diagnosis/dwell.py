"""When the device came to rest in each position.

Between two windows it is turned; the last sign of motion, in the gyroscopes or, without
them, in the accelerometers, is the arrival. What settles after a turn may count from
there or from some fixed time before the window (the fixture clamped, the operator's
hands off); which of them, the samples before the window tell.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.description import Description
from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.reduce import Rows, Source, averaged, rate_of, spans
from fieldcal.samples import Array, Block

ARRIVAL_S = 0.3
"""Standard uncertainty of the instant at which a turn by hand ends."""

PIECE_S = 0.2
MOVING = 7.0
"""Departure of a short mean from the window's that is motion, in standard errors."""

RATE, FORCE = 2e-3, 0.05
"""Departures that are no motion whatever the noise, rad/s and m/s^2."""

BETTER = 8.0
"""Odds (ln) for a fixed lead over the end of motion."""

LEADS, FINE = 25, 21


def arrivals(block: Block, about: Description, noise: Array) -> Array:
    """Instant from which the device was at rest in each position, (p,) s."""
    windows = spans(block, about)
    m = max(2, round(PIECE_S * rate_of(block)))
    out = np.full(len(windows), block.t[0])
    before = 0
    for p, (first, last) in enumerate(windows):
        if last > first >= before:
            held = np.concatenate(
                [triad[first:last].mean(axis=0) for triad in (block.acc, block.gyr)]
            )
            moved = _moved(block[before:first].six, held, noise, m)
            out[p] = block.t[before + moved if before else 0]
            before = int(last)
    return out


def _moved(gap: Array, held: Array, noise: Array, m: int) -> int:
    """Samples of a gap up to the last sign of motion; `held` is the window's mean."""
    whole = len(gap) // m
    if not whole:
        return len(gap)
    start = len(gap) - whole * m
    mean = gap[start:].reshape(whole, m, 6).mean(axis=1)
    limit = np.maximum(MOVING * noise / np.sqrt(m), [FORCE] * 3 + [RATE] * 3)
    moving = np.abs(mean - held) > limit
    rated = bool(np.isfinite(mean[:, 3:]).all())
    at = np.flatnonzero((moving[:, 3:] if rated else moving[:, :3]).any(axis=1))
    return start + (int(at[-1]) + 1) * m if len(at) else 0


def clamped(source: Source, bench: Bench, fit: Fit) -> Array:
    """Instants from which what settles counts, (p,) s: see above.

    `fit` has the settling in it, counted from the ends of the motion.
    """
    still = _dwelling(source, bench.rows.noise)
    if still is None:
        return source.arrived
    # where orientations are not known, it is that of the window that counts
    x = bench.rows.x
    first = np.searchsorted(x.position, np.minimum(still.x.position, x.position[-1]))
    still = replace(still, x=replace(still.x, f=x.f[first]))
    starts = beginnings(source)
    turned = np.isfinite(source.arrived)
    longest = float(np.max((starts - source.arrived)[turned], initial=0.0))
    plain = _squares(bench, fit, still, source.arrived)
    leads, step = np.linspace(0.0, longest, LEADS), longest / (LEADS - 1)
    for _ in range(2):
        tried = [
            np.where(turned, np.maximum(source.arrived, starts - lead), -np.inf)
            for lead in leads
        ]
        squares = [_squares(bench, fit, still, arrived) for arrived in tried]
        best = int(np.argmin(squares))
        leads = leads[best] + np.linspace(-step, step, FINE)
    better = squares[best] < plain - 2 * BETTER
    return tried[best] if better else source.arrived


def beginnings(source: Source) -> Array:
    """Where each window begins, (p,) s; a position without one has its arrival."""
    windows = source.about.windows
    given = [np.nan if w is None else w[0] for w in windows] or [source.block.t[0]]
    return np.where(np.isnan(given), source.arrived, given)


def _dwelling(source: Source, noise: Array) -> Rows | None:
    """Rows before the windows in which the device is in position already."""
    block = source.block
    m = max(2, round(PIECE_S * rate_of(block)))
    bounds, position = [], []
    for p, (first, last) in enumerate(spans(block, source.about)):
        start = int(np.searchsorted(block.t, source.arrived[p]))
        if not np.isfinite(source.arrived[p]):
            continue
        at = np.arange(start, first - m + 1, m)
        if last > first:
            bounds += [(a, a + m) for a in at]
            position += [p] * len(at)
    if not bounds:
        return None
    level = np.broadcast_to(noise, (len(bounds), 6))
    shaken = level[:, :3] ** 2
    return averaged(source, np.array(bounds), np.array(position), level, noise, shaken)


def _squares(bench: Bench, fit: Fit, still: Rows, arrived: Array) -> float:
    """Squares of windows and of the time before them, settling from `arrived` on."""
    rows = bench.rows
    since = rows.x.t - arrived[rows.x.position]
    refit = bench.but(rows=replace(rows, x=replace(rows.x, since_turn=since)))
    there = refit.fit(fit.terms, fit)
    since = still.x.t - arrived[still.x.position]
    since = np.where(since >= 0, since, np.inf)
    rest = still.y - there.state.predict(replace(still.x, since_turn=since))
    return there.chi2 + float(np.nansum((rest / still.sd) ** 2))
