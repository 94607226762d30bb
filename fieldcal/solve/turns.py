"""Gyroscopes from the turns between still stretches: scale factor and cross-coupling.

At rest the accelerometers show which way is up, before and after each turn; the
gyroscopes say how the device got from one to the other. That is how a gyroscope that
cannot see the Earth's rate gets its scale factor without a rate table: from the very
turns of a two- or five-position procedure, or from any turns by hand. `turn_fit` has
the equations. m/s^2, rad/s, device axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fieldcal.calibration import Calibration, Nominal
from fieldcal.errors import InputError, NotObservable
from fieldcal.frames import EARTH_RATE
from fieldcal.gravity import G0
from fieldcal.positions import Position
from fieldcal.samples import Array, Block
from fieldcal.solve import gyroscopes, scatter
from fieldcal.solve.estimate import UNITS, Estimate, join, not_determined
from fieldcal.solve.linear import Mask
from fieldcal.solve.observations import Observations
from fieldcal.solve.turn_fit import ENTRIES, NAMES, USEFUL, Drive, Problem, Rests
from fieldcal.windows import Average

GAP = 10.0
"""Time between samples, in usual ones, from which a turn counts as not recorded."""


def turns(
    block: Block,
    averages: Sequence[Average],
    accelerometers: Calibration,
    nominal: Nominal | None = None,
) -> Estimate:
    """Bias, scale factor and cross-coupling of the gyroscopes.

    Parameters
    ----------
    block : the recording with the turns in it
    averages : n windows at rest in time order, two at least
    accelerometers : calibration that makes directions of their means
    nominal : the gyroscopes' scale factors to start from

    Raises
    ------
    InputError
        If the accelerometers' bias or scale factor is not all known.
    NotObservable
        If no turn between two rests was recorded.

    """
    order = sorted(averages, key=lambda a: a.start)
    rests = directions(order, accelerometers)
    drive = _drive(order, nominal or Nominal())
    spans = [_between(block, a, b) for a, b in pairwise(order)]
    taken = [i for i, s in enumerate(spans) if s is not None]
    if not taken:
        raise NotObservable(
            "no turn between two positions was recorded whole, so the gyroscopes have "
            "no scale factor: record on while the device is turned"
        )
    kept = [s for s in spans if s is not None]
    found, notes = _widened(Problem(rests, drive, np.array(taken), kept))
    if len(kept) < len(spans):
        notes.append(f"{len(spans) - len(kept)} of {len(spans)} turns have samples "
                     "missing and were not used")  # fmt: skip
    sigma = np.sqrt(np.diag(found.covariance))
    useful = np.array([n.startswith("gyr_bias") for n in NAMES]) | (sigma < USEFUL)
    if not useful.all():
        notes.append(_open(useful))
    return replace(found.only(useful), warnings=tuple(notes))


def _widened(problem: Problem) -> tuple[Estimate, list[str]]:
    """Solve; where the turns scatter beyond their noise, widen the intervals."""
    first = problem.solve(0.0)
    if scatter.chance(first.chi2, first.dof) >= scatter.UNLIKELY:
        return first, []
    spread = scatter.extra(lambda s: problem.solve(s).chi2, first.dof, 1e-4)
    wide = problem.solve(spread)
    note = scatter.excess("turns", first.chi2, first.dof, spread, "rad")
    return replace(
        wide,
        covariance=wide.covariance * scatter.student_ratio(first.dof) ** 2,
        chi2=first.chi2,
        dof=first.dof,
    ), [note]


def _open(useful: Mask) -> str:
    missing = [n for n, ok in zip(NAMES[:6], useful[:6], strict=True) if not ok]
    if couplings := int((~useful[6:]).sum()):
        missing.append(f"{couplings} of 6 gyro_cross_coupling")
    about = sorted({"xyz"[ENTRIES[i - 3][1]] for i in np.flatnonzero(~useful)})
    level = f"turns about device axis {join(about)} while that axis is level"
    return not_determined(missing, [level], "these turns")


def with_turns(calibration: Calibration, found: Estimate) -> Calibration:
    """Add scale factor and cross-coupling of the gyroscopes to a calibration.

    They replace what it has of them. The bias is taken only where it has none: that of
    windows in known positions is the better one.
    """
    if "gyr_bias" in calibration.groups:
        found = found.only(np.array([not n.startswith("gyr_b") for n in found.names]))
    groups = {n.partition(".")[0] for n in found.names}
    said = calibration.warnings
    if "gyr_scale" in groups:
        said = tuple(w for w in said if w != gyroscopes.NO_SCALE)
    kept = [
        i for i, n in enumerate(calibration.names) if n.partition(".")[0] not in groups
    ]
    size = len(kept) + len(found.names)
    covariance = np.zeros((size, size))
    covariance[: len(kept), : len(kept)] = calibration.covariance[np.ix_(kept, kept)]
    covariance[len(kept) :, len(kept) :] = found.covariance
    return replace(
        calibration,
        names=(*(calibration.names[i] for i in kept), *found.names),
        values=np.concatenate([calibration.values[kept], found.values]),
        covariance=covariance,
        units=(
            *(calibration.units[i] for i in kept),
            *(UNITS[n.partition(".")[0]] for n in found.names),
        ),
        warnings=(*said, *found.warnings),
        info={**calibration.info, "turns": {"chi2": found.chi2, "dof": found.dof}},
    )


def offered(
    calibration: Calibration,
    block: Block,
    averages: Sequence[Average],
    nominal: Nominal | None = None,
) -> Calibration:
    """Calibration with what the turns give, or unchanged if they give no scale factor.

    Parameters as in `turns`.
    """
    try:
        found = turns(block, averages, calibration, nominal)
    except InputError:
        return calibration
    if not any(n.startswith("gyr_scale") for n in found.names):
        return calibration
    return with_turns(calibration, found)


def directions(averages: Sequence[Average], accelerometers: Calibration) -> Rests:
    """Directions of the specific force at rest, with what makes them uncertain."""
    bias, matrix = accelerometers.accelerometers()
    if not np.isfinite(matrix).all() or not np.isfinite(bias).all():
        raise InputError(
            "turns need the accelerometers calibrated on all three axes: bias and "
            "scale factor of each"
        )
    inverse = np.linalg.inv(matrix)
    f = (np.array([a.mean[:3] for a in averages]) - bias) @ inverse.T
    size = np.linalg.norm(f, axis=1)
    up = f / size[:, None]
    level = (np.eye(3) - up[:, :, None] * up[:, None, :]) / size[:, None, None]
    by_mean = level @ inverse
    # what the positions scatter beyond their noise is in the directions as well
    loose = float(accelerometers.info.get("extra_scatter", 0.0))
    rows, columns = [], []
    for i, name in enumerate(accelerometers.names):
        place = _reach(name, f)
        if place is not None:
            rows.append(i)
            columns.append(-(by_mean @ place[..., None])[..., 0])
    return Rests(
        up,
        by_mean,
        np.stack(columns, axis=-1),
        np.array([a.covariance[:3, :3] for a in averages]) + loose**2 * np.eye(3),
        accelerometers.covariance[np.ix_(rows, rows)],
    )


def _reach(name: str, f: Array) -> Array | None:
    """Derivative of the outputs by an accelerometer parameter, (n, 3)."""
    group, _, part = name.partition(".")
    out = np.zeros_like(f)
    if group == "acc_bias":
        out[:, "xyz".index(part)] = 1.0
    elif group == "acc_scale":
        axis = "xyz".index(part)
        out[:, axis] = f[:, axis]
    elif group == "cross_coupling":
        out[:, int(part[1]) - 1] = f[:, int(part[2]) - 1]
    else:
        return None
    return out


def _drive(averages: Sequence[Average], nominal: Nominal) -> Drive:
    still = Observations.of([Position("at rest")] * len(averages), averages, G0)
    found = gyroscopes.bias(still)
    length = np.array([a.end - a.start for a in averages])
    noise = np.array([a.covariance[3:, 3:] for a in averages])
    return Drive(
        found.values,
        found.covariance,
        np.array(nominal.gyr_scale),
        np.asarray((noise * length[:, None, None]).mean(axis=0)),
        float(np.hypot(found.extra.get("extra_scatter", 0.0), EARTH_RATE / np.sqrt(3))),
    )


def _between(
    block: Block, before: Average, after: Average
) -> tuple[Array, Array] | None:
    """Instants and rates of a turn; None where samples are missing."""
    part = block.between(before.end, after.start)
    if len(part) < 2 or not np.isfinite(part.gyr).all():
        return None
    steps = np.diff(part.t)
    gap = max(part.t[0] - before.end, after.start - part.t[-1], float(steps.max()))
    return None if gap > GAP * float(np.median(steps)) else (part.t, part.gyr)
