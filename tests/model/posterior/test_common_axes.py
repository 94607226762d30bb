"""Parameters in common axes: by the outputs of one device in two sets of axes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fieldcal.effects import catalogue
from fieldcal.effects.cross_coupling import PAIRS
from fieldcal.model.causes.cause import Group
from fieldcal.model.posterior.common_axes import in_common_axes, parameter_rows

FORCE, RATE = catalogue()["cross_coupling"], catalogue()["gyro_cross_coupling"]
OF_FORCE = [p.name for p in FORCE.params]
OF_RATE = [p.name for p in RATE.params]


def group_of(effect: Any, names: tuple[str, ...], first: int) -> Group:
    every = [p.name for p in effect.params]
    columns = first + np.arange(len(names))
    params = tuple(every.index(n) for n in names)
    part = "acc" if effect is FORCE else "gyr"
    size = np.full(len(names), 0.02)
    return Group(effect.id, part, columns, size, effect, params=params)


def fitted(force: tuple[str, ...], rate: tuple[str, ...]) -> Any:
    """A set of both causes, and its columns after one of its own."""
    groups = [group_of(FORCE, force, 1), group_of(RATE, rate, 1 + len(force))]
    columns = np.arange(1 + len(force) + len(rate))

    def places(wanted: Any) -> Any:
        return np.searchsorted(columns, wanted)

    members = [(SimpleNamespace(key=g.cause), g) for g in groups]
    return SimpleNamespace(
        members=members, state=SimpleNamespace(columns=columns, places_of=places)
    )


def coupled(values: Any, names: tuple[str, ...], effect: Any) -> np.ndarray[Any, Any]:
    """1 and the couplings of a triad, (3, 3)."""
    out, every = np.eye(3), [p.name for p in effect.params]
    for name, value in zip(names, values, strict=True):
        out[PAIRS[every.index(name)]] += value
    return out


@pytest.mark.parametrize("gone", ["k21", "k31", "k32"])
def test_a_device_in_the_common_axes_has_the_same_outputs(gone: str) -> None:
    """The rotation is the one that takes k_ji out of the accelerometers."""
    taken, size = (gone, "k12", "k13", "k23"), 1e-4
    rng = np.random.default_rng(3)
    there = fitted(taken, tuple(OF_RATE))
    values = size * rng.standard_normal(len(there.state.columns))
    told = in_common_axes(there, there.members[1][1])
    assert told.params == tuple(range(6))
    rows = parameter_rows(there, (there.members[1][0], told), turned=True)
    force = coupled(values[1:5], taken, FORCE)
    rate = coupled(values[5:], tuple(OF_RATE), RATE)
    i, j = int(gone[1]) - 1, int(gone[2]) - 1
    turn = np.eye(3)
    turn[i, j], turn[j, i] = values[1], -values[1]
    assert abs((force @ turn.T)[i, j]) < 10 * size**2
    common = coupled(rows @ values, tuple(OF_RATE), RATE)
    np.testing.assert_allclose(rate @ turn.T, common, atol=10 * size**2)
    assert np.abs(rate - common).max() > 0.5 * abs(values[1])


def test_what_a_turn_makes_is_told_beside_what_the_set_has() -> None:
    """A set with k31 and s12 has s13 and s31 in the axes in which k31 is zero."""
    there = fitted(("k31", "k23"), ("s12",))
    told = in_common_axes(there, there.members[1][1])
    assert [OF_RATE[j] for j in told.params] == ["s12", "s13", "s31"]
    assert told.columns.tolist() == [3, -1, -1]
    rows = parameter_rows(there, (there.members[1][0], told), turned=True)
    assert rows.tolist() == [[0, 0, 0, 1], [0, 1, 0, 0], [0, -1, 0, 0]]
    own = parameter_rows(there, (there.members[1][0], told), turned=False)
    assert own.tolist() == [[0, 0, 0, 1], [0, 0, 0, 0], [0, 0, 0, 0]]


def test_forces_stay_in_the_axes_of_the_set() -> None:
    """Their sums are formed where they are told."""
    there = fitted(("k12", "k21"), ("s12",))
    member = there.members[0]
    assert in_common_axes(there, member[1]) is member[1]
    rows = parameter_rows(there, member, turned=True)
    assert rows.tolist() == [[0, 1, 0, 0], [0, 0, 1, 0]]
