"""Noise: sizes beside the Cramer-Rao bound, prediction of what comes, and cost.

    python -m benchmarks noise [RECORDINGS]

First rmse over the bound, exactly from dense covariances, of sizes and of their
squares, and the scatter of errors in stated sigma. The bound is that of estimates
without a bias: those of squares have none, while the root of one that is known to a
third is too small on average. Then recordings, simulated and real, cut in halves: how
often the band of 68 of 100 from the first half holds the Allan deviation of the second
at 10 to 1000 s, with the standard error of that by the scatter of the series, and the
mean log score, beside allantools (the first half's deviations as they are), avar and
allan-variance (their fits), all with the scatter of the second half's estimate for
white noise. Last the processor time and memory of ten million samples.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec
from itertools import combinations
from pathlib import Path

import numpy as np

from benchmarks._words import how_many
from benchmarks.injected.recorded import REAL
from benchmarks.noise.peers import THEIRS, allan_variance, white_freedom
from benchmarks.noise.processes import bound, covariance, noise, recording
from fieldcal.core.samples import CHANNELS, Array, Block
from fieldcal.noise import estimate, reduced
from fieldcal.noise.levels import CosineLevels
from fieldcal.noise.likelihood import Flags, NoiseFit, Powers, fit
from fieldcal.noise.measured import measured
from fieldcal.noise.spectrum import CosineSpectrum

DT, SHORT, EACH = 0.1, 600, 1000
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
        power, count = spectrum.of(
            c, spectrum.last.values[:, c], np.ones(len(spectrum.last.bin))
        )
        powers = Powers(power, count, np.zeros(len(power), dtype=bool))
        one = _most_likely(spectrum, powers, sizes)
        value, stated = np.zeros(len(sizes)), np.full(len(sizes), np.nan)
        places = [list(sizes).index(term) for term in one.terms]
        value[places] = np.exp(one.x / 2)
        stated[places] = np.sqrt(np.diag(one.covariance)) / 2
        found.append(value)
        sigma.append(stated)
    return np.array(found), np.array(sigma)


def _most_likely(
    spectrum: CosineSpectrum, powers: Powers, sizes: dict[str, float]
) -> NoiseFit:
    """Fit the processes, less those that are not there at all."""
    for gone in range(len(sizes)):
        fits = [
            fit(spectrum, powers, names, 2 * np.log([sizes[n] for n in names]))
            for names in combinations(sizes, len(sizes) - gone)
        ]
        if some := [f for f in fits if f]:
            return max(some, key=lambda f: f.log_likelihood)
    raise AssertionError("one process is always there")


def beside_the_bound() -> None:
    """Print rmse over the bound of each size."""
    rng = np.random.default_rng(1)
    peer = find_spec("allan_variance") is not None
    print(f"rmse over the Cramer-Rao bound, {SHORT} samples, {EACH} recordings each")
    print(f"{'truth':26} {'size':4} {'bound':>8} {'ours':>6} {'square':>6} {'pull':>6} "
          f"{'allan-variance':>15}")  # fmt: skip
    for sizes in CASES:
        whole = sum(s**2 * covariance(SHORT, DT, p) for p, s in sizes.items())
        values = np.linalg.cholesky(whole) @ rng.standard_normal((SHORT, EACH))
        found, sigma = ours(values, sizes)
        theirs = (
            allan_variance(values, DT, sizes) if peer else np.full(found.shape, np.nan)
        )
        truth, best = np.array(list(sizes.values())), bound(SHORT, DT, sizes)
        name = " ".join(f"{p}={s:g}" for p, s in sizes.items())
        for i, process in enumerate(sizes):
            there = found[:, i] > 0
            pull = np.log(found[there, i] / truth[i]) / sigma[there, i]
            rmse = [np.sqrt(np.mean((f[:, i] / truth[i] - 1) ** 2)) / best[i]
                    for f in (found, theirs)]  # fmt: skip
            off = (found[:, i] / truth[i]) ** 2 - 1
            square = np.sqrt(np.mean(off**2)) / (2 * best[i])
            print(f"{name:26} {process:4} {best[i]:8.4f} {rmse[0]:6.3f} {square:6.3f} "
                  f"{np.std(pull):6.3f} {rmse[1]:15.3f}")  # fmt: skip


def scored(variance: Array, freedom: Array, deviation: Array) -> tuple[Array, Flags]:
    """Log density of log deviations, and whether 68 of 100 hold them."""
    from scipy.stats import chi2

    ratio = freedom * deviation**2 / variance
    density: Array = chi2.logpdf(ratio, freedom) + np.log(2 * ratio)
    held = (chi2.ppf(0.16, freedom) < ratio) & (ratio < chi2.ppf(0.84, freedom))
    return density, held


Series = list[tuple[Array, Flags]]
"""Log scores and whether bands hold, (t,) each, of one channel after the other."""


def halves(block: Block) -> dict[str, Series]:
    """Log scores and whether bands hold, of each estimator."""
    out: dict[str, Series] = {}
    middle = len(block) // 2
    model = estimate([reduced([block[:middle]])])
    second = reduced([block[middle:]])
    length = max(s.samples * s.dt for s in second.stretches)
    dt = 1 / model.rate_hz
    for name, channel in model.channels.items():
        place = CHANNELS.index(name)
        seen = measured(second.stretches, place)
        asked = (seen.tau >= FIRST) & (seen.tau <= min(LAST, length / 4))
        tau, deviation = seen.tau[asked], seen.deviation[asked]
        said = channel.predicted(tau, length)
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


def real() -> Iterator[Block]:
    """Real recordings at rest that lie beside the project."""
    import gzip

    from fieldcal.core.gravity import G0

    counts = REAL / "tomisuarez_mpu6050/example_data_tinit_calc.csv.gz"
    if counts.is_file():
        with gzip.open(counts, "rt") as text:
            rows = np.genfromtxt(text, delimiter=",", skip_header=4)[:, :6]
        rows = rows[np.isfinite(rows).all(axis=1)]
        rows *= np.repeat([G0 / 16384, np.pi / 180 / 131], 3)
        yield recording(rows, 0.01)
    stem = "sunsided_mpu6050_temp/set-2__unmoved-with-x-pointing-forward-10min__"
    files = [REAL / f"{stem}{k}.mat" for k in ("accelerometer", "gyroscope")]
    if all(f.is_file() for f in files) and find_spec("h5py"):
        h5py = import_module("h5py")
        parts = []
        for file in files:
            with h5py.File(file) as content:
                parts.append(np.array(content[next(iter(content))]).T)
        rows = np.hstack([parts[0][:, 1:4] * G0, np.deg2rad(parts[1][:, 1:4])])
        yield recording(rows, float(parts[0][-1, 0] - parts[0][0, 0]) / (len(rows) - 1))


def prediction(number: int) -> None:
    """Print how often bands hold, and mean log scores."""
    names = ["ours", *THEIRS]
    print(f"\nsecond half from the first, {FIRST:g} to {LAST:g} s: held by 68 of 100,"
          " and mean log score")  # fmt: skip
    print(f"{'':22}" + "".join(f"{n:>20}" for n in names))
    whole: dict[str, Series] = {}
    sources: dict[str, Callable[[], Iterator[Block]]] = {
        kind: lambda kind=kind: simulated(kind, number)  # type: ignore[misc]
        for kind in KINDS
    }
    for kind, blocks in {**sources, "real, at rest": real}.items():
        out: dict[str, Series] = {}
        for block in blocks():
            for name, series in halves(block).items():
                out.setdefault(name, []).extend(series)
                if kind in KINDS:
                    whole.setdefault(name, []).extend(series)
        _row(kind, out, names)
    _row("all simulated", whole, names)


def _row(kind: str, out: dict[str, Series], names: list[str]) -> None:
    cells = [_cell(out[n]) if n in out else "not there" for n in names]
    print(f"{kind:22}" + "".join(f"{c:>20}" for c in cells), flush=True)


def _cell(series: Series) -> str:
    """How often bands hold, with its standard error, and the mean log score."""
    scores = np.concatenate([score for score, _ in series])
    each = np.array([held.mean() for _, held in series])
    error = each.std() / np.sqrt(len(each))
    held = np.concatenate([held for _, held in series]).mean()
    return f"{100 * held:.0f} ± {100 * error:.0f} % {scores.mean():+.2f}"


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
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        words = [sys.executable, "-m", "fieldcal", "noise", str(Path(folder) / "long")]
        subprocess.run(words, capture_output=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime - before.ru_utime
    most = after.ru_maxrss / 1e3
    print(
        f"\n{TEN_MILLION:.0e} samples: {spent:.1f} s of processor time, {most:.0f} MB"
    )


def main() -> None:
    """Print all tables."""
    beside_the_bound()
    prediction(how_many(4))
    cost()
