"""Calibration of a navigator's sensors from a session of runs at rest.

session.toml gives each [[position]] the attitude that was entered, and in [site] the
latitude and how level the base is; ``[navigator]`` states ``solution``, the file,
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
from fieldcal.core.frames import direction_cosines, earth_rate_at_home
from fieldcal.core.positions import alpha_beta_angles, gamma_angles
from fieldcal.core.samples import Array
from fieldcal.core.sentences import join_words
from fieldcal.navigator.estimate import DriftEstimate, estimate_from_drift
from fieldcal.navigator.mistakes import ATTITUDES, AZIMUTH, LEVEL, SCATTER
from fieldcal.navigator.run_rows import RunSetup
from fieldcal.navigator.solution import read_solution, runs_in_windows
from fieldcal.session.description import Description

UNSTATED_LEVEL_DEG, UNSTATED_AZIMUTH_DEG = 3.0, 1.0
"""Uncertainty of level (by eye) and azimuth (by compass) if not stated, 1 sigma."""

ALIGNED_ITSELF_DEG = 10.0
"""Uncertainty of an attitude that the navigator found by its own alignment."""


def calibrate_navigator(folder: Path, about: Description) -> Calibration:
    """Calibrate the sensors of a navigator from the runs of a session folder.

    Raises
    ------
    InputError
        If session.toml lacks what is needed, or the solution cannot be used.
    NotObservable
        If the runs determine nothing.

    """
    table = about.raw.get("navigator", {})
    solution = read_solution(folder / table.get("solution", "solution.csv"))
    placed, base = run_setup(about, solution.recorded_columns)
    found = estimate_from_drift(
        runs_in_windows(solution.rotated(base), about.windows), placed
    )
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
        "navigator": drift_document(found, placed),
    }
    return replace(found.calibration(), info=info, warnings=limitations(found, about))


def run_setup(about: Description, used: list[int]) -> tuple[RunSetup, Array]:
    """Return the set-up of the runs, and the base axes in East, down, north, (3, 3).

    Raises
    ------
    InputError
        If latitude or an attitude is lacking, or the azimuth needs what is not there.

    """
    if not about.positions or not all(p.oriented for p in about.positions):
        raise InputError("session.toml: give each [[position]] the attitude of its run")
    if about.latitude_deg is None:
        raise InputError(
            "session.toml: [site] latitude_deg is lacking: a navigator turns with Earth"
        )
    table = about.raw.get("navigator", {})
    azimuth = np.deg2rad(float(table.get("azimuth_deg", 0.0)))
    if azimuth and any(len({0, 2} & {u - k for u in used}) == 1 for k in (0, 3)):
        raise InputError(
            "session.toml: [navigator] azimuth_deg turns north and East: the solution"
            " has one of them"
        )
    s, c = np.sin(azimuth), np.cos(azimuth)
    base = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    itself = table.get("aligned", "entered") == "itself"
    setting = about.angle_setting_deg or limits.read(about.grade).angle_setting_deg
    own = [setting if p.sigma is None else np.rad2deg(p.sigma) for p in about.positions]
    level = UNSTATED_LEVEL_DEG if about.level_deg is None else about.level_deg
    north = float(table.get("azimuth_sd_deg", UNSTATED_AZIMUTH_DEG))
    turns = direction_cosines(
        *alpha_beta_angles(about.positions), gamma_angles(about.positions)
    )
    known = RunSetup(
        base @ earth_rate_at_home(about.latitude),
        about.gravity,
        np.array([(about.mounting.T @ t).T for t in turns]),
        np.deg2rad([level, north, level]),
        np.deg2rad([ALIGNED_ITSELF_DEG if itself else o for o in own]),
        used,
    )
    return known, base


def limitations(found: DriftEstimate, about: Description) -> tuple[str, ...]:
    """Sentences on what the runs cannot determine."""
    out = [
        "scale factors of gyroscopes and cross-coupling hardly show in a run at rest:"
        " they are taken as the navigator has them"
    ]
    out += _contradicted_setup(found)
    if found.undetermined:
        out.append(
            f"{', '.join(found.undetermined)}: not determined by these runs: add"
            " attitudes with each axis up and down, longer runs, or the velocity that"
            " is lacking"
        )
    if about.raw.get("navigator", {}).get("aligned") == "itself":
        out.append(
            "the navigator found its level by its own accelerometers: what they are off"
            " by along the level is in that, and never in the drift; enter the attitude"
        )
    return tuple(out)


def _contradicted_setup(found: DriftEstimate) -> list[str]:
    """Sentences on what the runs contradict in the stated set-up."""
    (x, y, z), (sx, sy, sz) = np.rad2deg([-found.tilt, found.tilt_sigma])
    out = []
    if LEVEL in found.setup_mistakes:
        out.append(
            f"the base is not as level as stated: it leans by {_deg(x, sx)} about its x"
            f" and by {_deg(z, sz)} about its z; the values allow for that"
        )
    if AZIMUTH in found.setup_mistakes:
        out.append(
            f"the base is turned by {_deg(y, sy)} about its y, which points down, from"
            " what azimuth_deg says; the values allow for that"
        )
    if runs := [name for name in found.setup_mistakes if name.startswith("run")]:
        out.append(
            f"{join_words(runs)}: the device was not in the attitude that was entered;"
            " what such a run tells of biases is used, and nothing of its level"
        )
    if ATTITUDES in found.setup_mistakes:
        out.append(
            "the device was in no attitude quite as it was entered: the base sways, or"
            " the angles are not set as well as stated; every ± includes it"
        )
    if SCATTER in found.setup_mistakes:
        out.append(
            f"forces are off by {found.noise[-1]:.1g} m/s² from run to run: biases"
            " change between runs, or attitudes were not as entered; every ± includes"
            " it"
        )
    return out


def _deg(value: float, sigma: float) -> str:
    return " ± ".join(format_with_sigma(float(value), float(sigma))) + "°"


def drift_document(found: DriftEstimate, placed: RunSetup) -> dict[str, Any]:
    """Noise, tilt and contradictions, as the result file states them."""
    force, rate, velocity, position, jitter = found.noise
    recorded = np.array(placed.recorded)
    has_velocity, has_position = bool((recorded < 3).any()), bool((recorded > 2).any())
    return {
        "runs": len(placed.attitudes),
        "force_noise_m_s2_rthz": force,
        "rate_noise_rad_s_rthz": rate,
        "output_noise": velocity if has_velocity else position,
        "velocity_noise_m_s": velocity if has_velocity else None,
        "position_noise_m": position if has_position else None,
        "run_scatter_m_s2": jitter,
        "tilt_deg": np.rad2deg(found.tilt).tolist(),
        "tilt_sigma_deg": np.rad2deg(found.tilt_sigma).tolist(),
        "missing": list(found.undetermined),
        "contradicted": list(found.setup_mistakes),
    }
