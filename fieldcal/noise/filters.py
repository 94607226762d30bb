"""Noise parameters for the filters of other programs: white noise and random walk.

A filter has two parameters for a sensor, N and K, while a device may have more
processes. Both are fitted to the recording without the other processes, and the factor
by which they are too small is

    f^2 = max over tau of sigma^2(tau) / (N^2 / tau + K^2 tau / 3), 1 at least     (1)

with sigma the Allan deviation of all processes, tau from 1 s to a fourth of the
recording. Both parameters are multiplied by f. The noisiest axis of a triad is used. In
a filter with the step h, where noise is held for a step,

    white  N / sqrt(h),    bias  K / sqrt(h)   per second                          (2)

h: EKF3 of ArduPilot 12 ms, EKF2 of PX4 10 ms. A covariance of single samples, as
sensor_msgs/Imu has it, is N^2 times the rate: what a filter that takes them for
independent needs. Samples of a device with a low-pass scatter by less. Sources: Kalibr
wiki, IMU noise model; covariance prediction of EKF3 and EKF2, where a step adds
(h w)^2 to an angle and (h h p)^2 to a bias times h.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.likelihood import fit_processes
from fieldcal.noise.prediction import SizeDraw
from fieldcal.noise.processes import allan_variance
from fieldcal.noise.reference import most_probable_sizes
from fieldcal.noise.spectrum import CosineSpectrum
from fieldcal.noise.terms import ChosenProcesses
from fieldcal.noise.upper_limit import upper_limit

STEP_S = {"ardupilot": 0.012, "px4": 0.01}
PROGRAM_PARAMETERS = {
    "ardupilot": (
        *("EK3_ACC_P_NSE", "EK3_ABIAS_P_NSE"),
        *("EK3_GYRO_P_NSE", "EK3_GBIAS_P_NSE"),
    ),
    "px4": (
        *("EKF2_ACC_NOISE", "EKF2_ACC_B_NOISE"),
        *("EKF2_GYR_NOISE", "EKF2_GYR_B_NOISE"),
    ),
}
"""Parameters for white noise and bias of accelerometers, and of gyroscopes."""

UNITS = ("m/s^2", "m/s^3", "rad/s", "rad/s^2")

FilterNoise = dict[str, tuple[float, float, str]]
"""Parameters by name: value, standard deviation (nan for a bound) and unit."""


@dataclass(frozen=True, slots=True)
class FilterNoisePair:
    """White noise and random walk that replace all processes of a channel.

    Attributes
    ----------
    white, white_sigma : N, times `left_out`
    walk, walk_sigma : K, times `left_out`; if no walk is seen, its upper limit (95 %)
        with the sigma nan
    left_out : factor f of (1)

    """

    white: float
    white_sigma: float
    walk: float
    walk_sigma: float
    left_out: float


def fit_filter_noise(
    spectrum: CosineSpectrum, chosen: ChosenProcesses, drawn: tuple[SizeDraw, ...]
) -> FilterNoisePair:
    """Fit white noise and random walk to a channel, enlarged by the factor (1)."""
    tau = np.geomspace(1.0, max(spectrum.seconds / 4, 2.0), 24)
    whole = np.mean(
        [allan_variance(d.terms, d.x, tau, spectrum.dt) for d in drawn], axis=0
    )
    white = float(np.median([np.exp(d.x[d.terms.index("N")]) for d in drawn]))
    start = np.log([white, whole[-1] / tau[-1]])
    pair = fit_processes(spectrum, chosen.powers, ("N", "K"), start)
    if pair is None:
        one = fit_processes(spectrum, chosen.powers, ("N",), start[:1])
        if one is None:
            raise AssertionError("white noise is in every bin")
        size = float(np.exp(one.x[0]))
        factor = _left_out_factor(whole, size / tau)
        error = float(np.sqrt(one.covariance[0, 0])) / 2
        n = float(np.sqrt(size)) * factor
        walk = factor * upper_limit(spectrum, chosen.powers, "K", one.level)
        return FilterNoisePair(n, n * error, walk, np.nan, factor)
    pair = most_probable_sizes(spectrum, chosen.powers, pair)
    sizes, spread = np.exp(pair.x), np.sqrt(np.diag(pair.covariance)) / 2
    factor = _left_out_factor(whole, sizes[0] / tau + sizes[1] * tau / 3)
    n, k = (np.sqrt(sizes) * factor).tolist()
    return FilterNoisePair(n, n * float(spread[0]), k, k * float(spread[1]), factor)


def _left_out_factor(whole: Array, pair: Array) -> float:
    return float(np.sqrt(max(1.0, np.max(whole / pair))))  # (1)


def noisiest_axes(
    pairs: Mapping[str, FilterNoisePair], triad: str
) -> FilterNoisePair | None:
    """The largest of each parameter among the axes of a triad; None without axes."""
    some = [pair for name, pair in pairs.items() if name[0] == triad]
    if not some:
        return None
    loud = max(some, key=lambda p: p.white)
    slow = max(some, key=lambda p: p.walk)
    return FilterNoisePair(loud.white, loud.white_sigma, slow.walk, slow.walk_sigma,
                           max(loud.left_out, slow.left_out))  # fmt: skip


def program_parameters(
    program: str, pairs: Mapping[str, FilterNoisePair]
) -> FilterNoise:
    """Parameters of ArduPilot or PX4, (2)."""
    root = STEP_S[program] ** 0.5
    out: FilterNoise = {}
    for i, triad in enumerate("ag"):
        if (both := noisiest_axes(pairs, triad)) is None:
            continue
        white, bias = PROGRAM_PARAMETERS[program][2 * i : 2 * i + 2]
        out[white] = both.white / root, both.white_sigma / root, UNITS[2 * i]
        out[bias] = both.walk / root, both.walk_sigma / root, UNITS[2 * i + 1]
    return out


def kalibr_parameters(pairs: Mapping[str, FilterNoisePair]) -> FilterNoise:
    """Kalibr's four noise parameters."""
    out: FilterNoise = {}
    for triad, name, unit in (
        ("a", "accelerometer", "m/s^2"),
        ("g", "gyroscope", "rad/s"),
    ):
        if both := noisiest_axes(pairs, triad):
            density, walk = both.white, both.walk
            out[f"{name}_noise_density"] = density, both.white_sigma, f"{unit}/sqrt(Hz)"
            out[f"{name}_random_walk"] = walk, both.walk_sigma, f"{unit}*sqrt(Hz)"
    return out


def ros_covariances(
    white: Mapping[str, tuple[float, float]], rate_hz: float
) -> FilterNoise:
    """Variances of single samples for the diagonals of sensor_msgs/Imu.

    Parameters
    ----------
    white : N and its standard deviation, by channel
    rate_hz : samples a second

    """
    out: FilterNoise = {}
    for name, (n, sigma) in white.items():
        what = "linear_acceleration" if name[0] == "a" else "angular_velocity"
        unit = "m^2/s^4" if name[0] == "a" else "rad^2/s^2"
        place = 4 * "xyz".index(name[1])
        value = n * n * rate_hz
        out[f"{what}_covariance[{place}]"] = value, 2 * value * sigma / n, unit
    return out
