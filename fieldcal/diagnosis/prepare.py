"""Prepares a recording for the diagnosis: checks, removal of lines, reduction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldcal.calibration.gauge import SI
from fieldcal.calibration.plausible import UNREAL
from fieldcal.core.errors import InputError
from fieldcal.core.samples import ACC, CHANNELS, GYR, Block
from fieldcal.diagnosis.signal.chain import (
    CheckedRecording,
    check_chain,
    recheck_without_lines,
    with_undone_smoothing,
)
from fieldcal.diagnosis.signal.line import LineRemainder, SpectralLine
from fieldcal.diagnosis.signal.spectrum import find_lines, subtract_lines
from fieldcal.effects import catalogue
from fieldcal.model import detections, thresholds
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.base_sway import BaseSway, find_base_sway
from fieldcal.model.rows.block_means import masked
from fieldcal.model.rows.hand_tremor import rows_of_recording
from fieldcal.model.rows.reduce import rows_of_means
from fieldcal.model.rows.rest_onset import rest_instants
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.model.state import Term
from fieldcal.physics.effect import Chain, Line, Scatter
from fieldcal.physics.recording import Fault
from fieldcal.session.description import Description
from fieldcal.session.refused_samples import refuse_samples_of_no_imu


@dataclass(frozen=True, slots=True)
class PreparedRecording:
    """A recording, checked, cleaned of lines and reduced to rows.

    Attributes
    ----------
    checked : result of the checks of the signal chain
    source : samples and description, from which the rows were made
    rows : of the windows
    known : effects that the simulation has already
    spectral_lines : lines that were found and subtracted from the samples
    line_remainders : mean squares at the frequency of each line

    """

    checked: CheckedRecording
    source: RowSource
    rows: Rows
    known: tuple[Term, ...]
    spectral_lines: tuple[SpectralLine, ...]
    line_remainders: tuple[LineRemainder, ...]


def prepare_recording(block: Block, about: Description) -> PreparedRecording:
    """Check, clean and reduce a recording.

    Raises
    ------
    InputError
        If no window holds enough samples, accelerations are a direction, or the samples
        are of two devices.

    """
    if about.means_only:
        return _prepared_means(block, about.in_time_order())
    _refuse_empty(block, about)
    refuse_samples_of_no_imu(block, about.windows)
    about = about.in_time_order()
    about.refuse_overlap()
    known = known_terms(about.model)
    checked = check_chain(block, about)
    about = about.with_scaled_angles(checked.angle_factor)
    about = with_undone_smoothing(about, checked.faults)
    checked, source = _checked_source(checked, about)
    rows = rows_of_recording(source)
    _refuse_turning(rows, about)
    _refuse_spinning(rows, about)
    lines = find_lines(source, rows)
    tones = tuple(tone for tone, _ in lines)
    left = tuple(remains for _, remains in lines)
    if tones:
        calm = subtract_lines(source.block, source, rows, tones)
        source = replace(source, block=calm)
        rows = _with_vibration(rows_of_recording(source), rows)
        checked = recheck_without_lines(checked, calm, about)
    if not rows.used.any():
        raise InputError(
            "nothing in the windows can be used: every output is missing, stuck or"
            " clipped there; record them again"
        )
    rows = _without_constant_temperature(rows, source.thermometer)
    return PreparedRecording(checked, source, rows, known, tones, left)


def _checked_source(
    checked: CheckedRecording, about: Description
) -> tuple[CheckedRecording, RowSource]:
    """The samples without a base's swaying, and what is needed to make rows of them."""
    sways = find_base_sway(masked(checked.block, checked.usable), about)
    if sways is not None:
        checked = _without_sway(checked, sways, about)
    rest = rest_instants(checked.block, about, checked.noise)
    warmth = Thermometer.of(checked.block)
    source = RowSource(
        checked.block, about, checked.usable, rest, warmth, checked.clock_pace
    )
    if sways is not None:
        source = replace(
            source, sway_variance=sways.excess_variance, sway_noise=sways.white,
            sway_gravity_sigma=sways.gravity_sigma,
        )  # fmt: skip
    return checked, source


def _without_sway(
    checked: CheckedRecording, sways: BaseSway, about: Description
) -> CheckedRecording:
    """Subtract the swaying of the base; the effect "sway" is added to the faults."""
    size, spread = np.rad2deg(sways.amplitude), np.rad2deg(sways.spread[0])
    fault = Fault(
        channel="gx",
        values={
            "amplitude_deg": float(size),
            "hz": sways.hz,
            "needed_s": sways.needed_seconds,
        },
        sigmas={"amplitude_deg": float(spread), "hz": sways.spread[1]},
        from_s=float(checked.block.t[0]),
        to_s=float(checked.block.t[-1]),
        size=sways.amplitude * 2 * np.pi * sways.hz,
        sigma=float(size / max(spread, 1e-3 * size)),
        channels=CHANNELS,
    )
    block = _where(checked.block, sways.block)
    checked = replace(checked, block=block, faults=(*checked.faults, ("sway", fault)))
    return recheck_without_lines(checked, block, about)


def _where(block: Block, mended: Block) -> Block:
    """The mended samples; the original ones where the mended ones are nan."""
    acc = np.where(np.isfinite(mended.acc), mended.acc, block.acc)
    return replace(
        block, acc=acc, gyr=np.where(np.isfinite(mended.gyr), mended.gyr, block.gyr)
    )


def _prepared_means(block: Block, about: Description) -> PreparedRecording:
    """Prepare a session that has means only: one row each, and no turns."""
    about.refuse_overlap()
    checked = check_chain(block, about)
    warmth = Thermometer.of(block)
    rest = np.full(len(about.positions), -np.inf)
    source = RowSource(block, about, checked.usable, rest, warmth)
    rows = rows_of_means(source, about.mean_sigma)
    if not rows.used.any():
        raise InputError(
            "session.toml says of no position how well its means are known: write"
            " sigma = [ax, ay, az, gx, gy, gz] below each [[position]], m/s^2 and rad/s"
        )
    rows, known = _without_constant_temperature(rows, warmth), known_terms(about.model)
    return PreparedRecording(checked, source, rows, known, (), ())


def _with_vibration(calm: Rows, shaken: Rows) -> Rows:
    """Rows without lines, with the variance of the vibration before subtraction."""
    if len(calm.x) != len(shaken.x):
        return calm
    return replace(calm, x=replace(calm.x, variance=shaken.x.variance))


def _without_constant_temperature(rows: Rows, warmth: Thermometer) -> Rows:
    """Rows with the temperature set to unknown if it did not change."""
    if warmth.changes:
        return rows
    unknown = np.full(len(rows.x), np.nan)
    return replace(rows, x=replace(rows.x, warming=unknown))


def _refuse_empty(block: Block, about: Description) -> None:
    windows = window_bounds(block, about)
    many = windows[:, 1] - windows[:, 0]
    if not (many >= detections.MIN_WINDOW_SAMPLES).any():
        if not about.positions:
            raise InputError(
                f"session.toml has no [[position]], and {len(block)} samples are less"
                f" than the {detections.MIN_WINDOW_SAMPLES} of the shortest window:"
                " record longer, or at a higher rate"
            )
        held, most = len(about.positions), int(many.max(initial=0))
        if most:
            raise InputError(
                f"the longest window in session.toml holds {most} samples, and"
                f" {detections.MIN_WINDOW_SAMPLES} are needed: rest longer, or record"
                " at a higher rate"
            )
        raise InputError(
            f"none of the {held} windows in session.toml holds a sample; these run"
            f" from {block.t[0]:g} to {block.t[-1]:g} s of device time: check start_s"
            " and end_s"
        )
    if not (np.isfinite(block.acc).any() or np.isfinite(block.gyr).any()):
        raise InputError("the samples hold no output of any sensor; record them again")


def _refuse_turning(rows: Rows, about: Description) -> None:
    """Refuse a recording without positions in which the device is turned.

    Without positions the whole recording is one window. The turn must show in the
    gyroscopes as well, if there are any: a step of one output is no turn.
    """
    if about.positions or not rows.used[:, :3].all(axis=1).any():
        return
    acc, gyr = rows.y[:, ACC], np.nan_to_num(rows.y[:, GYR])
    leant = np.linalg.norm(acc - np.nanmedian(acc, axis=0), axis=1) / about.gravity
    rate = gyr - np.median(gyr, axis=0)
    turned = np.abs(np.cumsum(rate * rows.length[:, None], axis=0))
    elsewhere = np.deg2rad(thresholds.NOT_HELD_DEG)
    if np.nanmax(leant) > elsewhere and (turned.max() > elsewhere or not gyr.any()):
        raise InputError(
            "the device is turned in this recording, and session.toml has no"
            " [[position]]: write down when it was held, or let fieldcal import find"
            " the still stretches"
        )


def _refuse_spinning(rows: Rows, about: Description) -> None:
    """Refuse a recording without positions with rates that no gyroscope at rest has.

    A table about the vertical turns the device and no accelerometer shows it.
    """
    unsized = about.gauge.units[1] != SI[1] and about.gauge.size[1] == 1
    if about.positions or unsized:
        return
    usual, scale = about.nominal["gyr_bias"], about.nominal["gyr_scale"]
    rates = np.where(rows.used[:, GYR], np.abs((rows.y[:, GYR] - usual) / scale), 0.0)
    if (fastest := float(rates.max(initial=0.0))) > UNREAL["gyr_bias"]:
        raise InputError(
            f"the gyroscopes read {np.rad2deg(fastest):.3g} deg/s for a second, which"
            " no bias is, and session.toml has no [[position]]: write down when the"
            " device rested, with speed_deg_s where a rate table turned it; or import"
            " it again with --gyr-unit, if their unit is another"
        )


def known_terms(model: Mapping[str, Mapping[str, Any]]) -> tuple[Term, ...]:
    """Effects that [model] gives the simulation, with their values fixed.

    Raises
    ------
    InputError
        If an id is not in the catalogue, or a parameter not the effect's.

    """
    out = []
    for name, table in model.items():
        if (effect := catalogue().get(name)) is None:
            raise InputError(f"[model] effects: {name!r} is no effect in the catalogue")
        wrong = [key for key in table if key not in effect.names]
        if wrong:
            raise InputError(
                f"[model.{name}] {wrong[0]} is no parameter of it; it has"
                f" {', '.join(effect.names) or 'none'}"
            )
        if isinstance(effect, Chain | Line | Scatter):
            continue
        values = np.array([_number(name, table, p.name) for p in effect.params])
        missing = [s.name for s in effect.shapes if s.name not in table]
        if missing:
            raise InputError(f"[model.{name}] needs {missing[0]} as well")
        shape = {s.name: _number(name, table, s.name) for s in effect.shapes}
        out.append(Term(effect, values, shape))
    return tuple(out)


def _number(name: str, table: Mapping[str, Any], key: str) -> float:
    value = table.get(key, 0.0)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"[model.{name}] {key} = {value!r} is not a number; mend it")
    return float(value)
