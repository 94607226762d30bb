"""What the sensors of a simulator are to have, in numbers that any format can take.

    new = present + (recording - simulator)                                         (1)

in what differs, and nothing else: what agrees is left as it is. At first the present
state is what the simulator showed; once it was patched, what the patch said, so that
what a simulator has beyond its parameters is made up for as well.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fieldcal.against.result import Difference, Facts, Match
from fieldcal.core.samples import CHANNELS, Array
from fieldcal.effects import catalogue

CALIBRATION = ("acc_bias", "acc_scale", "gyr_bias", "gyr_scale")
NEUTRAL = {"acc_bias": 0.0, "acc_scale": 1.0, "gyr_bias": 0.0, "gyr_scale": 1.0}

LINEAR = ("cross_coupling", "gyro_cross_coupling", "gyro_scale")
"""Effects that are elements of a matrix beside the scale factors."""

TRIADS = {"acc": LINEAR[:1], "gyr": LINEAR[1:]}
"""The same by triad."""

INSTANTS = ("at_s", "from_s", "to_s")
"""Parameters that are instants of device time."""

Values = Mapping[str, float | str]


@dataclass(frozen=True)
class SensorModel:
    """Sensors as they are to be: U = bias + matrix f, and effects.

    Attributes
    ----------
    calibration : (3,) by group, where it is to be changed
    noise : by channel, standard deviation of a sample, m/s^2 and rad/s, likewise
    effects : parameters by id; those of what is to be taken out are 0, and instants
        count from the first sample
    shown : the same of what is not to be changed, as the simulator shows it: formats
        need it where one element of a file holds several things
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
        """Ids of all that it changes."""
        noise = ("noise",) if self.noise else ()
        return (*self.calibration, *noise, *self.effects)

    def group(self, name: str) -> Array:
        """A group of the calibration; that of a perfect sensor where it is not said."""
        if name not in self.calibration and self.shown is not None:
            return self.shown.group(name)
        return self.calibration.get(name, np.full(3, NEUTRAL[name]))

    def level(self, channel: str) -> float:
        """Noise of a channel; none where nothing is known of it."""
        if channel not in self.noise and self.shown is not None:
            return self.shown.level(channel)
        return self.noise.get(channel, 0.0)

    def matrix(self, triad: str) -> Array:
        """Scale factors and cross-coupling of "acc" or "gyr", (3, 3)."""
        out = np.diag(self.group(f"{triad}_scale"))
        for effect in TRIADS[triad]:
            for name, value in self._values(effect).items():
                row, column = int(name[1]) - 1, int(name[-1]) - 1  # k12, s3
                out[row, column] += float(value)
        return out

    def number(self, effect: str, name: str) -> float:
        """A parameter of an effect, 0 where it has none."""
        return float(self._values(effect).get(name, 0.0))

    def _values(self, effect: str) -> Values:
        if effect not in self.effects and self.shown is not None:
            return self.shown.effects.get(effect, {})
        return self.effects.get(effect, {})


def patched(found: Match, present: SensorModel | None = None) -> SensorModel:
    """The sensors that make a simulator like the recording (1).

    Parameters
    ----------
    found : a comparison
    present : what the simulator was last patched with; nothing at first

    """
    out = present or SensorModel()
    out = replace(out, rate_hz=found.real.rate_hz, start_c=found.real.start_c)
    if out.shown is None:
        out = replace(out, shown=_shown(found.simulator))
    for one in found.differences:
        if one.id in CALIBRATION:
            out = _with_calibration(out, one)
        elif one.id == "noise":
            out = _with_noise(out, one)
        elif one.id in catalogue():
            out = _with_effect(out, one, found)
    return out


def _shown(simulator: Facts) -> SensorModel:
    """What a simulator shows of itself."""
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
            name: {n: q.value for n, q in values.items()}
            for name, values in simulator.effects.items()
        },
    )


def _with_calibration(model: SensorModel, one: Difference) -> SensorModel:
    """A group, axis by axis."""
    known = model.calibration.get(one.id)
    value = np.full(3, NEUTRAL[one.id]) if known is None else known.copy()
    for axis, pair in one.parameters.items():
        i = "xyz".index(axis)
        before = value[i] if known is not None else _number(pair.simulator)
        value[i] = before + float(pair.difference.value)
    return replace(model, calibration={**model.calibration, one.id: value})


def _with_noise(model: SensorModel, one: Difference) -> SensorModel:
    """Noise: variances add up."""
    noise = dict(model.noise)
    for channel, pair in one.parameters.items():
        real, sim = (_number(q) for q in (pair.real, pair.simulator))
        before = noise.get(channel, sim)
        noise[channel] = float(np.sqrt(max(before**2 + real**2 - sim**2, 0.0)))
    order = {c: noise[c] for c in CHANNELS if c in noise}
    return replace(model, noise=order)


def _with_effect(model: SensorModel, one: Difference, found: Match) -> SensorModel:
    """An effect: its shape is the recording's, and what is a word as well."""
    shapes = {s.name for s in catalogue()[one.id].shapes}
    known = model.effects.get(one.id)
    values: dict[str, float | str] = dict(known or {})
    for name, pair in one.parameters.items():
        there = pair.real or pair.simulator
        if there is None:
            continue
        if name in {*shapes, *INSTANTS} or isinstance(there.value, str):
            values[name] = there.value
            if name in INSTANTS and not isinstance(there.value, str):
                clock = found.real if pair.real else found.simulator
                values[name] = there.value - clock.start_s
            continue
        before = _number(pair.simulator)
        if known is not None:
            before = float(known.get(name, 0.0))
        values[name] = before + float(pair.difference.value)
    return replace(model, effects={**model.effects, one.id: values})


def _number(quantity: object) -> float:
    """A quantity's value, 0 where it has none."""
    value = getattr(quantity, "value", 0.0)
    return 0.0 if isinstance(value, str) else float(value)


def told(name: str, values: Values, axes: Sequence[str] = ()) -> str:
    """An effect with its numbers, for the sentence that a format cannot hold it."""
    some = axes or tuple(values)
    parts = [
        f"{n} = {v}" if isinstance(v := values[n], str) else f"{n} = {v:.4g}"
        for n in some
    ]
    return f"{name} ({', '.join(parts)})" if parts else name
