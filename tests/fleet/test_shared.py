"""Evidence of levels against a dense model, and what is named of drawn sessions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from fieldcal.fleet.levels import Grouping, LevelEffect, PooledSessions, groupings
from fieldcal.fleet.reduced import ReducedSession, SharedColumn
from fieldcal.fleet.shared import SharedFinding, SharedSearch, stack_sessions
from fieldcal.history.sessions import StoredSession
from fieldcal.model import priors

DEVICES = ("A", "A", "B", "B", "C", "C")


def test_levels_that_group_alike_are_one_and_one_has_all() -> None:
    tables = [
        {"device": d, "lot": d.lower(), "station": s, "session": str(i)}
        for i, (d, s) in enumerate(zip(DEVICES, "XYXYXY", strict=True))
    ]
    del tables[0]["station"]
    found = groupings(tables, ("device", "lot", "station", "session"))
    assert [g.names for g in found] == [("all",), ("device", "lot"), ("session",)]
    assert found[1].labels == ("A, lot a", "B, lot b", "C, lot c")
    alone = groupings([{"device": "A"}] * 3, ("device", "lot"))
    assert [(g.names, g.labels) for g in alone] == [(("device",), ("A",))]


def drawn(
    rng: np.random.Generator, rows: int = 7, columns: int = 3
) -> tuple[list[np.ndarray], list[np.ndarray], PooledSessions]:
    """Rows with white noise of one, and what is left of them."""
    design = [rng.standard_normal((rows, columns)) for _ in DEVICES]
    seen = [rng.standard_normal(rows) + 2 for _ in DEVICES]
    matrix = np.array([a.T @ a for a in design])
    rhs = np.array([a.T @ y for a, y in zip(design, seen, strict=True)])
    return design, seen, PooledSessions(matrix, rhs)


def dense(
    design: list[np.ndarray], seen: list[np.ndarray],
    parts: list[tuple[np.ndarray, np.ndarray, float]],
) -> float:  # fmt: skip
    """Density of all rows against that of noise alone; columns, groups, v of parts."""
    rows = [len(y) for y in seen]
    y = np.concatenate(seen)
    cov = np.eye(len(y))
    owner = np.repeat(np.arange(len(seen)), rows)
    for columns, index, v in parts:
        whole = np.vstack([a[:, columns] for a in design])
        cov += v**2 * whole @ whole.T * (index[owner][:, None] == index[owner])
    none = multivariate_normal(cov=np.eye(len(y))).logpdf(y)
    return float(multivariate_normal(cov=cov).logpdf(y) - none)


def test_the_evidence_is_that_of_all_rows_together() -> None:
    rng = np.random.default_rng(3)
    design, seen, sessions = drawn(rng)
    level = Grouping.of("device", DEVICES)
    one = LevelEffect(np.array([0, 2]), level)
    found = sessions.posterior([one])
    truth = logsumexp(
        [
            dense(design, seen, [(one.columns, level.index, v)]) + np.log(p)
            for v, p in zip(priors.SIZES, priors.density(), strict=True)
        ]
    )
    assert found.score == pytest.approx(truth, abs=1e-9)
    empty = sessions.posterior([])
    assert empty.score == 0.0
    assert sessions.evidence_gain(empty, one) == pytest.approx(truth, abs=1e-9)


def test_what_a_further_effect_adds_is_exact_beside_the_others() -> None:
    rng = np.random.default_rng(4)
    design, seen, sessions = drawn(rng)
    first = LevelEffect(np.array([0, 1]), Grouping.of("device", DEVICES))
    second = LevelEffect(np.array([2]), Grouping.of("session", list("abcdef")))
    base = sessions.posterior([first])
    known = (first.columns, first.grouping.index, base.sizes[0])
    before = dense(design, seen, [known])
    truth = logsumexp(
        [
            dense(design, seen, [known, (second.columns, second.grouping.index, v)])
            + np.log(p)
            for v, p in zip(priors.SIZES, priors.density(), strict=True)
        ]
    )
    assert sessions.evidence_gain(base, second) == pytest.approx(
        truth - before, abs=1e-8
    )
    both = sessions.posterior([first, second])
    whole = np.vstack(design)
    owner = np.repeat(np.arange(6), 7)
    parts = [
        whole[:, [c]] * (m.grouping.index[owner] == g)[:, None] * v
        for m, v in zip(both.effects, both.sizes, strict=True)
        for g in range(len(m.grouping.labels))
        for c in m.columns
    ]
    ridge = np.hstack(parts)
    scale = np.repeat(both.sizes, [m.width for m in both.effects])
    left = np.linalg.inv(ridge.T @ ridge + np.eye(len(scale)))
    mean = left @ ridge.T @ np.concatenate(seen) * scale
    np.testing.assert_allclose(both.mean, mean, atol=1e-9)
    np.testing.assert_allclose(
        both.covariance, left * scale * scale[:, None], atol=1e-9
    )


NAMES = ("cross_coupling", "g_sensitivity", "base_tilt")


def column(effect: str, name: str) -> SharedColumn:
    return SharedColumn(effect, "", "", name, "1", 1e-3, 0.01)


COLUMNS = tuple(column(effect, name) for effect in NAMES for name in ("x", "y"))


def fleet(
    rng: np.random.Generator, count: int, value: np.ndarray, only: str | None = None
) -> list[StoredSession]:
    """Sessions of ten devices on four stations, each of which shows 1 sigma = 0.5.

    `value` (6,), in sigmas, is in every session, or in those of one station.
    """
    out = []
    for i in range(count):
        mixed = np.eye(6) + 0.2 * rng.standard_normal((6, 6))
        matrix = 4.0 * mixed.T @ mixed
        station = "PQRS"[rng.integers(4)]
        there = 0.5 * value * (only is None or station == only)
        noise = np.linalg.cholesky(matrix) @ rng.standard_normal(6)
        small = ReducedSession(COLUMNS, matrix, matrix @ there + noise)
        out.append(
            StoredSession(
                f"/s/{i}", f"A{i % 10}", {"station": station}, reduced=small.to_bytes()
            )
        )
    return out


def named(found: list[SharedFinding]) -> list[tuple[str, str]]:
    return [(f.effect.key[0], f.level) for f in found]


def test_what_is_two_sigma_in_each_session_is_certain_in_all() -> None:
    rng = np.random.default_rng(5)
    value = np.array([0, 0, 2.0, 0, 0, 0])
    (one,) = SharedSearch(fleet(rng, 24, value)).run()
    assert (one.effect.key[0], one.level) == ("g_sensitivity", "all")
    assert one.probability > 0.99 and one.level_probability > 0.9
    value_, sigma = one.values[0, 0], one.sigmas[0, 0]
    assert abs(value_ - 1e-3) < 4 * sigma and sigma < 2e-4


def test_a_station_is_told_from_devices_and_sessions() -> None:
    rng = np.random.default_rng(6)
    value = np.array([0, 0, 0, 0, 4.0, -4.0])
    (one,) = SharedSearch(fleet(rng, 24, value, "R")).run()
    assert (one.effect.key[0], one.level) == ("base_tilt", "station")
    at = one.effect.level_effect.grouping.labels.index("R")
    assert np.argmax(np.abs(one.values[:, 0])) == at
    document = one.to_json()
    assert set(document["groups"]) == {"P", "Q", "R", "S"}
    assert document["level"] == ["station"] and document["probability"] > 0.99


def test_of_what_every_session_has_for_itself_the_level_is_the_session() -> None:
    told = []
    for seed in range(9, 14):
        rng = np.random.default_rng(seed)
        sessions = []
        for one in fleet(rng, 16, np.zeros(6)):
            small = ReducedSession.from_bytes(one.reduced or b"")
            push = 4 * rng.standard_normal() * np.eye(6)[0]
            more = replace(small, rhs=small.rhs + small.matrix @ push)
            sessions.append(replace(one, reduced=more.to_bytes()))
        told.append(named(SharedSearch(sessions).run()))
    assert told == [[("cross_coupling", "session")]] * 5


@pytest.mark.statistical
def test_nothing_is_named_where_nothing_is() -> None:
    rng = np.random.default_rng(8)
    for _ in range(20):
        assert named(SharedSearch(fleet(rng, 10, np.zeros(6))).run()) == []


def test_time_constants_count_that_all_sessions_have() -> None:
    def warm(*shapes: str) -> ReducedSession:
        columns = tuple(SharedColumn("warm_up", "acc", s, "ax", "m/s^2", 1e-2, 0.1)
                        for s in shapes)  # fmt: skip
        return ReducedSession(columns, np.eye(len(shapes)), np.ones(len(shapes)))

    other = ReducedSession(COLUMNS[:2], np.eye(2), np.ones(2))
    columns, matrix, rhs = stack_sessions([warm("8 s", "16 s"), warm("16 s"), other])
    assert [(c.effect, c.shape) for c in columns] == [
        ("warm_up", "16 s"), *(("cross_coupling", "") for _ in range(2)),
    ]  # fmt: skip
    assert matrix[2, 0, 0] == 0.0 and rhs[1, 0] == 1.0


def strange(rng: np.random.Generator, only: str, tilts: bool) -> list[StoredSession]:
    """Sessions that explain themselves by a function without physics at one station.

    Where it `tilts`, that function stands in for base_tilt; else for no effect.
    """
    own = SharedColumn("beta", "ax", "", "0", "", 1.0, 5e-4, own=True)
    out = []
    for i in range(16):
        station = "PQRS"[i % 4]
        rows = 2 * rng.standard_normal((20, 6))
        function = rows[:, 4] if tilts else 2 * rng.standard_normal(20)
        seen = rng.standard_normal(20) + 5 * function * (station == only)
        alone = station == only
        design = np.column_stack([rows, function]) if alone else rows
        columns = (*COLUMNS, own) if alone else COLUMNS
        small = ReducedSession(columns, design.T @ design, design.T @ seen)
        out.append(
            StoredSession(
                f"/s/{i}", f"A{i}", {"station": station}, reduced=small.to_bytes()
            )
        )
    return out


def test_what_a_session_alone_cannot_name_others_may() -> None:
    found = SharedSearch(strange(np.random.default_rng(1), "R", tilts=True)).run()
    assert named(found) == [("base_tilt", "station")]


def test_what_no_effect_makes_is_named_by_nobody() -> None:
    found = SharedSearch(strange(np.random.default_rng(2), "R", tilts=False)).run()
    assert named(found) == []


def test_some_axes_of_an_effect_may_be_there_alone() -> None:
    columns = tuple(replace(c, variants=(0, 1) if c.name == "x" else (0,))
                    for c in COLUMNS)  # fmt: skip
    rng = np.random.default_rng(3)
    some = []
    for one in fleet(rng, 20, np.array([0, 0, 2.0, 0, 0, 0])):
        small = ReducedSession.from_bytes(one.reduced or b"")
        some.append(replace(one, reduced=replace(small, columns=columns).to_bytes()))
    (found,) = SharedSearch(some).run()
    assert [c.name for c in found.effect.columns] == ["x"] and found.level == "all"
