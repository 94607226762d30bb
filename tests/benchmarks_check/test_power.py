"""The oracle by chance itself; the course by answers drawn from a known one."""

import numpy as np
import pytest

from benchmarks.power import Course, oracle


@pytest.mark.parametrize("components", [1, 4])
def test_the_oracle_sees_its_size_nine_times_of_ten(components: int) -> None:
    rng = np.random.default_rng(components)
    quiet = (rng.standard_normal((100_000, components)) ** 2).sum(axis=1)
    limit = np.quantile(quiet, 0.995)
    seen = rng.standard_normal((100_000, components))
    seen[:, 0] += oracle(components)
    assert ((seen**2).sum(axis=1) > limit).mean() == pytest.approx(0.9, abs=0.01)


def test_sizes_close_in_on_nine_of_ten() -> None:
    rng = np.random.default_rng(5)
    pulls = []
    for truth in np.repeat([0.8, 1.4, 3.0], 30):
        course = Course()
        for _ in range(16):
            ratio = np.exp(course.often[0])
            chance = 1 / (1 + np.exp(-np.log(ratio / truth) / 0.2 - np.log(9)))
            course.add(ratio, rng.random() < chance)
        mean, sigma = course.often
        pulls.append((mean - np.log(truth)) / sigma)
        assert sigma < 0.5
    assert abs(np.mean(pulls)) < 0.6 and 0.5 < np.std(pulls) < 1.4
