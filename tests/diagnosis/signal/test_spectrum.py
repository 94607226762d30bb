"""Lines in noise that is stronger the lower the frequency, and beside a jump."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis.signal.spectrum import find_lines
from fieldcal.model.rows.reduce import reduce_to_rows
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.session.description_file import parse_description

RATE, N = 100.0, 400_000
"""More than an hour, in one window."""

WHITE = np.repeat([1e-2, 1e-3], 3)
UP = [1.0, -5.0, 8.3, 0.01, -0.02, 0.03]


def noise(seed: int, knee: float) -> Array:
    """White noise, and as much flicker at a frequency `knee`, Hz, (N, 6)."""
    rng = np.random.default_rng(seed)
    f = np.fft.rfftfreq(N, 1 / RATE)
    f[0] = f[1]
    shape = np.sqrt(1 + knee / f)[:, None]
    drawn = np.fft.rfft(rng.standard_normal((N, 6)), axis=0)
    found: Array = UP + WHITE * np.fft.irfft(drawn * shape, N, axis=0)
    return found


def lines(six: Array) -> list[float]:
    """Frequencies of what is found."""
    t = np.arange(N) / RATE
    about = parse_description(
        {"format": 1, "position": [{"start_s": 0.0, "end_s": N / RATE}]}
    )
    block = Block.of(t, six[:, :3], six[:, 3:])
    usable = np.ones((N, 6), dtype=bool)
    source = RowSource(block, about, usable, np.zeros(1), Thermometer.of(block))
    return [tone.hz for tone, _ in find_lines(source, reduce_to_rows(source))]


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(s, marks=pytest.mark.thorough) for s in (1, 2))]
)
def test_flicker_has_no_lines(seed: int) -> None:
    assert lines(noise(seed, 1.0)) == []


@pytest.mark.parametrize("hz", [0.08, pytest.param(17.0, marks=pytest.mark.thorough)])
def test_a_line_is_found_beside_flicker(hz: float) -> None:
    six = noise(3, 1.0)
    level = WHITE * np.sqrt((1 + 1.0 / hz) / N)
    wave = np.cos(2 * np.pi * hz * np.arange(N) / RATE + 0.4)
    six[:, [0, 4]] += 30 * level[[0, 4]] * wave[:, None]
    (found,) = lines(six)
    assert abs(found - hz) < 1e-4


@pytest.mark.thorough
@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(s, marks=pytest.mark.thorough) for s in (1, 2))]
)
def test_a_jump_of_a_bias_has_no_lines(seed: int) -> None:
    six = noise(seed, 1.0)
    six[110_800:] += [0, 0, 0, 0, 6e-3, 3e-3]
    assert lines(six) == []
