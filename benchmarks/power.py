"""The size at which each effect is named, beside that of a test which knows the rest.

    python -m benchmarks power [SESSIONS] [--only=EFFECT] [--seed=N]

For each effect with numbers, sessions are drawn in which it alone is concealed, 16 or
as many as are asked for. Its size is in standard deviations of what it makes of the
rows beyond bias and scale factor. A likelihood-ratio test that knows which effect it
may be, of what shape and in which components, and the noise, sees it nine times of ten
once

    chi2'(k, s^2) > chi2_0.995(k) has a probability of 0.9

for k components: it is wrong once in 200 empty sessions, as the diagnosis may be. What
is printed is the size at which the diagnosis is right nine times of ten, over that s.
Each next size is where those before put the nine of ten (a logistic course over the
logarithm of the size, of unknown place and width, on a grid).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import cache

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2

from benchmarks.concealed import draws, outcome
from benchmarks.concealed.others import calm
from benchmarks.concealed.sessions import Session
from fieldcal.core.samples import Array

SESSIONS = 16
SEED = 61_000_000
OFTEN = 0.9
QUIET = 0.995

MIDDLE = np.linspace(np.log(0.3), np.log(12.0), 60)
"""Where half are right, ln of the size over the oracle's."""

WIDTH = np.exp(np.linspace(np.log(0.05), np.log(0.6), 12))
"""Logistic width of the course, in the same."""

LAPSE = 0.02
"""Part of sessions that are not right at any size: what else may be wrong with them."""


@cache
def oracle(components: int) -> float:
    """Size that the test sees nine times of ten, in standard deviations.

    >>> round(oracle(1), 2), round(oracle(3), 2)
    (4.09, 4.62)
    """
    limit = chi2.ppf(QUIET, components)
    return float(brentq(lambda s: ncx2.sf(limit, components, s**2) - OFTEN, 0.1, 50.0))


class Course:
    """How often an effect is named over its size, as far as sessions tell.

    Attributes
    ----------
    weight : (60, 12) of each middle and width, ln

    """

    def __init__(self) -> None:
        self.weight: Array = np.zeros((len(MIDDLE), len(WIDTH)))

    def add(self, ratio: float, right: bool) -> None:
        """Take in a session of an effect of some size over the oracle's."""
        far = (np.log(ratio) - MIDDLE[:, None]) / WIDTH
        named = (1 - LAPSE) / (1 + np.exp(-far))
        self.weight = self.weight + np.log(named if right else 1 - named)

    @property
    def often(self) -> tuple[float, float]:
        """The ratio at which nine of ten are right and its standard deviation, ln."""
        at = MIDDLE[:, None] - WIDTH * np.log((1 - LAPSE) / OFTEN - 1)
        chance = np.exp(self.weight - self.weight.max())
        chance /= chance.sum()
        mean = float((chance * at).sum())
        return mean, float(np.sqrt((chance * (at - mean) ** 2).sum()))


def drawn(name: str, seed: int, ratio: float) -> tuple[Session, float]:
    """A session with an effect of about that size, and its size over the oracle's."""
    sigmas = ratio * oracle(2)
    session = calm(draws.single(name, np.random.default_rng(seed), sigmas))
    sizes = session.concealed[name]
    count = sum(v != 0 for n, v in sizes.items() if n not in draws.FIXED)
    return session, sigmas / oracle(count)


def followed(name: str, sessions: int, seed: int) -> Course:
    """The course of one effect after so many sessions."""
    course = Course()
    for i in range(sessions):
        session, ratio = drawn(name, seed + i, float(np.exp(course.often[0])))
        course.add(ratio, outcome(seed + i, session).right)
    return course


def rows(sessions: int, only: str, seed: int) -> Iterator[tuple[str, float, float]]:
    """Effect, ratio, and the factor that it is uncertain by."""
    for k, name in enumerate(n for n in draws.EQUATIONS if only in n):
        mean, sigma = followed(name, sessions, seed + 1000 * k).often
        print(f"{name}: {np.exp(mean):.2f}", file=sys.stderr, flush=True)
        yield name, float(np.exp(mean)), float(np.exp(sigma))


def main() -> None:
    """Print the table."""
    words = sys.argv[2:]
    numbers = [int(w) for w in words if w.isdigit()]
    given = dict(w.split("=", 1) for w in words if w.startswith("--"))
    only, seed = given.get("--only", ""), int(given.get("--seed", SEED))
    found = list(rows(numbers[0] if numbers else SESSIONS, only, seed))
    table = Table("effect", "size over the oracle's", "times or divided by")
    for name, ratio, factor in sorted(found, key=lambda row: row[1]):
        table.add_row(name, f"{ratio:.2f}", f"{factor:.2f}")
    Console().print(table)
    print(f"median {np.median([ratio for _, ratio, _ in found]):.2f}")
