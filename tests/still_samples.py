"""A device that lies still, written down sample by sample, as what rows are made of."""

from __future__ import annotations

from typing import Any

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.session.description import Description
from fieldcal.session.description_file import parse_description

RATE, G = 50.0, 9.8
FORCE = {0.0: (0.0, -G, 0.0), 90.0: (-G, 0.0, 0.0)}
"""By alpha, deg; beta is 0."""


def place(start: float, end: float, alpha: float | None = 0.0) -> dict[str, Any]:
    angles = {} if alpha is None else {"alpha_deg": alpha, "beta_deg": 0.0}
    return {**angles, "start_s": start, "end_s": end}


def about(*places: dict[str, Any], **tables: Any) -> Description:
    site = {"gravity": G, "latitude_deg": 50.0}
    return parse_description(
        {"format": 1, "site": site, "position": list(places), **tables}
    )


def samples(seconds: float, seed: int = 1, acc: float = 0.01) -> Block:
    """Noise of 0.01 m/s^2 and 1e-3 rad/s about home, from t = 2 s on."""
    rng = np.random.default_rng(seed)
    t = 2.0 + np.arange(round(seconds * RATE)) / RATE
    white = rng.standard_normal((len(t), 6)) * np.repeat([acc, 1e-3], 3)
    return Block.of(t, white[:, :3] + FORCE[0.0], white[:, 3:], 20 + 0.01 * t)


def source(block: Block, known: Description) -> RowSource:
    usable = np.ones((len(block), 6), dtype=bool)
    arrived = np.full(max(len(known.positions), 1), 1.0)
    return RowSource(block, known, usable, arrived, Thermometer.of(block))
