"""The report of one hour at 1 kHz: time to make it, its size, time to open it."""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import tomlkit

from fieldcal.cli import main as fieldcal
from fieldcal.core.frames import specific_force_at_rest
from fieldcal.core.positions import FIVE_POSITIONS, WIDE_POSITIONS
from fieldcal.core.samples import Array, Block
from fieldcal.report import gather, render
from fieldcal.report.browser import Browser, find_browser
from fieldcal.session.folder import Session
from fieldcal.session.sample_table import to_record_batch

RATE, SECONDS, TURN = 1000, 3600, 4.0
GRAVITY = 9.81


def _angles(t: Array) -> tuple[Array, Array, list[tuple[float, float]]]:
    """Turns through twenty positions, rad, and a window in each, s."""
    positions = (*FIVE_POSITIONS, *WIDE_POSITIONS) * 2
    each = SECONDS / len(positions)
    alpha, beta = np.zeros_like(t), np.zeros_like(t)
    last, windows = (0.0, 0.0), []
    for i, p in enumerate(positions):
        there = (p.alpha or 0.0, p.beta or 0.0)
        part = np.clip((t - i * each) / TURN, 0, 1)
        after = t >= i * each
        for angle, a, b in zip((alpha, beta), last, there, strict=True):
            angle[after] = (a + (b - a) * part**2 * (3 - 2 * part))[after]
        last = there
        windows.append((i * each + 8, (i + 1) * each - 8))
    return alpha, beta, windows


def _session(folder: Path) -> None:
    rng = np.random.default_rng(0)
    t = np.arange(RATE * SECONDS) / RATE
    alpha, beta, windows = _angles(t)
    acc = specific_force_at_rest(alpha, beta, GRAVITY) * [1.001, 0.998, 1.003] + [
        0.1,
        -0.05,
        0.2,
    ]
    acc += 0.02 * rng.standard_normal(acc.shape)
    gyr = np.column_stack([np.gradient(beta, t), 0 * t, np.gradient(alpha, t)])
    gyr += 1e-3 * rng.standard_normal(gyr.shape)
    warm = 25 + 5 * (1 - np.exp(-t / 900)) + 0.01 * rng.standard_normal(len(t))
    table = pa.Table.from_batches([to_record_batch(Block.of(t, acc, gyr, warm))])
    pyarrow.parquet.write_table(table, folder / "samples.parquet")
    rows = [
        dict(zip(("alpha_deg", "beta_deg"), p.degrees or (), strict=False))
        | {"start_s": w[0], "end_s": w[1]}
        for p, w in zip((*FIVE_POSITIONS, *WIDE_POSITIONS) * 2, windows, strict=True)
    ]
    about = {"format": 1, "site": {"gravity": GRAVITY}, "position": rows}
    (folder / "session.toml").write_text(tomlkit.dumps(about))


def main() -> None:
    """Print seconds to read, make and open, and megabytes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _session(folder)
        fieldcal(["solve", name])
        began = perf_counter()
        samples = len(Session.open(folder).block)
        read = perf_counter() - began
        began = perf_counter()
        page = folder / "report.html"
        page.write_text(render(gather(folder)), encoding="utf-8")
        made = perf_counter() - began
        print(f"{samples / 1e6:.1f} million samples of 7 channels")
        print(f"reading them     {read:6.2f} s")
        print(f"making the page  {made:6.2f} s, {made / read:.1f} x reading")
        print(f"size             {page.stat().st_size / 1e6:6.2f} MB (limit 6)")
        if find_browser() is None:
            print("opening          no Chromium here")
            return
        with Browser() as browser:
            times = []
            for _ in range(3):
                began = perf_counter()
                browser.open(page)
                drawn = browser.value("document.documentElement.dataset.drawn")
                times.append(perf_counter() - began)
        print(f"opening          {min(times):6.2f} s, {drawn} plots (limit 2)")
