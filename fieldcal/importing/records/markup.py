"""Elements of XML and tables of HTML as what JSON would hold.

    <sample t="0.01"><acc x="0.1" y="0.2" z="9.8"/></sample>
    <tr><td>0.01</td><td>0.1</td><td>0.2</td><td>9.8</td></tr>

An element is a record of its attributes and of what lies within it; several of one name
are a list. Rows of a table are lists, those with names of its columns as well. A
declaration is no part of it, and entities of its own are not replaced: nothing grows.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from html import unescape
from typing import Any, NamedTuple

ROWS = {"tr", "row", "table-row"}
CELLS = {"td", "th", "cell", "table-cell"}
"""Elements of tables in HTML, and in the workbooks of two office programs as XML."""

NAMED, VALUES = {"name", "key", "id", "channel", "label"}, {"value", "val", ""}
"""Attributes that name what an element holds, and where it stands; "" for its text."""

PARTS = {"thead", "tbody", "tfoot", "table-header-rows", "table-rows"}
"""Parts of a table, whose rows are its."""

EMPTY = {"area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta",
         "source", "track", "wbr"}  # fmt: skip
"""Elements of HTML that nothing ends."""

NAME = r"[A-Za-z_][\w:.-]*"
_ATTRIBUTE = re.compile(rf"({NAME})\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")
_PART = re.compile(
    r"<!--.*?-->|<!\[CDATA\[(?P<verbatim>.*?)\]\]>|<[!?][^>]*>"
    rf"|<(?P<end>/)?(?P<name>{NAME})(?P<more>(?:\s+[^<>]*?)?)(?P<alone>/)?\s*>"
    r"|(?P<text>[^<]+)|<",
    re.DOTALL,
)

FEWEST = 3
"""Numbers in an element that are several, as of axes."""

DEEPEST = 60
"""Elements within elements that are looked at."""


class Element:
    """An element while it is read: its attributes, and what lies within it.

    Attributes
    ----------
    name : without the prefix of its space of names
    fields : attributes and elements within it, by name
    rows : cells of its rows, if it is a table; of a row, its own
    text : what is written in it
    inner : the same, with what is written within its elements

    """

    def __init__(self, name: str, more: str = "") -> None:
        self.name = _local(name)
        self.fields: dict[str, Any] = {}
        self.rows: list[list[Any]] = []
        self.text: list[str] = []
        self.inner: list[str] = []
        for said in _ATTRIBUTE.finditer(more):
            if not said[1].startswith("xml"):
                self.fields[_local(said[1])] = _value(said[2] or said[3] or "")

    def write(self, text: str) -> None:
        """Take text in."""
        if text.strip():
            self.text.append(text)
            self.inner.append(text)

    def take(self, one: Element) -> None:
        """Take an element in that lies within it."""
        self.inner += one.inner
        low = one.name.lower()
        if low in CELLS:
            self.rows = self.rows or [[]]
            self.rows[0].append(_value("".join(one.inner)))
        elif low in ROWS and one.rows:
            self.rows.append(one.rows[0])
        elif low in PARTS and one.rows:
            self.rows += one.rows
        elif (pair := one.named_value) is not None and pair[0] not in self.fields:
            self.fields[pair[0]] = pair[1]
        elif one.name not in self.fields:
            self.fields[one.name] = one.value
        elif isinstance(before := self.fields[one.name], Several):
            before.append(one.value)
        else:
            self.fields[one.name] = Several([before, one.value])

    @property
    def value(self) -> Any:
        """What JSON would hold of it."""
        own = "".join(self.text).strip()
        if len(self.rows) > 1:
            return self.rows
        if not self.fields:
            return _value(own)
        # what stands beside attributes is called as the element is
        return self.fields | ({"": _value(own)} if own else {})

    @property
    def named_value(self) -> tuple[str, Any] | None:
        """A name and a value, where it says no more: ``<p name="ax" value="1"/>``."""
        contents = self.value
        if not isinstance(contents, dict) or len(contents) != len(("name", "value")):
            return None
        named = [key for key in contents if key.lower() in NAMED]
        if len(named) != 1 or not isinstance(contents[named[0]], str):
            return None
        (other,) = contents.keys() - {*named}
        is_value = other.lower() in VALUES
        return (contents[named[0]], contents[other]) if is_value else None

    @property
    def holds_several(self) -> bool:
        """Whether records or rows lie within it."""
        return bool(self.rows) or any(
            isinstance(one, (dict, Several)) for one in self.fields.values()
        )


class Several(list[Any]):
    """What several elements of one name hold."""


class MarkupDocument(NamedTuple):
    """Contents of a text in XML or HTML.

    Attributes
    ----------
    contents : as JSON would hold them
    is_cut : whether an element has no end; it is left out

    """

    contents: Any
    is_cut: bool


def read_markup(text: str) -> MarkupDocument:
    """Contents of a text in XML or HTML.

    >>> read_markup('<r><s t="0"><a x="1"/></s><s t="1"><a x="2"/></s></r>').contents
    {'r': {'s': [{'t': 0.0, 'a': {'x': 1.0}}, {'t': 1.0, 'a': {'x': 2.0}}]}}
    >>> read_markup("<table><tr><th>t<th>a</tr><tr><td>1<td>2</tr></table>").contents
    {'table': [['t', 'a'], [1.0, 2.0]]}
    >>> read_markup('<r><s t="0"/><s t="1"/><s t="2"').is_cut
    True
    """
    top = Element("")
    stack = [top]
    for part in _PART.finditer(text):
        if (name := part["name"]) is None:
            written = part["verbatim"] or unescape(part["text"] or "")
            stack[-1].write(written)
            continue
        low = _local(name).lower()
        if part["end"]:
            _close(stack, {low})
            continue
        if low in CELLS:
            # in HTML, the next one ends the one before it
            _close(stack, CELLS, within=ROWS)
        elif low in ROWS:
            _close(stack, ROWS, within={"table"})
        one = Element(name, part["more"] or "")
        if part["alone"] or low in EMPTY or len(stack) > DEEPEST:
            stack[-1].take(one)
        else:
            stack.append(one)
    opened = [one for one in stack[1:] if one.name.lower() not in CELLS | ROWS]
    loose = "<" in text[text.rfind(">") + 1 :]
    while len(stack) > 1:
        # an element without its end is not whole, but records within it are
        one = stack.pop()
        if one.holds_several:
            stack[-1].take(one)
    return MarkupDocument(top.fields, bool(opened) or loose)


def _close(
    stack: list[Element], names: Collection[str], within: Collection[str] = ()
) -> None:
    """End the innermost open element of some names, if none of `within` is nearer."""
    for i in range(len(stack) - 1, 0, -1):
        low = stack[i].name.lower()
        if low in names:
            while len(stack) > i:
                one = stack.pop()
                stack[-1].take(one)
            return
        if low in within:
            return


def _local(name: str) -> str:
    """A name without the prefix of its space of names."""
    return name.rpartition(":")[2]


def _value(text: str) -> Any:
    """A number, numbers between which spaces stand, or the text.

    >>> _value(" 9.81 "), _value("0.1 0.2 9.8"), _value("0,1"), _value("at rest")
    (9.81, [0.1, 0.2, 9.8], '0,1', 'at rest')
    """
    bare = unescape(text).strip()
    number = _number(bare)
    parts = bare.replace(", ", " ").replace(";", " ").split()
    if number is not None or len(parts) < FEWEST:
        return bare if number is None else number
    numbers = [_number(part) for part in parts]
    return bare if None in numbers else numbers


def _number(text: str) -> float | None:
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None
