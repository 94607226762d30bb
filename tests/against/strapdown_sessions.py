"""Sessions of the numpy simulator in `strapdown`."""

from __future__ import annotations

from typing import Any

import numpy as np
import strapdown

from fieldcal.core.samples import Block
from fieldcal.session import description_file

DEVICE: dict[str, Any] = {
    "bias": {"acc": [0.05, -0.03, 0.1], "gyr": [1e-3, -2e-3, 5e-4]},
    "matrix": {"acc": [[1.004, 0, 0], [0.002, 0.997, 0], [0, 0, 1.001]]},
    "noise": {"acc": [0.02] * 3, "gyr": [1e-3] * 3},
}


def played(device: dict[str, Any], seed: int, later: float = 0.0) -> tuple[Any, Any]:
    """Samples and description of what the numpy simulator makes."""
    table = strapdown.outputs({**device, "seed": seed})
    unknown = np.full(len(table), np.nan)
    block = Block.of(
        table[:, 0] + later, table[:, 1:4], table[:, 4:7], unknown, unknown, unknown
    )
    about = description_file.parse_description(
        {
            "format": 1,
            "site": {"gravity": strapdown.GRAVITY},
            "position": strapdown.schedule(3.0 + later),
        }
    )
    return block, about
