"""The noise of a device from recordings at rest: each channel's processes with their ±.

    from fieldcal.noise import estimate, reduced
    found = estimate([reduced([block])])
    found.channels["gx"].processes["N"]        # value, sigma, unit

Units: accelerometers m/s^2, gyroscopes rad/s; N per sqrt(Hz), B as the channel, K times
sqrt(Hz), Q times s, R per s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, UNITS, Array
from fieldcal.noise.averaging import Averaging, averaging
from fieldcal.noise.covariates import explained, thermometer
from fieldcal.noise.filters import TwoNumbers, two_numbers
from fieldcal.noise.likelihood import NoiseFit
from fieldcal.noise.measured import MeasuredAllan, measured
from fieldcal.noise.prediction import DeviationBand, Draw, draws, predict
from fieldcal.noise.processes import OF_UNIT
from fieldcal.noise.reduction import CHANNELS as NOISY
from fieldcal.noise.reduction import Reduction
from fieldcal.noise.spectrum import CosineSpectrum
from fieldcal.noise.terms import FILTERED_HZ, choose

SHORTEST = 30.0
"""Shortest stretch from which noise is estimated, s."""

FEWEST = 5
"""Draws with a process from which a limit for it is stated."""

QUICK = 1 / (2 * np.pi * FILTERED_HZ)
"""Correlation time below which noise is white to a mean over a second, s."""


@dataclass(frozen=True, slots=True)
class Size:
    """How large a process is.

    Attributes
    ----------
    value, sigma : in `unit`
    unit : of both
    time, time_sigma : correlation time, s; nan where it has none, inf where it is
        longer than can be told

    """

    value: float
    sigma: float
    unit: str
    time: float = np.nan
    time_sigma: float = np.nan


@dataclass(frozen=True, slots=True)
class ChannelEstimate:
    """Noise of one channel.

    Attributes
    ----------
    name, unit : of the channel
    processes : by symbol: N, Q, B, K, R, and G1, G2 of Gauss-Markov processes
    limits : of processes that were not found: what they do not exceed, 95 of 100
    temperature : change per degree that was taken out, with its standard error
    drawn : sizes as they may be, for predictions
    measured : Allan deviation
    pair : what filters with white noise and walk are told
    averaging : error of a mean against its length
    dispersion : as in `Chosen`
    filtered_hz : above this frequency the outputs are filtered; inf where they are not

    """

    name: str
    unit: str
    processes: dict[str, Size]
    limits: dict[str, Size]
    temperature: tuple[float, float] | None
    drawn: tuple[Draw, ...]
    measured: MeasuredAllan
    pair: TwoNumbers
    averaging: Averaging
    dispersion: float
    filtered_hz: float
    dt: float

    @property
    def ramp(self) -> float:
        """Ramp that was found, units per s."""
        return self.processes["R"].value if "R" in self.processes else 0.0

    def predicted(self, tau: Array, length: float) -> DeviationBand:
        """Allan deviation (t,) that a recording of a length, s, will have."""
        found = self.processes.get("R")
        ramp = (found.value, found.sigma) if found else (0.0, 0.0)
        return predict(list(self.drawn), tau, length, self.dt, ramp)


@dataclass(frozen=True, slots=True)
class NoiseModel:
    """Noise of a device.

    Attributes
    ----------
    channels : by name; those that were measured and move
    seconds : of all stretches together
    longest : of the longest, s
    stretches : how many
    rate_hz : samples a second
    bridged : part of the samples that was disturbed, and replaced

    """

    channels: dict[str, ChannelEstimate]
    seconds: float
    longest: float
    stretches: int
    rate_hz: float
    bridged: float


def estimate(recordings: Sequence[Reduction]) -> NoiseModel:
    """Estimate the noise of a device from its recordings at rest.

    Raises
    ------
    InputError
        If no stretch at rest is long enough, or nothing was measured.

    """
    every = [s for r in recordings for s in r.stretches]
    longest = max((s.samples * s.dt for s in every), default=0.0)
    if longest < SHORTEST:
        raise InputError(
            f"the longest stretch at rest lasts {longest:.0f} s: record"
            f" {SHORTEST:.0f} s at least, an hour to see bias instability"
        )
    kept = [s for s in every if s.samples * s.dt >= min(SHORTEST, longest / 4)]
    spectrum = CosineSpectrum(kept, NOISY)
    warm = all(r.warm for r in recordings)
    channels = {
        name: _channel(spectrum, i, warm)
        for i, name in enumerate(CHANNELS)
        if all(r.known[i] for r in recordings) and spectrum.moves(i)
    }
    if not channels:
        raise InputError(f"none of {', '.join(CHANNELS)} was measured, or ever changes")
    samples = sum(r.samples for r in recordings)
    return NoiseModel(
        channels,
        float(sum(s.samples * s.dt for s in kept)),
        longest,
        len(kept),
        1 / spectrum.dt,
        sum(r.bridged for r in recordings) / samples,
    )


def _channel(spectrum: CosineSpectrum, i: int, warm: bool) -> ChannelEstimate:
    covariates = {"R": spectrum.last.time}
    if warm:
        warmth = thermometer(spectrum, spectrum.last.values[:, NOISY])
        if warmth is not None:
            covariates["temperature"] = warmth
    left = explained(spectrum, i, covariates)
    chosen = choose(spectrum, left.powers)
    drawn = tuple(draws(spectrum, chosen))
    processes = _sizes(chosen.best, UNITS[i])
    if "R" in left.found:
        value, sigma = left.found["R"]
        processes["R"] = Size(value, sigma, OF_UNIT["R"].format(UNITS[i]))
    free = spectrum.frequency[chosen.powers.free]
    return ChannelEstimate(
        CHANNELS[i],
        UNITS[i],
        processes,
        _limits(drawn, processes, UNITS[i]),
        left.found.get("temperature"),
        drawn,
        measured(spectrum.stretches, i, left.found.get("temperature", (0.0,))[0]),
        two_numbers(spectrum, chosen, drawn),
        averaging(drawn, left.found.get("R", (0.0,))[0], spectrum.dt, spectrum.seconds),
        chosen.dispersion,
        float(free.min()) if len(free) else np.inf,
        spectrum.dt,
    )


def _sizes(best: NoiseFit, unit: str) -> dict[str, Size]:
    """Values of the processes with their uncertainty."""
    sigma = np.sqrt(np.diag(best.covariance))
    times = dict(zip(best.timed, range(len(best.terms), len(best.x)), strict=True))
    out: dict[str, Size] = {}
    for i, term in enumerate(best.terms):
        value = float(np.exp(best.x[i] / 2))
        time = time_sigma = np.nan
        if i in times:
            time = float(np.exp(best.x[times[i]]))
            time_sigma = time * float(sigma[times[i]])
        elif term == "B":
            time = np.inf
        name = "B" if term == "BT" else term
        if term == "G":
            name = f"G{1 + sum(key.startswith('G') for key in out)}"
        said = OF_UNIT[name[0]].format(unit)
        out[name] = Size(value, value * float(sigma[i]) / 2, said, time, time_sigma)
    out["N"] = _white(best, out["N"])
    order = ("N", "Q", "B", "K", "G1", "G2")
    return {name: out[name] for name in order if name in out}


def _white(best: NoiseFit, alone: Size) -> Size:
    """White noise as means over a second obey it, N^2 + 2 s^2 T of what is quicker.

    A device that filters its outputs has noise with a correlation time of some samples;
    to a mean over a second it is white.
    """
    weights = np.zeros(len(best.x))
    weights[best.terms.index("N")] = np.exp(best.x[best.terms.index("N")])
    for place, j in zip(best.timed, range(len(best.terms), len(best.x)), strict=True):
        if best.terms[place] == "G" and best.x[j] < np.log(QUICK):
            weights[[place, j]] = 2 * np.exp(best.x[place] + best.x[j])
    total = float(weights[: len(best.terms)].sum())
    share = weights / total
    sigma = float(np.sqrt(share @ best.covariance @ share))
    value = float(np.sqrt(total))
    return replace(alone, value=value, sigma=value * sigma / 2)


def _limits(
    drawn: tuple[Draw, ...], found: dict[str, Size], unit: str
) -> dict[str, Size]:
    """What processes that were not found do not exceed, 95 of 100."""
    out = {}
    for name, terms in (("B", ("B", "BT")), ("K", ("K",)), ("Q", ("Q",))):
        if name in found:
            continue
        sizes = [
            float(np.exp(max((d.x[i] for i, t in enumerate(d.terms) if t in terms))))
            for d in drawn
            if set(terms) & set(d.terms)
        ]
        if len(sizes) >= FEWEST:
            high = float(np.sqrt(np.quantile(sizes, 0.95)))
            out[name] = Size(high, np.nan, OF_UNIT[name].format(unit))
    return out
