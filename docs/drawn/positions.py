"""A drawing of each position, from the same turns that the estimators use.

The device is a box with the procedure's axes on it. Base axes are x East, y down, z
North; the eye looks from the south-east, from above. What points down on the page is
gravity.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from fieldcal.core.frames import direction_cosines
from fieldcal.core.positions import Position
from fieldcal.core.samples import Array

SIZE = np.array([1.0, 0.45, 0.7])
"""Half lengths of the box along its x, y, z."""

WIDTH, HEIGHT, SCALE = 210, 200, 52.0
AZIMUTH, ELEVATION = np.deg2rad(28.0), np.deg2rad(24.0)

AXES = (("x", "#d9480f"), ("y", "#2b8a3e"), ("z", "#1971c2"))


def drawings(positions: Sequence[Position]) -> str:
    """All positions side by side, as HTML."""
    figures = "".join(_figure(i, p) for i, p in enumerate(positions, 1))
    return f'<div style="display:flex;flex-wrap:wrap;gap:.5rem">{figures}</div>'


def _figure(number: int, position: Position) -> str:
    alpha, beta = position.degrees or (0.0, 0.0)
    name = f"{number}: α = {alpha:g}°, β = {beta:g}°"
    return (
        f'<figure style="margin:0;width:{WIDTH}px">{_svg(position, name)}'
        f'<figcaption style="text-align:center">{escape(name)}</figcaption></figure>'
    )


def _svg(position: Position, name: str) -> str:
    base = direction_cosines(position.alpha or 0.0, position.beta or 0.0).T
    away = seen(base.T)[1] > 0
    hidden, shown = ([a for a in range(3) if away[a] == side] for side in (True, False))
    parts = [_ground(), *axes(base, hidden), *_faces(base), *axes(base, shown)]
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(name)}"'
        f' xmlns="http://www.w3.org/2000/svg">{"".join(parts)}</svg>'
    )


def seen(points: Array) -> tuple[Array, Array]:
    """Points (n, 3) of the base on the page, (n, 2), and their distance, (n,)."""
    east, up, north = points[:, 0], -points[:, 1], points[:, 2]
    right = east * np.cos(AZIMUTH) + north * np.sin(AZIMUTH)
    away = -east * np.sin(AZIMUTH) + north * np.cos(AZIMUTH)
    height = up * np.cos(ELEVATION) + away * np.sin(ELEVATION)
    page = np.column_stack([WIDTH / 2 + SCALE * right, HEIGHT / 2 - SCALE * height])
    return page, away * np.cos(ELEVATION) - up * np.sin(ELEVATION)


def polygon(page: Array, style: str) -> str:
    """A polygon of points on the page, (n, 2)."""
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in page)
    return f'<polygon points="{points}" {style}/>'


def _ground() -> str:
    corners = np.array([[-1.5, 1, -1.2], [1.5, 1, -1.2], [1.5, 1, 1.2], [-1.5, 1, 1.2]])
    return polygon(seen(corners)[0], 'fill="currentColor" opacity="0.08"')


def _faces(base: Array) -> list[str]:
    """Faces of the box that are turned to the eye, the farthest first."""
    drawn = []
    for axis in range(3):
        for side in (-1, 1):
            one, two = (axis + 1) % 3, (axis + 2) % 3
            corners = np.zeros((4, 3))
            corners[:, axis] = side
            corners[:, one], corners[:, two] = [-1, 1, 1, -1], [-1, -1, 1, 1]
            page, away = seen((corners * SIZE) @ base.T)
            centre = seen((base[:, axis] * side)[None])[1][0]
            if centre < 0:
                shade = 0.45 + 0.14 * axis
                style = f'fill="#8aa0b8" fill-opacity="{shade}" stroke="currentColor"'
                drawn.append((away.mean(), polygon(page, style)))
    return [text for _, text in sorted(drawn, reverse=True)]


def axes(base: Array, wanted: Sequence[int]) -> list[str]:
    """Arrows along some of the axes of a box."""
    out = []
    for axis in wanted:
        name, colour = AXES[axis]
        start = base[:, axis] * SIZE[axis]
        end = base[:, axis] * (SIZE[axis] + 0.75)
        (x0, y0), (x1, y1) = seen(np.array([start, end]))[0]
        along = np.array([x1 - x0, y1 - y0])
        length = float(np.hypot(*along)) or 1.0
        u = along / length
        head = np.array(
            [
                [x1, y1],
                *([x1, y1] - 7 * u + 3.5 * s * u[::-1] * [1, -1] for s in (1, -1)),
            ]
        )
        out.append(
            f'<line x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}"'
            f' stroke="{colour}" stroke-width="2.2"/>'
            + polygon(head, f'fill="{colour}"')
            + f'<text x="{x1 + 9 * u[0]:.1f}" y="{y1 + 9 * u[1] + 4:.1f}"'
            f' text-anchor="middle" font-size="13" fill="{colour}">{name}</text>'
        )
    return out
