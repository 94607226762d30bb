"""Whether a device that stands squarely on another face is mounted otherwise.

Gravity along another axis than the first position has it is either a turn that is still
to be made, or a mounting that nobody declared. Gravity alone leaves four mountings, a
quarter turn about the vertical apart: the one is named that keeps most of what is
declared.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cache
from itertools import permutations, product

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.frames import mounting_matrix
from fieldcal.core.samples import Array
from fieldcal.run.position_check import FIRST_TOLERANCE_RAD


def fitting_mounting(
    device: Array, wanted: Array, declared: tuple[str, ...]
) -> tuple[str, ...] | None:
    """Mounting with which the device would be in position; None if there is none.

    Parameters
    ----------
    device : (3,) specific force, device axes
    wanted : (3,) where it should be, procedure axes
    declared : the mounting so far

    >>> z_up, home = np.array([0.0, 0.1, 9.8]), np.array([0.0, -9.81, 0.0])
    >>> fitting_mounting(z_up, home, ("+x", "+y", "+z"))
    ('+x', '-z', '+y')
    """
    length = float(np.linalg.norm(device) * np.linalg.norm(wanted))
    near: list[tuple[int, tuple[str, ...]]] = []
    for axes, matrix in _mountings():
        if matrix @ device @ wanted >= np.cos(FIRST_TOLERANCE_RAD) * length:
            changed = sum(a != b for a, b in zip(axes, declared, strict=True))
            near.append((changed, axes))
    return min(near)[1] if near else None


@cache
def _mountings() -> list[tuple[tuple[str, ...], Array]]:
    """All 24 right-handed mountings, each with its matrix."""
    found = []
    for names in permutations("xyz"):
        for signs in product("+-", repeat=3):
            axes = tuple(s + n for s, n in zip(signs, names, strict=True))
            with suppress(InputError):  # left-handed
                found.append((axes, mounting_matrix(axes)))
    return found


def wrong_mounting_message(
    device: Array, wanted: Array, declared: tuple[str, ...]
) -> str:
    """Notice about a device that would be in position with another mounting."""
    axes = fitting_mounting(device, wanted, declared)
    if axes is None or axes == declared:
        return ""
    return (
        f"{up_axis(device)} of the device is up, by the mounting {','.join(declared)}"
        f" it is not: if it is mounted so, begin again with --mounting={','.join(axes)}"
    )


def up_axis(device: Array) -> str:
    """Name of the device axis that is nearest to up, by the force (3,) at rest.

    >>> up_axis(np.array([0.1, -0.2, 9.8]))
    '+z'
    """
    i = int(np.argmax(np.abs(device)))
    return f"{'+' if device[i] > 0 else '-'}{'xyz'[i]}"
