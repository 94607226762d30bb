"""Runs of a navigator with a wrong set-up concealed, and what is said of them.

The navigator is `mechanisation`, the device, base and noise are `drifting`. What a
set-up is told to be is not what it is: the base leans, its azimuth is another, a device
was not in the attitude that was entered, or the base sways, so that each run begins at
another instant of its swaying. Nothing of this is an effect on samples, and so
`diagnose` is not asked, but `fieldcal navigator`.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.drifting import FACES, Sensors, record
from benchmarks.concealed.judging import Outcome
from fieldcal.calibration import Calibration
from fieldcal.core.samples import Array
from fieldcal.navigator.mistakes import (
    ATTITUDES,
    AZIMUTH,
    LEVEL,
    SCATTER,
    run_mistake_name,
)
from fieldcal.navigator.session_runs import calibrate_navigator
from fieldcal.session import description_file

STATED_LEVEL_DEG = 0.02
"""What `drifting` says of the base."""

STAND_FOR: Mapping[str, tuple[str, ...]] = {SCATTER: (ATTITUDES,)}
"""What else the sentence about each tells."""


@dataclass(frozen=True)
class NavigatorRuns:
    """What is recorded, and what of the set-up ought to be named.

    Attributes
    ----------
    label : what it is counted under
    sensors : of the navigator
    tilt_deg : (3,) of the base; East, down, north
    truth : of `mistakes`
    how : further arguments of `record`

    """

    label: str
    sensors: Sensors
    tilt_deg: Array
    truth: frozenset[str] = frozenset()
    how: Mapping[str, Any] = field(default_factory=dict)

    def outcome(self, seed: int) -> Outcome:
        """Record the runs, solve them and judge."""
        rng = np.random.default_rng(seed)
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            record(folder, self.sensors, rng, tilt_deg=self.tilt_deg, **self.how)
            start = time.perf_counter()
            found = calibrate_navigator(
                folder, description_file.read_description(folder / "session.toml")
            )
            seconds = time.perf_counter() - start
        named = {
            name: STAND_FOR.get(name, ())
            for name in found.info["navigator"]["contradicted"]
        }
        said = set(named).union(*named.values())
        return Outcome(
            self.label, np.nan, seed, "left_out" if named else "consistent",
            named, self.truth <= said and len(named) == len(self.truth),
            aliased=bool(self.truth - set(named)),
            extra=tuple(n for n in named if not self.truth & {n, *named[n]}),
            pulls=dict(self._pulls(found)), seconds=seconds,
        )  # fmt: skip

    def _pulls(self, found: Calibration) -> Iterator[tuple[str, float]]:
        for name in found.names:
            group, axis = name.split(".")
            true = self.sensors.truth[group]["xyz".index(axis)]
            yield name, (found.value(name) - true) / found.uncertainty(name)
        told = found.info["navigator"]
        if LEVEL in told["contradicted"]:
            for i in (0, 2):
                off = told["tilt_deg"][i] + self.tilt_deg[i]  # computed less real
                yield f"tilt {i}", off / told["tilt_sigma_deg"][i]


def _base(rng: np.random.Generator) -> Array:
    """A base as it is stated, deg."""
    sigma = [STATED_LEVEL_DEG, 0.5, STATED_LEVEL_DEG]
    return np.asarray(rng.normal(0, sigma))


def as_told(rng: np.random.Generator) -> NavigatorRuns:
    """Nothing concealed."""
    return NavigatorRuns("nothing, navigator", Sensors.drawn(rng), _base(rng))


def leaning(rng: np.random.Generator) -> NavigatorRuns:
    """A base that leans by 8 to 60 times what was stated."""
    azimuth, lean = rng.uniform(0, 2 * np.pi), np.exp(rng.uniform(*np.log([0.16, 1.2])))
    tilt = _base(rng) + lean * np.array([np.cos(azimuth), 0.0, np.sin(azimuth)])
    truth = frozenset({LEVEL})
    return NavigatorRuns("navigator, level", Sensors.drawn(rng), tilt, truth)


def turned(rng: np.random.Generator) -> NavigatorRuns:
    """Another azimuth than was said, with gyroscopes that see the Earth's rate."""
    sensors = Sensors.drawn(rng, rate_noise=2e-6)
    tilt = _base(rng) + [0.0, float(rng.choice([-1, 1]) * rng.uniform(4, 12)), 0.0]
    truth = frozenset({AZIMUTH})
    return NavigatorRuns("navigator, azimuth", sensors, tilt, truth)


def astray(rng: np.random.Generator) -> NavigatorRuns:
    """One run whose device was not in the attitude that was entered."""
    own, r = np.zeros((len(FACES), 3)), int(rng.integers(len(FACES)))
    way, size = rng.uniform(0, 2 * np.pi), float(np.exp(rng.uniform(*np.log([0.3, 2]))))
    own[r] = size * np.array([np.cos(way), 0.0, np.sin(way)])
    truth = frozenset({run_mistake_name(r)})
    return NavigatorRuns(
        "navigator, one attitude",
        Sensors.drawn(rng),
        _base(rng),
        truth,
        {"own_deg": own},
    )


def swaying(rng: np.random.Generator) -> NavigatorRuns:
    """A base that sways: each attitude is entered at another instant of it."""
    phase = rng.uniform(0, 2 * np.pi, (len(FACES), 2))
    own = np.zeros((len(FACES), 3))
    own[:, [0, 2]] = float(rng.uniform(0.2, 1.0)) * np.sin(phase)
    truth = frozenset({ATTITUDES})
    return NavigatorRuns(
        "navigator, sway", Sensors.drawn(rng), _base(rng), truth, {"own_deg": own}
    )


NAVIGATORS = {
    "nothing, navigator": as_told,
    "navigator, level": leaning,
    "navigator, azimuth": turned,
    "navigator, one attitude": astray,
    "navigator, sway": swaying,
}
