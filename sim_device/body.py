"""Motion, vibration and temperature of the device, by its profile.

Commanded and reached angles may differ by the profile's effects, as on a real fixture.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.sim_device import earth
from fieldcal.sim_device.effect import SimulatedEffect
from fieldcal.sim_device.joints import Angles, Joints, JointStates
from fieldcal.sim_device.motion import (
    BaseMotion,
    Installation,
    MovingFrame,
    SensorMotion,
    base_frame,
    mounting_axes,
    sensor_motion,
)
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.quaternion import STILL
from fieldcal.sim_device.random_process import random_stream
from fieldcal.sim_device.sensor_conditions import SensorConditions
from fieldcal.sim_device.temperature import temperature_course
from fieldcal.sim_device.way import REST, Manoeuvre


class Body:
    """Motion and environment of the device; true time in s, angles in rad.

    Attributes
    ----------
    joints : motion of the joints so far
    base_motions : motions of the base, past and future
    commanded_angles : last commanded angles
    vibration_rms : rms of the vibration in each position so far, m/s^2
    manoeuvres : prescribed motions of the device, each relative to its start

    """

    def __init__(self, profile: Profile, seed: int) -> None:
        self.profile = profile
        self.commanded_angles = (
            float(np.deg2rad(profile.motion.alpha_deg)),
            float(np.deg2rad(profile.motion.beta_deg)),
            float(np.deg2rad(profile.motion.gamma_deg)),
        )
        effects = profile.in_order
        settings = (e.joint_setting(random_stream(seed, e.id)) for e in effects)
        self._settings = [setting for setting in settings if setting is not None]
        creeps = (e.creep() for e in effects)
        self.joints = Joints(
            self._reached_angles(self.commanded_angles),
            tuple(c for c in creeps if c is not None),
        )
        self.base_motions: list[BaseMotion] = []
        for effect in effects:
            self.disturb(effect)
        self._stand = installation(profile)
        self._shaking = random_stream(seed, "vibration")
        self._strength = random_stream(seed, "vibration level")
        self.vibration_rms = [self._vibration_level()]
        self.manoeuvres: list[Manoeuvre] = []
        self._rest: tuple[bytes, SensorMotion] | None = None
        self._start_temperature = float(
            temperature_course(profile.temperature, np.zeros(1))[0][0]
        )

    def disturb(self, effect: SimulatedEffect) -> None:
        """Add the motion of the base that an effect causes, if any."""
        move = effect.base_motion()
        if move is not None:
            self.base_motions.append(move)

    def turn(self, start: float, seconds: float, angles: Angles) -> tuple[float, float]:
        """Turn to `angles`; return start and end of the turn, s."""
        return self.spin(start, seconds, angles, (0.0, 0.0, 0.0))

    def spin(
        self,
        start: float,
        seconds: float,
        angles: Angles,
        rate: tuple[float, float, float],
    ) -> tuple[float, float]:
        """Turn to `angles` and reach a constant `rate`; return start and end, s."""
        if not np.isfinite([*angles, *rate, start]).all():
            raise InputError(f"cannot turn to {angles}: the angles must be numbers")
        alpha, beta, gamma = map(float, angles)
        self.commanded_angles = (alpha, beta, gamma)
        self.vibration_rms.append(self._vibration_level())
        there = self._reached_angles(self.commanded_angles)
        return self.joints.spin(start, seconds, there, rate)

    def frame(self, t: Array) -> MovingFrame:
        """Frame of the procedure axes at ascending instants, (n,) s."""
        frame = base_frame(
            self._stand, self.base_motions, t, self.joints.at(self._held(t))
        )
        for way in self.manoeuvres:
            if (on := way.lasts(t)).any():
                frame = frame.then(
                    *(np.where(on, v, r) for v, r in zip(way.at(t), REST, strict=True))
                )
        return frame

    def _held(self, t: Array) -> Array:
        """Instants for the joints, (n,) s: the start of a manoeuvre during it."""
        for way in self.manoeuvres:
            t = np.where(way.lasts(t), way.t[0], t)
        return t

    def conditions(self, t: Array, vibration: Array) -> SensorConditions:
        """Inputs of the sensors at ascending instants, (n,) s."""
        swing = self.joints.at(t)
        felt = (
            self._motion_at_rest(t, swing)
            if self._is_at_rest(t, swing)
            else self._motion_at(t)
        )
        f, w = (np.broadcast_to(v, (3, len(t))) for v in (felt.f, felt.w))
        degrees, warming = temperature_course(self.profile.temperature, t)
        warmth = degrees - self._start_temperature
        return SensorConditions(
            t, f, w, warmth, warming, swing.since_turn, swing.turn_progress, vibration
        )

    def _motion_at_rest(self, t: Array, swing: JointStates) -> SensorMotion:
        """Sensor motion at rest; cached if the base cannot move."""
        if self.base_motions or self.manoeuvres:
            return self._motion_at(t[:1])
        key = swing.angle[:, 0].tobytes() + swing.axis[:, 0].tobytes()
        if self._rest is None or self._rest[0] != key:
            self._rest = key, self._motion_at(t[:1])
        return self._rest[1]

    def _motion_at(self, t: Array) -> SensorMotion:
        push = np.zeros((3, len(t)))
        for move in self.base_motions:
            if move.push is not None:
                push = push + move.push(t)
        return sensor_motion(self._stand, self.frame(t), push)

    def _is_at_rest(self, t: Array, swing: JointStates) -> bool:
        """Whether nothing moves at any of the instants, so that one represents all."""
        turned = swing.angle != swing.angle[:, :1]
        moved = any(move.lasts(t[0], t[-1]) for move in self.base_motions)
        carried = any(way.lasts(t).any() for way in self.manoeuvres)
        moving = swing.rate.any() or turned.any() or carried
        return not (moved or moving)

    def temperature(self, t: Array) -> Array:
        """Temperature of the sensors, (n,) °C."""
        return temperature_course(self.profile.temperature, t)[0]

    def vibration(self, t: Array) -> Array:
        """Vibration of the next samples, (3, n) m/s^2, device axes."""
        if not any(self.vibration_rms):
            return np.zeros((3, len(t)))
        position = self.joints.at(t).position.astype(np.int64)
        level = np.array(self.vibration_rms)[position]
        shaking: Array = (self._shaking.standard_normal((len(t), 3)) * level[:, None]).T
        return shaking

    def _reached_angles(self, angles: Angles) -> Angles:
        """Angles that the joints reach for commanded `angles`; the third is exact."""
        there = np.array(angles[:2])
        for setting in self._settings:
            there = setting(there)
        return float(there[0]), float(there[1]), angles[2]

    def _vibration_level(self) -> float:
        return sum(e.vibration_rms(self._strength) for e in self.profile.effects)


def installation(profile: Profile) -> Installation:
    """How the device is held, apart from its joints."""
    latitude = np.deg2rad(profile.site.latitude_deg)
    rate = earth.RATE if profile.feels_earth else 0.0
    index, signs = mounting_axes(profile.frame.mounting, right_handed=True)
    site = profile.site
    turning, pull = earth.moving_base_terms(
        float(latitude), site.height_m, site.north_m_s, site.east_m_s
    )
    still = np.array([[0.0], [-np.sin(latitude)], [np.cos(latitude)]])
    held = Installation(
        gravity=profile.gravity,
        earth=rate * still + turning,
        pull=pull,
        base=STILL,
        axes=index,
        signs=np.array(signs)[:, None],
        lever=np.zeros((3, 1)),
    )
    for effect in profile.in_order:
        held = effect.change_installation(held)
    return held
