"""Mistakes of a plan, a cable, a firmware or a file, once something was recorded.

Each takes a session that is about to be written (what the device does, what it put out,
what session.toml says of it) and spoils one thing of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.never_wrong.bench import EARTH, Bench, Samples, recorded

Rng = np.random.Generator


@dataclass(frozen=True)
class Written:
    """A session: its tables and its samples; `ending` of the file of samples."""

    about: dict[str, Any]
    samples: Samples
    ending: str = "parquet"


After = Callable[[Written, Bench, Rng], Written]


# -- of what is said


def swapped(written: Written, bench: Bench, rng: Rng) -> Written:
    """Two positions are written down in the wrong order."""
    rows = [dict(row) for row in written.about["position"]]
    i, j = rng.choice(bench.stated or len(rows), 2, replace=False)
    for key in ("alpha_deg", "beta_deg"):
        if key in rows[i]:
            rows[i][key], rows[j][key] = rows[j][key], rows[i][key]
    return replace(written, about={**written.about, "position": rows})


def _site(written: Written, **more: Any) -> Written:
    site = {**written.about["site"], **more}
    site = {key: value for key, value in site.items() if value is not None}
    return replace(written, about={**written.about, "site": site})


def latitude_unsaid(written: Written, bench: Bench, rng: Rng) -> Written:
    """Nobody says where the bench is."""
    return _site(written, latitude_deg=None, height_m=None)


def other_hemisphere(written: Written, bench: Bench, rng: Rng) -> Written:
    """The latitude has the wrong sign."""
    return _site(written, latitude_deg=-bench.latitude)


def level_unsaid(written: Written, bench: Bench, rng: Rng) -> Written:
    """Nobody says how level the base is, nor how well angles are set."""
    return _site(written, level_deg=None, angle_setting_deg=None)


def level_said_wrongly(written: Written, bench: Bench, rng: Rng) -> Written:
    """The base is said to be level to 0.01 degrees, however it stands."""
    return _site(written, level_deg=0.01)


def default_mounting(written: Written, bench: Bench, rng: Rng) -> Written:
    """The device is mounted otherwise, and nobody says so."""
    about = {**written.about, "frame": {"mounting": ["+x", "+y", "+z"]}}
    return replace(written, about=about)


def overlapping(written: Written, bench: Bench, rng: Rng) -> Written:
    """A window of the list begins before the one before it ends."""
    rows = [dict(row) for row in written.about["position"]]
    i = int(rng.integers(1, len(rows)))
    rows.insert(i, {**rows[i - 1], "start_s": rows[i - 1]["start_s"] + 1.0})
    return replace(written, about={**written.about, "position": rows})


def listed_often(written: Written, bench: Bench, rng: Rng) -> Written:
    """Every window is listed 20 times."""
    rows = [dict(row) for row in written.about["position"] for _ in range(20)]
    return replace(written, about={**written.about, "position": rows})


# -- of units, wiring and order


def acc_in_g(written: Written, bench: Bench, rng: Rng) -> Written:
    """Accelerations in g are said to be in m/s^2."""
    s = written.samples
    return replace(written, samples=replace(s, acc=s.acc / 9.80665))


def gyr_in_deg(written: Written, bench: Bench, rng: Rng) -> Written:
    """Rates in deg/s are said to be in rad/s."""
    s = written.samples
    return replace(written, samples=replace(s, gyr=np.rad2deg(s.gyr)))


def gyr_said_deg(written: Written, bench: Bench, rng: Rng) -> Written:
    """Rates in rad/s are said to be in deg/s."""
    units = {**written.about.get("units", {}), "angular_rate": "deg/s"}
    return replace(written, about={**written.about, "units": units})


def time_in_ns(written: Written, bench: Bench, rng: Rng) -> Written:
    """Times in ns are said to be in s."""
    s = written.samples
    return replace(written, samples=replace(s, t=s.t * 1e9))


def axis_turned_round(written: Written, bench: Bench, rng: Rng) -> Written:
    """One output has the other sign."""
    s, c = written.samples, int(rng.integers(6))
    six = np.hstack([s.acc, s.gyr])
    six[:, c] *= -1
    return replace(written, samples=Samples(s.t, six[:, :3], six[:, 3:]))


def axes_exchanged(written: Written, bench: Bench, rng: Rng) -> Written:
    """Two outputs of a triad are exchanged."""
    s, triad = written.samples, int(rng.integers(2))
    order = [[1, 0, 2], [0, 2, 1], [2, 1, 0]][int(rng.integers(3))]
    acc = s.acc[:, order] if triad == 0 else s.acc
    gyr = s.gyr[:, order] if triad == 1 else s.gyr
    return replace(written, samples=Samples(s.t, acc, gyr))


def gyr_copied(written: Written, bench: Bench, rng: Rng) -> Written:
    """A gyroscope's channel copies another's."""
    s = written.samples
    a, b = rng.choice(3, 2, replace=False)
    gyr = s.gyr.copy()
    gyr[:, a] = gyr[:, b]
    return replace(written, samples=replace(s, gyr=gyr))


# -- of the firmware


def acc_mean_taken(written: Written, bench: Bench, rng: Rng) -> Written:
    """The device takes the mean out of its accelerations."""
    s = written.samples
    return replace(written, samples=replace(s, acc=s.acc - s.acc.mean(axis=0)))


def mean_taken_and_rounded(written: Written, bench: Bench, rng: Rng) -> Written:
    """A program takes the mean out, and writes few digits."""
    s, grain = written.samples, float(rng.choice([1e-3, 1e-2, 0.1]))
    acc = np.round((s.acc - s.acc.mean(axis=0)) / grain) * grain
    return replace(written, samples=replace(s, acc=acc))


def gyr_tracked(written: Written, bench: Bench, rng: Rng) -> Written:
    """The device takes the bias out of its rates whenever it is at rest."""
    s, gyr = written.samples, written.samples.gyr.copy()
    keep = np.exp(-1 / bench.rate / rng.uniform(0.5, 5))
    moving = np.linalg.norm(gyr - np.median(gyr, axis=0), axis=1)
    bias = gyr[: int(bench.rate)].mean(axis=0)
    bar = 8 * bench.gyr_noise + 2 * EARTH
    for i in range(len(gyr)):
        if moving[i] < bar:
            bias = keep * bias + (1 - keep) * gyr[i]
        gyr[i] -= bias
    return replace(written, samples=replace(s, gyr=gyr))


def cut_toward_zero(written: Written, bench: Bench, rng: Rng) -> Written:
    """Accelerations are cut toward zero to a grain larger than their noise."""
    s = written.samples
    grain = bench.acc_noise * rng.uniform(2, 20)
    ending = str(rng.choice(["csv", "parquet"]))
    acc = np.trunc(s.acc / grain) * grain
    return replace(written, samples=replace(s, acc=acc), ending=ending)


def gravity_said(written: Written, bench: Bench, rng: Rng) -> Written:
    """The gravity that is written down is off by 0.05 to 0.3 %."""
    off = rng.uniform(5e-4, 3e-3) * rng.choice([-1, 1])
    return _site(written, gravity=bench.gravity * (1 + off))


def clipped(written: Written, bench: Bench, rng: Rng) -> Written:
    """The full scale is 8 to 9.6 m/s^2."""
    s, most = written.samples, rng.uniform(8, 9.6)
    return replace(written, samples=replace(s, acc=np.clip(s.acc, -most, most)))


AFTER: dict[str, After] = {
    "positions swapped": swapped,
    "latitude not said": latitude_unsaid,
    "other hemisphere": other_hemisphere,
    "level and angles not said": level_unsaid,
    "mounting not said": default_mounting,
    "windows overlapping": overlapping,
    "windows listed 20 times": listed_often,
    "g labelled m/s²": acc_in_g,
    "deg/s labelled rad/s": gyr_in_deg,
    "rad/s labelled deg/s": gyr_said_deg,
    "time in ns": time_in_ns,
    "an output reversed": axis_turned_round,
    "outputs exchanged": axes_exchanged,
    "a gyroscope copied": gyr_copied,
    "mean of acc removed": acc_mean_taken,
    "mean of acc removed, rounded": mean_taken_and_rounded,
    "bias of gyr tracked": gyr_tracked,
    "cut toward zero": cut_toward_zero,
    "gravity said wrongly": gravity_said,
    "clipped": clipped,
    "level said wrongly": level_said_wrongly,
}


def tables(bench: Bench) -> dict[str, Any]:
    """What an honest session.toml says of a bench."""
    site: dict[str, Any] = {"latitude_deg": bench.latitude, "height_m": bench.height}
    if bench.level_deg is not None:
        site["level_deg"] = bench.level_deg
    if bench.angles_deg is not None and not bench.imported:
        site["angle_setting_deg"] = bench.angles_deg
    rows: list[dict[str, float]] = []
    for (alpha, beta), (start, end) in zip(bench.angles, bench.windows, strict=True):
        row = {"start_s": float(start), "end_s": float(end)}
        if len(rows) < bench.stated:
            row |= {"alpha_deg": float(alpha), "beta_deg": float(beta)}
        rows.append(row)
    about: dict[str, Any] = {
        "format": 1,
        "device": {"name": "drawn", "serial": "N-1", "grade": bench.grade},
        "site": site,
        "frame": {"mounting": list(bench.mounting)},
        "position": rows,
    }
    if not bench.imported:
        about["run"] = {"procedure": "positions"}
    return about


def session(bench: Bench, names: tuple[str, ...], rng: Rng) -> Written:
    """A session on it, with the mistakes that are made afterwards."""
    written = Written(tables(bench), recorded(bench, rng))
    for name in names:
        if name in AFTER:
            written = AFTER[name](written, bench, rng)
    return written
