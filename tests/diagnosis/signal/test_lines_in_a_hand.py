"""A line that keeps its phase, where a hand trembles with another one each time."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis.signal.line import SpectralLine
from fieldcal.diagnosis.signal.spectrum import find_lines
from fieldcal.model.rows.reduce import reduce_to_rows
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.session.description_file import parse_description

RATE, HELD_S, REST_S, COUNT = 100.0, 6.0, 9.0, 20
NOISE = np.repeat([3e-2, 1e-3], 3)
TREMBLES = (3.6, 7.2, 10.1, 19.6)
"""Hz, more than are looked at."""


def held(seed: int) -> tuple[Array, Array]:
    """Times (n,) and outputs (n, 6) of a device that is held in many ways, in a hand.

    Its gyroscopes tremble for 6 s each time, the first two times the most.
    """
    rng = np.random.default_rng(seed)
    n = round(COUNT * REST_S * RATE)
    t = np.arange(n) / RATE
    six = NOISE * rng.standard_normal((n, 6))
    for k in range(COUNT):
        some = slice(round(k * REST_S * RATE), round((k + 1) * REST_S * RATE))
        up = rng.standard_normal(3)
        six[some, :3] += 9.8 * up / np.linalg.norm(up)
        for hz in TREMBLES:
            size = (5.0 if k < 2 else 0.5) * 1e-3 * rng.rayleigh(size=3)
            phase = rng.uniform(0, 2 * np.pi, 3)
            six[some, 3:] += size * np.cos(2 * np.pi * hz * t[some, None] + phase)
    return t, six


def lines(t: Array, six: Array, apart: bool = False) -> list[SpectralLine]:
    """What is found; `apart` states that gyroscopes have rows of their own."""
    starts = np.arange(COUNT) * REST_S + 1.0
    said = [{"start_s": s, "end_s": s + HELD_S} for s in starts.tolist()]
    about = parse_description({"format": 1, "position": said})
    block = Block.of(t, six[:, :3], six[:, 3:])
    usable = np.ones((len(t), 6), dtype=bool)
    source = RowSource(block, about, usable, starts, Thermometer.of(block))
    return [tone for tone, _ in find_lines(source, reduce_to_rows(source, apart=apart))]


@pytest.mark.parametrize("seed", range(3))
def test_a_hand_that_trembles_has_no_line(seed: int) -> None:
    assert lines(*held(seed)) == []


@pytest.mark.parametrize("hz", [7.2, 7.23, 8.1])
def test_a_line_is_found_in_outputs_that_do_not_tremble(hz: float) -> None:
    """At the frequency at which the others tremble, and at one of its own."""
    t, six = held(4)
    sigma = NOISE[0] * np.sqrt(2 / (COUNT * HELD_S * RATE))
    size = 10 * sigma * np.array([1.0, -0.6])
    six[:, :2] += size * np.cos(2 * np.pi * hz * t[:, None] + np.array([0.4, 2.0]))
    (tone,) = lines(t, six)
    assert abs(tone.hz - hz) < 1e-3 and tone.channels == ("ax", "ay")
    found = np.array([tone.values["ax"], tone.values["ay"]])
    assert np.abs(found - np.abs(size)).max() < 4 * sigma


def test_a_line_of_gyroscopes_is_found_in_rows_of_their_own() -> None:
    """The first rows of each window are for the accelerometers alone."""
    t, six = held(5)
    six[:, 4] += 0.3 * NOISE[4] * np.cos(2 * np.pi * 31.0 * t)
    for apart in (False, True):
        (tone,) = lines(t, six, apart)
        assert abs(tone.hz - 31.0) < 1e-3 and tone.channels == ("gy",)
