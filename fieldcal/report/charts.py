"""Charts as data: the page draws them, so that they can be zoomed.

Every chart has a text alternative that says what it shows in words.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from fieldcal.core.samples import Array

DIGITS = 7
"""Significant digits of a number in the page: more than a screen can show."""

SENSORS = ((0, "accelerometers", "m/s²"), (3, "gyroscopes", "rad/s"))
"""First channel of each triad, what it is called, and its unit."""

Draw = Literal["points", "line", "both"]


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis; `names` are written at 0, 1, 2, ... instead of numbers."""

    label: str
    unit: str = ""
    log: bool = False
    names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Series:
    """Points (x, y), each with an interval where `low` and `high` are given.

    `tone` picks one of six colours, each with a marker of its own; `y` is nan where
    there is no point.
    """

    name: str
    x: Array
    y: Array
    tone: int
    draw: Draw = "points"
    low: Array | None = None
    high: Array | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the object the page reads."""
        out: dict[str, Any] = {"name": self.name, "tone": self.tone, "draw": self.draw}
        for name in ("x", "y", "low", "high"):
            values = getattr(self, name)
            if values is not None:
                out[name] = json_numbers(values)
        return out


@dataclass(frozen=True, slots=True)
class LabelledSpan:
    """A stretch of the x axis with a label: a window."""

    start: float
    end: float
    label: str

    def to_json(self) -> dict[str, Any]:
        """Return the object the page reads."""
        return {"from": self.start, "to": self.end, "label": self.label}


@dataclass(frozen=True, slots=True)
class ChartMark:
    """An instant, or a level of the y axis, with a label."""

    at: float
    label: str


@dataclass(frozen=True, slots=True)
class Chart:
    """Points and lines over two axes."""

    id: str
    title: str
    alt: str
    x: Axis
    y: Axis
    series: tuple[Series, ...]
    levels: tuple[ChartMark, ...] = ()
    spans: tuple[LabelledSpan, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return the object the page reads."""
        return {
            "kind": "chart",
            "id": self.id,
            "x": asdict(self.x),
            "y": asdict(self.y),
            "series": [s.to_json() for s in self.series],
            "levels": [asdict(m) for m in self.levels],
            "spans": [s.to_json() for s in self.spans],
            "marks": [],
        }


@dataclass(frozen=True, slots=True)
class RecordingChart:
    """Channels of a recording over device time, one panel each, zoomed together.

    `means` (spans, panels) are drawn across the spans, nan where there is none.
    """

    id: str
    title: str
    alt: str
    panels: tuple[tuple[str, str, int], ...]
    clock: str
    store: Mapping[str, Any]
    spans: tuple[LabelledSpan, ...]
    means: Array
    marks: tuple[ChartMark, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the object the page reads."""
        return {
            "kind": "record",
            "id": self.id,
            "panels": [
                {"label": label, "unit": unit, "tone": tone}
                for label, unit, tone in self.panels
            ],
            "x": asdict(Axis(self.clock, "s")),
            "store": self.store,
            "means": [json_numbers(row) for row in self.means],
            "spans": [s.to_json() for s in self.spans],
            "marks": [asdict(m) for m in self.marks],
        }


def json_numbers(values: Array | Sequence[float]) -> list[float | None]:
    """JSON numbers, rounded; null where there is none."""
    return [
        float(f"{v:.{DIGITS}g}") if np.isfinite(v) else None
        for v in np.asarray(values, float).tolist()
    ]
