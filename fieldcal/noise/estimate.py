"""The noise of a device from recordings at rest: each channel's processes with their ±.

    from fieldcal.noise import estimate_noise, reduce_recording
    found = estimate_noise([reduce_recording([block])])
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
from fieldcal.noise.averaging import AveragingError, averaging_error
from fieldcal.noise.covariates import fit_covariates, thermometer_covariate
from fieldcal.noise.device_filter import FILTERED_HZ
from fieldcal.noise.filters import FilterNoisePair, fit_filter_noise
from fieldcal.noise.levels import ReducedStretch
from fieldcal.noise.likelihood import NoiseFit
from fieldcal.noise.measured import MeasuredAllan, measured_allan_deviation
from fieldcal.noise.prediction import (
    DeviationBand,
    SizeDraw,
    draw_sizes,
    predict_allan_deviation,
)
from fieldcal.noise.processes import PROCESS_UNITS
from fieldcal.noise.reduction import CHANNELS as NOISY
from fieldcal.noise.reduction import Reduction
from fieldcal.noise.spectrum import CosineSpectrum
from fieldcal.noise.terms import ChosenProcesses, choose_processes
from fieldcal.noise.upper_limit import upper_limit

MIN_STRETCH_S = 30.0
"""Shortest stretch from which noise is estimated, s."""

SAME_RATE = 0.02
"""Most by which rates of one device differ because of clocks, each off by 1 %."""

MIN_DRAWS = 5
"""Fewest draws with a process from which its limit is taken."""

WHITE_TIME_S = 1 / (2 * np.pi * FILTERED_HZ)
"""Correlation time below which noise acts as white on means over a second, s."""


@dataclass(frozen=True, slots=True)
class ProcessSize:
    """Size of a process.

    Attributes
    ----------
    value, sigma : in `unit`
    unit : of both
    time, time_sigma : correlation time, s; nan if it has none, inf if it is longer than
        the recording can show

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
    limits : upper limits (95 %) of processes that were not found
    temperature : change per degree that was subtracted, with its standard error
    drawn : draws of the sizes, for predictions
    measured : measured Allan deviation
    pair : white noise and random walk for filters that have only these
    averaging : error of a mean against its length
    dispersion : as in `ChosenProcesses`
    filtered_hz : lowest frequency of what is left out because the outputs are filtered,
        or hum; inf where nothing is

    """

    name: str
    unit: str
    processes: dict[str, ProcessSize]
    limits: dict[str, ProcessSize]
    temperature: tuple[float, float] | None
    drawn: tuple[SizeDraw, ...]
    measured: MeasuredAllan
    pair: FilterNoisePair
    averaging: AveragingError
    dispersion: float
    filtered_hz: float
    dt: float

    @property
    def ramp(self) -> float:
        """Estimated ramp, units per s; 0 if none was found."""
        return self.processes["R"].value if "R" in self.processes else 0.0

    def predict_allan(self, tau: Array, length: float) -> DeviationBand:
        """Allan deviation (t,) that another recording of `length` s will have."""
        found = self.processes.get("R")
        ramp = (found.value, found.sigma) if found else (0.0, 0.0)
        return predict_allan_deviation(list(self.drawn), tau, length, self.dt, ramp)


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


def estimate_noise(
    recordings: Sequence[Reduction], names: Sequence[str] = ()
) -> NoiseModel:
    """Estimate the noise of a device from its recordings at rest.

    Parameters
    ----------
    recordings : each reduced
    names : of the recordings, for messages

    Raises
    ------
    InputError
        If no stretch at rest is long enough, their rates differ, or nothing was
        measured.

    """
    names = names or [f"recording {i + 1}" for i in range(len(recordings))]
    pairs = zip(names, recordings, strict=True)
    origin = [(name, s) for name, r in pairs for s in r.stretches]
    longest = max((s.samples * s.dt for _, s in origin), default=0.0)
    if longest < MIN_STRETCH_S:
        raise InputError(
            f"the longest stretch at rest lasts {longest:.0f} s: record"
            f" {MIN_STRETCH_S:.0f} s at least, an hour to see bias instability"
        )
    least = min(MIN_STRETCH_S, longest / 4)
    origin = [(name, s) for name, s in origin if s.samples * s.dt >= least]
    _check_one_rate(origin)
    kept = [s for _, s in origin]
    spectrum = CosineSpectrum(kept, NOISY)
    warm = all(r.has_temperature for r in recordings)
    channels = {
        name: _estimate_channel(spectrum, i, warm)
        for i, name in enumerate(CHANNELS)
        if all(r.known[i] for r in recordings) and spectrum.ever_changes(i)
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


def _check_one_rate(origin: Sequence[tuple[str, ReducedStretch]]) -> None:
    """Refuse stretches of different rates: a coefficient has one frequency only."""
    (fast, short), (slow, long) = (
        of(origin, key=lambda pair: pair[1].dt) for of in (min, max)
    )
    if long.dt > (1 + SAME_RATE) * short.dt:
        raise InputError(
            f"{slow} has {1 / long.dt:.4g} samples a second at rest, and {fast} has"
            f" {1 / short.dt:.4g}: estimate the noise of each rate by itself"
        )


def _estimate_channel(spectrum: CosineSpectrum, i: int, warm: bool) -> ChannelEstimate:
    covariates = {"R": spectrum.last.time}
    if warm:
        warmth = thermometer_covariate(spectrum, spectrum.last.values[:, NOISY])
        if warmth is not None:
            covariates["temperature"] = warmth
    left = fit_covariates(spectrum, i, covariates)
    chosen = choose_processes(spectrum, left.powers)
    trends = left.at_level(spectrum, i, chosen.best.level)
    drawn = tuple(draw_sizes(spectrum, chosen))
    processes = _process_sizes(chosen.best, UNITS[i])
    if "R" in trends:
        value, sigma = trends["R"]
        processes["R"] = ProcessSize(value, sigma, PROCESS_UNITS["R"].format(UNITS[i]))
    free = spectrum.frequency[chosen.powers.free]
    return ChannelEstimate(
        CHANNELS[i],
        UNITS[i],
        processes,
        _upper_limits(spectrum, chosen, drawn, UNITS[i]),
        trends.get("temperature"),
        drawn,
        measured_allan_deviation(
            spectrum.stretches, i, trends.get("temperature", (0.0,))[0]
        ),
        fit_filter_noise(spectrum, chosen, drawn),
        averaging_error(
            drawn, trends.get("R", (0.0,))[0], spectrum.dt, spectrum.seconds
        ),
        chosen.dispersion,
        float(free.min()) if len(free) else np.inf,
        spectrum.dt,
    )


def _process_sizes(best: NoiseFit, unit: str) -> dict[str, ProcessSize]:
    """Values of the processes with their uncertainty."""
    sigma = np.sqrt(np.diag(best.covariance))
    times = dict(zip(best.timed, range(len(best.terms), len(best.x)), strict=True))
    out: dict[str, ProcessSize] = {}
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
        said = PROCESS_UNITS[name[0]].format(unit)
        out[name] = ProcessSize(
            value, value * float(sigma[i]) / 2, said, time, time_sigma
        )
    out["N"] = _white_noise_size(best, out["N"])
    order = ("N", "Q", "B", "K", "G1", "G2")
    return {name: out[name] for name in order if name in out}


def _white_noise_size(best: NoiseFit, alone: ProcessSize) -> ProcessSize:
    """White noise of means over a second: N^2, plus 2 s^2 T of faster processes.

    The noise of filtered outputs has a correlation time of some samples. For means over
    a second it acts as white noise.
    """
    weights = np.zeros(len(best.x))
    weights[best.terms.index("N")] = np.exp(best.x[best.terms.index("N")])
    for place, j in zip(best.timed, range(len(best.terms), len(best.x)), strict=True):
        if best.terms[place] == "G" and best.x[j] < np.log(WHITE_TIME_S):
            weights[[place, j]] = 2 * np.exp(best.x[place] + best.x[j])
    total = float(weights[: len(best.terms)].sum())
    share = weights / total
    sigma = float(np.sqrt(share @ best.covariance @ share))
    value = float(np.sqrt(total))
    return replace(alone, value=value, sigma=value * sigma / 2)


def _upper_limits(
    spectrum: CosineSpectrum,
    chosen: ChosenProcesses,
    drawn: tuple[SizeDraw, ...],
    unit: str,
) -> dict[str, ProcessSize]:
    """Upper limits (95 %) of processes that were not found.

    That of the draws which have the process, if there are some.
    """
    out = {}
    for name, terms in (("B", ("B", "BT")), ("K", ("K",)), ("Q", ("Q",))):
        if set(terms) & set(chosen.best.terms):
            continue
        sizes = [
            float(np.exp(max((d.x[i] for i, t in enumerate(d.terms) if t in terms))))
            for d in drawn
            if set(terms) & set(d.terms)
        ]
        high = (
            float(np.sqrt(np.quantile(sizes, 0.95)))
            if len(sizes) >= MIN_DRAWS
            else upper_limit(spectrum, chosen.powers, name, chosen.best.level)
        )
        out[name] = ProcessSize(high, np.nan, PROCESS_UNITS[name].format(unit))
    return out
