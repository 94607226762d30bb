"""Lists of numbers in a JSON document, each with the name of what it lies in.

A list of records becomes a list for each of their fields: ``{"acc": {"x": 1}}`` gives
``acc_x``, three numbers in a list are axes, and texts that are times of a clock become
seconds. Records that hold several samples each say when the first of them was taken;
the others lie evenly until the next record begins, where none was lost between. Where
the texts or the fields of records differ, such as the name of a sensor, each kind has
lists of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.records.json_record import (
    DEEPEST,
    JsonRecord,
    floats,
    is_number,
    join_devices,
    read_record,
)
from fieldcal.importing.records.pandas_json import records_of_frame
from fieldcal.importing.records.record_pairs import pair_records
from fieldcal.importing.records.sensor_numbers import with_named_sensors
from fieldcal.importing.times.clock_text import ClockText
from fieldcal.importing.times.fifo_time import GAP_BATCHES
from fieldcal.importing.words.heading_words import heading_meaning
from fieldcal.importing.words.listed_axes import listed_axes
from fieldcal.importing.words.sensor_words import AXES


def json_lists(
    document: Any,
    name: str = "",
    says: list[str] | None = None,
    order: Sequence[str] = AXES,
) -> Iterator[tuple[str, Array]]:
    """Lists (n,) or (n, k) of a document, with their names.

    Parameters
    ----------
    document, name : and what it lies in
    says : grows by what the user must know, a sentence each
    order : axes of three numbers in a list, which a text beside it may list

    >>> [(n, v.tolist()) for n, v in json_lists([{"t": 0, "a": {"x": 1}}, {"t": 1}])]
    [('t', [0.0, 1.0]), ('a_x', [1.0, nan])]
    """
    if (frame := records_of_frame(document)) is not None:
        document = frame
    if isinstance(document, Mapping):
        texts = (one for one in document.values() if isinstance(one, str))
        order = next(filter(None, map(listed_axes, texts)), order)
        for key, value in document.items():
            if name.count("/") < DEEPEST:
                full = f"{name}/{key}" if name else key
                yield from json_lists(value, full or "value", says, order)
    elif not isinstance(document, list) or len(document) <= 1:
        return
    elif all(is_number(one) for one in document):
        yield name or "list", floats(document)
    elif all(isinstance(one, list) for one in document):
        if len({len(one) for one in document}) == 1 and document[0]:
            rows = [floats(one) for one in map(_flat, document)
                    if all(map(is_number, one))]  # fmt: skip
            if len(rows) == len(document) and len({*map(len, rows)}) == 1:
                yield name or "list", np.array(rows)
    else:
        records = [read_record(one, order=order)
                   for one in document if isinstance(one, Mapping)]  # fmt: skip
        records = [*with_named_sensors(records)]
        for bare, values in _fields(records, [] if says is None else says):
            yield (f"{name}/{bare}" if name else bare), values


def _flat(row: Sequence[Any]) -> list[Any]:
    """A row without the lists within it: ``[t, [ax, ay, az], [gx, gy, gz]]``."""
    inner = [one if isinstance(one, list) else [one] for one in row]
    return [value for one in inner for value in one]


def _fields(
    records: Sequence[JsonRecord], says: list[str]
) -> Iterator[tuple[str, Array]]:
    """Values of each field, (n,), with the kind of its records before its name."""
    kinds = {kind: _lists(alike) for kind, alike in _kinds(records).items()}
    if len(kinds) > 1 and (pair := pair_records(kinds)) is not None:
        says.append(
            f"of its records, those of {pair.acc} are taken, each with the nearest of"
            f" {pair.gyr}"
        )
        says += pair.says
        yield from pair.fields.items()
        return
    for prefix, fields in kinds.items():
        for key, values in fields.items():
            yield (f"{prefix}_{key}" if prefix else key), values


def _kinds(records: Sequence[JsonRecord]) -> dict[str, list[JsonRecord]]:
    """Records of the same kind, by the texts in which they differ from others."""
    names = {name for one in records for name in one.texts}
    differ = [
        name
        for name in sorted(names)
        if 1 < len({one.texts.get(name) for one in records}) <= len(records) / 2
    ]
    found: dict[str, list[JsonRecord]] = {}
    for one in records:
        said = [one.texts.get(n, "") for n in differ]
        found.setdefault("_".join(filter(None, said)), []).append(one)
    return found


def _lists(records: Sequence[JsonRecord]) -> dict[str, Array]:
    """Values of each field, (n,), in the order of the records."""
    records = join_devices(records)
    if any(one.samples for one in records):
        return _sample_fields([one for one in records if one.samples])
    found = {
        name: np.array([one.numbers.get(name, np.nan) for one in records])
        for name in dict.fromkeys(name for one in records for name in one.numbers)
    }
    return found | {
        f"utc {name} [s]": _seconds([one.clocks.get(name, "") for one in records])
        for name in dict.fromkeys(name for one in records for name in one.clocks)
    }


def _seconds(texts: Sequence[str]) -> Array:
    clock = ClockText()
    read = (clock.seconds(text) for text in texts)
    return np.array([np.nan if since is None else since for since in read])


def _sample_fields(records: Sequence[JsonRecord]) -> dict[str, Array]:
    """Values of each field of samples, if a record contains several samples."""
    many = [min(len(inner) for inner in one.samples.values()) for one in records]
    bare = [one._replace(samples={}) for one in records]
    whole = [
        read_record({name: inner[i] for name, inner in one.samples.items()})
        for one, m in zip(records, many, strict=True)
        for i in range(m)
    ]
    found = _lists(whole) if not any(one.samples for one in whole) else {}
    for name, values in _lists(bare).items():
        said = heading_meaning(name)
        is_time = said is not None and said.kind == "t"
        spread = (
            _evenly_spaced_times(values, many) if is_time else np.repeat(values, many)
        )
        found[name] = spread
    return found


def _evenly_spaced_times(begins: Array, many: Sequence[int]) -> Array:
    """Times of samples at equal intervals from one record to the next.

    Behind a pause, and in the last record, they lie as far apart as they usually do.
    """
    number = np.array(many)
    away = np.append(np.diff(begins), np.nan) / np.maximum(number, 1)
    forward = away[away > 0]
    usual = float(np.median(forward)) if len(forward) else 0.0
    step = np.where((away > 0) & (away < GAP_BATCHES * usual), away, usual)
    place = np.arange(number.sum()) - np.repeat(np.cumsum(number) - number, number)
    times: Array = np.repeat(begins, number) + place * np.repeat(step, number)
    return times
