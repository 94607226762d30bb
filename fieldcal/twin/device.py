"""The virtual twin of a device: the result of a diagnosis, as a device file.

    truth      bias and scale factor, fitted together with the effects
    noise      white noise of each axis in the windows
    effects    those of the simulation, and those found, with their fitted values
    climate    the recorded temperature

Times of a device file count from switching on, which is taken as the session's start.
Facts that the recording does not determine are those of session.toml.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.core.sampling import sampling_rate
from fieldcal.diagnosis import Diagnosis
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.result import FoundEffect
from fieldcal.diagnosis.signal.line import SpectralLine
from fieldcal.effects import catalogue
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.model.state import State, Term
from fieldcal.physics.effect import Chain, Effect, Scatter
from fieldcal.physics.recording import lsb_of
from fieldcal.session.description import Description
from fieldcal.session.site import MIDDLE_LATITUDE_DEG
from fieldcal.sim_device import vocabulary
from fieldcal.sim_device.effect import SimulatedEffect
from fieldcal.sim_device.profile import (
    Climate,
    FullScale,
    Identity,
    MountingAxes,
    NoiseFigures,
    Profile,
    Sampling,
    Site,
    Triad,
    Truth,
)
from fieldcal.twin.physical import TwinState

INSTANTS = ("at_s", "from_s", "to_s")
"""Parameters that are instants of device time."""

WORDS = 32_768
"""Steps from zero to full scale of a 16-bit word."""

SHOWN_UNITS = ("g", "mg", "deg/s", "mrad/s")
POINT_S = 20.0
POINTS = 200
"""Least distance and largest number of points of the temperature course."""

VIBRATION = "vibration_rectification"


def twin_profile(
    explanation: Explanation, found: Diagnosis, known: TwinState
) -> Profile:
    """Profile of the twin: the fitted state with all effects that were found."""
    prepared = explanation.prepared
    start = float(prepared.source.block.t[0])
    effects = [
        *effects_of_terms(known.state.terms, start),
        *earth_rate_effects(known.heading),
    ]
    effects += known_random_effects(prepared.source.about)
    for tone in prepared.spectral_lines:
        effects += line_effects(tone, start)
    for one in found.effects:
        effects += effects_on_samples(explanation, one, start)
    effects = _without_repeats(effects)
    return device_profile(explanation, known.state, effects, known.latitude)


def device_profile(
    explanation: Explanation,
    state: State,
    effects: list[SimulatedEffect],
    latitude: float,
) -> Profile:
    """Profile of a device with the calibration of a state and some effects.

    The latitude is in rad; nan if nobody knows it, and nothing depends on it.
    """
    source = explanation.prepared.source
    about = source.about
    bias, loud = state.bias.copy(), 0.0
    noise = _noise(explanation, effects)
    for term in state.terms:
        if term.effect.id == VIBRATION:  # the catalogue's variance has the noise in it
            bias[:3] += term.values * explanation.rows.x.variance.min(axis=0)
            loud = float(vibration_by_position(explanation).max(initial=0.0))
    effects = [_with_level(e, loud) if e.id == VIBRATION else e for e in effects]
    name, serial = (str(about.device.get(k, "")) for k in ("name", "serial"))
    return Profile(
        device=Identity(
            f"twin of {name or 'a device'}",
            serial or "SIM-1",
            about.grade,
        ),
        sampling=Sampling(float(f"{sampling_rate(source.block):.9g}")),
        site=Site(
            MIDDLE_LATITUDE_DEG if np.isnan(latitude) else float(np.rad2deg(latitude)),
            about.height_m,
            about.gravity + float(about.base_motion.force[1]),
            *about.velocity,
        ),
        frame=MountingAxes((about.axes[0], about.axes[1], about.axes[2])),
        range=FullScale(
            about.limits.get("acceleration"), about.limits.get("angular_rate")
        ),
        truth=Truth(
            _triad(bias[:3]),
            _triad(state.scale[:3]),
            _triad(bias[3:]),
            _triad(state.scale[3:]),
        ),
        noise=noise,
        temperature=temperature_course(source.thermometer, float(source.block.t[0])),
        effects=tuple(effects),
    )


def effects_of_terms(terms: Sequence[Term], start: float) -> list[SimulatedEffect]:
    """Simulated effects of terms; terms of one effect and shape are added."""
    total: dict[tuple[str, tuple[tuple[str, float], ...]], Term] = {}
    for term in terms:
        key = (term.effect.id, tuple(term.shape.items()))
        more = total[key].values if key in total else 0.0
        total[key] = replace(term, values=term.values + more)
    out = []
    for term in total.values():
        given = _nonzero_parameters(term.effect, term.values)
        if given or not term.effect.params:
            given |= _since_start(term.shape, start)
            out.append(vocabulary.checked_effect(term.effect.id, given))
    return out


def earth_rate_effects(heading: float | None) -> Iterator[SimulatedEffect]:
    """Simulated effects of the Earth's rate at a heading, rad; none without one."""
    if heading is not None:
        yield vocabulary.checked_effect("earth_rate", {})
        if heading:
            psi = float(np.rad2deg(heading))
            yield vocabulary.checked_effect("heading_error", {"psi_deg": psi})


def known_random_effects(about: Description) -> Iterator[SimulatedEffect]:
    """Random effects, and effects on samples, that the simulation has already."""
    for name, given in about.model.items():
        if isinstance(catalogue()[name], Scatter | Chain):
            yield vocabulary.checked_effect(name, given)


def line_effects(tone: SpectralLine, start: float) -> Iterator[SimulatedEffect]:
    """A line, one effect for each of its causes, with its phase at the start.

    Re(c exp(2 pi i hz t)) = |c| sin(2 pi hz (t - start) + phase)
    """
    phases = np.angle(tone.causes) + np.pi / 2 + 2 * np.pi * tone.hz * start
    for j, (size, phase) in enumerate(zip(np.abs(tone.causes), phases, strict=True)):
        given = {"hz": tone.hz, "phase_deg": float(np.rad2deg(phase) % 360)}
        if tone.effect.id == "sway":  # about x (East), about z (north)
            given |= {"amplitude_deg": float(size), "azimuth_deg": 90.0 * j}
        elif tone.effect.params[j].name not in tone.values:
            continue
        else:
            given[tone.effect.params[j].name] = float(size)
        yield vocabulary.checked_effect(tone.effect.id, given)


def effects_on_samples(
    explanation: Explanation, found: FoundEffect, start: float
) -> Iterator[SimulatedEffect]:
    """Simulated effect of a found random effect, or of a found fault of samples."""
    kind = catalogue()[found.id]
    if not isinstance(kind, Scatter | Chain):
        return
    given: dict[str, Any] = {n: q.value for n, q in found.parameters.items()}
    if given.get("unit", "g") not in SHOWN_UNITS:
        return
    if found.id == "decode_fault":
        channel = CHANNELS.index(str(given["channel"]))
        block = explanation.prepared.source.block
        given["full_scale"] = WORDS * lsb_of(block.six[:, channel])
    yield vocabulary.checked_effect(found.id, _since_start(given, start))


def temperature_course(warmth: Thermometer, start: float) -> Climate:
    """The recorded course of the temperature, in a limited number of points."""
    if not np.isfinite(warmth.start_c):
        return Climate(self_heating_k=0.0)
    long = np.ptp(warmth.t) > 1.0
    count = int(np.clip(np.ptp(warmth.t) / POINT_S, 2, POINTS)) if long else 1
    when = np.linspace(warmth.t[0], warmth.t[-1], count)
    degrees = warmth.start_c + warmth.at(when)[0]
    points = zip((when - start).tolist(), degrees.tolist(), strict=True)
    return Climate(points=tuple(points), self_heating_k=0.0)


def vibration_by_position(explanation: Explanation) -> Array:
    """Vibration in each position beyond the quietest window, (p,) m/s^2 rms."""
    x, scale = explanation.rows.x, explanation.state.scale[:3]
    more = (x.variance - x.variance.min(axis=0)) / scale**2
    out = np.zeros(explanation.dictionary.position_count)
    out[x.position] = np.sqrt(np.maximum(more, 0.0).mean(axis=1))
    return out


def _noise(explanation: Explanation, effects: list[SimulatedEffect]) -> NoiseFigures:
    """White noise before what the signal chain adds to it."""
    noise = np.nan_to_num(explanation.rows.noise)
    for one in effects:
        if one.id == "quantisation":
            steps = np.repeat([one["acc"], one["gyr"]], 3)
            noise = np.sqrt(np.maximum(noise**2 - steps**2 / 12, 0.0))
        if one.id == "noise_level":
            noise[CHANNELS.index(one.words["channel"])] /= one["ratio"]
    still = (0.0, 0.0, 0.0)
    thermometer = explanation.prepared.source.thermometer.noise
    return NoiseFigures(
        acc=_triad(noise[:3]),
        gyr=_triad(noise[3:]),
        acc_instability=still,
        gyr_instability=still,
        temperature=thermometer if np.isfinite(thermometer) else 0.0,
    )


def _nonzero_parameters(effect: Effect, values: Array) -> dict[str, Any]:
    """Parameters that are not zero."""
    names = [p.name for p in effect.params]
    return {n: float(v) for n, v in zip(names, values, strict=True) if v}


def _since_start(given: Mapping[str, Any], start: float) -> dict[str, Any]:
    """Parameters with instants counted from the session's start."""
    return {k: v - start if k in INSTANTS else v for k, v in given.items()}


def _with_level(effect: SimulatedEffect, level: float) -> SimulatedEffect:
    return vocabulary.checked_effect(effect.id, {**effect.parameters, "level": level})


def _without_repeats(
    effects: list[SimulatedEffect],
) -> list[SimulatedEffect]:
    """Keep only the last one of effects that a device cannot have twice."""
    out: dict[object, SimulatedEffect] = {}
    for i, one in enumerate(effects):
        again = one.REPEATS and one.id != "earth_rate"
        out[(one.id, i) if again else one.id] = one
    return list(out.values())


def _triad(values: Array) -> Triad:
    x, y, z = (float(v) for v in values)
    return x, y, z
