"""A given set, estimated, as a calibration with what the user must know."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration, Method
from fieldcal.calibration.gauge import GROUPS
from fieldcal.calibration.names import AXES, ParameterName, group_of, sensor_of
from fieldcal.calibration.plausible import elsewhere, senseless
from fieldcal.core.errors import NotObservable
from fieldcal.core.samples import UNITS as CHANNEL_UNITS
from fieldcal.core.sentences import join
from fieldcal.model import thresholds
from fieldcal.solve import words
from fieldcal.solve.assumed import Asked
from fieldcal.solve.borrowed import Borrowed
from fieldcal.solve.doubt import DoubtfulPosition
from fieldcal.solve.estimation import Estimated, scatter_of, turns_scatter
from fieldcal.solve.latitude import EarthVertical
from fieldcal.solve.observations import Observations
from fieldcal.solve.rank import ladder_remedy
from fieldcal.solve.reliability import WrongAngles

UNITS = {group: unit for group, (_, _, unit) in GROUPS.items()}
UNITS |= {"angle_offset": "deg", "base_tilt": "deg"}
"""Unit of each group's components."""

OF_ACC = frozenset(
    {"acc_bias", "acc_scale", "cross_coupling", "angle_offset", "base_tilt"}
)
"""Groups that the accelerometers at rest determine."""

OF_TURNS = frozenset({"gyr_scale", "gyro_cross_coupling"})
"""Groups that turns determine."""


def calibration(
    method: Method,
    observations: Observations,
    asked: Asked,
    found: Estimated,
    notes: Sequence[str],
    told: Borrowed | None = None,
) -> Calibration:
    """Put an estimate into a calibration.

    Raises
    ------
    NotObservable
        If it has no parameter, or the accelerometers were at rest and none of theirs
        is determined.

    """
    names, sigma = found.names, np.sqrt(np.diag(found.covariance))
    sentences = [
        words.carried(found.sure, found.causes, names, found.moved, found.ended_s),
        told.sentence if told else "",
        *_open(method, observations, found),
        *notes,
        *_level(method, asked, observations),
    ]
    if not names or _blind(found, observations):
        raise NotObservable(
            "these positions determine nothing: " + "; ".join(filter(None, sentences))
        )
    odd = [
        *senseless(names, found.values, sigma, observations.nominal),
        *elsewhere(_named(found.contradicted, observations)),
        *_elsewhere(found, observations),
    ]
    sentences += _doubts(method, observations, found)
    fit = found.acc if any(map(_is_acc, names)) else found.gyr
    info = _info(method, observations, asked, found)
    return Calibration(
        method=method,
        names=names,
        values=found.values,
        covariance=found.covariance,
        units=tuple(UNITS[group_of(n)] for n in names),
        chi2=fit.chi2,
        dof=fit.dof,
        rms=found.acc.rms,
        warnings=tuple(dict.fromkeys(w for w in [*odd, *sentences] if w)),
        good=not odd and not fit.contradicts,
        info=info | ({"borrowed": told.to_json()} if told else {}),
    )


def _blind(found: Estimated, observations: Observations) -> bool:
    """Whether the accelerometers at rest gave nothing, and no table turned."""
    if not observations.has_acc or observations.rotating.any():
        return False
    return not any(map(_is_acc, found.names))


def _is_acc(name: str) -> bool:
    """Whether a parameter is a bias or a scale factor of the accelerometers."""
    return sensor_of(group_of(name)) == "acc"


def _open(method: Method, observations: Observations, found: Estimated) -> list[str]:
    """Parameters that the rows leave open, and which positions would give them."""
    sentences = []
    acc = [n for n in found.missing if group_of(n) in OF_ACC]
    if acc and found.given.wanted.level_deg is not None:
        acc = [n for n in acc if group_of(n) != "base_tilt"]
    if acc:
        sentences.append(
            _scalar(acc, found, len(observations))
            if method == "scalar"
            else words.not_determined(
                acc, _remedy(observations, found), "these positions"
            )
        )
    gyr = [n for n in found.missing if group_of(n) == "gyr_scale"]
    cross = [n for n in found.missing if group_of(n) == "gyro_cross_coupling"]
    if not found.given.wanted.gyr_scale and observations.has_gyr:
        sentences.append(
            "gyr_scale is not determined: the Earth's rate gives it only with two "
            "known positions and the latitude"
            if observations.grade == "navigation"
            else words.NO_SCALE
        )
    elif gyr or cross:
        sentences.append(_turning(gyr, cross, observations, found))
    return sentences


def _remedy(observations: Observations, found: Estimated) -> list[str]:
    names = [n for n in found.given.names if group_of(n) in OF_ACC]
    if any(n in found.missing for n in names) and not observations.rotating.any():
        return ladder_remedy(observations, names)
    return []


def _turning(
    gyr: Sequence[str],
    cross: Sequence[str],
    observations: Observations,
    found: Estimated,
) -> str:
    """What of the gyroscopes turns or rates leave open."""
    missing = [*gyr] + ([f"{len(cross)} of 6 gyro_cross_coupling"] if cross else [])
    if not found.given.wanted.turned and not observations.rotating.any():
        return (
            f"{join(missing)} {'are' if missing[1:] else 'is'} left out: the"
            " Earth's rate gives it only roughly in these windows; average longer, or"
            " integrate turns between the positions"
        )
    turned = {ParameterName.of(n).entry[1] for n in cross}
    turned |= {ParameterName.of(n).axis for n in gyr}
    about = [AXES[axis] for axis in sorted(turned)]
    if observations.rotating.any():
        return words.not_determined(
            missing, [f"a rate of 20°/s about device axis {a}" for a in about],
            "this schedule",
        )  # fmt: skip
    level = f"turns about device axis {join(about)} while that axis is level"
    return words.not_determined(missing, [level], "these turns")


def _scalar(missing: Sequence[str], found: Estimated, n: int) -> str:
    """What lengths of the force leave open."""
    hidden = [m for m in missing if group_of(m) == "cross_coupling"]
    if len(hidden) < len(missing):
        return words.not_determined(
            missing, ["positions with each axis up and down"], "these orientations"
        )
    entries = [ParameterName.of(name).entry for name in hidden]
    pairs = [f"{AXES[row]} and {AXES[column]}" for row, column in entries]
    why = "axes held up and down alone cannot show it"
    if n < 9:
        why = f"{n} norms cannot carry 9 parameters"
    elif found.acc.dof in words.FEW:
        why += f" (and all nine would leave {words.FEW[found.acc.dof]})"
    return (
        f"{join(hidden)} {'are' if hidden[1:] else 'is'} not determined, {why}:"
        f" add positions with gravity half way between {join(pairs)}"
    )


def _doubts(method: Method, observations: Observations, found: Estimated) -> list[str]:
    """What of the windows' agreement the user must know."""
    doubt = DoubtfulPosition.of(observations, found.bad)
    few, scattered = _few(method, found), _scattered(found)
    return [*few, doubt.sentence if doubt else "", *scattered]


def _few(method: Method, found: Estimated) -> list[str]:
    """What so few windows cannot check."""
    if np.isnan(found.acc.rms):
        return []
    if found.acc.dof <= 0:
        return [words.NO_DOF]
    if method == "scalar" and found.acc.dof in words.FEW:
        return [
            f"{words.FEW[found.acc.dof]}: the residual says nothing about the fit; add"
            " positions in other orientations"
        ]
    return []


def _level(method: Method, asked: Asked, observations: Observations) -> list[str]:
    if method != "two_position" or asked.level_deg:
        return []
    moved = observations.gravity * np.deg2rad(0.1)
    return [
        "the base is taken as exactly level: a tilt of 0.1° moves a bias by up to "
        f"{moved:.3f} m/s^2 unseen; take five positions, or say how level it is"
        " (--level)"
    ]


def _scattered(found: Estimated) -> list[str]:
    """Scatter beyond the noise."""
    what = "norms" if found.given.free.all() else "positions"
    sentences = []
    for name, agreed, channels in (
        (what, found.acc, (0, 1, 2)), ("gyroscopes' means", found.gyr, (3, 4, 5)),
    ):  # fmt: skip
        if not np.isnan(agreed.rms):
            spread, unit = scatter_of(found.found, channels), CHANNEL_UNITS[channels[0]]
            sentences.append(words.excess(name, agreed.chi2, agreed.dof, spread, unit))
    chi2, dof = _turns(found)
    if dof >= thresholds.TURNS_TELL:
        sentences.append(
            words.excess("turns", chi2, dof, turns_scatter(found.found), "rad")
        )
    return sentences


def _named(
    turns: Sequence[tuple[int, int]], observations: Observations
) -> list[tuple[str, str]]:
    """Turns by the names of the positions at their ends."""
    names = [position.name for position in observations.positions]
    return [(names[before], names[behind]) for before, behind in turns]


def _elsewhere(found: Estimated, observations: Observations) -> list[str]:
    """A latitude that the gyroscopes contradict."""
    shown = EarthVertical.of(found.given, found.search, observations.latitude)
    return [shown.sentence] if shown and shown.wrong else []


def _turns(found: Estimated) -> tuple[float, int]:
    """chi2 of the closures, and how many are left over."""
    chi2, count = found.closures
    spent = sum(group_of(n) in OF_TURNS for n in found.names)
    return chi2, max(0, count - spent)


def _harms(wrong: WrongAngles, found: Estimated) -> bool:
    """Whether wrong angles could move a parameter beyond its uncertainty."""
    sigma = np.sqrt(np.diag(found.covariance))
    return any(
        abs(wrong.moves[name]) > thresholds.MOVED_WRONG * s
        for name, s in zip(found.names, sigma, strict=True)
    )


def _carried(observations: Observations, found: Estimated) -> dict[str, Any]:
    """What the set has that was not asked for, and what that does."""
    moved = dict(zip(found.names, found.moved.tolist(), strict=True))
    out: dict[str, Any] = {"causes": found.causes, "moved_sigmas": moved}
    if found.ended_s is not None:
        last = (
            float(observations.temperature[-1])
            if len(observations.temperature)
            else np.nan
        )
        warm = last if np.isfinite(last) else None
        out["as_of"] = {"since_start_s": found.ended_s, "temperature_degc": warm}
    return out


def _info(
    method: Method, observations: Observations, asked: Asked, found: Estimated
) -> dict[str, Any]:
    known = observations.temperature[np.isfinite(observations.temperature)]
    latitude = observations.latitude
    out: dict[str, Any] = {
        "conditions": {
            "positions": len(observations),
            "gravity": observations.gravity,
            "latitude_deg": None if latitude is None else float(np.rad2deg(latitude)),
            "temperature_degc": float(known.mean()) if len(known) else None,
            "temperature_sd_k": float(known.std()) if len(known) else None,
            "grade": observations.grade,
        },
        "bad_position": [round(float(p), 4) for p in found.bad],
        "extra_scatter": scatter_of(found.found, (0, 1, 2)),
        "angle_sigma_deg": asked.angles_deg,
    }
    if doubt := DoubtfulPosition.of(observations, found.bad):
        out["doubtful_position"] = doubt.to_json()
    if np.isfinite(found.acc.left_out):
        out["left_out_rms"] = found.acc.left_out
    if method == "two_position" and asked.level_deg:
        out["level_sigma_deg"] = asked.level_deg
    if observations.has_gyr:
        gyr = found.gyr
        out["gyroscopes"] = {
            "chi2": gyr.chi2, "dof": gyr.dof, "unit": "rad/s",
            "rms": gyr.rms if np.isfinite(gyr.rms) else None,
            "extra_scatter": scatter_of(found.found, (3, 4, 5)),
        }  # fmt: skip
    if harmful := [w for w in found.wrong_angles if _harms(w, found)]:
        out["wrong_angles"] = [w.to_json() for w in harmful]
    if found.causes:
        out["carried"] = _carried(observations, found)
    if found.turns:
        chi2, dof = _turns(found)
        scatter = turns_scatter(found.found)
        out["turns"] = {"chi2": chi2, "dof": dof, "scatter_rad": scatter}
    return out
