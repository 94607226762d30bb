"""A run as JUnit XML: what was discarded is not taken."""

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import parse

import pytest

from fieldcal.core.positions import TWO_POSITIONS
from fieldcal.run import junit


def mark(event: str, position: int, host_s: float) -> dict[str, Any]:
    return {"event": event, "position": position, "host_s": host_s}


HOME = [mark("asked", 0, 0.0), mark("window", 0, 10.0)]
TURNED = [mark("asked", 1, 11.0), mark("window", 1, 20.0), mark("repeated", 1, 30.0)]
AGAIN = [mark("asked", 1, 31.0)]


@pytest.mark.parametrize(
    ("after", "child", "time"),
    [
        ([], "failure", None),
        (AGAIN, "failure", None),
        ([*AGAIN, mark("skipped", 1, 32.0)], "skipped", None),
        ([*AGAIN, mark("window", 1, 45.0)], None, "14.000"),
    ],
)
def test_a_window_that_was_discarded_does_not_count(
    after: list[dict[str, Any]], child: str | None, time: str | None, tmp_path: Path
) -> None:
    marks = [*HOME, *TURNED, *after]
    junit.write(tmp_path / "x.xml", "two", TWO_POSITIONS, marks, {})
    home, turned = parse(tmp_path / "x.xml").getroot().findall("testcase")
    assert home.get("time") == "10.000" and not list(home)
    assert [e.tag for e in turned] == ([child] if child else [])
    assert turned.get("time") == time
