"""Reduction of a session to what it states about effects that sessions may share.

All that belongs to the session alone (bias, scale factors, orientations, instability,
random walks) is eliminated with its sizes in that session. What remains is

    M = T (G_kk - G_ka C G_ak) T,  q = T (b_k - G_ka C b_a),  C = (G_aa + S^-2)^-1  (1)

with T typical sizes. M and q of sessions that share an effect are added; for the
notation see `model.evidence.gram`. An effect with a time constant has columns at powers
of two of a second, so that all sessions have the same columns. An effect with an
instant belongs to one session.

A smooth function that no effect makes keeps its columns if it explains the session:
several sessions together may show that it is an effect that they share.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.diagnosis.explain import Explanation
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.search.set_at_instability import with_typical_calibration

MAX_LOG_TIME_DISTANCE = 0.1
"""Largest distance of a session's time constant from a power of two, ln."""


@dataclass(frozen=True, slots=True)
class SharedColumn:
    """A parameter of an effect that sessions may share.

    Attributes
    ----------
    effect, part : id of the effect, and triad if it has one
    shape : value of the time constant, empty if there is none
    name, unit, typical : name, unit and typical size of the parameter
    chance : prior probability that a session has the effect
    variants : numbers of the variants of the effect that contain the parameter; a
        variant is the effect on some of its axes, or on all
    own : whether it belongs to a smooth function that no effect makes; no other session
        shares it

    """

    effect: str
    part: str
    shape: str
    name: str
    unit: str
    typical: float
    chance: float
    variants: tuple[int, ...] = (0,)
    own: bool = False


@dataclass(frozen=True, slots=True)
class ReducedSession:
    """A session, reduced to the effects that it may share.

    Attributes
    ----------
    columns : (k,) parameters
    matrix, rhs : M (k, k) and q (k,) of (1), in typical sizes

    """

    columns: tuple[SharedColumn, ...]
    matrix: Array
    rhs: Array

    def to_bytes(self) -> bytes:
        """Return the bytes that the store keeps: a compressed file of numpy."""
        out = io.BytesIO()
        names = json.dumps([asdict(c) for c in self.columns]).encode()
        upper = self.matrix[np.triu_indices(len(self.columns))]
        np.savez_compressed(
            out, columns=np.frombuffer(names, np.uint8), matrix=upper, pull=self.rhs
        )
        return out.getvalue()

    @classmethod
    def from_bytes(cls, data: bytes) -> ReducedSession:
        """Read the bytes that `to_bytes` returns."""
        with np.load(io.BytesIO(data), allow_pickle=False) as kept:
            told = json.loads(kept["columns"].tobytes())
            columns = tuple(
                SharedColumn(**c | {"variants": (*c["variants"],)}) for c in told
            )
            size = len(columns)
            matrix = np.zeros((size, size))
            matrix[np.triu_indices(size)] = kept["matrix"]
            matrix += np.triu(matrix, 1).T
            return cls(columns, matrix, kept["pull"])


def reduce_session(explanation: Explanation) -> ReducedSession:
    """Reduce a session by its explanation, (1)."""
    best = explanation.inferred.best
    dictionary = explanation.inferred.fit.dictionary
    wide, _ = with_typical_calibration(dictionary, best)
    own = np.ones(len(wide), dtype=bool)
    first = len(wide) - sum(len(g.columns) for _, g in best.members)
    for cause, group in best.members:
        left = _shareable(cause) or cause.kind == "unknown"
        own[first : first + len(group.columns)] = not left
        first += len(group.columns)
    state = best.state
    less = Eliminated.of(state.rows, state.columns[own], wide[own])
    groups = [
        found
        for cause in dictionary.causes
        if _shareable(cause)
        for found in _groups_on_common_grid(cause)
    ]
    groups += [(c, "", g) for c, g in best.members if c.kind == "unknown"]
    none = np.empty(0, dtype=np.intp)
    columns = np.concatenate([none, *(g.columns for _, _, g in groups)])
    typical = np.concatenate([np.empty(0), *(g.typical for _, _, g in groups)])
    matrix, rhs = less.schur_complement(columns, typical)
    named = [c for cause, shape, g in groups for c in _shared_columns(cause, shape, g)]
    return ReducedSession(tuple(named), 0.5 * (matrix + matrix.T), rhs)


def _shareable(cause: Cause) -> bool:
    """Whether other sessions may have the same cause: an effect without an instant."""
    effect = cause.variants[0].effect
    if cause.kind != "effect" or effect is None:
        return False
    return all(s.kind in ("session", "turn") for s in effect.shapes)


def _groups_on_common_grid(cause: Cause) -> Iterator[tuple[Cause, str, Group]]:
    """Groups of a cause with all its parameters, at time constants of powers of two."""
    first = cause.variants[0]
    if not first.shape:
        yield cause, "", first
        return
    near: dict[int, tuple[float, Group]] = {}
    for group in cause.variants:
        if group.params != first.params or group.origin:
            continue
        (tau,) = group.shape.values()
        power = round(np.log2(tau))
        off = abs(np.log(tau) - power * np.log(2))
        if off < near.get(power, (MAX_LOG_TIME_DISTANCE,))[0]:
            near[power] = (off, group)
    for power, (_, group) in sorted(near.items()):
        yield cause, f"{2.0**power:g} s", group


def _shared_columns(cause: Cause, shape: str, group: Group) -> Iterator[SharedColumn]:
    if group.effect is None:
        for i in range(len(group.columns)):
            yield SharedColumn(
                cause.name, cause.part, "", str(i), "", 1.0, cause.chance, own=True
            )
        return
    parts = list(dict.fromkeys(g.params for g in cause.variants))
    for index in group.params:
        p = group.effect.params[index]
        having = tuple(i for i, part in enumerate(parts) if index in part)
        yield SharedColumn(
            cause.name, cause.part, shape, p.name, p.unit, p.typical, cause.chance,
            having,
        )  # fmt: skip
