"""The virtual twin of a device: everything that a diagnosis found, as a device file.

    truth      bias and scale factor, fitted together with the effects
    noise      white noise of each axis, as it is in the windows
    effects    what the simulation had already, and what was found, as fitted
    climate    the temperature that was recorded

Times of a device file count from when the device is switched on; the session's start
takes the place of that. What the recording cannot tell stays as the session has it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.core.sampling import rate_of
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
"""Points of the temperature's course, and how close they may be."""

VIBRATION = "vibration_rectification"


def device_of(explanation: Explanation, found: Diagnosis, known: TwinState) -> Profile:
    """The device as a diagnosis knows it, with all that was found in it."""
    prepared = explanation.prepared
    start = float(prepared.source.block.t[0])
    effects = [*settled(known.state.terms, start), *of_earth(known.heading)]
    effects += known_random_effects(prepared.source.about)
    for tone in prepared.spectral_lines:
        effects += of_tone(tone, start)
    for one in found.effects:
        effects += of_samples(explanation, one, start)
    return device(explanation, known.state, _each_once(effects))


def device(
    explanation: Explanation, state: State, effects: list[SimulatedEffect]
) -> Profile:
    """The device with some calibration and some effects."""
    source = explanation.prepared.source
    about = source.about
    bias, loud = state.bias.copy(), 0.0
    noise = _noise(explanation, effects)
    for term in state.terms:
        if term.effect.id == VIBRATION:  # the catalogue's variance has the noise in it
            bias[:3] += term.values * explanation.rows.x.variance.min(axis=0)
            loud = float(vibration(explanation).max(initial=0.0))
    effects = [_levelled(e, loud) if e.id == VIBRATION else e for e in effects]
    name, serial = (str(about.device.get(k, "")) for k in ("name", "serial"))
    return Profile(
        device=Identity(
            f"twin of {name or 'a device'}",
            serial or "SIM-1",
            about.grade,
        ),
        sampling=Sampling(float(f"{rate_of(source.block):.9g}")),
        site=Site(
            about.latitude_deg,
            about.height_m,
            about.gravity + float(about.under_way.force[1]),
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
        temperature=climate(source.warmth, float(source.block.t[0])),
        effects=tuple(effects),
    )


def settled(terms: Sequence[Term], start: float) -> list[SimulatedEffect]:
    """Effects with an equation, with their values; those of one shape are one."""
    total: dict[tuple[str, tuple[tuple[str, float], ...]], Term] = {}
    for term in terms:
        key = (term.effect.id, tuple(term.shape.items()))
        more = total[key].values if key in total else 0.0
        total[key] = replace(term, values=term.values + more)
    out = []
    for term in total.values():
        given = _numbers(term.effect, term.values)
        if given or not term.effect.params:
            given |= _counted(term.shape, start)
            out.append(vocabulary.effect(term.effect.id, given))
    return out


def of_earth(heading: float | None) -> Iterator[SimulatedEffect]:
    """The Earth's rate as a fixture of some heading, rad, feels it, if it does."""
    if heading is not None:
        yield vocabulary.effect("earth_rate", {})
        if heading:
            psi = float(np.rad2deg(heading))
            yield vocabulary.effect("heading_error", {"psi_deg": psi})


def known_random_effects(about: Description) -> Iterator[SimulatedEffect]:
    """Random effects and those on samples that the simulation has already."""
    for name, given in about.model.items():
        if isinstance(catalogue()[name], Scatter | Chain):
            yield vocabulary.effect(name, given)


def of_tone(tone: SpectralLine, start: float) -> Iterator[SimulatedEffect]:
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
        yield vocabulary.effect(tone.effect.id, given)


def of_samples(
    explanation: Explanation, found: FoundEffect, start: float
) -> Iterator[SimulatedEffect]:
    """What is random, and what happened to samples."""
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
    yield vocabulary.effect(found.id, _counted(given, start))


def climate(warmth: Thermometer, start: float) -> Climate:
    """The course of the temperature, in as many points as it is known to."""
    if not np.isfinite(warmth.start_c):
        return Climate(self_heating_k=0.0)
    long = np.ptp(warmth.t) > 1.0
    count = int(np.clip(np.ptp(warmth.t) / POINT_S, 2, POINTS)) if long else 1
    when = np.linspace(warmth.t[0], warmth.t[-1], count)
    degrees = warmth.start_c + warmth.at(when)[0]
    points = zip((when - start).tolist(), degrees.tolist(), strict=True)
    return Climate(points=tuple(points), self_heating_k=0.0)


def vibration(explanation: Explanation) -> Array:
    """Vibration in each position beyond the quietest window, (p,) m/s^2 rms."""
    x, scale = explanation.rows.x, explanation.state.scale[:3]
    more = (x.variance - x.variance.min(axis=0)) / scale**2
    out = np.zeros(explanation.dictionary.places)
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
    thermometer = explanation.prepared.source.warmth.noise
    return NoiseFigures(
        acc=_triad(noise[:3]),
        gyr=_triad(noise[3:]),
        acc_instability=still,
        gyr_instability=still,
        temperature=thermometer if np.isfinite(thermometer) else 0.0,
    )


def _numbers(effect: Effect, values: Array) -> dict[str, Any]:
    """Parameters that are not zero."""
    names = [p.name for p in effect.params]
    return {n: float(v) for n, v in zip(names, values, strict=True) if v}


def _counted(given: Mapping[str, Any], start: float) -> dict[str, Any]:
    """With instants counted from the session's start."""
    return {k: v - start if k in INSTANTS else v for k, v in given.items()}


def _levelled(effect: SimulatedEffect, level: float) -> SimulatedEffect:
    return vocabulary.effect(effect.id, {**effect.parameters, "level": level})


def _each_once(
    effects: list[SimulatedEffect],
) -> list[SimulatedEffect]:
    """With several of what cannot be there twice put together: the last one counts."""
    out: dict[object, SimulatedEffect] = {}
    for i, one in enumerate(effects):
        again = one.REPEATS and one.id != "earth_rate"
        out[(one.id, i) if again else one.id] = one
    return list(out.values())


def _triad(values: Array) -> Triad:
    x, y, z = (float(v) for v in values)
    return x, y, z
