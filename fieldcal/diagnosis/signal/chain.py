"""Faults of the signal chain, which must be treated before any physics is fitted.

Some are corrected (axes, units, bytes), some samples are left out (stuck, clipped,
bumped), and other faults are only reported (lost samples, the clock, coarse steps).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.positions import alpha_beta_angles, gamma_angles
from fieldcal.core.samples import CHANNELS, Array, Block, Index, Mask
from fieldcal.core.sampling import sampling_rate
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.model.causes.smoothing_left import SMOOTHING
from fieldcal.model.rows.block_means import masked
from fieldcal.model.rows.orientation import gyro_readings
from fieldcal.model.rows.reduce import median_sigma
from fieldcal.model.rows.vibration import quiet_window_noise
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.physics.effect import Chain
from fieldcal.physics.experience import Experience
from fieldcal.physics.grid_stretches import (
    grids_by_stretch,
    windows_on_one_grid,
)
from fieldcal.physics.recording import CheckedSamples, Fault, grids_of
from fieldcal.session.description import Description
from fieldcal.windows.dead_axis import dead_sensors
from fieldcal.windows.noise import ChannelNoise


@dataclass(frozen=True, slots=True)
class CheckedRecording:
    """A recording after the checks of its signal chain.

    Attributes
    ----------
    block : corrected samples
    usable : (n, 6) whether a sample can be used
    faults : faults found, each with the id of its effect
    noise : (6,) standard deviation of one usable sample in the windows
    unused : sentences about sensors with an axis without a signal

    """

    block: Block
    usable: Mask
    faults: tuple[tuple[str, Fault], ...]
    noise: Array
    unused: tuple[str, ...] = ()

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of the effects found, each once."""
        return tuple(dict.fromkeys(i for i, fault in self.faults if fault.values))

    @property
    def angle_factor(self) -> float:
        """Factor by which the stated angles must be multiplied."""
        return float(np.prod([fault.angles for _, fault in self.faults]))

    @property
    def clock_pace(self) -> float:
        """Seconds of the device's clock per true second."""
        skews = [f.values["ppm"] for i, f in self.faults if i == "clock_skew"]
        return 1 + 1e-6 * float(skews[0]) if skews else 1.0


def check_chain(block: Block, about: Description) -> CheckedRecording:
    """Look for every fault of the signal chain, and correct or leave out samples.

    A session of means only cannot be checked: its rows are different positions.
    """
    usable = np.hstack([np.isfinite(block.acc), np.isfinite(block.gyr)])
    dead = dead_sensors(block.acc, block.gyr)
    if about.means_only:
        return CheckedRecording(block, usable, (), median_sigma(about.mean_sigma))
    faults: list[tuple[str, Fault]] = []
    for sensor in dead:
        # a sensor without any signal is not reported as stuck as well
        usable[:, sensor.channels] &= not sensor.absent
    block, samples = _correct(block, usable, about, faults)
    samples = _on_one_grid_each(samples, usable, about)
    for name in _ids_by_treatment("mask"):
        before = len(faults)
        new_faults = _find(name, samples)
        for fault in _off_rails(new_faults, samples) if name == "stuck" else new_faults:
            if name == "saturation" and _is_stuck(fault, faults):
                continue
            faults.append((name, fault))
            _mark_unusable(name, fault, usable, samples.windows)
        if len(faults) > before:
            samples = samples_to_check(block, usable, about)
    for sensor in dead:
        usable[:, sensor.channels] = False
    if dead:
        samples = samples_to_check(block, usable, about)
    for name in _ids_by_treatment("note"):
        faults += [(name, fault) for fault in _find(name, samples)]
    unused = tuple(sensor.message for sensor in dead)
    return CheckedRecording(
        block, usable, tuple(_without_rail_runs(faults)), samples.noise, unused
    )


def _correct(
    block: Block,
    usable: Mask,
    about: Description,
    faults: list[tuple[str, Fault]],
    described: bool = False,
) -> tuple[Block, CheckedSamples]:
    """Correct the faults that can be undone; they are appended to `faults`.

    If `described`, those of session.toml are left as they are.
    """
    samples = samples_to_check(block, usable, about)
    for name in _ids_by_treatment("mend"):
        if described and _chain_effect(name).misread:
            continue
        for fault in _find(name, samples):
            faults.append((name, fault))
            if fault.mended is not None:
                six = _mend_samples(block, fault)
                block = block.with_six(six)
                samples = samples_to_check(block, usable, about)
    return block, samples


def _on_one_grid_each(
    samples: CheckedSamples, usable: Mask, about: Description
) -> CheckedSamples:
    """The samples without the part of a window that lies on another grid."""
    if not samples.grids.changed.any():
        return samples
    block, windows = samples.block, samples.windows
    for whole, kept in zip(
        windows, windows_on_one_grid(block, samples.grids, windows), strict=True
    ):
        usable[whole[0] : kept[0]] = usable[kept[1] : whole[1]] = False
    return samples_to_check(block, usable, about)


def repair_samples(
    block: Block, about: Description
) -> tuple[Block, list[tuple[str, Fault]]]:
    """Undo what was done to the samples of a device that session.toml describes.

    Returns them, and the faults that were undone with the ids of their effects.
    """
    faults: list[tuple[str, Fault]] = []
    if about.means_only:
        return block, faults
    usable = np.isfinite(block.six)
    block, _ = _correct(block, usable, about, faults, described=True)
    return block, [(name, fault) for name, fault in faults if fault.mended is not None]


def with_undone_smoothing(
    about: Description, faults: Iterable[tuple[str, Fault]]
) -> Description:
    """The description with what is known of a smoothing that was undone."""
    fault = next((found for name, found in faults if name == SMOOTHING), None)
    if fault is None:
        return about
    by_sensor = [
        [float(known.get(part, 0.0)) for part in ("acc", "gyr")]
        for known in (fault.values, fault.sigmas)
    ]
    return replace(about, smoothing=np.array(by_sensor))


def recheck_without_lines(
    checked: CheckedRecording, block: Block, about: Description
) -> CheckedRecording:
    """Repeat the check of the noise level, which lines in the spectrum can mislead."""
    faults = [(n, f) for n, f in checked.faults if n != "noise_level"]
    samples = samples_to_check(block, checked.usable, about)
    faults += [("noise_level", f) for f in _find("noise_level", samples)]
    return replace(checked, faults=tuple(faults))


def _ids_by_treatment(treatment: str) -> list[str]:
    """Ids of the effects on samples with one treatment, in their order."""
    chain = [e for e in catalogue().values() if isinstance(e, Chain)]
    treated = [e for e in chain if e.treatment == treatment]
    return [e.id for e in sorted(treated, key=lambda e: (e.place, e.id))]


def _find(name: str, samples: CheckedSamples) -> list[Fault]:
    return _chain_effect(name).find(samples)


def _chain_effect(name: str) -> Chain:
    effect = catalogue()[name]
    if not isinstance(effect, Chain):
        raise TypeError(f"{name} is no effect on samples")
    return effect


def _mend_samples(block: Block, fault: Fault) -> Array:
    if fault.mended is None:
        return block.six
    if "channel" not in fault.values:
        return fault.mended
    six, c = block.six, CHANNELS.index(fault.channel)
    six[:, c] = fault.mended[:, c]
    return six


def _mark_unusable(name: str, fault: Fault, usable: Mask, windows: Index) -> None:
    if name == "bump":
        usable[fault.rows] = False
        return
    c = CHANNELS.index(fault.channel)
    usable[fault.rows, c] = False
    if name == "saturation":
        for first, last in windows:
            inside = (fault.rows >= first) & (fault.rows < last)
            if inside.sum() > thresholds.MAX_CLIPPED_SHARE * (last - first):
                usable[first:last, c] = False


def _off_rails(faults: list[Fault], samples: CheckedSamples) -> list[Fault]:
    """Runs of equal values without those at a limit to which a channel returns.

    A stuck channel stops once and anywhere; a clipped one always stops at its limit.
    """
    if not faults:
        return faults
    rails = {f.channel: f.rows for f in _find("saturation", samples)}
    clipped = [bool(np.isin(f.rows, rails.get(f.channel, ())).all()) for f in faults]
    often = Counter(f.channel for f, c in zip(faults, clipped, strict=True) if c)
    pairs = zip(faults, clipped, strict=True)
    return [f for f, c in pairs if not (c and often[f.channel] > 1)]


def _is_stuck(fault: Fault, faults: list[tuple[str, Fault]]) -> bool:
    return any(n == "stuck" and f.channel == fault.channel for n, f in faults)


def _without_rail_runs(faults: list[tuple[str, Fault]]) -> list[tuple[str, Fault]]:
    """Leave out runs of equal values that are the limit of a clipped channel."""
    clipped = {
        f.channel: {int(r) for r in f.rows} for n, f in faults if n == "saturation"
    }
    return [
        (n, f)
        for n, f in faults
        if not (
            n == "stuck" and clipped.get(f.channel, set()) >= {int(r) for r in f.rows}
        )
    ]


def samples_to_check(block: Block, usable: Mask, about: Description) -> CheckedSamples:
    """Samples and facts that the checks are given."""
    windows, rate = window_bounds(block, about), sampling_rate(block)
    block, held = masked(block, usable), windows[windows[:, 1] > windows[:, 0]]
    unknown = np.full(6, np.nan)
    noise = ChannelNoise(unknown, unknown)
    if len(held):
        noise = quiet_window_noise(block, held, rate)
    if about.positions:
        alpha, beta = alpha_beta_angles(about.positions)
        gamma = gamma_angles(about.positions)
    else:
        alpha = beta = np.array([np.nan])
        gamma = np.zeros(1)
    here = np.arange(len(alpha))
    x = Experience.at_rest(
        alpha,
        beta,
        about.gravity,
        gamma=gamma,
        rate=gyro_readings(about, here, np.full((len(alpha), 3), np.nan)).rates(
            about.mounting
        ),
        base_force=about.base_force,
        base_rate=about.base_rate,
        mounting=about.mounting,
        latitude=about.latitude,
    )
    limits = [about.limits.get(k, np.nan) for k in ("acceleration", "angular_rate")]
    return CheckedSamples(
        block=block, windows=windows, x=x,
        scale=np.concatenate([about.nominal["acc_scale"], about.nominal["gyr_scale"]]),
        bias=np.concatenate([about.nominal["acc_bias"], about.nominal["gyr_bias"]]),
        noise=noise.white, quick=noise.quick, steps=grids_of(block),
        grids=grids_by_stretch(block), limits=np.array(limits),
        rate_hz=about.rate_hz or np.nan, without=about.excluded_spans,
    )  # fmt: skip
