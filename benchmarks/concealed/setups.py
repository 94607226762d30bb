"""Sessions of unusual set-ups: what moves the base, and how attitudes are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.concealed.draws import drawn, sized
from benchmarks.concealed.others import calm
from benchmarks.concealed.sessions import Session, plain
from fieldcal.sim_device.profile import Identity
from fieldcal.sim_device.vocabulary import checked_effect


def pier(rng: np.random.Generator) -> Session:
    """A base that sways irregularly about both level axes, as a ship at the pier."""
    session = calm(plain(rng))
    hz, azimuth = float(rng.uniform(0.1, 0.5)), float(rng.uniform(0, 180))
    both = []
    for turned in (0.0, 90.0):
        values = {
            "amplitude_deg": float(rng.uniform(0.4, 1.0)),
            "hz": hz * float(rng.uniform(0.8, 1.2)),
            "spread_hz": float(rng.choice([0.0, 0.1])) * hz,
            "azimuth_deg": azimuth + turned,
            "phase_deg": float(rng.uniform(0, 360)),
        }
        both.append(values)
    one = session.profile
    swaying = tuple(checked_effect("sway", values) for values in both)
    profile = replace(one, effects=(*one.effects, *swaying))
    return replace(session, profile=profile, concealed={"sway": {}}, label="pier")


def pier_by_force(rng: np.random.Generator) -> Session:
    """The same of a device without gyroscopes."""
    return replace(pier(rng), gyroscopes=False, label="pier, no gyroscopes")


def under_way(rng: np.random.Generator) -> Session:
    """Nothing concealed, on a base whose velocity over the Earth is said.

    Of navigation grade: tactical grade knows no north, and finds Coriolis as a tilt.
    """
    session = calm(plain(rng))
    one = session.profile
    north, east = (float(v) for v in rng.uniform(-100, 100, 2))
    profile = replace(
        one,
        site=replace(one.site, north_m_s=north, east_m_s=east),
        noise=replace(one.noise, gyr=(10 ** rng.uniform(-4.5, -4),) * 3),
        device=Identity(grade="navigation"),
        effects=(),
    )
    return replace(session, profile=profile, label="nothing")


def table_of_known_speed(rng: np.random.Generator) -> Session:
    """Nothing concealed, on a table about an axis that nobody knows; twice at rest."""
    session = calm(plain(rng, ("table",)))
    windows = tuple(
        w if i < len(session.windows) - 2 else replace(w, rate=(0.0, 0.0, 0.0))
        for i, w in enumerate(session.windows)
    )
    return replace(session, windows=windows, speeds=True, label="nothing, speeds")


def any_attitude(rng: np.random.Generator, sigmas: float) -> Session:
    """An effect of the accelerometers; any attitudes, each told as one finite turn."""
    session = calm(plain(rng, ("twelve", "wide")))
    third = rng.uniform(-np.pi, np.pi, len(session.windows)).tolist()
    windows = tuple(
        replace(w, gamma=gamma) for w, gamma in zip(session.windows, third, strict=True)
    )
    session = replace(session, windows=windows)
    name = str(rng.choice(["cross_coupling", "quadratic", "base_tilt"]))
    values = sized(session, name, drawn(name, rng, session.windows[-1].end), sigmas)
    if values is None:
        return any_attitude(rng, sigmas)
    told = replace(session.having({name: values}), attitudes=True)
    return replace(told, label="any attitude", sigmas=sigmas)
