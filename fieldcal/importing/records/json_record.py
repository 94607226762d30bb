"""A record of JSON, with what lies within it named after what it lies in.

Several IMUs may lie in a list of each record, told apart by a name or a number that is
the same in all: ``{"t": 1, "imus": [{"id": 0, "acc": …}, {"id": 1, "acc": …}]}``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.times.clock_text import is_clock
from fieldcal.importing.words.device_names import tells_devices
from fieldcal.importing.words.heading_words import (
    bare_axis,
    heading_meaning,
    words_in_name,
)
from fieldcal.importing.words.sensor_words import AXES

DEEPEST = 20
"""Records within records that are looked at."""


class JsonRecord(NamedTuple):
    """A record, without records within it.

    Attributes
    ----------
    numbers : by name; nan where there is none
    clocks : times of a clock by name
    texts : other texts by name
    samples : records of several samples by name

    """

    numbers: dict[str, float]
    clocks: dict[str, str]
    texts: dict[str, str]
    samples: dict[str, Sequence[Any]]


def is_number(value: Any) -> bool:
    """Whether a value is a number, or one that is missing."""
    return value is None or (
        isinstance(value, (int, float)) and not isinstance(value, bool)
    )


def floats(values: Sequence[Any]) -> Array:
    """Numbers (n,); nan where one is missing."""
    return np.array([_float(value) for value in values])


def _float(value: Any) -> float:
    try:
        return float("nan" if value is None else value)
    except OverflowError:
        return float("inf")


def _number_in_text(name: str, text: str) -> float | None:
    """A number that is written as text; None if it is none or a device's number.

    >>> written = (("z", "9.81"), ("time", "17"), ("device", "2"))
    >>> tuple(_number_in_text(name, text) for name, text in written)
    (9.81, 17.0, None)
    """
    try:
        number = float(text)
    except ValueError:
        return None
    channel = (
        heading_meaning(name) is not None or bare_axis(words_in_name(name)) is not None
    )
    return number if channel or "." in text else None


def read_record(
    value: Mapping[str, Any],
    name: str = "",
    depth: int = 0,
    order: Sequence[str] = AXES,
) -> JsonRecord:
    """A record, with the names of what lies within it joined.

    Parameters
    ----------
    value, name, depth : the record, what it lies in, and how many records that are
    order : axes of three numbers in a list

    """
    found = JsonRecord({}, {}, {}, {})
    for key, inner in value.items():
        full = f"{name}_{key}".strip("_") or "value"
        if isinstance(inner, Mapping) and depth < DEEPEST:
            within = read_record(inner, full, depth + 1, order)
            found.numbers.update(within.numbers)
            found.clocks.update(within.clocks)
            found.texts.update(within.texts)
            found.samples.update(within.samples)
        elif is_number(inner):
            found.numbers[full] = _float(inner)
        elif (
            isinstance(inner, str)
            and (number := _number_in_text(full, inner)) is not None
        ):
            found.numbers[full] = number
        elif isinstance(inner, str) and is_clock(inner):
            found.clocks[full] = inner
        elif isinstance(inner, str):
            found.texts[full] = inner
        elif isinstance(inner, list) and all(is_number(one) for one in inner):
            axes = order if len(inner) == len(AXES) else range(len(inner))
            pairs = zip(axes, inner, strict=True)
            found.numbers.update({f"{full}_{a}": _float(v) for a, v in pairs})
        elif isinstance(inner, list) and inner:
            found.samples[full] = inner
    return found


def join_devices(records: Sequence[JsonRecord]) -> Sequence[JsonRecord]:
    """Records in which the fields of a list of IMUs have the IMUs' names."""
    names = [name for name in records[0].samples if _devices(records, name)]
    return [_with_devices(one, names) for one in records] if names else records


def _devices(records: Sequence[JsonRecord], name: str) -> bool:
    """Whether a list always contains one record of each of several devices."""
    said = [_names(one.samples.get(name, [])) for one in records]
    return 1 < len(said[0]) == len({*said[0]}) and said.count(said[0]) == len(said)


def _names(inner: Sequence[Any]) -> list[str]:
    """Names of the records of a list, if they are stated."""
    if not all(isinstance(one, Mapping) for one in inner):
        return []
    keys = [key for key in inner[0] if tells_devices(key)] if inner else []
    return [str(one.get(keys[0], "")) for one in inner] if keys else []


def _with_devices(one: JsonRecord, names: Sequence[str]) -> JsonRecord:
    rest = {k: v for k, v in one.samples.items() if k not in names}
    found = JsonRecord({**one.numbers}, {**one.clocks}, {**one.texts}, rest)
    for name in names:
        inner = one.samples[name]
        for device, fields in zip(_names(inner), inner, strict=True):
            bare = {k: v for k, v in fields.items() if not tells_devices(k)}
            within = read_record(bare, f"{name}{device}")
            found.numbers.update(within.numbers)
            found.samples.update(within.samples)
    return found
