"""Effects that the samples themselves show: lines, and faults of the signal chain."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fieldcal.core.samples import CHANNELS
from fieldcal.diagnosis.result import FoundEffect, Quantity
from fieldcal.diagnosis.signal.line import SpectralLine
from fieldcal.effects import catalogue
from fieldcal.physics.recording import Fault


def effect_of_line(tone: SpectralLine, gained: float) -> FoundEffect:
    """The effect of a line in the spectrum."""
    values = {
        n: Quantity(v, tone.sigmas[n], tone.effect.unit(n))
        for n, v in tone.values.items()
    }
    evidence = {"delta_chi2": tone.chi2, "held_out_gain": gained}
    return FoundEffect(tone.effect.id, values, evidence=evidence)


def effects_of_faults(faults: Sequence[tuple[str, Fault]]) -> Iterator[FoundEffect]:
    """Effects on samples; quantisation of both triads is reported once."""
    steps: dict[str, Quantity] = {}
    for name, fault in faults:
        if not fault.values:
            continue
        effect = catalogue()[name]
        units = {p.name: p.unit for p in effect.params}
        units |= {s.name: s.unit for s in effect.shapes}
        values = {
            n: Quantity(v, fault.sigmas.get(n), _unit_of_value(n, fault, units))
            for n, v in fault.values.items()
        }
        if name == "quantisation":
            steps |= values
            continue
        yield FoundEffect(name, values, evidence={"delta_chi2": fault.sigma**2})
    if steps:
        yield FoundEffect("quantisation", steps)


def _unit_of_value(name: str, fault: Fault, units: dict[str, str]) -> str:
    if name == "limit":
        return "m/s^2" if fault.channel in CHANNELS[:3] else "rad/s"
    if name == "needed_s":  # of a window
        return "s"
    return units.get(name, "1")
