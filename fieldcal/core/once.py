"""What is computed of a block of samples once, however many steps ask for it."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from fieldcal.core.samples import Block

P = ParamSpec("P")
T = TypeVar("T")


def once_per_block(
    compute: Callable[Concatenate[Block, P], T],
) -> Callable[Concatenate[Block, P], T]:
    """Remember what a function returns for a block for as long as the block is in use.

    Blocks are not changed after they are made, so the answer stays true. It is the same
    object for all that ask: functions so decorated return what nobody changes either.
    Of further arguments, arrays are compared by their values.

    >>> import numpy as np
    >>> count_rows = once_per_block(lambda block, first: len(block.t[first:]))
    >>> count_rows(Block.of(np.zeros(2), np.zeros((2, 3))), 1)
    1
    """
    known: WeakKeyDictionary[Block, dict[Hashable, T]] = WeakKeyDictionary()

    @wraps(compute)
    def remembered(block: Block, /, *args: P.args, **kwargs: P.kwargs) -> T:
        answers = known.setdefault(block, {})
        key = tuple(map(_by_value, (*args, *kwargs.items())))
        if key not in answers:
            answers[key] = compute(block, *args, **kwargs)
        return answers[key]

    return remembered


def _by_value(argument: object) -> Hashable:
    """What an argument is compared by."""
    if isinstance(argument, np.ndarray):
        return argument.shape, argument.dtype.str, argument.tobytes()
    return argument
