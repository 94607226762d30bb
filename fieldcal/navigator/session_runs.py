"""A session of runs at rest, to what the sensors of its navigator must be.

session.toml gives each [[position]] the attitude that was entered, and in [site] the
latitude and how level the base is; ``[navigator]`` tells ``solution``, the file,
``azimuth_deg`` and ``azimuth_sd_deg``, where the base's z points from north, and
``aligned``: "entered", or "itself" where the navigator levelled by its own sensors.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration, limits
from fieldcal.calibration.wording import format_with_sigma
from fieldcal.core.errors import InputError, NotObservable
from fieldcal.core.frames import earth_rate_home, turn
from fieldcal.core.positions import angles, third_angles
from fieldcal.core.samples import Array
from fieldcal.core.sentences import join
from fieldcal.navigator.estimate import Drift, estimate
from fieldcal.navigator.mistakes import ATTITUDES, AZIMUTH, LEVEL, SCATTER
from fieldcal.navigator.run_rows import Setup
from fieldcal.navigator.solution import read, runs
from fieldcal.session.description import Description

UNSAID_LEVEL_DEG, UNSAID_AZIMUTH_DEG = 3.0, 1.0
"""What an eye sees of a tilt, and a compass of north, 1 sigma."""

ALIGNED_ITSELF_DEG = 10.0
"""What a navigator may have taken for level and north."""


def calibrated(folder: Path, about: Description) -> Calibration:
    """What the runs of a folder say.

    Raises
    ------
    InputError
        If session.toml lacks what is needed, or the solution cannot be used.
    NotObservable
        If the runs determine nothing.

    """
    table = about.raw.get("navigator", {})
    solution = read(folder / table.get("solution", "solution.csv"))
    placed, base = setup(about, solution.used)
    found = estimate(runs(solution.turned(base), about.windows), placed)
    if not found.names:
        raise NotObservable(
            "these runs determine nothing: longer ones, in more attitudes, would"
        )
    info = {
        "device": dict(about.device),
        "conditions": {
            "positions": len(about.positions),
            "gravity": about.gravity,
            "latitude_deg": about.latitude_deg,
            "temperature_degc": None,
            "grade": about.grade,
        },
        "navigator": document(found, placed),
    }
    return replace(found.calibration(), info=info, warnings=said(found, about))


def setup(about: Description, used: list[int]) -> tuple[Setup, Array]:
    """What is known of place and runs, and the base axes in East, down, north, (3, 3).

    Raises
    ------
    InputError
        If latitude or an attitude is lacking, or the azimuth needs what is not there.

    """
    if not about.positions or not all(p.oriented for p in about.positions):
        raise InputError("session.toml: give each [[position]] the attitude of its run")
    if "latitude_deg" not in about.raw.get("site", {}):
        raise InputError("[site] latitude_deg is lacking: a navigator turns with Earth")
    table = about.raw.get("navigator", {})
    azimuth = np.deg2rad(float(table.get("azimuth_deg", 0.0)))
    if azimuth and any(len({0, 2} & {u - k for u in used}) == 1 for k in (0, 3)):
        raise InputError(
            "[navigator] azimuth_deg turns north and East: the solution has one of them"
        )
    s, c = np.sin(azimuth), np.cos(azimuth)
    base = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    itself = table.get("aligned", "entered") == "itself"
    setting = about.angle_setting_deg or limits.read(about.grade).angle_setting_deg
    own = [setting if p.sigma is None else np.rad2deg(p.sigma) for p in about.positions]
    level = UNSAID_LEVEL_DEG if about.level_deg is None else about.level_deg
    north = float(table.get("azimuth_sd_deg", UNSAID_AZIMUTH_DEG))
    turns = turn(*angles(about.positions), third_angles(about.positions))
    known = Setup(
        base @ earth_rate_home(about.latitude),
        about.gravity,
        np.array([(about.mounting.T @ t).T for t in turns]),
        np.deg2rad([level, north, level]),
        np.deg2rad([ALIGNED_ITSELF_DEG if itself else o for o in own]),
        used,
    )
    return known, base


def said(found: Drift, about: Description) -> tuple[str, ...]:
    """What the runs cannot tell, a sentence each."""
    out = [
        "scale factors of gyroscopes and cross-coupling hardly show in a run at rest:"
        " they are taken as the navigator has them"
    ]
    out += _contradicted(found)
    if found.missing:
        out.append(
            f"{', '.join(found.missing)}: not determined by these runs: add attitudes"
            " with each axis up and down, longer runs, or the velocity that is lacking"
        )
    if about.raw.get("navigator", {}).get("aligned") == "itself":
        out.append(
            "the navigator found its level by its own accelerometers: what they are off"
            " by along the level is in that, and never in the drift; enter the attitude"
        )
    return tuple(out)


def _contradicted(found: Drift) -> list[str]:
    """What of the set-up the runs contradict, a sentence each."""
    (x, y, z), (sx, sy, sz) = np.rad2deg([-found.tilt, found.tilt_sigma])
    out = []
    if LEVEL in found.off:
        out.append(
            f"the base is not as level as stated: it leans by {_deg(x, sx)} about its x"
            f" and by {_deg(z, sz)} about its z; the values allow for that"
        )
    if AZIMUTH in found.off:
        out.append(
            f"the base is turned by {_deg(y, sy)} about its y, which points down, from"
            " what azimuth_deg says; the values allow for that"
        )
    if runs := [name for name in found.off if name.startswith("run")]:
        out.append(
            f"{join(runs)}: the device was not in the attitude that was entered; what"
            " such a run tells of biases is used, and nothing of its level"
        )
    if ATTITUDES in found.off:
        out.append(
            "the device was in no attitude quite as it was entered: the base sways, or"
            " the angles are not set as well as stated; every ± includes it"
        )
    if SCATTER in found.off:
        out.append(
            f"forces are off by {found.noise[3]:.1g} m/s² from run to run: biases"
            " change between runs, or attitudes were not as entered; every ± includes"
            " it"
        )
    return out


def _deg(value: float, sigma: float) -> str:
    return " ± ".join(format_with_sigma(float(value), float(sigma))) + "°"


def document(found: Drift, placed: Setup) -> dict[str, Any]:
    """Noise and tilt as they were found."""
    force, rate, out, jitter = found.noise
    return {
        "runs": len(placed.attitudes),
        "force_noise_m_s2_rthz": force,
        "rate_noise_rad_s_rthz": rate,
        "output_noise": out,
        "run_scatter_m_s2": jitter,
        "tilt_deg": np.rad2deg(found.tilt).tolist(),
        "tilt_sigma_deg": np.rad2deg(found.tilt_sigma).tolist(),
        "missing": list(found.missing),
        "contradicted": list(found.off),
    }
