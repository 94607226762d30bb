"""A device that is drawn with its place, noise, base and fixture."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.concealed import draws, others
from benchmarks.concealed.sessions import Session, plain
from fieldcal.sim_device import profile as device
from fieldcal.sim_device.effects import kind
from fieldcal.sim_device.vocabulary import checked_effect

FASTEST = 50.0
"""Samples a second at most: what they cost is time, and noise is drawn anyway."""

TILTS = {"base_tilt", "angle_offset"}
"""Models of a tilt that every device has, and that a calibration finds."""

SHOWN = tuple(
    name
    for name in draws.EQUATIONS
    if not kind(name).NEEDS_EARTH
    and not kind(name).EXAMPLE.turntable
    and name not in (*draws.TURNING, *draws.LINES)
)
"""Effects with numbers that show at rest."""


@dataclass(frozen=True)
class Bench:
    """A device, and how the fixture sets it.

    Attributes
    ----------
    session : the device with what is concealed; its windows are not used
    angles_deg : how well angles are set, as stated and as they are

    """

    session: Session
    angles_deg: float


def drawn(number: int, rng: np.random.Generator) -> Bench:
    """A device that conceals nothing, an effect or two."""
    sigmas = float(np.exp(rng.uniform(*np.log((10.0, 30.0)))))
    if number % 3 == 0:
        session = plain(rng, ("ladder",))
    elif number % 6 == 5:
        session = others.several(rng, sigmas)
    else:
        session = draws.single(str(rng.choice(SHOWN)), rng, sigmas)
    concealed = dict(session.concealed)
    rate = min(session.profile.sampling.rate_hz, FASTEST)
    profile = replace(session.profile, sampling=device.Sampling(rate))
    if not TILTS & set(concealed):
        about_x, about_z = rng.normal(0.0, 0.5, 2)
        tilt = checked_effect(
            "base_tilt", {"about_x_deg": about_x, "about_z_deg": about_z}
        )
        profile = replace(profile, effects=(*profile.effects, tilt))
    said = float(np.exp(rng.uniform(np.log(0.002), np.log(0.02))))
    return Bench(replace(session, profile=profile), said)
