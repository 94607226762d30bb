"""A run as JUnit XML, for continuous integration.

A test case for each position, one for each check of GO or NO-GO, and one for the run
itself, which is an error if it broke off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

from fieldcal.core.escaping import escape_invisible
from fieldcal.core.positions import Position
from fieldcal.session.file_writing import write_atomically

TROUBLE_MARKS = ("wrong", "rejected", "kept")
"""Marks of faults in a position."""


def write(
    path: Path,
    name: str,
    positions: Sequence[Position],
    marks: Sequence[Mapping[str, Any]],
    result: Mapping[str, Any] | None,
    error: str = "",
) -> None:
    """Write the file.

    Parameters
    ----------
    path : of the file
    name : of the procedure
    positions : planned and added
    marks : of the session
    result : the object of result.json, None if the run broke off
    error : why it did

    Raises
    ------
    SessionError
        If the file cannot be written.

    """
    suite = Element("testsuite", name=f"fieldcal.{name}")
    for number, position in enumerate(positions):
        _add_position_case(suite, number, position, marks)
    for check in (result or {}).get("decision", {}).get("checks", []):
        case = SubElement(suite, "testcase", classname="verdict", name=check["name"])
        if check["ok"] is None:
            SubElement(case, "skipped", message=check["says"])
        elif not check["ok"]:
            SubElement(case, "failure", message=check["says"])
    if result is None:
        case = SubElement(suite, "testcase", classname="run", name=name)
        SubElement(case, "error", message=error)
    for kind, key in (
        ("failure", "failures"),
        ("error", "errors"),
        ("skipped", "skipped"),
    ):
        suite.set(key, str(len(suite.findall(f"testcase/{kind}"))))
    suite.set("tests", str(len(suite)))
    for element in suite.iter():
        element.text = element.text and escape_invisible(element.text)
        for key, value in element.items():
            element.set(key, escape_invisible(value))
    write_atomically(path, tostring(suite, encoding="utf-8", xml_declaration=True))


def _add_position_case(
    suite: Element, number: int, position: Position, marks: Sequence[Mapping[str, Any]]
) -> None:
    mine = [m for m in marks if m.get("position") == number]
    events = [m["event"] for m in mine]
    begun = max((i for i, e in enumerate(events) if e == "repeated"), default=-1) + 1
    valid = mine[begun:]  # a window before was discarded
    asked = [m["host_s"] for m in valid if m["event"] == "asked"]
    taken = [m["host_s"] for m in valid if m["event"] == "window"]
    label = f"{number + 1}: {position.name}"
    case = SubElement(suite, "testcase", classname="position", name=label)
    if taken:
        case.set("time", f"{max(0.0, taken[-1] - asked[0]) if asked else 0:.3f}")
    elif "skipped" in events[begun:]:
        SubElement(case, "skipped", message="left out by the operator")
    else:
        said = [str(m["text"]) for m in valid if m["event"] in TROUBLE_MARKS]
        message = said[-1] if said else "it was not taken"
        SubElement(case, "failure", message=message)
    trouble = [str(m["text"]) for m in mine if m["event"] in TROUBLE_MARKS]
    if trouble:
        SubElement(case, "system-out").text = "\n".join(trouble)
