"""Another device after a jump of the biases: by its biases, noise and steps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from fieldcal.acceptance import exchange
from fieldcal.acceptance.exchange import DOUBT, EXCHANGED, exchange_text
from fieldcal.calibration import Calibration, limits
from fieldcal.core.samples import Array, Block
from fieldcal.windows import Average

BOUNDS = limits.read("tactical")
RATE, HELD, COUNT = 50.0, 10.0, 500
REPEATS = {"acc_bias": BOUNDS.acc_bias_repeat, "gyr_bias": BOUNDS.gyr_bias_repeat}


def recording(
    rng: np.random.Generator, noise: tuple[float, float], step: tuple[float, float]
) -> tuple[list[Average], Block]:
    """Six windows, two of them before 25 s, each part with its noise and its step."""
    t = np.arange(6 * COUNT) / RATE
    six = rng.standard_normal((len(t), 6)) * np.repeat([5e-3, 1e-4], 3)
    early = (t < 20.0)[:, None]
    six *= np.where(early, *noise)
    for part, width in zip((early[:, 0], ~early[:, 0]), step, strict=True):
        if width:
            six[part, :3] = width * np.round(six[part, :3] / width)
    windows = [
        Average(np.zeros(6), np.eye(6), 21.0, COUNT, HELD * k, HELD * k + 9.0)
        for k in range(6)
    ]
    return windows, Block.of(t, six[:, :3], six[:, 3:])


def jumping(bias: dict[str, tuple[float, float]]) -> Calibration:
    info: dict[str, Any] = {"jump": {"at_s": 19.995, "bias": bias}}
    return Calibration(
        "joint", ("acc_bias.x",), np.zeros(1), 1e-10 * np.eye(1), ("m/s^2",), 7.0, 7,
        1e-3, info=info,
    )  # fmt: skip


def jumps(rng: np.random.Generator, times: float) -> dict[str, tuple[float, float]]:
    """Differences of biases of two runs, whose spread is so many times the usual."""
    return {
        f"{group}.{axis}": (times * repeat * (after - before), 0.1 * repeat)
        for group, repeat in REPEATS.items()
        for axis in "xyz"
        for before, after in [rng.normal(0, 1, 2).tolist()]
    }


def said(
    seed: int, times: float, ratio: float, step: tuple[float, float] = (0.0, 0.0)
) -> str:
    rng = np.random.default_rng(seed)
    windows, block = recording(rng, (1.0, ratio), step)
    return exchange_text(jumping(jumps(rng, times)), block, windows, BOUNDS)


def test_a_restart_is_none() -> None:
    assert sum(bool(said(seed, 1.0, 1.0)) for seed in range(40)) == 0


@pytest.mark.parametrize("ratio", [0.25, 5.0])
def test_other_noise_after_a_jump_is_another_device(ratio: float) -> None:
    for seed in range(8):
        text = said(seed, 3.0, ratio)
        assert "at 20 s" in text
        assert "noise of the gyroscopes is" in text and "another device" in text


def test_another_step_after_a_jump_is_another_device() -> None:
    texts = [said(seed, 3.0, 1.0, (1e-3, 2.5e-3)) for seed in range(8)]
    assert all("the step of its outputs changes" in text for text in texts)
    assert not any(said(seed, 1.0, 1.0, (1e-3, 1e-3)) for seed in range(8))


def test_steps_of_single_precision_change_with_the_size_of_numbers() -> None:
    """A bias that jumps across a power of two is no other device."""
    for seed in range(8):
        rng = np.random.default_rng(seed)
        windows, block = recording(rng, (1.0, 1.0), (0.0, 0.0))
        block.acc[:] += np.where(block.t[:, None] < 20.0, 3.9, 4.1)
        single = block.six.astype(np.float32).astype(float)
        assert not exchange_text(
            jumping(jumps(rng, 1.0)), block.with_six(single), windows, BOUNDS
        )


@pytest.mark.parametrize("ratio", [1.0, 1.15, 3.0])
def test_the_odds_are_those_of_normal_laws(
    ratio: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(4)
    bias = jumps(rng, 2.0)
    windows, block = recording(rng, (1.0, ratio), (0.0, 0.0))

    def density(k: float) -> float:
        laws = [
            norm.pdf(v, scale=np.sqrt(2 * (k * REPEATS[n.split(".")[0]]) ** 2 + s**2))
            for n, (v, s) in bias.items()
        ]
        return float(np.prod(laws))

    change, sigma = noise_changes(block)
    wide = np.prod(norm.pdf(change, scale=np.hypot(1.0, sigma)))
    near = np.prod(norm.pdf(change, scale=sigma))
    odds = EXCHANGED / (1 - EXCHANGED) * (1 + density(5.0) / density(1.0)) / 2
    odds *= wide / (0.98 * near + 0.02 * wide)
    expected = odds / (1 + odds)
    monkeypatch.setattr(exchange, "DOUBT", 0.0)
    text = exchange_text(jumping(bias), block, windows, BOUNDS)
    found = float(text.split("probability ")[1][:4])
    assert found == pytest.approx(expected, abs=0.05)
    assert (expected > DOUBT) == (ratio > 2)


def noise_changes(block: Block) -> tuple[Array, Array]:
    """Log of the ratio of the noise of both triads, and its error, by differences."""
    logs = []
    for k in range(6):
        one = block.between(HELD * k, HELD * k + 9.0).six
        noise = np.diff(one, axis=0).std(axis=0) / np.sqrt(2)
        logs.append([np.log(noise[:3]).mean(), np.log(noise[3:]).mean()])
    each = np.array(logs)
    change = each[2:].mean(axis=0) - each[:2].mean(axis=0)
    left = np.concatenate([each[:2] - each[:2].mean(0), each[2:] - each[2:].mean(0)])
    scatter = np.sqrt((left**2).sum(axis=0) / 4)
    return change, np.hypot(0.1, scatter) * np.sqrt(1 / 2 + 1 / 4)


def test_nothing_is_said_without_a_jump_or_windows_on_both_sides() -> None:
    rng = np.random.default_rng(1)
    windows, block = recording(rng, (1.0, 9.0), (0.0, 0.0))
    found = jumping(jumps(rng, 3.0))
    assert exchange_text(found, block, windows, BOUNDS)
    assert exchange_text(found, block, windows[2:], BOUNDS) == ""
    steady = Calibration(
        "joint", ("acc_bias.x",), np.zeros(1), np.eye(1), ("m/s^2",), 7.0, 7, 1e-3
    )
    assert exchange_text(steady, block, windows, BOUNDS) == ""
