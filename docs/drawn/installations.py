"""Drawings of where a device is installed: at home, and with both joints turned.

Everything is made of boxes that turn with the device, as the estimators' positions say;
the device is the dark one, with the procedure's axes on it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from drawn.positions import AXES, HEIGHT, WIDTH, polygon, seen
from fieldcal.core.frames import direction_cosines
from fieldcal.core.samples import Array

SHADES = {"device": "#30475e", "object": "#8aa0b8", "under": "#b08968"}
"""What is calibrated, what carries it, and what lies under that."""


@dataclass(frozen=True)
class Box:
    """A box that turns with the device.

    Attributes
    ----------
    what : of `SHADES`
    centre, half : east, down, north at home; in half widths of a drawing

    """

    what: str
    centre: tuple[float, float, float]
    half: tuple[float, float, float]


@dataclass(frozen=True)
class Installation:
    """A place where a device is.

    Attributes
    ----------
    name : of the object
    boxes : it is drawn of
    turned : alpha and beta of the second drawing, deg

    """

    name: str
    boxes: Sequence[Box]
    turned: tuple[float, float]


DEVICE = Box("device", (0.0, -0.35, 0.0), (0.2, 0.1, 0.14))

INSTALLATIONS: Mapping[str, Installation] = {
    "bare": Installation(
        "a bare unit on its ladder",
        [Box("device", (0, -0.2, 0), (0.45, 0.2, 0.3)),
         Box("under", (0, 0.1, 0), (0.9, 0.06, 0.6))],
        (45.0, 5.0),
    ),
    "vehicle": Installation(
        "a vehicle: ramps under the wheels of a side, then of an end",
        [DEVICE, Box("object", (0, 0.05, 0), (0.45, 0.25, 1.0)),
         *(Box("under", (x, 0.4, z), (0.1, 0.16, 0.2))
           for x in (-0.45, 0.45) for z in (-0.65, 0.65))],
        (10.0, 10.0),
    ),
    "boat": Installation(
        "a boat on its trailer: a jack under a side, and the drawbar",
        [DEVICE, Box("object", (0, 0.0, 0), (0.4, 0.22, 1.0)),
         Box("object", (0, 0.3, 0), (0.15, 0.12, 0.9)),
         Box("under", (0, 0.5, -0.1), (0.6, 0.05, 0.7))],
        (8.0, 8.0),
    ),
    "launcher": Installation(
        "a launcher on its transporter: the ladder under the rail",
        [Box("device", (0, -0.3, 0.5), (0.12, 0.09, 0.14)),
         Box("object", (0, -0.1, 0), (0.14, 0.12, 1.2)),
         Box("under", (0, 0.12, 0), (0.3, 0.08, 0.9))],
        (20.0, 25.0),
    ),
    "airframe": Installation(
        "a large airframe: jacks, no more than ten degrees to either side",
        [DEVICE, Box("object", (0, 0.0, 0), (0.22, 0.22, 1.25)),
         Box("object", (0, -0.02, 0.15), (1.3, 0.04, 0.22)),
         Box("object", (0, -0.3, -1.1), (0.35, 0.03, 0.12))],
        (10.0, -10.0),
    ),
}  # fmt: skip


def drawings(installation: Installation) -> str:
    """The object at home, and turned, as HTML."""
    places = ((0.0, 0.0), installation.turned)
    figures = "".join(_figure(installation, *place) for place in places)
    return f'<div style="display:flex;flex-wrap:wrap;gap:.5rem">{figures}</div>'


def _figure(installation: Installation, alpha: float, beta: float) -> str:
    where = "home" if alpha == beta == 0 else f"α = {alpha:g}°, β = {beta:g}°"
    base = direction_cosines(np.deg2rad(alpha), np.deg2rad(beta)).T
    ground = np.array([[-1.5, 1, -1.3], [1.5, 1, -1.3], [1.5, 1, 1.3], [-1.5, 1, 1.3]])
    parts = [polygon(seen(ground)[0], 'fill="currentColor" opacity="0.08"')]
    faces = [face for box in installation.boxes for face in _faces(box, base)]
    parts += [text for _, text in sorted(faces, key=lambda f: -f[0])]
    parts += _arrows(installation.boxes[0], base)
    label = escape(f"{installation.name}: {where}")
    return (
        f'<figure style="margin:0;width:{WIDTH}px"><svg viewBox="0 0 {WIDTH} {HEIGHT}"'
        f' role="img" aria-label="{label}" xmlns="http://www.w3.org/2000/svg">'
        f'{"".join(parts)}</svg><figcaption style="text-align:center">{where}'
        "</figcaption></figure>"
    )


def _faces(box: Box, base: Array) -> list[tuple[float, str]]:
    """Faces that are turned to the eye, each with how far away it is."""
    drawn = []
    for axis in range(3):
        one, two = (axis + 1) % 3, (axis + 2) % 3
        for side in (-1, 1):
            corners = np.zeros((4, 3))
            corners[:, axis] = side
            corners[:, one], corners[:, two] = [-1, 1, 1, -1], [-1, -1, 1, 1]
            if seen((base[:, axis] * side)[None])[1][0] >= 0:
                continue
            page, away = seen((corners * box.half + np.array(box.centre)) @ base.T)
            fill = f'fill="{SHADES[box.what]}" fill-opacity="{0.65 + 0.12 * axis}"'
            drawn.append((float(away.mean()), polygon(page, f'{fill} stroke="#222"')))
    return drawn


def _arrows(device: Box, base: Array) -> list[str]:
    """The procedure's axes, from the middle of the device."""
    out, start = [], np.array(device.centre)
    for axis, (name, colour) in enumerate(AXES):
        end = start + 0.8 * np.eye(3)[axis]
        (x0, y0), (x1, y1) = seen(np.array([start, end]) @ base.T)[0]
        out.append(
            f'<line x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}"'
            f' stroke="{colour}" stroke-width="2.2"/><text x="{x1:.1f}" y="{y1:.1f}"'
            f' font-size="13" font-weight="bold" fill="{colour}">{name}</text>'
        )
    return out
