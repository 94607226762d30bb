"""The documentation's examples are run, on a session of a virtual device."""

import doctest
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
import tomlkit

from fieldcal.positions import FIVE
from fieldcal.sample_files import to_batch
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.replay import simulate
from fieldcal.sim_device.vocabulary import effect

DOCS = Path(__file__).parent.parent / "docs"


@pytest.fixture
def bench_7(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder to stand in, with a session of five positions on a tilted base."""
    monkeypatch.chdir(tmp_path)
    starts = 5.0 + 40.0 * np.arange(len(FIVE))
    windows = [
        (p.alpha or 0.0, p.beta or 0.0, float(s), float(s) + 30.0)
        for p, s in zip(FIVE, starts, strict=True)
    ]
    tilt = effect("angle_offset", {"alpha0_deg": 0.8, "beta0_deg": -0.5})
    earth = effect("earth_rate", {})
    block = simulate(Profile(effects=(tilt, earth)), windows, seed=1)
    folder = tmp_path / "bench-7"
    folder.mkdir()
    positions = [
        dict(zip(("alpha_deg", "beta_deg"), p.degrees or (), strict=False))
        | {"start_s": w[2], "end_s": w[3]}
        for p, w in zip(FIVE, windows, strict=True)
    ]
    about = {
        "format": 1,
        "device": {"name": "bench unit 7"},
        "site": {"latitude_deg": 50.45, "height_m": 170.0},
        "position": positions,
    }
    (folder / "session.toml").write_text(tomlkit.dumps(about))
    table = pa.Table.from_batches([to_batch(block)])
    pyarrow.parquet.write_table(table, folder / "samples.parquet")


@pytest.mark.usefixtures("bench_7")
@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda p: p.stem)
def test_examples_of_the_documentation(page: Path) -> None:
    failed, tried = doctest.testfile(str(page), module_relative=False)
    assert failed == 0
    assert tried or ">>>" not in page.read_text()
