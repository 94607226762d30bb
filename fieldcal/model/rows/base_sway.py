"""A base that sways: windows and turns corrected to a base at rest.

In the windows the effect of the swaying is subtracted (`windows.sway`). At the ends of
a window the device is rotated by phi from its attitude on a base at rest, and a turn to
the next window starts and ends with such a rotation. It is removed by an added rotation
of phi(end) before the turn and -phi(start) after it, in a tenth of a second each. The
turn then leads from one attitude at rest to the next.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.positions import table_rates
from fieldcal.core.samples import Array, Block, Index
from fieldcal.core.sampling import sampling_rate
from fieldcal.model import detections, resolutions
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.session.description import Description
from fieldcal.windows.sway import find_sway
from fieldcal.windows.sway_process import needed_seconds
from fieldcal.windows.sway_waves import SwayWaves


@dataclass(frozen=True, slots=True)
class BaseSway:
    """Sway of a base in a recording.

    Attributes
    ----------
    block : the samples without the sway
    excess_variance : (p, 6) variance of each window's mean that remains
    white : (6,) standard deviation of one sample; noise slower than the quickest wave
        is subtracted with the waves
    amplitude, hz : rad and Hz, of one wave with the power of all
    spread : (2,) standard deviations of both over the windows
    needed_seconds : length that a window needs, s
    gravity_sigma : m/s^2, standard deviation of the apparent loss of gravity in all
        windows, if without gyroscopes rotation and acceleration are not separable

    """

    block: Block
    excess_variance: Array
    white: Array
    amplitude: float
    hz: float
    spread: tuple[float, float]
    needed_seconds: float
    gravity_sigma: float

    @property
    def sentence(self) -> str:
        """Sentence for the operator."""
        unknown = (
            "; without gyroscopes nothing tells whether it turns or is pushed: the"
            " scale factors are uncertain by"
            f" {1e6 * self.gravity_sigma / G0:.0f}e-6 for that"
        )
        return (
            f"the base sways by {np.rad2deg(self.amplitude):.2g}° at {self.hz:.2g} Hz:"
            " this is taken out of the windows, and what it leaves open is in the ±;"
            f" each position needs {self.needed_seconds:.0f} s on such a base"
            f"{unknown if self.gravity_sigma else ''}"
        )


def find_base_sway(block: Block, about: Description) -> BaseSway | None:
    """Sway of the base; None if it does not sway, or if this cannot be decided.

    Gyroscopes separate rotation from acceleration; accelerometers alone do not. Known
    positions decide, since a device in a hand also rotates; on a base that sways there,
    it sways in the others as well.
    """
    gyroscopes = np.isfinite(block.gyr).any(axis=0)
    fixed = _known_positions(about)
    if not fixed or gyroscopes.any() != gyroscopes.all():
        return None
    windows = window_bounds(block, about)
    unit = np.concatenate([about.nominal[n] for n in ("acc_scale", "gyr_scale")])
    waves_by_position = {
        p: waves
        for p, (a, b) in enumerate(windows)
        # SI, and every axis to its own side
        if b > a and (waves := find_sway(block.t[a:b], block[a:b].six / unit))
    }
    swaying = [waves_by_position[p] for p in fixed if p in waves_by_position]
    if len(swaying) < detections.MIN_SWAYING_SHARE * len(fixed):
        return None
    sizes = np.array(
        [np.mean([w.mean_squares for w in waves], axis=0) for waves in swaying]
    )
    amplitude = np.sqrt(2 * sizes[:, 0])
    if np.sqrt((amplitude**2).mean()) < detections.MIN_SWAY_RAD:
        return None
    hz = np.sqrt(sizes[:, 1] / sizes[:, 0]) / (2 * np.pi)
    lost = about.gravity * float(sizes[:, 0].mean()) / 2  # <phi^2> / 2 of gravity
    left: list[Array] = []
    for p, (a, b) in enumerate(windows):
        if p in waves_by_position:
            excess = [w.excess_variance for w in waves_by_position[p]]
            left.append(sum(excess, np.zeros(6)) / len(excess) ** 2)
        else:
            seen = _unseen_sway_variance(sizes.mean(axis=0), block.t[a:b])
            left.append(seen * np.repeat([about.gravity**2, 1.0], 3))
    root = np.sqrt(max(len(swaying) - 1, 1))
    noise = [w.noise * w.length for waves in waves_by_position.values() for w in waves]
    felt = block.with_six(block.six / unit)
    steady = _without_sway(felt, windows, waves_by_position)
    return BaseSway(
        block.with_six(steady * unit), np.array(left) * unit**2,
        np.sqrt(np.mean(noise, axis=0) * sampling_rate(block)) * np.abs(unit),
        float(np.sqrt((amplitude**2).mean())), float(hz.mean()),
        (float(amplitude.std() / root), float(hz.std() / root)),
        max(needed_seconds(w) for waves in waves_by_position.values() for w in waves),
        0.0 if gyroscopes.any() else lost,
    )  # fmt: skip


def _unseen_sway_variance(size: Array, t: Array) -> Array:
    """Variance (6,) of the means in a window in which no sway was found.

    Of the rotation about each axis, rad^2, and of its rate, rad^2/s^2. The mean of a
    wave over T has the size sqrt(2) / (w T) of the wave. `size` (2,) are the mean
    squares of both, about any axis.
    """
    length = float(np.ptp(t)) if len(t) > 1 else np.inf
    turned = 2 * size[0] / max(size[1] / size[0], 1e-12) / length**2
    return np.repeat([turned, 2 * size[0] / length**2], 3)


def _known_positions(about: Description) -> list[int]:
    """Positions whose attitude is known; none if a rate table turns the device.

    One among others that are not known tells no base from a hand.
    """
    positions = about.positions
    if not positions or table_rates(positions).any():
        return []
    fixed = [i for i, p in enumerate(positions) if p.oriented]
    return [] if len(fixed) == 1 < len(positions) else fixed


def _without_sway(
    block: Block, windows: Index, waves_by_position: dict[int, list[SwayWaves]]
) -> Array:
    """Samples (n, 6), SI, corrected to a base at rest."""
    six, rate = block.six, sampling_rate(block)
    for p, of_window in waves_by_position.items():
        a, b = (int(i) for i in windows[p])
        middles = [(u.span[1] + v.span[0]) / 2 for u, v in pairwise(of_window)]
        edges = [a, *np.searchsorted(block.t, middles).tolist(), b]
        for waves, (first, last) in zip(of_window, pairwise(edges), strict=True):
            six[first:last] -= waves.outputs(block.t[first:last])
    few = max(1, round(resolutions.ROTATION_STEP_S * rate))
    ordered = sorted((int(a), int(b), p) for p, (a, b) in enumerate(windows) if b > a)
    for (_, end, p), (start, _, q) in pairwise(ordered):
        if start - end < 4 * few:
            continue
        if p in waves_by_position:
            turned = waves_by_position[p][-1].turn_angle(block.t[end : end + 1])[0]
            six[end + few : end + 2 * few, 3:] += turned * rate / few
        if q in waves_by_position:
            waves = waves_by_position[q][0]
            last = start - 1 - round(detections.WINDOW_MARGIN_S * rate)
            # the rate falls to rest from this sample to the next one
            turned = waves.turn_angle(block.t[last : last + 2].mean(keepdims=True))[0]
            six[last + 1 : start, 3:] -= waves.outputs(block.t[last + 1 : start])[:, 3:]
            six[start - 2 * few : start - few, 3:] -= turned * rate / few
    return six
