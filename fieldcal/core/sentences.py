"""Lists of words, and numbers of things, in a sentence."""

from __future__ import annotations

from collections.abc import Sequence


def join_words(words: Sequence[str], last: str = "and") -> str:
    """Words separated by commas, with `last` before the last one.

    >>> join_words(["a"]), join_words(["a", "b"]), join_words(["a", "b", "c"], "or")
    ('a', 'a and b', 'a, b or c')
    """
    return f" {last} ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def degrees_of_freedom(dof: int) -> str:
    """How many degrees of freedom there are.

    >>> degrees_of_freedom(1), degrees_of_freedom(12)
    ('1 degree of freedom', '12 degrees of freedom')
    """
    return f"{dof} degree{'' if dof == 1 else 's'} of freedom"
