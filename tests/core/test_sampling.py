"""How often samples come, whatever becomes of a few of them, and pauses of them."""

import doctest

import numpy as np
import pytest

from fieldcal.core import sampling
from fieldcal.core.samples import Block
from fieldcal.core.sampling import has_no_pause, sampling_rate, shows_losses


def test_the_rate_is_that_of_the_clock_whatever_the_stamps() -> None:
    t = 3.0 + np.arange(1000) / 40.0
    still = np.zeros((1000, 3))
    assert sampling_rate(Block.of(t, still)) == pytest.approx(40.0)
    bursts = t[np.arange(1000) // 10 * 10] + 1e-5 * (np.arange(1000) % 10)
    assert sampling_rate(Block.of(bursts, still)) == pytest.approx(40.0)
    gap = t + 100.0 * (t > 20.0)
    assert sampling_rate(Block.of(gap, still)) == pytest.approx(40.0)
    assert sampling_rate(Block.of(t[:2], still[:2])) == pytest.approx(40.0)
    assert sampling_rate(Block.of(t[:1], still[:1])) == 1.0


def test_every_so_many_steps_are_enough_for_the_rate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of steps of 0.1 and 0.3 s in turn those looked at are of one kind."""
    monkeypatch.setattr(sampling, "STEPS_USED", 10)
    t = np.cumsum(np.tile([0.1, 0.3], 20))
    assert sampling_rate(Block.of(t, np.zeros((40, 3)))) == pytest.approx(
        1 / 0.2, rel=0.6
    )


def test_every_step_of_a_short_recording_counts_for_the_rate() -> None:
    """Of 20 steps of 0.1 s and 20 of 0.3 s in turn the median is between them."""
    t = np.concatenate([[0.0], np.cumsum(np.tile([0.1, 0.3], 20))])
    assert sampling_rate(Block.of(t, np.zeros((41, 3)))) == pytest.approx(5.0)


@pytest.mark.parametrize("rate", [1.0, 50.0, 1000.0])
def test_a_pause_counts_wherever_it_touches_the_samples(rate: float) -> None:
    t = np.arange(40) / rate
    t[20:] += 3.0 / rate  # four periods from sample 19 to 20
    inside = [(10, 30), (19, 21), (20, 25), (15, 20), (0, 40)]
    beside = [(21, 40), (0, 19), (5, 10)]
    assert not any(has_no_pause(t, *span, rate) for span in inside)
    assert all(has_no_pause(t, *span, rate) for span in beside)
    # a sample or two that were lost are none
    t[20:] -= 1.0 / rate
    assert all(has_no_pause(t, *span, rate) for span in [*inside, *beside])


def test_the_example_holds() -> None:
    assert doctest.testmod(sampling, extraglobs={"np": np}).failed == 0


def test_losses_show_in_steps_that_are_even_and_not_in_others() -> None:
    rng, t = np.random.default_rng(1), np.arange(1000) / 100.0
    some = np.delete(t, rng.choice(1000, 50, replace=False))
    for even in (t, some, t + rng.normal(0, 5e-4, 1000), t[:2], t[:1]):
        assert shows_losses(even)
    bursts = np.floor(t / 0.1) * 0.1 + 0.09 + 1e-4 * (np.arange(1000) % 10)
    in_pairs = t - 0.009 * (np.arange(1000) % 2)
    for uneven in (bursts, in_pairs, np.sort(t + rng.uniform(-4e-3, 4e-3, 1000))):
        assert not shows_losses(uneven)
