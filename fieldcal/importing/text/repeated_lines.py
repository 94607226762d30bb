"""What comes again and again in a text: shapes of lines, and labels of values."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Sequence

from fieldcal.importing.words.heading_words import heading_meaning
from fieldcal.importing.words.sensor_words import AXES

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
"""A number as programs print it."""

MIN_LABEL_SHARE = 0.5
"""Share of the commonest label's lines in which others are no column."""

_WORD = re.compile(r"[A-Za-z_]\w*")
_NAMED = re.compile(r"([A-Za-z_]\w*)\s*[:=]")


def line_shape(line: str) -> str:
    """A line without its numbers: the constant text of a program's output.

    >>> line_shape("Temperature 25.31 deg C") == line_shape("Temperature -1 deg C")
    True
    """
    return re.sub(NUMBER, "", line).strip()


def repeated_shapes(lines: Iterable[str], names: Iterable[str]) -> set[str]:
    """Shapes that come more than once, of lines that say none of these names.

    What has such a name and no value is a damaged row.

    >>> repeated_shapes(["--", "ax: nan", "--", "ax: nan", "ready"], ["ax", "ay", "az"])
    {'--'}
    """
    words = {w for name in names for w in _WORD.findall(name.partition(" [")[0])}
    seen = Counter(
        line_shape(line) for line in lines if not words & {*_NAMED.findall(line)}
    )
    return {one for one, times in seen.items() if times > 1 and one}


def count_sentences(lines: Iterable[str]) -> int:
    """Number of lines with words that come again and again, with other numbers.

    >>> count_sentences(["Temperature is 29.1 deg C", "0.1,0.2", "Temperature is 3 C"])
    0
    >>> count_sentences(["0.1,0.2", "Roll, Yaw: 0.3, 0.4", "Roll, Yaw: -1, 7", "3,4"])
    2
    """
    shapes = Counter(line_shape(line) for line in lines)
    return sum(n for one, n in shapes.items() if n > 1 and _WORD.search(one))


def name_axes(names: Iterable[str]) -> bool:
    """Whether labels name the axes of an accelerometer or of gyroscopes.

    >>> name_axes(["ax [mg]", "ay [mg]", "az [mg]", "rate"]), name_axes(["a", "x", "y"])
    (True, False)
    """
    said = [heading_meaning(*_without_unit(name)) for name in names]
    axes = {(one.kind, one.axis) for one in said if one is not None}
    return any(all((kind, axis) in axes for axis in AXES) for kind in "ag")


def _without_unit(name: str) -> tuple[str, str]:
    """A label and its unit.

    >>> _without_unit("ax [mg]"), _without_unit("ax")
    (('ax', 'mg'), ('ax', ''))
    """
    label, _, unit = name.partition(" [")
    return label, unit.removesuffix("]")


def repeated_labels(
    rows: Iterable[Sequence[tuple[str, str]]], clocks: Collection[str]
) -> list[str]:
    """Labels that repeat, in their order."""
    seen = Counter(name for row in rows for name, _ in row)
    usual = max((m for name, m in seen.items() if name not in clocks), default=0)
    return [name for name, many in seen.items() if many >= MIN_LABEL_SHARE * usual]
