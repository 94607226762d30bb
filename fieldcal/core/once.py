"""What is computed of a block of samples once, however many steps ask for it."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

from fieldcal.core.samples import Block

T = TypeVar("T")


def once_per_block(compute: Callable[[Block], T]) -> Callable[[Block], T]:
    """Remember what a function returns for a block for as long as the block is in use.

    Blocks are not changed after they are made, so the answer stays true. It is the same
    object for all that ask: functions so decorated return what nobody changes either.

    >>> import numpy as np
    >>> count_rows = once_per_block(lambda block: len(block.t))
    >>> import numpy as np
    >>> count_rows(Block.of(np.zeros(2), np.zeros((2, 3))))
    2
    """
    known: WeakKeyDictionary[Block, T] = WeakKeyDictionary()

    @wraps(compute)
    def remembered(block: Block) -> T:
        if block not in known:
            known[block] = compute(block)
        return known[block]

    return remembered
