"""What 1 rad/s reads in the numbers of a file, by its turns.

    d(u)/dt = u x w,   u = a / |a|                                                 (1)

As gravity turns in device axes while the device is turned, this gives the scale of the
rates w. A hand turns a device about its wrist or elbow and not about the sensor, and
jerks it: such forces follow the turn, so (1) is off by up to a tenth. Where the device
rests before the turns and behind them, the rests tell the scale without them.
"""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.importing.units.gravity_size import GravityReading
from fieldcal.importing.units.scales import MIN_ROWS
from fieldcal.importing.units.turn_closure import closing_scale

TURNED = 0.5
"""Turn of gravity that all of a recording must have for (1), rad: root of the sum of
the squares of what it turns by in each half second. 45° within 1.2 s are as much."""

AGREES = 0.9
"""Correlation of both sides of (1) from which on it is believed."""

_ROUGHLY = 0.3
"""Correlation from which on the turns from rest to rest are looked at."""

_SWUNG = 0.3
"""Part by which |a| is not g: then a hand is felt, and (1) does not hold."""

_OFTEN, _RAIL = 5, 1.5
"""Rows at one value that are a rail, and how far it is out, in standard deviations."""

_UPRIGHT = 0.25
"""Part of a turn about the vertical that seems to tilt gravity: biases of 0.25 g."""

STIRS, TIMES = 0.01, 20.0
"""Turn within half a second, rad, that no noise of rates makes, and how many times what
gravity shows it is where the unit is another: of deg/s some fifty. Of what flies it is
a few, which feels its thrust and not gravity."""

BIAS, STAYS = 0.5, 0.95
"""Bias that no gyroscope has, rad/s: 30 deg/s; and length of the mean of the directions
of gravity, of which each has length 1, where it stays."""

_LAG, _PAUSE, _LONGEST = 0.5, 1.5, 60.0
"""Time over which (1) is integrated, s: jerks of a hand are shorter; usual steps of a
slower log that are a pause; and the longest step over which a rate tells a turn, s."""


def estimate_rate_unit(
    t: Array, acc: Array, gyr: Array, gravity: GravityReading, turned: float = TURNED
) -> float | None:
    """Estimate the reading of 1 rad/s in numbers (n, 3), by (1); None without turns.

    Parameters
    ----------
    t : (n,) s
    acc, gyr : (n, 3) in numbers of the file
    gravity : what the accelerometers read at rest
    turned : least turn of gravity, as of `TURNED`, rad

    """
    sides = TurnSides.of(t, acc, gyr, gravity)
    if sides is None or sides.moved < turned**2 * sides.lag:
        return None
    left, right = sides.left.ravel(), sides.right.ravel()
    power = float(right @ right)
    both = float(left @ right)
    agrees = both / np.sqrt(power * sides.moved)
    if agrees < _ROUGHLY:
        return None
    rough = power / both
    closes = closing_scale(sides.t, sides.up, sides.gyr, rough)
    return rough if closes is None and agrees >= AGREES else closes


def turns_deny(t: Array, acc: Array, gyr: Array, gravity: GravityReading) -> bool:
    """Whether gravity turns, and nothing like numbers (n, 3) that may be rates.

    Parameters
    ----------
    t, acc, gyr, gravity : as of `estimate_rate_unit`

    """
    sides = TurnSides.of(t, acc, gyr, gravity)
    if sides is None or sides.moved < TURNED**2 * sides.lag:
        return False
    both = float(sides.left.ravel() @ sides.right.ravel())
    return both < _ROUGHLY * float(np.sqrt((sides.right**2).sum() * sides.moved))


class TurnComparison(NamedTuple):
    """Rms turn of gravity within half a second, rad, by rates and by accelerometers.

    What the accelerometers show is more than it turned, by their noise and by the
    forces of whoever moves the device; so in the right unit rates cannot say much more.
    Nor can what remains of them on the average, where gravity stays: it is their bias.
    Rates about the vertical tell nothing: of those a bias of the accelerometers alone
    makes a part.

    Attributes
    ----------
    said : as the rates say, less their median, were they rad/s
    shown : as the accelerometers show
    bias : rate about a level axis that would be a bias then, rad/s

    """

    said: float
    shown: float
    bias: float

    def allow(self, size: float, times: float = TIMES) -> bool:
        """Whether rates can be in a unit in which 1 rad/s reads `size`.

        They say no more than so many times what gravity shows.
        """
        turns = self.said / size < max(STIRS, times * self.shown)
        return turns and self.bias / size < BIAS

    def odd(self) -> str:
        """What cannot be if rates are rad/s."""
        said, shown, bias = np.rad2deg([self.said, self.shown, self.bias])
        if self.bias > BIAS and self.said < max(STIRS, TIMES * self.shown):
            return f"{bias:.2g} deg/s would be left at rest, which is no bias"
        return (
            f"gravity would turn by {said:.2g} deg within half a second then, and turns"
            f" by {shown:.2g} deg at most"
        )


def compare_turns(
    t: Array, acc: Array, gyr: Array, gravity: GravityReading
) -> TurnComparison | None:
    """Compare turns by rates with turns of gravity; None if there are none.

    Parameters
    ----------
    t, acc, gyr, gravity : as of `estimate_rate_unit`

    """
    sides = TurnSides.of(t, acc, gyr, gravity)
    if sides is None:
        return None
    up = sides.up / np.maximum(np.linalg.norm(sides.up, axis=1), 0.1)[:, None]
    mean = up.mean(axis=0)
    stays = float(np.linalg.norm(mean)) > STAYS
    about = np.cross(mean, sides.usual) if stays else np.zeros(3)
    said, shown, angle = (_rms_turn(x, sides.lag // 2)
                          for x in (sides.right, sides.left, sides.angles))  # fmt: skip
    upright = said < _UPRIGHT * angle
    level = float(np.linalg.norm(about))
    steady = level < _UPRIGHT * np.linalg.norm(sides.usual)
    return TurnComparison(
        said=0.0 if upright else said,
        shown=shown,
        bias=0.0 if steady else level,
    )


def _rms_turn(turns: Array, many: int) -> float:
    """Root of the mean square of turns (n, 3), averaged over so many of them."""
    many = min(max(many, 1), len(turns))
    total = np.cumsum(np.vstack([np.zeros((1, 3)), turns]), axis=0)
    mean = (total[many:] - total[:-many]) / many
    return float(np.sqrt((mean**2).sum(axis=1).mean()))


class TurnSides(NamedTuple):
    """Both sides of (1), over each lag.

    Attributes
    ----------
    left, right : (n, 3) change of u, and what the rates make of it
    angles : (n, 3) integrals of the rates
    lag : rows
    moved : sum of the squares of the left one
    t, up, gyr : (m,), (m, 3) of the rows that are known; the rates without their
        median, nan where one is at its rail
    usual : (3,) that median
    steps : (m - 1,) s from row to row; nan where (1) does not hold

    """

    left: Array
    right: Array
    angles: Array
    lag: int
    moved: float
    t: Array
    up: Array
    gyr: Array
    usual: Array
    steps: Array

    @classmethod
    def of(
        cls, t: Array, acc: Array, gyr: Array, gravity: GravityReading
    ) -> Self | None:
        """Both sides; None of too few rows, or where no rate changes."""
        known = np.isfinite(np.column_stack([t, acc, gyr])).all(axis=1)
        t, acc, gyr = t[known], acc[known], gyr[known]
        if len(t) < MIN_ROWS:
            return None
        steps = np.diff(t)
        pause = max(_LAG, min(_PAUSE * float(np.median(steps)), _LONGEST))
        steps[(steps > pause) | (steps < 0)] = np.nan
        step = float(np.nanmean(steps)) if np.isfinite(steps).any() else 0.0
        lag = max(2, round(_LAG / step)) if step > 0 else len(t)
        if len(t) < 4 * lag:
            return None
        clipped = _at_rails(gyr)
        whole = (acc - gravity.offset) / gravity.size
        length = np.maximum(np.linalg.norm(whole, axis=1), 0.1)
        usual = np.median(gyr, axis=0)
        up, gyr = whole / length[:, None], gyr - usual
        turning = np.cross(up, gyr)
        swung = (np.abs(length - 1) > _SWUNG) | clipped
        steps[swung[1:] | swung[:-1]] = np.nan
        right, angles = (lagged_sums((x[1:] + x[:-1]) / 2 * steps[:, None], lag)
                         for x in (turning, gyr))  # fmt: skip
        left = up[lag:] - up[:-lag]
        told = np.isfinite(right).all(axis=1)
        left, right, angles = left[told], right[told], angles[told]
        if not right.any():
            return None
        moved = float((left**2).sum())
        gyr = np.where(clipped[:, None], np.nan, gyr)
        return cls(left, right, angles, lag, moved, t, whole, gyr, usual, steps)


def _at_rails(gyr: Array) -> NDArray[np.bool_]:
    """Rows (n, 3) in which an axis is at the greatest or least value, again and again.

    An output that is clipped says less than the rate, so it tells no scale.
    """
    ends = np.array([gyr.min(axis=0), gyr.max(axis=0)])
    often = [(gyr == end).sum(axis=0) >= _OFTEN for end in ends]
    turns = np.abs(ends - np.median(gyr, axis=0)) > _RAIL * gyr.std(axis=0)
    low, high = ((gyr == ends[i]) & often[i] & turns[i] for i in (0, 1))
    rails: NDArray[np.bool_] = (low | high).any(axis=1)
    return rails


def lagged_sums(steps: Array, lag: int) -> Array:
    """Sums of `lag` successive steps (n, k); nan over a pause."""
    paused = np.isnan(steps)
    total = np.cumsum(np.where(paused, 0.0, steps), axis=0)
    gaps = np.cumsum(paused, axis=0)
    first = np.zeros((1, steps.shape[1]))
    total, gaps = (np.vstack([first, x]) for x in (total, gaps))
    sums: Array = total[lag:] - total[:-lag]
    sums[(gaps[lag:] > gaps[:-lag]).any(axis=1)] = np.nan
    return sums
