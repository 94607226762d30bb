"""What is computed of a block once."""

import gc
import weakref

import numpy as np

from fieldcal.core.once import once_per_block
from fieldcal.core.samples import Array, Block, Index


def block() -> Block:
    """Three samples of nothing."""
    return Block.of(np.arange(3.0), np.zeros((3, 3)))


def test_it_is_computed_once_for_a_block_and_anew_for_another() -> None:
    asked = []

    @once_per_block
    def count(one: Block) -> int:
        asked.append(one)
        return len(asked)

    first, equal = block(), block()
    assert (count(first), count(equal), count(first)) == (1, 2, 1)


def test_a_block_that_nobody_uses_is_forgotten() -> None:
    @once_per_block
    def answer(one: Block) -> float:
        return float(one.t.sum())

    one = block()
    gone = weakref.ref(one)
    assert answer(one) == 3.0
    del one
    gc.collect()
    assert gone() is None


def test_it_is_computed_anew_for_other_values_of_further_arguments() -> None:
    """Arrays are the same if their values, shape and type are."""
    asked = []

    @once_per_block
    def count(one: Block, at: Array | Index, scale: float = 1.0) -> int:
        asked.append((one, at, scale))
        return len(asked)

    one, at = block(), np.arange(4.0)
    assert (count(one, at), count(one, at.copy()), count(one, at, 2.0)) == (1, 1, 2)
    assert count(one, at.reshape(2, 2)) == 3
    assert count(one, np.arange(4)) == 4
    assert (count(one, at, scale=2.0), count(one, at)) == (5, 1)
