"""What the fields of a table of Arrow hold: names, units, times, names of devices."""

from __future__ import annotations

import re
from typing import Any

from fieldcal.importing.headings.heading import Column
from fieldcal.importing.words.device_names import may_count
from fieldcal.importing.words.heading_words import heading_meaning

_PLACE = re.compile(r"\.([0-2])$")


def may_name_devices(field: Any) -> bool:
    """Whether a column that is named so holds names or numbers of devices."""
    import pyarrow as pa

    kind = field.type
    kind = kind.value_type if pa.types.is_dictionary(kind) else kind
    counts = bool(pa.types.is_integer(kind))
    return (counts and not may_count(field.name)) or is_text(kind)


def holds_times(field: Any) -> bool:
    """Whether a column holds times, by its name or as they are stored."""
    column = column_of(field)
    said = heading_meaning(column.name, column.unit)
    return said is not None and said.kind == "t"


def as_texts(column: Any) -> Any:
    """A column of names or whole numbers as texts."""
    import pyarrow as pa

    return column.cast(pa.string())


def is_text(kind: Any) -> bool:
    """Whether a type of Arrow is that of texts."""
    import pyarrow as pa

    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


def column_of(field: Any) -> Column:
    """A column with its name and unit; one of times is called so."""
    import pyarrow as pa

    if not (pa.types.is_timestamp(field.type) or pa.types.is_duration(field.type)):
        # of a list: acc.0 is the axis of an array
        called = _PLACE.sub(r"[\1]", field.name)
        return Column(field.name, called, _unit(field))
    said = heading_meaning(field.name)
    named = said is not None and said.kind == "t"
    return Column(field.name, field.name if named else "time", "s")


def _unit(field: Any) -> str:
    """Unit that a column states."""
    said = field.metadata or {}
    text: bytes = said.get(b"unit", said.get(b"units", b""))
    return text.decode(errors="replace")
