"""Whether the device is in the requested position, by its accelerometers.

At rest the specific force shows the position, but the calibration is not known yet and
the base may be tilted. Both shift all positions alike. After the first position,
therefore, the *change* since the last one is judged. It is known much better, so that a
step of 2.5 degrees is detected.

    |(f - f_held) - (f_wanted - f_held_wanted)| <= g (NEAR + TILT |change wanted| / g)

f is specific force in procedure axes, m/s^2, corrected by the nominal calibration. A
tilted base changes a turn in proportion to the turn. If a common slip of the operator
explains the force twice as well as the requested position, the slip is reported.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fieldcal.core.frames import angles_of_force_direction, in_axes_turned_about_y
from fieldcal.core.positions import Position, specific_forces
from fieldcal.core.samples import Array
from fieldcal.run.acc_unit import acc_unit_message, reads_gravity

FIRST_TOLERANCE_RAD = np.deg2rad(8.0)
"""Tolerance for the first position, rad: base tilt and bias of a raw device."""

JOINT_TOLERANCE_RAD, TILT_TOLERANCE_RAD = np.deg2rad(1.0), np.deg2rad(3.5)
"""Tolerance for later positions, rad: of the joints, of the base for a unit turn."""


@dataclass(frozen=True, slots=True)
class AcceptedPosition:
    """A position that was accepted, and the force measured there."""

    position: Position
    f: Array


@dataclass(frozen=True, slots=True)
class PositionCheck:
    """Measured position of the device, compared with the requested one.

    Attributes
    ----------
    ok : whether averaging may begin
    alpha_deg, beta_deg : angles by the accelerometers, less the offset that an earlier
        position shows; of three angles, under the third one as requested
    problem : one sentence for the operator, empty when ok
    limit_deg : tolerance; nan if only the norm is judged

    """

    ok: bool
    alpha_deg: float
    beta_deg: float
    problem: str = ""
    limit_deg: float = np.nan


def check_position(
    wanted: Position,
    f: Array,
    gravity: float,
    held: AcceptedPosition | None,
    others: Mapping[str, Position] | None = None,
    address: str = "",
) -> PositionCheck:
    """Compare measured force with a position asked for.

    Parameters
    ----------
    wanted : position asked for; without angles only the norm is judged
    f : (3,) measured specific force, procedure axes, m/s^2
    gravity : m/s^2
    held : an earlier position, or None before the first
    others : further places it might be in instead, by what is then said of it
    address : of the device, whose options state a unit

    """
    norm = float(np.linalg.norm(f))
    if not np.isfinite(norm):
        problem = (
            "an axis of the accelerometers gives no value, so nobody can tell the"
            " position: check the columns of the wire format, and the device"
        )
        return PositionCheck(False, np.nan, np.nan, problem)
    upright = in_axes_turned_about_y(
        _without_offset(f, gravity, held), np.array(-wanted.gamma)
    )
    alpha, beta = np.rad2deg(angles_of_force_direction(upright))
    seen = (float(alpha), float(beta))
    if not reads_gravity(norm, gravity):
        problem = acc_unit_message(norm, gravity, address)
        return PositionCheck(False, *seen, problem)
    if not wanted.oriented:
        return PositionCheck(True, *seen)
    chord = _relative_force_change(wanted, held.position, gravity) if held else 0.0
    limit = (
        JOINT_TOLERANCE_RAD + TILT_TOLERANCE_RAD * chord
        if held
        else FIRST_TOLERANCE_RAD
    )
    miss = _angle_off(wanted, f, gravity, held)
    slip, slip_miss = _nearest_slip(wanted, f, gravity, held, others or {})
    slipped = slip_miss < min(miss / 2, limit) and miss > JOINT_TOLERANCE_RAD
    within = float(np.rad2deg(limit))
    if miss <= limit and not slipped:
        return PositionCheck(True, *seen, limit_deg=within)
    problem = _problem_sentence(wanted, seen, slip if slipped else "", np.rad2deg(miss))
    return PositionCheck(False, *seen, problem, within)


def round_to_tenth(angle: float) -> float:
    """Round an angle for display, deg; zero has no sign."""
    return round(float(angle), 1) + 0.0


@lru_cache(maxsize=64)
def _force(position: Position, gravity: float) -> Array:
    """Specific force of a position, (3,) m/s^2; cached, since every block needs it."""
    f: Array = specific_forces([position], gravity)[0]
    f.flags.writeable = False
    return f


def _relative_force_change(a: Position, b: Position, gravity: float) -> float:
    """Change of the force between two positions over g, 0 to 2."""
    difference = _force(a, gravity) - _force(b, gravity)
    return float(np.linalg.norm(difference) / gravity)


def _without_offset(f: Array, gravity: float, held: AcceptedPosition | None) -> Array:
    if held is None:
        return f
    clean: Array = f - (held.f - _force(held.position, gravity))
    return clean


def _angle_off(
    wanted: Position, f: Array, gravity: float, held: AcceptedPosition | None
) -> float:
    """Angle between the device and the wanted position, rad."""
    clean = _without_offset(f, gravity, held)
    return float(np.linalg.norm(clean - _force(wanted, gravity)) / gravity)


def _nearest_slip(
    wanted: Position,
    f: Array,
    gravity: float,
    held: AcceptedPosition | None,
    others: Mapping[str, Position],
) -> tuple[str, float]:
    """The operator's slip that best explains the position, and its error, rad."""
    before = held.position if held else None
    said, there = _possible_slips(wanted, before, tuple(others.items()), gravity)
    if not said:
        return "", np.inf
    misses = np.linalg.norm(_without_offset(f, gravity, held) - there, axis=1) / gravity
    best = int(np.argmin(misses))
    return said[best], float(misses[best])


@lru_cache(maxsize=16)
def _possible_slips(
    wanted: Position,
    before: Position | None,
    others: tuple[tuple[str, Position], ...],
    gravity: float,
) -> tuple[tuple[str, ...], Array]:
    """Sentence and force, (n, 3) m/s^2, of each slip that an operator may have made.

    Cached, since they are the same for every block in a position.
    """
    a, b, c = wanted.all_degrees or (0.0, 0.0, 0.0)
    turned = [
        ((-a, b), "α is turned the wrong way"),
        ((a, -b), "β is turned the wrong way"),
        ((-a, -b), "both angles are turned the wrong way"),
        ((b, a), "α and β are exchanged"),
        ((a + 180, b), "the device is upside down, or its mounting is not as declared"),
        ((a, b + 180), "the device is upside down, or its mounting is not as declared"),
        ((a, 0.0), "β is not turned yet"),
        ((0.0, b), "α is not turned yet"),
    ]
    slips = [(p, said) for said, p in others if p.oriented]
    if wanted.oriented:
        own = [(Position.deg(*at, gamma=c), said) for at, said in turned]
        if c:
            own.append((Position.deg(a, b, gamma=-c), "γ is turned the wrong way"))
            own.append((Position.deg(a, b), "γ is not turned yet"))
        slips = [*own, *slips]
    if before and before.oriented:
        slips.insert(0, (before, "it has not been turned yet"))
    there = specific_forces([p for p, _ in slips], gravity)
    there.flags.writeable = False
    return tuple(said for _, said in slips), there


def _problem_sentence(
    wanted: Position, seen: tuple[float, float], slip: str, off_by: float
) -> str:
    if wanted.all_degrees is None:
        asked = f"asked for is {wanted.name}"
        return f"{slip or f'the device is {off_by:.1f}° off'}: {asked}"
    a, b, c = wanted.all_degrees
    now = [round_to_tenth(angle) for angle in seen]
    where = f"the device is at α = {now[0]:.1f}°, β = {now[1]:.1f}°"
    asked = f"asked for is α = {a:g}°, β = {b:g}°"
    if c:  # gravity shows two angles, and not by which third one they come
        where += f" if γ is {c:g}°"
        asked += f", γ = {c:g}°"
    if slip:
        return f"{slip}: {where}, {asked}"
    off = {"α": round_to_tenth(a - seen[0]), "β": round_to_tenth(b - seen[1])}
    turns = [f"{by:+.1f}° in {name}" for name, by in off.items() if by]
    return f"{where}, {asked}: turn it by {', '.join(turns) or 'a little'}"
