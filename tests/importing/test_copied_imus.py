"""Axes that come twice under the same names: two devices, or one and its copy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laid_about import turned, write
from scipy.ndimage import convolve1d
from scipy.signal import butter, filtfilt, lfilter, medfilt, savgol_filter

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
    table = turned(21, 100.0, 3.0)
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


RUNNING_SUM = np.ones(15) / 15

FILTERS: dict[str, Callable[[Array], Array]] = {
    "forth and back": lambda x: filtfilt(*butter(2, 0.1), x, axis=0),
    "forth and back, narrow": lambda x: filtfilt(*butter(4, 0.04), x, axis=0),
    "once, from zero": lambda x: lfilter(*butter(2, 0.1), x, axis=0),
    "mean about each row": lambda x: convolve1d(x, RUNNING_SUM, axis=0),
    "polynomials": lambda x: savgol_filter(x, 21, 3, axis=0),
    "median about each row": lambda x: medfilt(x, [9, 1]),
}


@pytest.mark.parametrize("filtered", FILTERS.values(), ids=FILTERS)
@pytest.mark.parametrize("first", [False, True])
def test_a_filter_may_know_later_samples(
    filtered: Callable[[Array], Array], first: bool
) -> None:
    """Its steps hardly have the sign of what goes into it."""
    outputs = turned(22, 100.0, 3.0)[:, 1:]
    pair = [outputs, filtered(outputs)]
    table = np.column_stack([outputs[:, 0], *(pair[::-1] if first else pair)])
    at = {i: {c: n + 1 for c, n in own.items()} for i, own in AT.items()}
    assert copied_imus(table, at) == ({"1": "2"} if first else {"2": "1"})


@given(st.integers(0, 2**20), st.floats(0.3, 1.0))
@settings(max_examples=20)
def test_two_devices_of_the_same_biases_are_two(seed: int, calmer: float) -> None:
    """As those of a simulator that has none, turned together."""
    rng = np.random.default_rng(seed)
    truth = np.repeat(rng.normal(0, 5, (6, 6)), 200, axis=0)
    noise = np.array([*[0.02] * 3, *[0.002] * 3])
    pair = [truth + size * noise * rng.normal(size=truth.shape) for size in (1, calmer)]
    assert copied_imus(np.hstack(pair), AT) == {}
