"""Work in processes: each item has one result, whatever happens to them."""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from typing import Any

import pytest

from fieldcal.core.errors import InputError
from fieldcal.fleet.workers import Pool, processes, results, scheduled


def carried_out(item: str) -> str:
    """Ends the process of items that say so."""
    if item.startswith("kill"):
        os.kill(os.getpid(), signal.SIGKILL)
    return item.upper()


def test_a_process_that_is_killed_costs_its_own_item_only() -> None:
    items = [*map(str, range(6)), "kill a", *map(str, range(6, 12)), "kill b"]
    found = list(results(items, carried_out, processes(2, [__name__])))
    assert sorted(one.item for one in found) == sorted(items), "each once"
    lost = {one.item: one.error for one in found if one.value is None}
    assert set(lost) == {"kill a", "kill b"}
    assert all("its process was killed" in said for said in lost.values())


def test_an_engine_that_gives_up_an_item_goes_on_with_the_others() -> None:
    def refused(item: str) -> str:
        if item == "b":
            raise RuntimeError("its workers died")
        return item

    pool = Pool(lambda: ThreadPoolExecutor(2), 2)
    found = {one.item: one for one in results(["a", "b", "c"], refused, pool)}
    assert found["b"].error == "b: RuntimeError: its workers died"
    assert found["a"].value == "a" and found["c"].value == "c"


def test_no_more_is_given_out_than_keeps_workers_busy() -> None:
    given: list[str] = []

    class Counting(ThreadPoolExecutor):
        def submit(self, fn: Any, /, *args: Any) -> Any:  # type: ignore[override]
            given.append(args[0])
            return super().submit(fn, *args)

    items = [str(i) for i in range(50)]
    some: Iterator[object] = results(items, str.upper, Pool(lambda: Counting(1), 1))
    next(some)
    assert len(given) <= 3


@pytest.mark.filterwarnings("ignore")
def test_a_scheduler_of_dask_does_the_same() -> None:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
        ) as cluster,
        scheduled(cluster.scheduler_address) as pool,
    ):
        assert pool.workers == 2
        found = {one.value for one in results(["a", "b", "c"], str.upper, pool)}
    assert found == {"A", "B", "C"}


def test_a_scheduler_that_is_none_is_said() -> None:
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match="no scheduler answers"):
        with scheduled("nonsense://1"):
            raise AssertionError


def test_a_pool_that_cannot_be_opened_again_says_so() -> None:
    @contextlib.contextmanager
    def shut() -> Iterator[Executor]:
        raise InputError("the engine is gone")
        yield

    with pytest.raises(InputError, match="is gone"):
        list(results(["a"], str.upper, Pool(shut, 1)))
