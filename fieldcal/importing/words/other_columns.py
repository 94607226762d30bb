"""Names of columns that only grow and are no times: counters, and what a table does."""

from __future__ import annotations

from fieldcal.importing.words.heading_units import is_unit_of
from fieldcal.importing.words.heading_words import heading_meaning, words_in_name
from fieldcal.importing.words.name_and_unit import name_unit_splits

COUNTERS = ("packet", "packets", "counter", "count", "cntr", "cnt", "index", "idx",
            "number", "nr", "no", "frame", "row", "line", "sample", "samples", "seq",
            "sequence", "id", "n")  # fmt: skip
"""Words of columns that count rows or messages."""

TURNED = ("rate", "rates", "speed", "rpm", "angle", "commanded", "command", "cmd",
          "setpoint", "target")  # fmt: skip
"""Words of what a table does, whose steps may only grow."""

COUNTED = ("data", "message", "messages", "msg", "record", "records")
"""Words of what is counted, which stand beside them."""


def is_counter(name: str) -> bool:
    """Whether a name is that of a counter, whose numbers are no times.

    >>> [is_counter(one) for one in ("Packet number", "DATA_CNTR", "sample_time", "")]
    [True, True, False, False]
    """
    words = words_in_name(name)
    return bool({*words} & {*COUNTERS}) and {*words} <= {*COUNTERS, *COUNTED}


def is_other_quantity(name: str) -> bool:
    """Whether a name is that of a quantity that may only grow, and is no time.

    >>> [is_other_quantity(one) for one in ("table rate (deg/s)", "rpm", "T [K]", "c1")]
    [True, True, True, False]
    """
    said = heading_meaning(name)
    if said is not None:
        return said.kind == "temperature"
    units = {unit for _, unit in name_unit_splits(name, "") if unit}
    others = {unit for unit in units if not is_unit_of(unit, "t")}
    return bool(others or {*words_in_name(name)} & {*TURNED})
