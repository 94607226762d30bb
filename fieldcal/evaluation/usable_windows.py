"""Windows of a session that can be used, with their averages.

A window without samples or without a calm part is left out. A sensor with an axis that
never changes is left out of all windows. Warnings name both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.calibration.gauge import SI
from fieldcal.core.errors import FieldcalError, InputError, SessionError
from fieldcal.core.samples import ACC, CHANNELS, GYR, Block, Grain
from fieldcal.core.sentences import join_words
from fieldcal.evaluation.window_mean import (
    average_turntable_window,
    average_window,
    table_rate,
)
from fieldcal.model.rows.base_sway import find_base_sway
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.physics.grid_stretches import (
    grids_by_stretch,
    windows_on_one_grid,
)
from fieldcal.physics.recording import Grids
from fieldcal.session.description import Description
from fieldcal.session.folder import Session
from fieldcal.session.refused_samples import refuse_samples_of_no_imu
from fieldcal.windows import Average, LearnedNoise
from fieldcal.windows.dead_axis import DeadSensor, dead_sensors, without_dead_axes
from fieldcal.windows.high_pass import decay_time_constant
from fieldcal.windows.noise import converter_noise

RANGE_TOLERANCE = 1e-6
"""Tolerance of a full scale for rounding and conversion of units, as a share of it."""


@dataclass(frozen=True, slots=True)
class UsableWindows:
    """Usable windows of a session.

    Attributes
    ----------
    position_numbers : number of the position of each window, from 0
    averages : average of each window
    warnings : what was left out, and why

    """

    position_numbers: tuple[int, ...]
    averages: tuple[Average, ...]
    warnings: tuple[str, ...]

    def at_rest(self, session: Session) -> UsableWindows:
        """Return the windows in which no rate table turned."""
        held = [
            i
            for i, row in enumerate(self.position_numbers)
            if not session.about.positions[row].on_turning_table
        ]
        return replace(
            self,
            position_numbers=tuple(self.position_numbers[i] for i in held),
            averages=tuple(self.averages[i] for i in held),
        )


def usable_windows(session: Session) -> UsableWindows:
    """Average the windows of a recorded session.

    Raises
    ------
    SessionError
        If it has no position, or no window of any position can be used.
    InputError
        If windows overlap, a channel is another's copy, accelerations are a direction
        or behind a high-pass filter, or samples are of two devices.

    """
    if not session.positions:
        raise SessionError(
            f"{session.folder}: session.toml has no [[position]]: write down when each"
            " position was held, or let fieldcal import find the still stretches"
        )
    session.about.refuse_overlap()
    if session.about.means_only:
        return _windows_of_means(session)
    refuse_samples_of_no_imu(session.block, session.about.windows)
    if tau := decay_time_constant(session.block, session.about.windows):
        raise InputError(
            f"{session.folder}: what the accelerometers read at rest decays toward 0,"
            f" with a time constant of {tau:.3g} s: they are behind a high-pass filter;"
            " switch it off, and record again"
        )
    dead = dead_sensors(session.block.acc, session.block.gyr)
    own: list[str] = []
    living = without_dead_axes(session.block, dead)
    taken = _average_windows(session, living, own)
    if not taken:
        raise SessionError(
            f"{session.folder}: {_all_of(session.positions)} can be used; {own[-1]}"
            f"{_missing_unit_hint(session.about)}"
        )
    warnings = [*session.warnings, *own]
    rows = sorted(taken)
    return _windows_without(dead, rows, [taken[i] for i in rows], warnings)


def _all_of(positions: Sequence[object]) -> str:
    many = len(positions) > 1
    return f"none of the {len(positions)} windows" if many else "no window"


def _windows_without(
    dead: Sequence[DeadSensor],
    rows: Sequence[int],
    averages: Sequence[Average],
    warnings: Sequence[str],
) -> UsableWindows:
    """The windows with nan for the sensors `dead`, and their messages as warnings."""
    for sensor in dead:
        averages = [_without_sensor(average, sensor.channels) for average in averages]
    return UsableWindows(
        tuple(rows), tuple(averages), (*warnings, *(sensor.message for sensor in dead))
    )


def _average_windows(
    session: Session, block: Block, warnings: list[str]
) -> dict[int, Average]:
    """Averages by position number; appends sentences about windows to `warnings`."""
    grids = grids_by_stretch(session.block)
    about, remarks = _cut_where_grids_change(session, grids)
    grains = _rounding_grains(session, grids, window_bounds(block, about))
    warnings += (*_range_warnings(session), *remarks)
    sways = find_base_sway(block, about)
    if sways is not None:
        block = sways.block
        warnings.append(sways.sentence)
    taken: dict[int, Average] = {}
    least = converter_noise(block)
    noise: LearnedNoise | None = None
    held = about.in_time_order()
    # each window provides the noise for the next
    for i, window in zip(held.position_numbers, held.windows, strict=True):
        try:
            if about.positions[i].on_turning_table:
                rate = table_rate(block, window, about, i)
                found, remark = average_turntable_window(block, window, rate, grains[i])
            else:
                found, noise, remark = average_window(block, window, noise, grains[i])
        except FieldcalError as error:
            warnings.append(f"{_position_label(session, i)} is left out: {error}")
            continue
        if sways is not None:
            by_sway = np.diag(sways.excess_variance[i])
            found = replace(found, covariance=found.covariance + by_sway)
        taken[i] = found.no_better_than(least)
        if remark:
            warnings.append(f"{_position_label(session, i)}: {remark}")
    incomplete = _incomplete(taken, about)
    for i, missing in incomplete.items():
        del taken[i]
        warnings.append(
            f"{_position_label(session, i)} is left out: its window has no"
            f" {join_words(missing)}, which others have; take it again"
        )
    if incomplete and not taken:
        lacking = dict.fromkeys(map(join_words, incomplete.values()))
        warnings.append(
            f"each lacks a channel that another has ({' or '.join(lacking)}): record"
            " all channels together"
        )
    return taken


def _cut_where_grids_change(
    session: Session, grids: Grids
) -> tuple[Description, list[str]]:
    """The windows, each on one grid, and sentences about those that were cut."""
    about, t = session.about, session.block.t
    whole = window_bounds(session.block, about)
    kept = windows_on_one_grid(session.block, grids, whole)
    windows, said = list(about.windows), []
    for i in np.flatnonzero((kept != whole).any(axis=1)).tolist():
        start, end = t[kept[i, 0]], t[kept[i, 1] - 1]
        windows[i] = float(start), float(np.nextafter(end, np.inf))
        said.append(
            f"{_position_label(session, i)}: the resolution of the outputs changes"
            f" within it; its mean is that of the part from {start:.1f} to {end:.1f} s:"
            " record with one range and one number format"
        )
    return replace(about, windows=tuple(windows)), said


def _incomplete(
    taken: Mapping[int, Average], about: Description
) -> dict[int, list[str]]:
    """Channels that windows lack and others have, by position number.

    Accelerometers are not used while a rate table turns.
    """
    turning = {i for i in taken if about.positions[i].on_turning_table}
    wanted = np.array([[*[i not in turning] * 3, *[True] * 3] for i in taken], bool)
    known = np.array([np.isfinite(a.mean) for a in taken.values()], bool)
    lacking = wanted & ~known & (known & wanted).any(axis=0)
    named = [[CHANNELS[c] for c in np.flatnonzero(row)] for row in lacking]
    return {i: names for i, names in zip(taken, named, strict=True) if names}


def _windows_of_means(session: Session) -> UsableWindows:
    """Return the windows of a session that consists of means only.

    Raises
    ------
    SessionError
        If no mean lies in any window.

    """
    block, sigma = session.block, session.about.mean_sigma
    rows, averages = [], []
    for i, window in enumerate(session.windows):
        part = block.between(*window) if window else block[:0]
        if not len(part):
            continue
        mean = part.six.mean(axis=0)
        mean[~np.isfinite(sigma[i])] = np.nan
        warmth = float(part.temperature.mean())
        instant = float(part.t[0])
        covariance = np.diag(sigma[i] ** 2)
        averages.append(Average(mean, covariance, warmth, len(part), instant, instant))
        rows.append(i)
    if not rows:
        raise SessionError(
            f"{session.folder}: no mean lies in a window of session.toml: give each"
            " [[position]] a start_s and end_s about its mean"
        )
    means = np.array([average.mean for average in averages])
    dead = dead_sensors(means[:, ACC], means[:, GYR])
    return _windows_without(dead, rows, averages, session.warnings)


def _range_warnings(session: Session) -> list[str]:
    """Sentences about samples beyond the full scale stated in session.toml."""
    said = []
    triads = {"acceleration": session.block.acc, "angular_rate": session.block.gyr}
    for (kind, values), si in zip(triads.items(), SI, strict=True):
        limit = session.about.limits.get(kind, np.inf)
        most = float(np.nanmax(np.abs(values), initial=0.0))
        if most > limit * (1 + RANGE_TOLERANCE):
            said.append(
                f"samples reach {most:.4g} {si}, beyond [range] {kind} ="
                f" {limit:.4g} {si}: range or unit in session.toml is another"
            )
    return said


def _position_label(session: Session, row: int) -> str:
    """A position by its number, from 1, and by its name if it has one."""
    number, name = f"position {row + 1}", session.positions[row].name
    return number if name == number else f"{number} ({name})"


def _without_sensor(average: Average, channels: slice) -> Average:
    mean, covariance = average.mean.copy(), average.covariance.copy()
    mean[channels] = covariance[channels, :] = covariance[:, channels] = np.nan
    return replace(average, mean=mean, covariance=covariance)


def _missing_unit_hint(about: Description) -> str:
    """Remedy, as part of a sentence, if the unit of a count is not stated."""
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


def _rounding_grains(
    session: Session, grids: Grids, bounds: NDArray[np.intp]
) -> list[Grain]:
    """Rounding in each window, as the device reported or as the recording shows it.

    The latter only if an output repeats one value throughout a window, which then does
    not show its noise and its step. `bounds` (p, 2) are the samples of the windows.
    """
    reported = reported_grain(session)
    if reported.step.all():
        return [reported] * len(bounds)
    constant, out = _constant(session), []
    for first, last in bounds.tolist():
        steps = np.where(constant, grids.within(first, last), 0.0)
        acc, gyr = float(steps[ACC].max()), float(steps[GYR].max())
        out.append(Grain(reported.acc or acc, reported.gyr or gyr, reported.cut))
    return out


def _constant(session: Session) -> NDArray[np.bool_]:
    """Outputs that repeat one value throughout some window, (6,)."""
    found = np.zeros(6, dtype=bool)
    for window in filter(None, session.about.windows):
        held = session.block.between(*window)
        if len(held):
            low, high = held.six.min(axis=0), held.six.max(axis=0)
            found |= low == high
    return found


def reported_grain(session: Session) -> Grain:
    """Rounding that the device reported during the recording."""
    marks = [mark for mark in session.marks() if mark.get("event") == "grain"]
    if not marks:
        return Grain()
    mark = marks[-1]
    return Grain(float(mark["acc"]), float(mark["gyr"]), bool(mark["cut"]))
