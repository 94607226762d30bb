"""Noise: sizes beside the Cramer-Rao bound, prediction of what comes, and cost.

    python -m benchmarks noise [RECORDINGS]

First rmse over the bound, exactly from dense covariances, with its standard error, and
the scatter of errors in stated sigma. Then recordings, simulated and real (`rests`),
cut in halves: how often the band of 68 of 100 from the first half holds the Allan
deviation of the second at 10 to 1000 s, for real ones from 1 s on as well, with the
standard error of that by the scatter of the series, and the mean log score, beside
allantools (the first half's deviations as they are), avar and allan-variance (their
fits), all with the scatter of the second half's estimate for white noise. Last the
processor time and memory of ten million samples.
"""

from __future__ import annotations

import multiprocessing
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from benchmarks._words import how_many
from benchmarks.noise.peers import THEIRS, allan_variance, white_freedom
from benchmarks.noise.processes import bound, covariance, noise, recording
from benchmarks.noise.rests import rests
from fieldcal.core.samples import CHANNELS, Array, Block
from fieldcal.noise import estimate_noise, reduce_recording
from fieldcal.noise.levels import CosineLevels
from fieldcal.noise.likelihood import (
    Flags,
    NoiseFit,
    Powers,
    expected_powers,
    information_matrix,
)
from fieldcal.noise.measured import measured_allan_deviation
from fieldcal.noise.reference import most_probable_sizes
from fieldcal.noise.spectrum import CosineSpectrum

DT, SHORT, EACH = 0.1, 600, 4000
CASES: list[dict[str, float]] = [
    {"N": 1.0}, {"N": 1.0, "K": 1.0}, {"N": 1.0, "K": 0.3}, {"N": 1.0, "B": 1.0},
    {"N": 1.0, "Q": 0.3}, {"N": 1.0, "Q": 0.3, "K": 1.0},
]  # fmt: skip
KINDS: dict[str, dict[str, float]] = {
    "white": {"N": 1.0}, "white, walk": {"N": 1.0, "K": 0.03},
    "white, flicker": {"N": 1.0, "B": 0.3},
    "white, Gauss-Markov": {"N": 1.0, "s": 0.3, "T": 30.0},
    "white, walk, ramp": {"N": 1.0, "K": 0.02, "R": 2e-4},
}  # fmt: skip
FIRST, LAST = 10.0, 1000.0
SOON = 1.0
"""From which averaging time on real recordings count: some last a minute only."""

NAMES = ["ours", *THEIRS]
TEN_MILLION = 10_000_000


def spectra(values: Array) -> CosineSpectrum:
    """All columns reduced."""
    levels = CosineLevels(DT, values.shape[1], values.shape[1])
    levels.add(values)
    return CosineSpectrum([levels.reduced()], values.shape[1])


def ours(values: Array, sizes: dict[str, float]) -> tuple[Array, Array]:
    """Sizes of each column (c, p) and stated relative errors."""
    spectrum = spectra(values)
    found, sigma = [], []
    for c in range(values.shape[1]):
        power, count = spectrum.channel_powers(
            c, spectrum.last.values[:, c], np.ones(len(spectrum.last.bin))
        )
        powers = Powers(power, count, np.zeros(len(power), dtype=bool))
        one = _most_probable(spectrum, powers, sizes)
        found.append(np.exp(one.x / 2))
        sigma.append(np.sqrt(np.diag(one.covariance)) / 2)
    return np.array(found), np.array(sigma)


def _most_probable(
    spectrum: CosineSpectrum, powers: Powers, sizes: dict[str, float]
) -> NoiseFit:
    """Sizes of processes that are known to be there, sought from the true ones."""
    x = 2 * np.log(list(sizes.values()))
    level, slopes = expected_powers(spectrum, tuple(sizes), x)
    start = NoiseFit(
        tuple(sizes), x, information_matrix(powers, slopes), level, 0.0, np.zeros(0)
    )
    return most_probable_sizes(spectrum, powers, start)


def beside_the_bound() -> None:
    """Print rmse over the bound of each size, with its standard error."""
    rng = np.random.default_rng(1)
    peer = find_spec("allan_variance") is not None
    print(f"rmse over the Cramer-Rao bound, {SHORT} samples, {EACH} recordings each")
    print(f"{'truth':22} {'size':4} {'bound':>8} {'ours':>15} {'pull':>6} "
          f"{'allan-variance':>15}")  # fmt: skip
    for sizes in CASES:
        whole = sum(s**2 * covariance(SHORT, DT, p) for p, s in sizes.items())
        values = np.linalg.cholesky(whole) @ rng.standard_normal((SHORT, EACH))
        found, sigma = ours(values, sizes)
        theirs = (
            allan_variance(values, DT, sizes) if peer else np.full(found.shape, np.nan)
        )
        truth, best = np.array(list(sizes.values())), bound(SHORT, DT, sizes)
        pull = np.std(np.log(found / truth) / sigma, axis=0)
        name = " ".join(f"{p}={s:g}" for p, s in sizes.items())
        for i, process in enumerate(sizes):
            (ratio, error), (other, _) = (
                _over(f[:, i] / truth[i] - 1, best[i]) for f in (found, theirs)
            )
            print(f"{name:22} {process:4} {best[i]:8.4f} {ratio:7.3f} ± {error:.3f} "
                  f"{pull[i]:6.3f} {other:15.3f}", flush=True)  # fmt: skip


def _over(errors: Array, best: float) -> tuple[float, float]:
    """Root mean square of relative errors over the bound, and its standard error."""
    squares = (errors / best) ** 2
    ratio = float(np.sqrt(squares.mean()))
    return ratio, float(squares.std() / np.sqrt(len(squares)) / (2 * ratio))


def scored(variance: Array, freedom: Array, deviation: Array) -> tuple[Array, Flags]:
    """Log density of log deviations, and whether 68 of 100 hold them."""
    from scipy.stats import chi2

    ratio = freedom * deviation**2 / variance
    density: Array = chi2.logpdf(ratio, freedom) + np.log(2 * ratio)
    held = (chi2.ppf(0.16, freedom) < ratio) & (ratio < chi2.ppf(0.84, freedom))
    return density, held


Series = list[tuple[Array, Flags]]
"""Log scores and whether bands hold, (t,) each, of one channel after the other."""


def halves(block: Block, first: float = FIRST) -> dict[str, Series]:
    """Log scores and whether bands hold, of each estimator, from a time on, s."""
    out: dict[str, Series] = {}
    middle = len(block) // 2
    model = estimate_noise([reduce_recording([block[:middle]])])
    second = reduce_recording([block[middle:]])
    length = max(s.samples * s.dt for s in second.stretches)
    dt = 1 / model.rate_hz
    for name, channel in model.channels.items():
        place = CHANNELS.index(name)
        seen = measured_allan_deviation(second.stretches, place)
        asked = (seen.tau >= first) & (seen.tau <= min(LAST, length / 4))
        if not asked.any():
            continue
        tau, deviation = seen.tau[asked], seen.deviation[asked]
        said = channel.predict_allan(tau, length)
        held = (said.low < deviation) & (deviation < said.high)
        out.setdefault("ours", []).append((said.log_score(deviation), held))
        freedom = white_freedom(tau, length, dt)
        x = block.six[:middle, place]
        for peer, (module, of) in THEIRS.items():
            if find_spec(module):
                variance = of(x[np.isfinite(x)], dt, tau)
                score = scored(variance, freedom, deviation)
                out.setdefault(peer, []).append(score)
    return out


def simulated(kind: str, number: int) -> Iterator[Block]:
    """Recordings of an hour and of six, 10 Hz."""
    rng = np.random.default_rng(sorted(KINDS).index(kind))
    for i in range(number):
        n = 36_000 if i % 2 else 216_000
        yield recording(noise(rng, n, DT, 6, **KINDS[kind]), DT)


def prediction(number: int) -> None:
    """Print how often bands hold, and mean log scores."""
    print(f"\nsecond half from the first, {FIRST:g} to {LAST:g} s: held by 68 of 100,"
          " and mean log score")  # fmt: skip
    print(f"{'':22}" + "".join(f"{n:>20}" for n in NAMES))
    whole: dict[str, Series] = {}
    for kind in KINDS:
        _row(kind, _added(whole, simulated(kind, number), FIRST))
    _row("all simulated", whole)
    real = dict(rests())
    print(f"real recordings at rest, from {SOON:g} s on")
    soon: dict[str, Series] = {}
    for name, block in real.items():
        _row(name, _added(soon, [block], SOON))
    _row("all of these", soon)
    _row(f"from {FIRST:g} s on", _added({}, real.values(), FIRST))


def _added(
    whole: dict[str, Series], blocks: Iterable[Block], first: float
) -> dict[str, Series]:
    """Series of some recordings by estimator, which are added to others as well."""
    out: dict[str, Series] = {}
    for block in blocks:
        for name, series in halves(block, first).items():
            out.setdefault(name, []).extend(series)
            whole.setdefault(name, []).extend(series)
    return out


def _row(kind: str, out: dict[str, Series]) -> None:
    cells = [_cell(out[n]) if n in out else "not there" for n in NAMES]
    print(f"{kind:22}" + "".join(f"{c:>20}" for c in cells), flush=True)


def _cell(series: Series) -> str:
    """How often bands hold, with its standard error, and the mean log score."""
    scores = np.concatenate([score for score, _ in series])
    each = np.array([held.mean() for _, held in series])
    error = each.std() / np.sqrt(len(each))
    held = np.concatenate([held for _, held in series]).mean()
    return f"{100 * held:.0f} ± {100 * error:.0f} % {scores.mean():+.2f}"


def _spent(words: list[str]) -> tuple[float, float]:
    """Processor time of a command, s, and the most memory that it had, MB."""
    subprocess.run(words, capture_output=True, check=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime, used.ru_maxrss / 1e3


def cost() -> None:
    """Print processor time and memory of ten million samples."""
    from fieldcal.session.recorder import Recorder

    part, rng = 1 << 17, np.random.default_rng(2)
    with tempfile.TemporaryDirectory() as folder:
        with Recorder(Path(folder) / "long", {"format": 1}) as recorder:
            for first in range(0, TEN_MILLION, part):
                n = min(part, TEN_MILLION - first)
                block = recording(1e-3 * rng.standard_normal((n, 6)), 0.01)
                block.t[:] += first * 0.01
                recorder.append(block)
        words = [sys.executable, "-m", "fieldcal", "noise", str(Path(folder) / "long")]
        # a child counts the memory of the one that starts it: let a small process do it
        with multiprocessing.get_context("spawn").Pool(1) as small:
            spent, most = small.apply(_spent, (words,))
    print(
        f"\n{TEN_MILLION:.0e} samples: {spent:.1f} s of processor time, {most:.0f} MB"
    )


def main() -> None:
    """Print all tables."""
    beside_the_bound()
    prediction(how_many(4))
    cost()
