"""The device's body: how it is held, moved, shaken and warmed, by its profile.

What it is asked for and where it goes may differ, as on a real fixture: by its effects.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.sim_device import earth
from fieldcal.sim_device.effect import SimulatedEffect
from fieldcal.sim_device.joints import Angles, Joints, Swing
from fieldcal.sim_device.life import Life
from fieldcal.sim_device.motion import (
    BaseMotion,
    Felt,
    MovingFrame,
    Stand,
    carried,
    feel,
    mounting_axes,
)
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.quaternion import STILL
from fieldcal.sim_device.random_process import stream
from fieldcal.sim_device.temperature import course
from fieldcal.sim_device.way import REST, Manoeuvre


class Body:
    """Where the device is and what it lives through; true time in s, angles in rad.

    Attributes
    ----------
    joints : its motion so far
    moves : motions of the base, so far and to come
    asked : the angles it was last asked for
    levels : rms of the vibration in each position so far, m/s^2
    ways : that it is carried along, each from where the joints are when it begins

    """

    def __init__(self, profile: Profile, seed: int) -> None:
        self.profile = profile
        self.asked = (
            float(np.deg2rad(profile.motion.alpha_deg)),
            float(np.deg2rad(profile.motion.beta_deg)),
            float(np.deg2rad(profile.motion.gamma_deg)),
        )
        effects = profile.in_order
        settings = (e.setting(stream(seed, e.id)) for e in effects)
        self._settings = [setting for setting in settings if setting is not None]
        creeps = (e.creep() for e in effects)
        self.joints = Joints(
            self._set(self.asked), tuple(c for c in creeps if c is not None)
        )
        self.moves: list[BaseMotion] = []
        for effect in effects:
            self.disturb(effect)
        self._stand = stand(profile)
        self._shaking = stream(seed, "vibration")
        self._strength = stream(seed, "vibration level")
        self.levels = [self._level()]
        self.ways: list[Manoeuvre] = []
        self._rest: tuple[bytes, Felt] | None = None
        self._start_temperature = float(course(profile.temperature, np.zeros(1))[0][0])

    def disturb(self, effect: SimulatedEffect) -> None:
        """Move the base as the effect does, if it does."""
        move = effect.base_motion()
        if move is not None:
            self.moves.append(move)

    def turn(self, start: float, seconds: float, angles: Angles) -> tuple[float, float]:
        """Turn to `angles`; returns when it starts and ends."""
        return self.spin(start, seconds, angles, (0.0, 0.0, 0.0))

    def spin(
        self,
        start: float,
        seconds: float,
        angles: Angles,
        rate: tuple[float, float, float],
    ) -> tuple[float, float]:
        """Turn to `angles` and run up to a constant `rate`; when it starts and ends."""
        if not np.isfinite([*angles, *rate, start]).all():
            raise InputError(f"cannot turn to {angles}: the angles must be numbers")
        alpha, beta, gamma = map(float, angles)
        self.asked = (alpha, beta, gamma)
        self.levels.append(self._level())
        there = self._set(self.asked)
        return self.joints.spin(start, seconds, there, rate)

    def frame(self, t: Array) -> MovingFrame:
        """Frame of the procedure axes at ascending instants, (n,) s."""
        frame = carried(self._stand, self.moves, t, self.joints.at(self._held(t)))
        for way in self.ways:
            if (on := way.lasts(t)).any():
                frame = frame.then(
                    *(np.where(on, v, r) for v, r in zip(way.at(t), REST, strict=True))
                )
        return frame

    def _held(self, t: Array) -> Array:
        """Instants at which the joints were last moved, (n,) s: not while carried."""
        for way in self.ways:
            t = np.where(way.lasts(t), way.t[0], t)
        return t

    def life(self, t: Array, vibration: Array) -> Life:
        """What the sensors live through at ascending instants, (n,) s."""
        swing = self.joints.at(t)
        felt = self._resting(t, swing) if self._still(t, swing) else self._felt(t)
        f, w = (np.broadcast_to(v, (3, len(t))) for v in (felt.f, felt.w))
        degrees, warming = course(self.profile.temperature, t)
        warmth = degrees - self._start_temperature
        return Life(t, f, w, warmth, warming, swing.since, swing.progress, vibration)

    def _resting(self, t: Array, swing: Swing) -> Felt:
        """What is felt at rest; on a base that nothing moves, as long as it rests."""
        if self.moves or self.ways:
            return self._felt(t[:1])
        key = swing.angle[:, 0].tobytes() + swing.axis[:, 0].tobytes()
        if self._rest is None or self._rest[0] != key:
            self._rest = key, self._felt(t[:1])
        return self._rest[1]

    def _felt(self, t: Array) -> Felt:
        push = np.zeros((3, len(t)))
        for move in self.moves:
            if move.push is not None:
                push = push + move.push(t)
        return feel(self._stand, self.frame(t), push)

    def _still(self, t: Array, swing: Swing) -> bool:
        """Whether nothing moves at any of the instants, so that one stands for all."""
        turned = swing.angle != swing.angle[:, :1]
        moved = any(move.lasts(t[0], t[-1]) for move in self.moves)
        carried = any(way.lasts(t).any() for way in self.ways)
        moving = swing.rate.any() or turned.any() or carried
        return not (moved or moving)

    def temperature(self, t: Array) -> Array:
        """Temperature of the sensors, (n,) °C."""
        return course(self.profile.temperature, t)[0]

    def vibration(self, t: Array) -> Array:
        """Vibration of the next samples, (3, n) m/s^2, device axes."""
        if not any(self.levels):
            return np.zeros((3, len(t)))
        position = self.joints.at(t).position.astype(np.int64)
        level = np.array(self.levels)[position]
        shaking: Array = (self._shaking.standard_normal((len(t), 3)) * level[:, None]).T
        return shaking

    def _set(self, angles: Angles) -> Angles:
        """Where the joints end up when asked for `angles`; the third is set exactly."""
        there = np.array(angles[:2])
        for setting in self._settings:
            there = setting(there)
        return float(there[0]), float(there[1]), angles[2]

    def _level(self) -> float:
        return sum(e.shaking(self._strength) for e in self.profile.effects)


def stand(profile: Profile) -> Stand:
    """How the device is held, apart from its joints."""
    latitude = np.deg2rad(profile.site.latitude_deg)
    rate = earth.RATE if profile.feels_earth else 0.0
    index, signs = mounting_axes(profile.frame.mounting, right_handed=True)
    site = profile.site
    turning, pull = earth.carried(
        float(latitude), site.height_m, site.north_m_s, site.east_m_s
    )
    still = np.array([[0.0], [-np.sin(latitude)], [np.cos(latitude)]])
    held = Stand(
        gravity=profile.gravity,
        earth=rate * still + turning,
        pull=pull,
        base=STILL,
        axes=index,
        signs=np.array(signs)[:, None],
        lever=np.zeros((3, 1)),
    )
    for effect in profile.in_order:
        held = effect.stands(held)
    return held
