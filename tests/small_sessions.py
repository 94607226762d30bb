"""Sessions of a few rows, and dictionaries of a few causes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.wander import Wander
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.rows.averages import Rows
from fieldcal.model.search.selection import Search
from fieldcal.model.state import State
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.linear_system import gram
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.physics.experience import Experience

LADDER = (
    *((0, 0), (22.5, 0), (45, 0), (45, 5), (22.5, 5), (0, 5)),
    *((-22.5, 2.5), (-45, 5), (-45, 0)),
)
G = 9.81
SPACING_S, WINDOW_S, LEAD_S = 40.0, 30.0, 2.0
SD = np.array([3e-4] * 3 + [2e-5] * 3)
"""White noise of a row, m/s^2 and rad/s: some seconds of what tactical grade has."""


def ladder(rows: int = 3, free: Sequence[int] = (), **known: Any) -> Experience:
    """Rows at rest in nine positions; the orientation of some may not be known."""
    position = np.repeat(np.arange(len(LADDER)), rows)
    alpha, beta = np.deg2rad(LADDER)[position].T.copy()
    inside = np.tile((np.arange(rows) + 0.5) / rows * WINDOW_S, len(LADDER))
    t = SPACING_S * position + inside
    exact = Experience.at_rest(alpha, beta, G)
    hidden = np.isin(position, free)
    alpha[hidden] = beta[hidden] = np.nan
    has = {
        "t": t, "since_start": t, "since_turn": inside + LEAD_S, "position": position,
        "warming": 2e-3 * t, "heating": np.full(len(t), 2e-3), "f": exact.f,
        "latitude": 0.88,
    }  # fmt: skip
    return Experience.at_rest(alpha, beta, G, **(has | known))


def dictionary(x: Experience, common: float = 0.0) -> Dictionary:
    """Everything that may have made the rows; no turn between windows is seen."""
    held = len(np.unique(x.position))
    return Dictionary(
        x, np.ones((len(x), 6), bool), np.array([x.since_turn]),
        np.full((held, 6), common), np.ones(6), False, Wander.none(),
    )  # fmt: skip


def nominal(places: int = len(LADDER)) -> State:
    """What a perfect device has."""
    return State(np.zeros(6), np.ones(6), np.zeros((places, 2)), np.zeros(3))


def rows_of(x: Experience, y: Array) -> Rows:
    """Rows with white noise as usual."""
    sd = np.tile(SD, (len(x), 1))
    span = np.column_stack([x.t, x.t])
    still = np.zeros(len(x))
    return Rows(x, y, sd, np.zeros_like(sd), np.full(len(x), 1.0), SD, span, still)


@dataclass(frozen=True)
class Session:
    """A dictionary with the rows of each channel about the nominal state.

    Attributes
    ----------
    dictionary : with the columns of its causes only
    linear : rows of each channel, nothing recorded yet

    """

    dictionary: Dictionary
    linear: tuple[LinearRows, ...]

    @classmethod
    def of(
        cls, x: Experience, keys: Iterable[str], chance: float | None = None
    ) -> Session:
        """A session with some causes; all with the same chance, if one is given."""
        whole = dictionary(x)
        by_key = {c.key: c for c in whole.causes}
        causes = [by_key[key] for key in keys]
        if chance is not None:
            causes = [replace(c, chance=chance) for c in causes]
        flat = np.hstack([x.f, x.w])
        linear = WindowSystem(rows_of(x, flat), whole).linearised(nominal())
        kept = np.unique(
            np.concatenate(
                [g.columns for g in whole.always]
                + [g.columns for c in causes for g in c.variants]
            )
        )
        return cls(
            _narrowed(whole, causes, kept), tuple(_only(p, kept) for p in linear)
        )

    @property
    def design(self) -> Array:
        """Derivative of every output by every column, (n, 6, k)."""
        out = np.zeros((len(self.dictionary.x), 6, self.dictionary.width))
        for part in self.linear:
            table = part.design / part.weight[:, None]
            out[part.rows[:, None], part.channel, part.columns] = table
        return out

    def recorded(self, off: Array) -> list[LinearRows]:
        """Rows of which y - h is (n, 6)."""
        return [
            replace(p, white=off[p.rows, p.channel] * p.weight) for p in self.linear
        ]

    def gram(self, off: Array) -> Gram:
        """What such rows say."""
        at_rest = np.zeros(self.dictionary.width)
        return gram(self.recorded(off), self.dictionary, at_rest)

    def search(self, off: Array) -> Search:
        """The search over such rows."""
        return Search(Sets(self.dictionary, self.gram(off)))

    def noise(self, rng: np.random.Generator, tau: Array | None = None) -> Array:
        """White noise, and what windows are off by each for itself, (n, 6)."""
        x = self.dictionary.x
        out = SD * rng.standard_normal((len(x), 6))
        if tau is not None:
            out += (rng.standard_normal((len(LADDER), 6)) * tau[:6])[x.position]
        return out


def _narrowed(whole: Dictionary, causes: Sequence[Cause], kept: Index) -> Dictionary:
    """The dictionary with some causes and their columns, numbered anew."""

    def moved(group: Group) -> Group:
        return replace(group, columns=np.searchsorted(kept, group.columns))

    out = copy(whole)
    out.width = len(kept)
    out.always = [moved(g) for g in whole.always]
    out.causes = [replace(c, variants=tuple(map(moved, c.variants))) for c in causes]
    return out


def _only(part: LinearRows, kept: Index) -> LinearRows:
    there = np.isin(part.columns, kept)
    columns = np.searchsorted(kept, part.columns[there])
    return replace(part, columns=columns, design=part.design[:, there])
