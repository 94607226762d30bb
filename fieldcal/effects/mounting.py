"""Axes exchanged or reversed, or a unit that is not the declared one.

    U = b + diag(k) S u f,    S one of the 48 signed permutations, u a ratio of units

At rest f is known in every position, so the S and u under which bias and scale factor
stay near the nominal ones are found by trying them all. Between two positions the force
turns by an angle that the gyroscopes must at least turn through:

    r = integral |W - W_rest| dt / angle(f_p, f_q)

which is 1 to about 2, and 57.3 times that where deg/s are taken for rad/s; and where
the axes of the gyroscopes are not those of the accelerometers, gravity does not turn as
they say (`rate_axes`). Angles that are written in radians are tried in the same way as
axes are: they leave the force nearly where it was at home. Source: model of this
project.

>>> import numpy as np
>>> f = np.array([[0, -9.8, 0], [-6.9, -6.9, 0], [0, -6.9, 6.9]])
>>> axes, _ = turned_axes(f[:, [1, 0, 2]] * [1, 1, -1], f)
>>> axes_label(axes)
'+y+x-z'
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array, Block, Index
from fieldcal.core.sampling import has_no_pause, sampling_rate
from fieldcal.physics.effect import Chain
from fieldcal.physics.experience import Experience
from fieldcal.physics.rate_axes import ObservedTurn, axes_by_turns, signed_axes
from fieldcal.physics.recording import CheckedSamples, Fault

BIAS, SCALE, FLOOR = 1.0, 0.1, 0.1
"""Allowed spread of bias, m/s^2, of scale, and of other effects, m/s^2."""

BETTER = 30.0
"""Log odds against the declared axes from which others are accepted."""

FITS = 10.0
"""Largest mean square of the residuals of accepted axes, in the spreads above."""

UNITS = {"g": G0, "mg": 1e-3 * G0, "m/s^2 read as g": 1 / G0, "deg/s": np.pi / 180}
GRAVITY_TOLERANCE = 0.05

RATES = {"deg/s": np.pi / 180, "mrad/s": 1e-3, "rad/s read as deg/s": 180 / np.pi}
ANGLES = {"rad": 180 / np.pi}
"""Factors for stated angles in another unit."""

USUAL_ANGLE_RATIO, ANGLE_RATIO_FACTOR = 1.5, 4.0
"""Angle turned over the least that it can be, and by what factor that may be off: units
are 17 apart and more."""

MIN_TURN_RAD = np.deg2rad(10.0)
"""Smallest turn of the force that is used, rad."""

MARGIN_S = 30.0
"""Longest part of a window beside a turn that is searched for turning, s."""


def turned_axes(measured: Array, f: Array) -> tuple[Array, float]:
    """Most probable axes (3, 3) of measured forces, and log odds against the identity.

    Both in m/s^2, measured with the nominal calibration taken out.
    """
    every = signed_axes()
    odds = [_odds(measured, f @ axes.T) for axes in every]
    best = int(np.argmax([likelihood for likelihood, _ in odds]))
    if odds[best][1] > FITS * measured.size:
        return every[0], 0.0
    return every[best], odds[best][0] - odds[0][0]


def angle_unit(x: Experience, held: Index, measured: Array) -> str:
    """Unit of the stated angles, if it is not the degree; empty if it is.

    Parameters
    ----------
    x : positions
    held : (n,) those whose angles are known
    measured : (n, 3) m/s^2 in them, with the nominal calibration taken out

    """
    if len(held) < 2:
        return ""
    for name, size in ANGLES.items():
        other = x.turned(alpha=size * x.alpha, beta=size * x.beta, gamma=size * x.gamma)
        likely, squares = _odds(measured, other.f[held])
        if squares > FITS * measured.size:
            continue
        said = max(_odds(measured, x.f[held] @ axes.T)[0] for axes in signed_axes())
        if likely - said > BETTER:
            return name
    return ""


def _odds(measured: Array, f: Array) -> tuple[float, float]:
    """Log likelihood and sum of squares, with bias near 0 and scale factor near 1."""
    total, squares = 0.0, 0.0
    for m, force in zip(measured.T, f.T, strict=True):
        design = np.column_stack([np.ones(len(force)) * BIAS, force * SCALE])
        cov = design @ design.T + FLOOR**2 * np.eye(len(force))
        rest = m - force
        squares += float(rest @ np.linalg.solve(cov, rest))
        total -= 0.5 * float(np.linalg.slogdet(cov)[1])
    return total - 0.5 * squares, squares


def measured_turns(
    recording: CheckedSamples, held: Sequence[int], f: Array
) -> list[ObservedTurn]:
    """Turns between windows by number, where the force is f (n, 3).

    Those that are too small, of which a part was not recorded, or that lie mostly
    inside the windows, as where these were stated roughly, say nothing.
    """
    block, out = recording.block, []
    often = sampling_rate(block)
    for (p, one), (q, two) in pairwise(zip(held, f, strict=True)):
        gap = slice(recording.windows[p, 1], recording.windows[q, 0])
        if not angle_between(one, two) > MIN_TURN_RAD or gap.stop - gap.start < 2:
            continue
        if not has_no_pause(block.t, gap.start, gap.stop, often):
            continue
        if _turns_in_windows(recording, p, q):
            continue
        rest = recording.mean(p)[3:]
        rate = (block.gyr[gap] - rest) / recording.scale[3:]
        middle = (rate[1:] + rate[:-1]) / 2
        out.append(ObservedTurn(one, two, middle * np.diff(block.t[gap])[:, None]))
    return out


def _turns_in_windows(recording: CheckedSamples, p: int, q: int) -> bool:
    """Whether the gyroscopes turn further inside two windows than between them.

    Both are in the unit of the outputs, so that it does not matter.
    """
    block = recording.block
    (first, end), (start, last) = recording.windows[[p, q]].tolist()
    early, late = (end - first) // 3, (last - start) // 3
    # the middle of a window is at rest even if the window was stated roughly
    rests = [block.gyr[first + early : end - early].mean(axis=0),
             block.gyr[start + late : last - late].mean(axis=0)]  # fmt: skip
    edges = np.searchsorted(
        block.t, [block.t[end - 1] - MARGIN_S, block.t[start] + MARGIN_S]
    ).tolist()
    inside = _angle(block, slice(max(end - early, edges[0]), end), rests[0])
    inside += _angle(block, slice(start, min(start + late, edges[1])), rests[1])
    between = _angle(block, slice(end, start), rests[0])
    return float(np.linalg.norm(inside)) > float(np.linalg.norm(between))


def _angle(block: Block, rows: slice, rest: Array) -> Array:
    """Integral (3,) of the rates of some samples against those at rest."""
    rate = block.gyr[rows][1:] - rest
    total: Array = np.nansum(rate * np.diff(block.t[rows])[:, None], axis=0)
    return total


def rate_unit(turns: Sequence[ObservedTurn]) -> str:
    """Unit of the gyroscopes, if it is not the declared one; empty if it is."""
    ratios = [
        float(np.linalg.norm(turn.angles, axis=1).sum())
        / angle_between(turn.before, turn.behind)
        for turn in turns
    ]
    ratio = float(np.median(ratios)) if ratios else 0.0
    if not 0.0 < ratio < np.inf:  # gyroscopes that say nothing
        return ""
    for name, size in RATES.items():
        if abs(np.log(ratio * size / USUAL_ANGLE_RATIO)) < np.log(ANGLE_RATIO_FACTOR):
            return name
    return ""


def axes_label(axes: Array) -> str:
    """Signed axes by the rows of a matrix (3, 3), such as +x-z+y."""
    at = np.argmax(np.abs(axes), axis=1).tolist()
    return "".join("+-"[bool(row[i] < 0)] + "xyz"[i]
                   for row, i in zip(axes, at, strict=True))  # fmt: skip


def angle_between(one: Array, two: Array) -> float:
    """Angle between two vectors (3,), rad."""
    return float(np.arctan2(np.linalg.norm(np.cross(one, two)), one @ two))


def _rate_fault(
    recording: CheckedSamples, undo: Array, values: dict[str, float | str]
) -> Fault:
    """Fault of gyroscopes in another unit or other axes, corrected by `undo` (3, 3)."""
    six = recording.block.six
    six[:, 3:] = six[:, 3:] @ undo.T
    return replace(
        _whole_recording_fault(recording),
        channel="gx",
        values=values,
        size=1.0,
        mended=six,
    )


def _whole_recording_fault(recording: CheckedSamples) -> Fault:
    """A fault of all forces, from the first sample to the last."""
    return Fault(
        channel="ax",
        values={},
        sigmas={},
        from_s=float(recording.block.t[0]),
        to_s=float(recording.block.t[-1]),
        size=recording.x.gravity,
    )


class Mounting(Chain):
    """Wrong axes or a wrong unit in session.toml."""

    misread = True
    covariate = "force at rest is not where it should be"
    treatment = "mend"
    place = 1  # a channel with wrong bytes looks like one of another axis
    decided_by = "the drawing on the device, and its data sheet"
    cure = (
        "Correct [frame] mounting by the drawing on the device. Of another unit, import"
        " again with --acc-unit or --gyr-unit, or state it in the device's address."
        " Where"
        " gyr_axes says that gx gy gz lie along other axes than the accelerometers',"
        " import again with --columns that name them so, such as -gy,gx,gz. Write"
        " angles in degrees."
    )
    source = "model of this project"

    def find(self, recording: CheckedSamples) -> list[Fault]:
        """Axes or unit that are not the declared ones."""
        known = recording.x.force_known
        held = [i for i, (a, b) in enumerate(recording.windows) if b > a and known[i]]
        mean = np.array([recording.mean(i)[:3] for i in held])
        if not np.isfinite(mean).all() or not len(mean):
            return []
        acc = (mean - recording.bias[:3]) / recording.scale[:3]
        unit = self._unit(acc, recording.x.gravity)
        if unit:
            return [self._fault(recording, {"unit": unit}, UNITS[unit], np.eye(3))]
        oriented = recording.x.oriented[held]
        if angle := angle_unit(recording.x, np.array(held)[oriented], acc[oriented]):
            fault, size = _whole_recording_fault(recording), ANGLES[angle]
            return [replace(fault, values={"angles": angle}, angles=size)]
        force = np.where(oriented[:, None], recording.x.f[held], acc)
        if rate := rate_unit(measured_turns(recording, held, force)):
            return [_rate_fault(recording, RATES[rate] * np.eye(3), {"unit": rate})]
        return self._axes(recording, held, acc)

    def _axes(
        self, recording: CheckedSamples, held: Sequence[int], acc: Array
    ) -> list[Fault]:
        """Axes of the whole device, and those that the gyroscopes have beside it.

        `acc` (n, 3) is measured in the windows `held`, m/s^2. A mirrored device has
        gyroscopes that seem to turn the other way, so its own axes are put right first.
        """
        axes: Array = np.eye(3)
        oriented = recording.x.oriented[held]
        if oriented.sum() >= 2:
            found, odds = turned_axes(acc[oriented], recording.x.f[held][oriented])
            axes = found if odds >= BETTER else axes
        seen = measured_turns(recording, held, acc @ axes)
        turned = axes_by_turns([t._replace(angles=t.angles @ axes) for t in seen])
        values: dict[str, float | str] = {}
        if turned is not None:
            values["gyr_axes"] = axes_label(turned.T)
        if (axes == np.eye(3)).all():
            return [] if turned is None else [_rate_fault(recording, turned, values)]
        # the mounting that session.toml should have had
        values["axes"] = axes_label(recording.x.mounting @ axes.T)
        return [self._fault(recording, values, 1.0, axes.T, turned)]

    @staticmethod
    def _unit(acc: Array, gravity: float) -> str:
        length = float(np.median(np.linalg.norm(acc, axis=1)))
        for name, size in UNITS.items():
            if name != "deg/s" and abs(length * size / gravity - 1) < GRAVITY_TOLERANCE:
                return name
        return ""

    @staticmethod
    def _fault(
        recording: CheckedSamples,
        values: dict[str, float | str],
        unit: float,
        undo: Array,
        rates: Array | None = None,
    ) -> Fault:
        six = recording.block.six
        acc = six[:, :3] @ undo.T * unit
        gyr = six[:, 3:] @ undo.T @ (np.eye(3) if rates is None else rates.T)
        mended = np.hstack([acc, gyr])
        return replace(_whole_recording_fault(recording), values=values, mended=mended)
