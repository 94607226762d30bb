"""Values within brackets within others, as programs print objects for people.

    I { Acc = Vec { Unit = G, Data = <0.1, 0.2, 1> }, Gyro = Vec { Data = <1, 2, 3> } }
    Vector3(x=0.1, y=0.2, z=9.8) Vector3(x=0.01, y=0.02, z=0.03)
    (0.01, (0.1, 0.2, 9.8), (0.01, 0.02, 0.03))

A value is called by the names of all that it lies within, and a unit beside it is its
own. Where nothing but axes is named, the numbers are columns, and physics tells them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple, Self

from fieldcal.importing.text.labels import (
    ARRIVAL,
    LEVEL,
    LONGEST,
    labelled_values,
)
from fieldcal.importing.text.log_prefixes import log_prefix
from fieldcal.importing.text.text_form import Reader, TextForm, is_true_of_most
from fieldcal.importing.text.text_lines import MISSING
from fieldcal.importing.words.heading_words import heading_meaning
from fieldcal.importing.words.sensor_words import AXES

FEWEST = 3
"""Values of a line: the axes of a sensor."""

DEEP = 2
"""Brackets about a value that columns do not have."""

UNIT = ("unit", "units")
"""Names of what is the unit of the values beside it."""

OPEN = "([{<"

MOST_DEEP = 20
"""Brackets within brackets that are looked at."""

_TOKEN = re.compile(
    r"(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.:]))"
    r"|(?P<word>'[^']*'|\"[^\"]*\"|[^\W\d][\w./^²°]*)"
    r"|(?P<open>[(\[{<])|(?P<close>[)\]}>])|(?P<is>[=:]+)|[\s,;|]+"
)


class NestedValue(NamedTuple):
    """A number within brackets.

    Attributes
    ----------
    name : of all that it lies within, and its axis; "" if nothing says any
    unit : that is said beside it, or nothing
    text : the number

    """

    name: str
    unit: str
    text: str


class NestedValues(TextForm):
    """Lines of values within brackets, made lines of labels or of plain columns."""

    def __init__(self, labelled: bool) -> None:
        self._labelled = labelled

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have it and their labels alone tell less."""
        if separator or not is_true_of_most(lines, lambda line: bool(_values(line))):
            return None
        last = next(line for line in reversed(lines) if _values(line))
        if _tell([name for name, _ in labelled_values(last)]):
            return None
        return cls(_tell([value.name for value in _values(last)]))

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            values = _values(line)
            if not values:
                # no row: whoever reads rows says so
                return line
            before = line[: _begin(line)]
            if not self._labelled:
                numbers = ",".join(value.text for value in values)
                log = log_prefix(line)
                before = LEVEL.sub("", before)
                return f"{log.value},{numbers}" if log else f"{before}{numbers}"
            return before + ", ".join(
                f"{v.name} [{v.unit}]: {v.text}" if v.unit else f"{v.name}: {v.text}"
                for v in values
            )

        return lambda lines: [one(line) for line in lines]


def _tell(names: Sequence[str]) -> bool:
    """Whether names say a sensor, and each something else."""
    said = [heading_meaning(name) for name in names]
    sensors = any(one is not None and one.kind in ("a", "g") for one in said)
    return sensors and len({*names}) == len(names)


def _begin(line: str) -> int:
    """Where what a program's log or a monitor writes before a line ends."""
    prefix, arrival = log_prefix(line), ARRIVAL.match(line)
    begin = prefix.length if prefix else arrival.end() if arrival else 0
    level = LEVEL.match(line, begin)
    return level.end() if level else begin


def _values(line: str) -> list[NestedValue]:
    """Numbers of a line, with the names of what they lie in; none of another line.

    >>> _values("Acc = V { Unit = G, Data = <1, 2, 3> }")[2]
    NestedValue(name='Acc_Data_z', unit='G', text='3')
    >>> _values("Acc = 1, 2, 3"), _values("[1, 2, 3]")
    ([], [])
    """
    if len(line) > LONGEST or not any(sign in line for sign in OPEN):
        return []
    tokens, at, text = [], _begin(line), line.rstrip()
    while at < len(text):
        said = _TOKEN.match(text, at)
        if said is None:
            return []
        at = said.end()
        if said.lastgroup:
            tokens.append((said.lastgroup, said[0]))
    read = _Reader(tokens)
    try:
        values = read.group(())
    except ValueError:
        return []
    nested = read.typed or read.deepest >= DEEP
    return values if nested and len(values) >= FEWEST else []


class _Reader:
    """Reads the pieces of a line.

    Attributes
    ----------
    typed : whether the type of what lies in brackets stands before them
    deepest : brackets within brackets

    """

    def __init__(self, tokens: Sequence[tuple[str, str]]) -> None:
        self._tokens, self._at = [*tokens, ("end", "")], 0
        self.typed, self.deepest = False, 0

    def group(self, names: tuple[str, ...], depth: int = 0) -> list[NestedValue]:
        """Values up to the end of a bracket, or of the line.

        Raises
        ------
        ValueError
            If something stands there that is neither a value nor its name.

        """
        self.deepest = max(self.deepest, depth)
        found: list[NestedValue] = []
        bare: list[int] = []
        unit = ""
        while (one := self._next())[0] not in ("close", "end"):
            kind, name = one
            inner, of_type = names, False
            if name in MISSING and self._tokens[self._at][0] != "is":
                kind = "number"
            if kind == "word":
                is_name = self._tokens[self._at][0] == "is"
                if is_name:
                    inner = (*names, name.strip("'\""))
                    kind = self._skip_is()
                    text = self._tokens[self._at - 1][1]
                    if kind == "word" and self._tokens[self._at][0] != "open":
                        unit = text if name.lower() in UNIT else unit
                        continue
                    name = text
                elif _tell([f"{name} x"]):
                    inner = (*names, name)
                if of_type := kind == "word":
                    kind = self._next()[0]
            if kind == "number":
                self.typed |= of_type
                bare += [len(found)] if inner == names else []
                found.append(NestedValue("_".join(inner), "", name))
            elif kind == "open" and depth < MOST_DEEP:
                within = self.group(inner, depth + 1)
                # the address of a device in brackets is no value
                self.typed |= of_type and bool(within)
                found += within
            else:
                raise ValueError(f"{kind} in a line of values")
        if (one[0] == "end") != (depth == 0):
            raise ValueError("a bracket is open")
        ends = AXES if len(bare) == len(AXES) else [*map(str, range(len(bare)))]
        for i, end in zip(bare, ends, strict=True) if len(bare) > 1 else ():
            whole = "_".join(filter(None, (found[i].name, end)))
            found[i] = found[i]._replace(name=whole)
        return [v._replace(unit=v.unit or unit) for v in found]

    def _next(self) -> tuple[str, str]:
        self._at += 1
        return self._tokens[self._at - 1]

    def _skip_is(self) -> str:
        """Pass the sign behind a name; return the kind of what follows."""
        self._at += 1
        return self._next()[0]
