"""Events of the link as marks, also of links that are read ahead."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fieldcal.core.samples import Block, Grain
from fieldcal.drivers.driver import Driver, LinkHealth
from fieldcal.run.link_marks import LinkMarks
from fieldcal.session.marks import gaps_without_restart


class Kept:
    """Marks in a list."""

    def __init__(self) -> None:
        self.marks: list[dict[str, Any]] = []

    def mark(self, event: str, **what: Any) -> None:
        self.marks.append({"event": event, **what})


def marked(
    rate: float,
    away: float,
    *,
    counted_before: bool,
    since_power_on: bool = False,
    restarts: int = 0,
) -> list[dict[str, Any]]:
    """Marks of a link that is away once; who reads it may count that ahead."""
    health, kept = LinkHealth(since_power_on=since_power_on), Kept()
    link = SimpleNamespace(
        health=health, notes={}, grain=Grain(), read_back=SimpleNamespace(same=None)
    )
    marks = LinkMarks(cast(Driver, link), kept)
    t = np.arange(400) / rate
    t[203:] += away
    for i in range(0, 400, 8):
        if i == (160 if counted_before else 200) and away:
            health.gaps, health.missing = 1, round(away * rate)
            health.restarts = restarts
        marks.take(Block.of(t[i : i + 8], np.zeros((8, 3))))
    marks.end()
    return [mark for mark in kept.marks if mark["event"] == "link"]


@pytest.mark.parametrize("counted_before", [False, True])
def test_a_long_gap_is_marked_where_it_is(counted_before: bool) -> None:
    some = marked(100.0, 2.0, counted_before=counted_before)
    gap = [m for m in some if m.get("from_s") == pytest.approx(2.02)]
    assert len(gap) == 1 and gap[0]["to_s"] == pytest.approx(4.03)
    assert sum(m.get("missing", 0) for m in some) == 200


def test_a_slow_device_has_no_gaps() -> None:
    assert marked(1.0, 0.0, counted_before=False) == []


@pytest.mark.parametrize("since_power_on", [False, True])
@pytest.mark.parametrize("restarts", [0, 1])
def test_a_clock_since_power_on_tells_a_gap_without_a_restart(
    since_power_on: bool, restarts: int
) -> None:
    marks = marked(
        100.0, 2.0, counted_before=False, since_power_on=since_power_on,
        restarts=restarts,
    )  # fmt: skip
    told = since_power_on and not restarts
    sure = next(gaps_without_restart(marks), None)
    assert (sure is not None) == told
    assert sure is None or sure == pytest.approx((2.02, 4.03))
