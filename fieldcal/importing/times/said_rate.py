"""A sampling rate that a file says in a number of its own, by the number's name."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

_RATE = re.compile(
    r"(?:sampl\w*_?|output_?|data_?|update_?|imu_?)?(?:rate|freq|frequency|fs|odr)"
    r"(?:_?hz)?",
    re.IGNORECASE,
)
_STEP = re.compile(
    r"(?:sampl\w*_?|time_?)?(?:interval|period|step|dt|ts)_?(s|ms|us)", re.IGNORECASE
)
_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}

DEEPEST = 20
"""Records within records that are looked at."""


def named_scalars(
    document: Any, name: str = "", depth: int = 0
) -> Iterator[tuple[str, float]]:
    """Numbers that stand alone in a document, with their names.

    >>> list(named_scalars({"imu": {"fs": 100, "acc": [1, 2]}}))
    [('imu/fs', 100.0)]
    """
    if isinstance(document, Mapping) and depth < DEEPEST:
        for key, value in document.items():
            yield from named_scalars(
                value, f"{name}/{key}" if name else str(key), depth + 1
            )
    elif isinstance(document, (int, float)) and not isinstance(document, bool):
        yield name, float(document)


def stated_rate(named: Mapping[str, float]) -> tuple[float, str] | None:
    """Rate in Hz that one of these numbers states, with its name; None if none does.

    >>> stated_rate({"payload/interval_ms": 10.0})
    (100.0, 'payload/interval_ms = 10')
    """
    for name, value in named.items():
        bare = name.rpartition("/")[2]
        where = f"{name} = {value:g}"
        if _RATE.fullmatch(bare) and 0 < value < float("inf"):
            return value, where
        if (said := _STEP.fullmatch(bare)) and 0 < value < float("inf"):
            return 1 / (value * _SECONDS[said[1].lower()]), where
    return None
