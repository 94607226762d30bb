"""Session folders for tests: samples of any device, with what is known about them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import tomlkit

from fieldcal.core.samples import Block
from fieldcal.session.sample_table import to_record_batch
from fieldcal.sim_device.profile import Climate, NoiseFigures, Profile
from fieldcal.sim_device.replay import HeldWindow, simulate
from fieldcal.sim_device.vocabulary import checked_effect

NINE = [(a, b) for b in (0.0, 5.0, -5.0) for a in (0.0, 45.0, -45.0)]
SITE = {"latitude_deg": 50.45, "height_m": 170.0}
FACES = [(0.0, 0.0), (180.0, 0.0), (90.0, 0.0), (-90.0, 0.0), (0.0, 90.0), (0.0, -90.0)]
WIDE = [*FACES, (45.0, 0.0), (-45.0, 0.0), (0.0, 45.0), (45.0, 35.0)]
CALM = Profile(
    noise=NoiseFigures(acc_instability=(0.0,) * 3, gyr_instability=(0.0,) * 3),
    temperature=Climate(self_heating_k=0.0),
    effects=(checked_effect("earth_rate", {}),),
)
"""A device without instability that does not warm itself."""


def write_session(
    folder: Path, block: Block, positions: Sequence[dict[str, Any]], **tables: Any
) -> Path:
    """Write a session folder; `tables` are further ones of session.toml."""
    folder.mkdir(parents=True, exist_ok=True)
    about = {"format": 1, "site": SITE, **tables}
    if positions:
        about["position"] = list(positions)
    (folder / "session.toml").write_text(tomlkit.dumps(about))
    batch = to_record_batch(block)
    with pa.ipc.new_stream(folder / "samples.arrows", batch.schema) as file:
        file.write_batch(batch)
    return folder


def places(
    angles: Sequence[tuple[float, float]] = NINE,
    seconds: float = 20.0,
    gap: float = 8.0,
    start: float = 3.0,
) -> list[dict[str, Any]]:
    """Tables of positions held one after another."""
    starts = start + (seconds + gap) * np.arange(len(angles))
    return [
        {
            "alpha_deg": a,
            "beta_deg": b,
            "start_s": float(s),
            "end_s": float(s) + seconds,
        }
        for (a, b), s in zip(angles, starts, strict=True)
    ]


def recorded(
    profile: Profile, positions: Sequence[dict[str, Any]], seed: int = 1
) -> Block:
    """What a virtual device puts out while it is held in some positions."""
    return simulate(profile, windows_of(positions), seed=seed)


def windows_of(positions: Sequence[dict[str, Any]]) -> list[HeldWindow]:
    """The same positions for the virtual device."""
    return [
        HeldWindow(
            float(np.deg2rad(p.get("alpha_deg", 0.0))),
            float(np.deg2rad(p.get("beta_deg", 0.0))),
            p["start_s"],
            p["end_s"],
            tuple(np.deg2rad(p.get("rate_deg_s", (0.0, 0.0, 0.0))).tolist()),
        )
        for p in positions
    ]
