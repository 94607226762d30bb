"""From a session's windows to what the estimators are given.

A window that somebody else marked may hold a disturbance. Then the longest calm part of
it is used, and that is said; a window with no calm part, or with no samples, is left
out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal import __version__
from fieldcal.calibration import Calibration, Nominal
from fieldcal.calibration.gauge import SI
from fieldcal.description import Description
from fieldcal.errors import FieldcalError, Moved, SessionError
from fieldcal.samples import Array, Block, Grain
from fieldcal.session import Session
from fieldcal.solve.observations import Observations
from fieldcal.solve.turntable import going_round
from fieldcal.windows import Average, Noise, Window, average

SHORTEST = 5.0
"""Shortest calm part of a disturbed window that is worth using, s."""


def observations(
    about: Description, averages: Sequence[Average], rows: Sequence[int] | None = None
) -> Observations:
    """Averages with what is known of the positions they were taken in.

    Parameters
    ----------
    about : device, site, frame and positions
    averages : one for each position, or for those numbered in `rows`
    rows : numbers of the positions, all by default

    """
    numbers = range(len(about.positions)) if rows is None else rows
    return Observations.of(
        [about.positions[i] for i in numbers],
        averages,
        about.gravity,
        latitude=about.latitude,
        mounting=about.mounting,
        grade="navigation" if about.grade == "navigation" else "tactical",
        nominal=Nominal(**{k: tuple(v.tolist()) for k, v in about.nominal.items()}),
    )


def with_provenance(calibration: Calibration, about: Description) -> Calibration:
    """The calibration with the device it belongs to and the software that made it."""
    origin = {"device": dict(about.device), "software": f"fieldcal {__version__}"}
    if not about.gauge.plain:
        origin["gauge"] = about.gauge.table()
    return replace(calibration, info={**calibration.info, **origin})


def observe(session: Session) -> tuple[Observations, tuple[str, ...]]:
    """Average the windows of a recorded session; warnings name what was left out.

    Raises
    ------
    SessionError
        If it has no position, or no window of any position can be used.

    """
    found = rests(session)
    return observations(session.about, found.averages, found.rows), found.warnings


@dataclass(frozen=True, slots=True)
class Rests:
    """The windows of a session that can be used.

    Attributes
    ----------
    rows : number of each one's position
    averages : of each
    warnings : what was left out, and why

    """

    rows: tuple[int, ...]
    averages: tuple[Average, ...]
    warnings: tuple[str, ...]

    def at_rest(self, session: Session) -> Rests:
        """Return those in which no table turned."""
        held = [
            i
            for i, row in enumerate(self.rows)
            if not table_rate(session.about, row).any()
        ]
        return replace(
            self,
            rows=tuple(self.rows[i] for i in held),
            averages=tuple(self.averages[i] for i in held),
        )


def rests(session: Session) -> Rests:
    """Average the windows of a recorded session.

    Raises
    ------
    SessionError
        If it has no position, or no window of any position can be used.

    """
    if not session.positions:
        raise SessionError(
            f"{session.folder}: session.toml has no [[position]]: write down when each"
            " position was held, or let fieldcal import find the still stretches"
        )
    block = session.block
    rows, averages, warnings = [], [], list(session.warnings)
    noise: Noise | None = None
    grain = grain_of(session)
    for i, window in enumerate(session.windows):
        rate = table_rate(session.about, i)
        try:
            if rate.any():
                found, said = _on_a_table(block, window, rate, grain)
            else:
                found, noise, said = _take(block, window, noise, grain)
        except FieldcalError as error:
            warnings.append(f"position {i + 1} is left out: {error}")
            continue
        rows.append(i)
        averages.append(found)
        if said:
            warnings.append(f"position {i + 1}: {said}")
    if not rows:
        raise SessionError(
            f"{session.folder}: no window can be used; {warnings[-1]}"
            f"{_worth(session.about)}"
        )
    return Rests(tuple(rows), tuple(averages), tuple(warnings))


def _worth(about: Description) -> str:
    """What to do where nobody said what a count is worth."""
    missing = [
        f"{group} (how many {unit} in one {si})"
        for group, unit, si, size in zip(
            ("acc_scale", "gyr_scale"), about.gauge.units, SI, about.gauge.size,
            strict=True,
        )
        if unit != si and size == 1
    ]  # fmt: skip
    if not missing:
        return ""
    return f"; session.toml must say in [nominal] {' and '.join(missing)}"


def with_turns_between(
    calibration: Calibration, session: Session, still: Rests, wanted: bool = False
) -> Calibration:
    """Add what the turns between the windows say about the gyroscopes.

    Parameters
    ----------
    calibration : from the windows
    session : the recording
    still : its windows
    wanted : add it however uncertain; otherwise only where it is worth having

    """
    from fieldcal.solve import turns

    still = still.at_rest(session)
    if not still.rows:
        return calibration
    seen = observations(session.about, still.averages, still.rows)
    if not seen.has_gyr:
        return calibration
    if wanted:
        found = turns.turns(session.block, still.averages, calibration, seen.nominal)
        return turns.with_turns(calibration, found)
    if "gyr_scale" in calibration.groups:
        return calibration
    return turns.offered(calibration, session.block, still.averages, seen.nominal)


def grain_of(session: Session) -> Grain:
    """What the device said that it rounds to, when it was recorded."""
    marks = [mark for mark in session.marks() if mark.get("event") == "grain"]
    if not marks:
        return Grain()
    said = marks[-1]
    return Grain(float(said["acc"]), float(said["gyr"]), bool(said["cut"]))


def _take(
    block: Block,
    span: tuple[float, float] | None,
    noise: Noise | None,
    grain: Grain,
) -> tuple[Average, Noise | None, str]:
    """Average of a window, what it taught about the noise, and what must be said."""
    if span is None:
        raise SessionError("its window was not taken before the recording ended")
    part = block.between(*span)
    if len(part) < 2:
        raise SessionError(
            f"no samples lie between {span[0]:g} and {span[1]:g} s; the recording"
            f" spans {block.t[0]:g} to {block.t[-1]:g} s"
        )
    window = Window(noise=noise, grain=grain)
    window.add(part)
    try:
        return window.average(), window.noise and window.noise.spectrum, ""
    except Moved as moved:
        calm = _calm(part, moved, noise, grain)
        if calm is None:
            raise
        said = f"{moved}; only the calm part from {calm.start:.1f} to {calm.end:.1f} s"
        return calm, noise, f"{said} is used"


def table_rate(about: Description, row: int) -> Array:
    """Rate of the table in a position by its number, in device axes, (3,) rad/s."""
    rate = np.array(about.positions[row].rate or (0.0, 0.0, 0.0))
    turned: Array = rate @ about.mounting
    return turned


def steadied(block: Block, rate: Array) -> tuple[Block, Array]:
    """A window without what goes round with a rate table, and what that leaves open.

    Gravity goes round, so nothing is asked of the accelerometers; what of the Earth's
    rate goes round is taken out. The covariance (3, 3) is that of the gyroscopes' mean.

    Parameters
    ----------
    block : samples of one window
    rate : (3,) of the table in device axes, rad/s

    """
    blind = replace(block, acc=np.full_like(block.acc, np.nan))
    if len(block) < 2 or not np.isfinite(block.gyr).any(axis=0).all():
        return blind, np.zeros((3, 3))
    noise = np.nanstd(np.diff(block.gyr, axis=0), axis=0) / np.sqrt(2)
    sd = np.broadcast_to(np.where(noise > 0, noise, np.nan), block.gyr.shape)
    found = going_round(block.t, rate, block.gyr, sd, np.ones(3), 0.0)
    return replace(blind, gyr=block.gyr - found.values), found.covariance


def _on_a_table(
    block: Block, span: tuple[float, float] | None, rate: Array, grain: Grain
) -> tuple[Average, str]:
    """Average while a table turns at some rate, (3,) rad/s in device axes."""
    if span is not None:
        block, left = steadied(block.between(*span), rate)
    one, _, said = _take(block, span, None, grain)
    covariance = one.covariance.copy()
    covariance[3:, 3:] += left
    return replace(one, covariance=covariance), said


def _calm(
    block: Block, moved: Moved, noise: Noise | None, grain: Grain
) -> Average | None:
    """Average of the longest calm part, None if there is none worth it."""
    sides = [
        block.between(-float("inf"), moved.at),
        block.between(moved.at, float("inf")),
    ]
    best: Average | None = None
    for side in sorted(sides, key=len, reverse=True):
        length = float(side.t[-1] - side.t[0]) if len(side) > 1 else 0.0
        if length < SHORTEST or (best and length <= best.end - best.start):
            continue
        try:
            found: Average | None = average(side, noise=noise, grain=grain)
        except Moved as again:
            inside = side.t[0] < again.at < side.t[-1]
            # a disturbance lasts: what follows its first instant is disturbed as well
            shifted = again.at if inside else side.t[0] + 1.0
            found = _calm(side, Moved(str(again), shifted, again.axis), noise, grain)
        if found and (best is None or found.end - found.start > best.end - best.start):
            best = found
    return best
