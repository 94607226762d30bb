"""A recorded session of a virtual device with known truth, written into a folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import tomlkit

from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.session.sample_table import to_record_batch
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.replay import simulate
from fieldcal.sim_device.vocabulary import checked_effect

TILT = (0.8, -0.5)
"""What the joints' zeros of the device are off, deg."""


def five_positions(folder: Path, about: Mapping[str, Any] | None = None) -> Path:
    """Write a session of five positions, off by `TILT`; `about` goes into its toml."""
    starts = 5.0 + 40.0 * np.arange(len(FIVE_POSITIONS))
    windows = [
        (p.alpha or 0.0, p.beta or 0.0, float(s), float(s) + 30.0)
        for p, s in zip(FIVE_POSITIONS, starts, strict=True)
    ]
    off = dict(zip(("alpha0_deg", "beta0_deg"), TILT, strict=True))
    effects = (checked_effect("angle_offset", off), checked_effect("earth_rate", {}))
    block = simulate(Profile(effects=effects), windows, seed=1)
    folder.mkdir()
    positions = [
        dict(zip(("alpha_deg", "beta_deg"), p.degrees or (), strict=False))
        | {"start_s": w[2], "end_s": w[3]}
        for p, w in zip(FIVE_POSITIONS, windows, strict=True)
    ]
    tables = {
        "format": 1,
        "device": {"name": "bench unit 7"},
        "site": {"latitude_deg": 50.45, "height_m": 170.0},
        "position": positions,
        **(about or {}),
    }
    (folder / "session.toml").write_text(tomlkit.dumps(tables))
    table = pa.Table.from_batches([to_record_batch(block)])
    pyarrow.parquet.write_table(table, folder / "samples.parquet")
    return folder
