"""Axes that come twice under the same names: two devices, or one and its copy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laid_about import turned, write
from scipy.signal import lfilter

from fieldcal.cli import main
from fieldcal.core.samples import CHANNELS, Array
from fieldcal.importing.tables.copied_imus import copied_imus
from fieldcal.session.folder import Session

TWICE = ",".join(["t", *CHANNELS, *CHANNELS])
AT = {i: {c: n + len(CHANNELS) * k for n, c in enumerate(CHANNELS)}
      for k, i in enumerate("12")}  # fmt: skip


def smoothed(outputs: Array, part: float) -> Array:
    """Outputs (n, k) behind a filter of the first order, which begins settled."""
    found: Array = lfilter(
        [part], [1, part - 1], outputs, axis=0, zi=(1 - part) * outputs[:1]
    )[0]
    return found


@pytest.mark.parametrize("part", [1.0, 0.5, 0.1])
@pytest.mark.parametrize("first", [False, True])
def test_the_filtered_copy_of_a_device_is_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], part: float, first: bool
) -> None:
    table = turned(21, 100.0)
    pair = [table[:, 1:], smoothed(table[:, 1:], part)]
    rows = np.column_stack([table[:, 0], *(pair[::-1] if first else pair)])
    assert main(["import", str(write(tmp_path, rows, heading=TWICE)),
                 "-o", str(tmp_path / "out")]) == 0  # fmt: skip
    block = Session.open(tmp_path / "out").block
    np.testing.assert_allclose(block.acc, table[:, 1:4], rtol=1e-8)
    np.testing.assert_allclose(block.gyr, table[:, 4:], rtol=1e-8)
    assert "the same device" in capsys.readouterr().err


@given(
    st.integers(0, 2**20),
    st.sampled_from([0.002, 0.02]),
    st.sampled_from([0.0, 0.004]),
)
def test_two_devices_are_two_whatever_step_their_numbers_have(
    seed: int, bias: float, step: float
) -> None:
    rng = np.random.default_rng(seed)
    truth = np.repeat(rng.normal(0, 5, (6, 6)), 100, axis=0)
    pair = [
        truth + rng.normal(0, 0.01, truth.shape) + sign * bias / 2 for sign in (-1, 1)
    ]
    table = np.hstack(pair)
    table = np.round(table / step) * step if step else table
    assert copied_imus(table, AT) == {}


@given(st.integers(0, 2**20), st.floats(0.2, 1), st.sampled_from([0.0, 0.004]))
def test_a_copy_is_found_whatever_the_filter(
    seed: int, part: float, step: float
) -> None:
    rng = np.random.default_rng(seed)
    outputs = np.repeat(rng.normal(0, 5, (6, 6)), 300, axis=0)
    outputs += rng.normal(0, 0.02, outputs.shape)
    outputs = np.round(outputs / step) * step if step else outputs
    table = np.hstack([outputs, smoothed(outputs, part)])
    assert copied_imus(table, AT) == {"2": "1"}
