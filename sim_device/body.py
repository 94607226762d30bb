"""The device's body: how it is held, moved, shaken and warmed, by its profile.

What it is asked for and where it goes differ as on a real fixture: the gauge of a joint
has a scale, its zero an offset, and whoever sets an angle does so a little off.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.sim_device import earth
from fieldcal.sim_device.influences import Life
from fieldcal.sim_device.joints import Joints, Swing
from fieldcal.sim_device.motion import (
    Felt,
    MovingFrame,
    Stand,
    base_attitude,
    carried,
    feel,
)
from fieldcal.sim_device.noise import stream
from fieldcal.sim_device.profile import Profile, mounting_axes
from fieldcal.sim_device.rocking import Push, SwayMotion
from fieldcal.sim_device.temperature import course
from fieldcal.sim_device.vocabulary import AXES
from fieldcal.sim_device.way import REST, Manoeuvre

Angles = tuple[float, float]


class Body:
    """Where the device is and what it lives through; true time in s, angles in rad.

    Attributes
    ----------
    joints : its motion so far
    bumps : of the base, so far and to come
    asked : the angles it was last asked for
    levels : rms of the vibration in each position so far, m/s^2
    ways : that it is carried along, each from where the joints are when it begins

    """

    def __init__(self, profile: Profile, seed: int) -> None:
        self.profile = profile
        self.asked = (
            float(np.deg2rad(profile.motion.alpha_deg)),
            float(np.deg2rad(profile.motion.beta_deg)),
        )
        self._hand = stream(seed, "angle_setting")
        self.joints = Joints(self._set(self.asked))
        self.bumps = [_bump(profile, k) for k in range(len(profile.every("bump")))]
        self._sways = [
            SwayMotion(
                np.deg2rad(e["amplitude_deg"]),
                e["hz"],
                np.deg2rad(e["phase_deg"]),
                np.deg2rad(e["azimuth_deg"]),
            )
            for e in profile.every("sway")
        ]
        self._stand = stand(profile)
        self._shaking = stream(seed, "vibration")
        self._strength = stream(seed, "vibration level")
        self.levels = [self._level()]
        self.ways: list[Manoeuvre] = []
        self._start_temperature = float(course(profile.temperature, np.zeros(1))[0][0])

    def turn(self, start: float, seconds: float, angles: Angles) -> Angles:
        """Turn to `angles`; returns when it starts and ends."""
        return self.spin(start, seconds, angles, (0.0, 0.0, 0.0))

    def spin(
        self,
        start: float,
        seconds: float,
        angles: Angles,
        rate: tuple[float, float, float],
    ) -> Angles:
        """Turn to `angles` and run up to a constant `rate`; when it starts and ends."""
        if not np.isfinite([*angles, *rate, start]).all():
            raise InputError(f"cannot turn to {angles}: the angles must be numbers")
        self.asked = (float(angles[0]), float(angles[1]))
        self.levels.append(self._level())
        there = self._set(self.asked)
        return self.joints.spin(start, seconds, there, rate)

    def frame(self, t: Array) -> MovingFrame:
        """Frame of the procedure axes at ascending instants, (n,) s."""
        rocking = [s.rocking() for s in self._sways]
        rocking += [b.rocking() for b in self.bumps]
        frame = carried(self._stand, rocking, t, self.joints.at(self._held(t)))
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
        felt = self._felt(t[:1] if self._still(t, swing) else t)
        f, w = (np.broadcast_to(v, (3, len(t))) for v in (felt.f, felt.w))
        degrees, warming = course(self.profile.temperature, t)
        warmth = degrees - self._start_temperature
        return Life(t, f, w, warmth, warming, swing.since, swing.progress, vibration)

    def _felt(self, t: Array) -> Felt:
        push = np.zeros((3, len(t)))
        for bump in self.bumps:
            push = push + bump.acceleration(t)
        return feel(self._stand, self.frame(t), push)

    def _still(self, t: Array, swing: Swing) -> bool:
        """Whether nothing moves at any of the instants, so that one stands for all."""
        turned = swing.angle != swing.angle[:, :1]
        shaken = any(b.start <= t[-1] and not b.over(t[0]) for b in self.bumps)
        carried = any(way.lasts(t).any() for way in self.ways)
        moving = swing.rate.any() or turned.any() or carried
        return not (self._sways or shaken or moving)

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
        """Where the joints end up when asked for `angles`."""
        scale = self.profile.one("angle_scale")
        offset = self.profile.one("angle_offset")
        setting = self.profile.one("angle_setting")
        there = np.array(angles)
        if scale:
            there = there * (1 + np.array(scale.vector(("alpha", "beta"))))
        if offset:
            there = there + np.deg2rad(offset.vector(("alpha0_deg", "beta0_deg")))
        if setting:
            sigma = np.deg2rad(setting["sigma_deg"])
            there = there + sigma * self._hand.standard_normal(2)
        return float(there[0]), float(there[1])

    def _level(self) -> float:
        effect = self.profile.one("vibration_rectification")
        return effect["level"] * float(self._strength.random()) if effect else 0.0


def stand(profile: Profile) -> Stand:
    """How the device is held, apart from its joints."""
    tilt = profile.one("base_tilt")
    about_x, about_z = (
        np.deg2rad(tilt.vector(("about_x_deg", "about_z_deg"))) if tilt else (0.0, 0.0)
    )
    heading = profile.one("heading_error")
    psi = np.deg2rad(heading["psi_deg"]) if heading else 0.0
    latitude = np.deg2rad(profile.site.latitude_deg)
    rate = earth.RATE if profile.feels_earth else 0.0
    mounting = profile.one("mounting")
    wrong = mounting.words["axes"] if mounting else ""
    names = [wrong[i : i + 2] for i in (0, 2, 4)] if wrong else profile.frame.mounting
    index, signs = mounting_axes(names, right_handed=not wrong)
    lever = profile.one("lever_arm")
    return Stand(
        gravity=profile.gravity,
        earth=rate * np.array([[0.0], [-np.sin(latitude)], [np.cos(latitude)]]),
        base=base_attitude(float(psi), float(about_x), float(about_z)),
        axes=index,
        signs=np.array(signs)[:, None],
        lever=np.array(lever.vector(AXES) if lever else (0.0, 0.0, 0.0))[:, None],
    )


def _bump(profile: Profile, k: int) -> Push:
    e = profile.every("bump")[k]
    return Push(
        e["at_s"],
        e["for_s"],
        e["push"],
        float(np.deg2rad(e["tilt_deg"])),
        float(np.deg2rad(e["azimuth_deg"])),
    )
