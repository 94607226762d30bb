"""Lines whose values have names: ``ax=0.12 ay=-0.03``, ``Accel: 0.1 0.2 9.8``, JSON.

A line is either names, each with ``=`` or ``:`` and one or more numbers behind it, or
one JSON object. Numbers behind one name are called ``Accel[0]``, ``Accel[1]`` …, what
is in an object within an object ``acc.x``. A unit may follow behind a space, before a
comma, semicolon, bar or the end of the line: ``ax: 0.12 m/s^2, ay: …``.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from fieldcal.core.errors import InputError

NUMBER_PATTERN = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[nN][aA][nN]"
"""A number as devices print it; no infinity, and no digits of another script."""

_GAP = r"(?:\s*[,;|]\s*|\s+)"
_NAME = re.compile(r"([^\W\d][^=:,;|{}\"]*?)\s*[=:]\s*", re.ASCII)
_VALUES = re.compile(
    rf"(?:{NUMBER_PATTERN})(?:{_GAP}(?:{NUMBER_PATTERN}))*(?=[\s,;|]|$)", re.ASCII
)
_UNIT = re.compile(r"\s+([A-Za-z][\w/^*-]*)(?=\s*(?:[,;|]|$))", re.ASCII)
_BEHIND = re.compile(rf"{_GAP}|\s*$", re.ASCII)


class NamedValues(NamedTuple):
    """Numbers of a line by their names, and units by the same names where it has any.

    A number that is beyond what a double holds is infinite.
    """

    values: dict[str, float]
    units: dict[str, str]


class ChannelMap:
    """Which names in a line are which channels: ``ax=aX,ay=aY,az=aZ,t=ms``.

    Parameters
    ----------
    text : the pairs, channel first
    known : the channels there are

    Raises
    ------
    InputError
        If a pair is none, its channel is unknown, or a name occurs twice.

    """

    def __init__(self, text: str, known: Sequence[str]) -> None:
        pairs = [part.partition("=") for part in text.split(",")]
        self.channels = [channel for channel, _, _ in pairs]
        self._names = [name for _, _, name in pairs]
        for channel, name in zip(self.channels, self._names, strict=True):
            if channel not in known or not name:
                raise InputError(
                    f"map={text}: {channel!r} is not CHANNEL=NAME with a channel of"
                    f" {', '.join(known)}"
                )
        self._others = _next_in_lists(self._names)
        if len(set(self._names)) < len(self._names):
            raise InputError(f"map={text}: a name occurs twice")

    def values(self, line: str) -> list[float] | None:
        """Values of the channels; None of a line that is broken or lacks a name.

        So is one with more numbers behind a name than the map takes from there: the
        point of 9.8 may have become a blank.
        """
        said = read_named_line(line)
        if said is None or not said.values.keys() >= set(self._names):
            return None
        if not self._others.isdisjoint(said.values):
            return None
        return [said.values[name] for name in self._names]


def _next_in_lists(names: Sequence[str]) -> set[str]:
    """Names of what would stand behind the last numbers of lists."""
    found = [re.fullmatch(r"(.*)\[(\d+)\]", name) for name in names]
    behind = {f"{one[1]}[{int(one[2]) + 1}]" for one in found if one}
    return behind - set(names)


def read_named_line(line: str) -> NamedValues | None:
    """Read all that has a name; None if the line is broken or a name occurs twice.

    >>> read_named_line("Accel: 0.1 0.2 9.8 Gyro: 1, 2, 3 dps").values["Gyro[2]"]
    3.0
    >>> read_named_line('{"acc": {"x": 1.5}, "id": "a"}').values
    {'acc.x': 1.5}
    >>> read_named_line("ax=0.12 ay=-0.")
    NamedValues(values={'ax': 0.12, 'ay': -0.0}, units={})
    >>> read_named_line("ax=0.12 ay=-"), read_named_line("ax=0.12 ax=0.12")
    (None, None)
    """
    line = line.strip()
    return _read_object(line) if line.startswith("{") else _read_pairs(line)


def _read_pairs(line: str) -> NamedValues | None:
    said, at = NamedValues({}, {}), 0
    while at < len(line):
        name = _NAME.match(line, at)
        values = name and _VALUES.match(line, name.end())
        if not name or not values:
            return None
        unit = _UNIT.match(line, values.end())
        behind = _BEHIND.match(line, unit.end() if unit else values.end())
        numbers = re.findall(NUMBER_PATTERN, values[0], re.ASCII)
        if behind is None or not _add(said, name[1], [float(n) for n in numbers]):
            return None
        if unit:
            said.units.update(dict.fromkeys(_labels(name[1], len(numbers)), unit[1]))
        at = behind.end()
    return said if said.values else None


def _labels(name: str, n: int) -> list[str]:
    """Names of n numbers behind one name."""
    return [name] if n == 1 else [f"{name}[{i}]" for i in range(n)]


def _add(said: NamedValues, name: str, numbers: Sequence[float]) -> bool:
    """Add numbers behind a name; False if they are there already."""
    labels = _labels(name, len(numbers))
    if said.values.keys() & {name, *labels, f"{name}[0]"}:
        return False
    said.values.update(zip(labels, numbers, strict=True))
    return True


def _read_object(line: str) -> NamedValues | None:
    try:
        # an integer of any length is a double, as it is in other lines
        tree = json.loads(line, object_pairs_hook=_distinct, parse_int=float)
        found = list(_leaves("", tree))
    except (ValueError, RecursionError):
        return None
    values = dict(found)
    return NamedValues(values, {}) if 0 < len(values) == len(found) else None


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object; ValueError if a key occurs twice."""
    tree = dict(pairs)
    if len(tree) < len(pairs):
        raise ValueError
    return tree


def _leaves(path: str, tree: Any) -> list[tuple[str, float]]:
    """Numbers of a tree with their names; what is no number has none."""
    if isinstance(tree, float):
        return [(path, tree)]
    if isinstance(tree, dict):
        inner = [(f"{path}.{key}" if path else key, one) for key, one in tree.items()]
    elif isinstance(tree, list):
        inner = [(f"{path}[{i}]", one) for i, one in enumerate(tree)]
    else:
        inner = []
    return [leaf for name, one in inner for leaf in _leaves(name, one)]
