"""The sensor model that a simulator should have, independent of any format.

    new = present + (recording - simulator)                                         (1)

for everything that differs; the rest is unchanged. The first present values are those
that the simulator showed. Later they are those of the last patch, so that errors of the
simulator beyond its parameters are compensated, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fieldcal.against.result import Difference, Facts, Match
from fieldcal.core.samples import CHANNELS, Array
from fieldcal.diagnosis.result import Quantity
from fieldcal.effects import catalogue

CALIBRATION = ("acc_bias", "acc_scale", "gyr_bias", "gyr_scale")
NEUTRAL = {"acc_bias": 0.0, "acc_scale": 1.0, "gyr_bias": 0.0, "gyr_scale": 1.0}

LINEAR = ("cross_coupling", "gyro_cross_coupling", "gyro_scale")
"""Effects that are elements of a matrix beside the scale factors."""

TRIADS = {"acc": LINEAR[:1], "gyr": LINEAR[1:]}
"""The same, by triad."""

INSTANTS = ("at_s", "from_s", "to_s")
"""Parameters that are instants of device time."""

Values = Mapping[str, float | str]


@dataclass(frozen=True)
class SensorModel:
    """Sensors of a simulator: U = bias + matrix f, and effects.

    Attributes
    ----------
    calibration : (3,) by group, only where it is to be changed
    noise : by channel, standard deviation of a sample, m/s^2 and rad/s; only where it
        is to be changed
    effects : parameters by id; those of effects to be removed are 0, and instants are
        counted from the first sample
    shown : the model that the simulator shows, for all that is not changed; formats
        need it where one element of a file holds several parameters
    rate_hz : samples a second
    start_c : temperature at which the biases hold, deg C; nan where unknown

    """

    calibration: Mapping[str, Array] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)
    effects: Mapping[str, Values] = field(default_factory=dict)
    shown: SensorModel | None = None
    rate_hz: float = np.nan
    start_c: float = np.nan

    @property
    def changed(self) -> tuple[str, ...]:
        """Ids of everything that is to be changed."""
        noise = ("noise",) if self.noise else ()
        return (*self.calibration, *noise, *self.effects)

    def group(self, name: str) -> Array:
        """A group of the calibration; of a perfect sensor where it is unknown."""
        if name not in self.calibration and self.shown is not None:
            return self.shown.group(name)
        return self.calibration.get(name, np.full(3, NEUTRAL[name]))

    def level(self, channel: str) -> float:
        """Noise of a channel; 0 where it is unknown."""
        if channel not in self.noise and self.shown is not None:
            return self.shown.level(channel)
        return self.noise.get(channel, 0.0)

    def knows_noise(self, triad: str) -> bool:
        """Whether the noise of "acc" or "gyr" is known, of this model or as shown."""
        if any(channel[0] == triad[0] for channel in self.noise):
            return True
        return self.shown is not None and self.shown.knows_noise(triad)

    def matrix(self, triad: str) -> Array:
        """Scale factors and cross-coupling of "acc" or "gyr", (3, 3)."""
        out = np.diag(self.group(f"{triad}_scale"))
        for effect in TRIADS[triad]:
            for name, value in self.parameters(effect).items():
                row, column = int(name[1]) - 1, int(name[-1]) - 1  # k12, s3
                out[row, column] += float(value)
        return out

    def assumed(self, ids: Sequence[str]) -> list[str]:
        """Ids, of calibration or effects, that neither patch nor simulator shows.

        Where an element of a file holds them, it has the value of a perfect sensor.
        """
        known = {*self.calibration, *self.effects}
        if self.shown is not None:
            known |= {*self.shown.calibration, *self.shown.effects}
        return [one for one in ids if one not in known]

    def number(self, effect: str, name: str) -> float:
        """A parameter of an effect; 0 where it is absent."""
        return float(self.parameters(effect).get(name, 0.0))

    def parameters(self, effect: str) -> Values:
        """Parameters of an effect; empty where it is unknown."""
        if effect not in self.effects and self.shown is not None:
            return self.shown.effects.get(effect, {})
        return self.effects.get(effect, {})


def patch_model(found: Match, present: SensorModel | None = None) -> SensorModel:
    """The sensor model with which the simulator matches the recording (1).

    Parameters
    ----------
    found : a comparison
    present : the last patch of the simulator; None at first

    """
    out = present or SensorModel()
    out = replace(out, rate_hz=found.real.rate_hz, start_c=found.real.start_c)
    if out.shown is None:
        out = replace(out, shown=_model_of_simulator(found.simulator))
    for one in found.differences:
        if one.id in CALIBRATION:
            out = _with_calibration(out, one)
        elif one.id == "noise":
            out = _with_noise(out, one)
        elif one.id in catalogue():
            out = _with_effect(out, one, found)
    return out


def _model_of_simulator(simulator: Facts) -> SensorModel:
    """The sensor model that a simulator shows."""
    calibration = {
        name: np.array(
            [_number(axes[i]) if i in axes else NEUTRAL[name] for i in "xyz"]
        )
        for name, axes in simulator.calibration.items()
    }
    return SensorModel(
        calibration,
        {channel: _number(q) for channel, q in simulator.noise.items()},
        {
            name: {n: _value(n, q, simulator) for n, q in values.items()}
            for name, values in simulator.effects.items()
        },
    )


def _with_calibration(model: SensorModel, one: Difference) -> SensorModel:
    """Change a group of the calibration, axis by axis."""
    value, patched = model.group(one.id).copy(), one.id in model.calibration
    for axis, pair in one.parameters.items():
        i = "xyz".index(axis)
        before = value[i] if patched else _number(pair.simulator)
        value[i] = before + float(pair.difference.value)
    return replace(model, calibration={**model.calibration, one.id: value})


def _with_noise(model: SensorModel, one: Difference) -> SensorModel:
    """Change the noise; variances add up."""
    noise = dict(model.noise)
    for channel, pair in one.parameters.items():
        real, sim = (_number(q) for q in (pair.real, pair.simulator))
        before = noise.get(channel, sim)
        noise[channel] = float(np.sqrt(max(before**2 + real**2 - sim**2, 0.0)))
    order = {c: noise[c] for c in CHANNELS if c in noise}
    return replace(model, noise=order)


def _with_effect(model: SensorModel, one: Difference, found: Match) -> SensorModel:
    """Change an effect; its shapes and words are taken from the recording."""
    shapes = {s.name for s in catalogue()[one.id].shapes}
    known = model.effects.get(one.id)
    values: dict[str, float | str] = dict(model.parameters(one.id))
    for name, pair in one.parameters.items():
        there = pair.real or pair.simulator
        if there is None:
            continue
        if name in {*shapes, *INSTANTS} or isinstance(there.value, str):
            values[name] = _value(
                name, there, found.real if pair.real else found.simulator
            )
            continue
        before = _number(pair.simulator)
        if known is not None:
            before = float(known.get(name, 0.0))
        values[name] = before + float(pair.difference.value)
    return replace(model, effects={**model.effects, one.id: values})


def _value(name: str, quantity: Quantity, recording: Facts) -> float | str:
    """A parameter's value; an instant counts from the first sample."""
    if name in INSTANTS and not isinstance(quantity.value, str):
        return quantity.value - recording.start_s
    return quantity.value


def _number(quantity: object) -> float:
    """A quantity's value; 0 if it is absent or a text."""
    value = getattr(quantity, "value", 0.0)
    return 0.0 if isinstance(value, str) else float(value)


def effect_with_values(name: str, values: Values, axes: Sequence[str] = ()) -> str:
    """An effect with its values, for a sentence about what a format cannot hold."""
    some = axes or tuple(values)
    parts = [
        f"{n} = {v}" if isinstance(v := values[n], str) else f"{n} = {v:.4g}"
        for n in some
    ]
    return f"{name} ({', '.join(parts)})" if parts else name
