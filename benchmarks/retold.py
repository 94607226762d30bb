"""Published recordings told otherwise: what is said of them should not change.

    python -m benchmarks retold [--only=NAME]

Each recording of `recordings` with a known answer is imported, and its samples are told
again as a table without any other word: with its axes turned or mirrored, another
clock, more noise, some samples lost, a gap, fewer samples, or a part of it alone. What
is in the device is the same in all of them. Where less is recorded, an effect may no
longer show; what the whole recording has not, under any name that it holds possible,
is new, and wrong if it is named.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks._words import option, ran
from benchmarks.injected.recorded import REAL
from benchmarks.recordings import PUBLISHED, Published, Verdict, diagnosed, imported
from fieldcal.core.samples import Array
from fieldcal.session.folder import Session

LOST = 0.05
"""Share of the samples that do not arrive, and of the recording that a gap is."""

HEAD = ",".join(
    ["time_s", *(f"acc_{i}_m_s2" for i in "xyz"), *(f"gyr_{i}_rad_s" for i in "xyz")]
)

OF_THE_TELLING = {
    "askew": {"cross_coupling", "gyro_scale", "gyro_cross_coupling"},
    "some lost": {"dropped"},
    "gap": {"dropped"},
    "more noise": {"noise_level"},
}
"""What a telling puts in."""


class Told(NamedTuple):
    """A recording: t (n,) s, acc and gyr (n, 3), m/s^2 and rad/s."""

    t: Array
    acc: Array
    gyr: Array

    def some(self, which: NDArray[np.bool_] | slice) -> Told:
        """Some of the samples."""
        return Told(self.t[which], self.acc[which], self.gyr[which])

    def turned(self, matrix: Array) -> Told:
        """In axes that the rows of a matrix point along."""
        return Told(self.t, self.acc @ matrix.T, self.gyr @ matrix.T)


def _part(first: float, last: float) -> Callable[[Told], Told]:
    def part(one: Told) -> Told:
        n = len(one.t)
        return one.some(slice(int(first * n), int(last * n)))

    return part


def _upside(one: Told) -> Told:
    return one.turned(np.diag([1.0, -1.0, -1.0]))


def _swapped(one: Told) -> Told:
    return one.turned(np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]))


def _askew(one: Told) -> Told:
    """In axes that are none of the device's, in which scale factors are couplings."""
    a, b = 0.7, 0.4
    about_z = [[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]]
    about_x = [[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]]
    return one.turned(np.array(about_z) @ np.array(about_x))


def _late(one: Told) -> Told:
    """Seconds since 1970 of a clock that is fast."""
    return one._replace(t=1.7e9 + 1.0003 * one.t)


def _louder(one: Told) -> Told:
    """Twice the noise power of the quickest changes."""
    rng = np.random.default_rng(5)

    def louder(values: Array) -> Array:
        usual = np.median(np.abs(np.diff(values, axis=0)), axis=0) / 0.954
        out: Array = values + usual * rng.standard_normal(values.shape)
        return out

    return Told(one.t, louder(one.acc), louder(one.gyr))


def _lossy(one: Told) -> Told:
    return one.some(np.random.default_rng(6).random(len(one.t)) > LOST)


def _gap(one: Told) -> Told:
    part = np.linspace(0.0, 1.0, len(one.t))
    return one.some((part < 0.5) | (part > 0.5 + LOST))


def _means(one: Told) -> Told:
    """Means of four samples, as a logger sends that filters."""
    whole = len(one.t) // 4 * 4
    table = np.column_stack(one)[:whole]
    means = table.reshape(whole // 4, 4, 7).mean(axis=1)
    return Told(means[:, 0], means[:, 1:4], means[:, 4:])


TELLINGS: dict[str, Callable[[Told], Told]] = {
    "same": lambda one: one,
    "upside down": _upside,
    "swapped": _swapped,
    "askew": _askew,
    "another clock": _late,
    "more noise": _louder,
    "some lost": _lossy,
    "gap": _gap,
    "half rate": lambda one: one.some(slice(None, None, 2)),
    "means of four": _means,
    "first 70 %": _part(0.0, 0.7),
    "last 70 %": _part(0.3, 1.0),
}


def main() -> None:
    """Print the table."""
    if not REAL.is_dir():
        print(f"the recordings are not here: {REAL}")
        return
    print("| recording | telling | rests | verdict | no longer | new |")
    print("|---|---|---|---|---|---|")
    for one in PUBLISHED:
        name = f"{one.files[0].split('.')[0]} {one.stream}".strip()
        if one.right != "?" and option("only") in name:
            _retell(one, name)


def _retell(one: Published, name: str) -> None:
    """Rows of one recording."""
    with tempfile.TemporaryDirectory() as place:
        _, folder = imported(one, Path(place) / "session")
        if folder is None:
            print(f"| {name} | | not imported | | | |")
            return
        block = Session.open(folder).block
        told = Told(block.t - block.t[0], block.acc, block.gyr)
        whole = _found(told, Path(place) / "whole")
        print(f"| {name} | whole | {whole.positions} | {_words(whole.effects)} | | |")
        for label, telling in TELLINGS.items():
            found = _found(telling(told), Path(place) / label.split()[0])
            new = _beyond(found, whole) - OF_THE_TELLING.get(label, set())
            print(
                f"| | {label} | {found.positions} | {found.verdict.replace('_', ' ')}"
                f" | {_words(_beyond(whole, found))} | {_words(new)} |",
                flush=True,
            )


def _beyond(one: Verdict, other: Verdict) -> set[str]:
    """Effects of one verdict for which nothing stands in the other."""
    there = set(other.effects).union(*other.instead.values())
    return {e for e, instead in one.instead.items() if not there & {e, *instead}}


def _words(effects: set[str] | tuple[str, ...]) -> str:
    return ", ".join(sorted(set(effects)))


def _found(told: Told, out: Path) -> Verdict:
    """Write a table of samples, import it and diagnose it."""
    path = out.with_suffix(".csv")
    form = ["%.6f", *["%.9g"] * 6]
    np.savetxt(path, np.column_stack(told), form, ",", header=HEAD, comments="")
    code, _, said = ran(["import", str(path), "-o", str(out)])
    if code:
        return Verdict(0, 0, f"not imported: {said.splitlines()[-1]}", (), 0.0)
    return diagnosed(out)
