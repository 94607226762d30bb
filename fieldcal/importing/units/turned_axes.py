"""Axes of gyroscopes that are not those of the accelerometers beside them.

    d(u)/dt = u x P w,   u = a / |a|                                               (1)

Loggers write two chips that lie turned to each other, or the rates in the order yaw,
pitch, roll, under the same x, y and z. Each of the 48 ways P to name the rates anew,
some of them with the other sign, is held against the turns of gravity. It may as well
be the forces that are named otherwise: with M = P^T or -P^T, and P right-handed,

    d(M u)/dt = M u x w                                                            (2)
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import permutations, product
from shlex import quote
from typing import NamedTuple

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Array
from fieldcal.importing.units.gravity_size import GravityReading
from fieldcal.importing.units.rate_size import (
    AGREES,
    TURNED,
    TurnSides,
    lagged_sums,
)

ACCELEROMETERS, GYROSCOPES = CHANNELS[:3], CHANNELS[3:]

APART = 0.3
"""How much less correlated (1) is as the rates are named than in the way that holds."""

ALIKE = 0.1
"""Difference of the correlation of two ways between which the turns leave the choice:
those of an axis about which the device was not turned."""


class AxisNaming(NamedTuple):
    """A way to name the columns of rates.

    Attributes
    ----------
    axes : number of the axis that each of the three columns is about
    signs : 1, or -1 of a column whose sign is the other one

    """

    axes: tuple[int, ...]
    signs: tuple[int, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """What the columns are called then.

        >>> AxisNaming((2, 1, 0), (1, 1, -1)).names
        ('gz', 'gy', '-gx')
        """
        pairs = zip(self.axes, self.signs, strict=True)
        return tuple(("-" if sign < 0 else "") + GYROSCOPES[i] for i, sign in pairs)

    @property
    def forces(self) -> tuple[str, ...]:
        """What those of the forces are called where the rates keep their names, by (2).

        Of both ways the one with fewer other signs: whoever turns one sign does so with
        the forces. Empty where neither does: a sign of the rates is another one then.

        >>> AxisNaming((0, 1, 2), (-1, -1, 1)).forces
        ('ax', 'ay', '-az')
        >>> AxisNaming((1, 0, 2), (-1, -1, -1)).forces
        ('ay', 'ax', 'az')
        """
        if np.linalg.det(self.matrix) < 0:
            return ()
        back = [self.axes.index(i) for i in range(3)]
        signs = [self.signs[i] for i in back]
        usual = 1 if sum(signs) > 0 else -1
        return tuple(
            ("-" if sign != usual else "") + ACCELEROMETERS[i]
            for i, sign in zip(back, signs, strict=True)
        )

    @property
    def matrix(self) -> Array:
        """P of (1), (3, 3)."""
        turned = np.zeros((3, 3))
        turned[list(self.axes), range(3)] = self.signs
        return turned


def find_axis_naming(
    t: Array, acc: Array, gyr: Array, gravity: GravityReading
) -> AxisNaming | None:
    """How rates are to be named for gravity to turn by them, as they are it does not.

    None where no way does so much better, or where the device did not turn about
    enough axes to tell.

    Parameters
    ----------
    t : (n,) s
    acc, gyr : (n, 3) in numbers of the file
    gravity : what the accelerometers read at rest

    """
    sides = TurnSides.of(t, acc, gyr, gravity)
    if sides is None or sides.moved < TURNED**2 * sides.lag:
        return None
    agrees = _Correlations(sides)
    found = {way: agrees.of(way.matrix) for way in _ways()}
    best = max(found.values())
    if best < AGREES or best - agrees.of(np.eye(3)) < APART:
        return None
    alike = [way for way, one in found.items() if one > best - ALIKE]
    # of an axis that hardly turned, a right-handed triad tells the sign
    right = [way for way in alike if np.linalg.det(way.matrix) > 0]
    chosen = alike if len(alike) == 1 else right
    return chosen[0] if len(chosen) == 1 else None


def _ways() -> Iterator[AxisNaming]:
    for axes in permutations(range(3)):
        for signs in product((1, -1), repeat=3):
            yield AxisNaming(axes, signs)


class _Correlations:
    """Correlation of both sides of (1) for any P, of sums that are made once."""

    def __init__(self, sides: TurnSides) -> None:
        up, gyr = sides.up, sides.gyr
        unit = up / np.maximum(np.linalg.norm(up, axis=1), 0.1)[:, None]
        products = (unit[:, :, None] * gyr[:, None, :]).reshape(-1, 9)
        means = (products[1:] + products[:-1]) / 2 * sides.steps[:, None]
        sums = lagged_sums(means, sides.lag)
        left = unit[sides.lag :] - unit[: -sides.lag]
        told = np.isfinite(sums).all(axis=1)
        self._with_left = left[told].T @ sums[told]
        self._with_each = sums[told].T @ sums[told]
        self._moved = float((left[told] ** 2).sum())

    def of(self, turned: Array) -> float:
        """Correlation for P (3, 3)."""
        both = power = 0.0
        for i in range(3):
            # (u x P w)_i of all products u_j w_k
            j, k = (i + 1) % 3, (i + 2) % 3
            weights = np.zeros((3, 3))
            weights[j], weights[k] = turned[k], -turned[j]
            flat = weights.ravel()
            both += float(self._with_left[i] @ flat)
            power += float(flat @ self._with_each @ flat)
        return both / float(np.sqrt(power * self._moved)) if power > 0 else 0.0


class NamedColumns(NamedTuple):
    """Columns of the rates, as something called them.

    Attributes
    ----------
    file : that they stand in
    columns : as ``--columns`` names them, all; () of formats that name none
    reversed : channels of them whose sign is turned
    by_user : whether the user named them

    """

    file: str
    columns: tuple[str, ...]
    reversed: frozenset[str]
    by_user: bool

    def doubts(
        self, t: Array, acc: Array, gyr: Array, gravity: GravityReading
    ) -> list[str]:
        """Axes by which gravity does not turn as it does, a sentence each.

        Parameters
        ----------
        t, acc, gyr, gravity : as of `find_axis_naming`

        Raises
        ------
        InputError
            With the columns both ways, where the names in the file say so.

        """
        way = find_axis_naming(t, acc, gyr, gravity)
        if way is None:
            return []
        odd = (
            "gravity does not turn by the rates gx gy gz as they are named, but does if"
            f" these are {' '.join(way.names)}"
        )
        if self.by_user or not self.columns:
            return [f"{odd}: the axes of the two sensors are not the same"]
        others = [self._with(GYROSCOPES, way.names)]
        if way.forces:
            others.append(self._with(ACCELEROMETERS, way.forces))
            odd += f", or if the forces ax ay az are {' '.join(way.forces)}"
        options = " or ".join(f"--columns {quote(one)}" for one in others)
        raise InputError(
            f"{self.file}: {odd}: add {options} or"
            f" --columns {quote(self._with(GYROSCOPES, GYROSCOPES))}, if they are as"
            " named"
        )

    def _with(self, old: Sequence[str], names: Sequence[str]) -> str:
        """All columns, with these names of those of a sensor."""
        called = dict(zip(old, names, strict=True))
        parts = (one.partition("=") for one in self.columns)
        return ",".join(
            self._signed(channel, called.get(channel, channel)) + behind + place
            for channel, behind, place in parts
        )

    def _signed(self, channel: str, name: str) -> str:
        turned = (channel in self.reversed) != name.startswith("-")
        return ("-" if turned else "") + name.lstrip("-")
