"""What the sensors put out beyond bias, scale factor and noise.

Each function takes the effect and what the device lives through, and returns what the
effect adds to the outputs, (3, n) for one triad or (6, n) for both; device axes,
m/s^2 and rad/s. Coefficients are named as in the catalogue of effects. f is the
specific force in m/s^2, w the angular rate in rad/s, i the sensor:

    cross_coupling        sum_(j != i) k_ij f_j
    gyro_cross_coupling   sum_(j != i) s_ij w_j
    gyro_scale            s_i w_i
    quadratic             k_i f_i^2
    cubic                 k_i f_i^3
    scale_asymmetry       k_i |f_i|
    pendulous_products    l_i1 fx fy + l_i2 fy fz + l_i3 fx fz
    g_sensitivity         sum_j g_ij f_j           (gyroscopes)
    g2_sensitivity        q_i f_i^2                (gyroscopes)
    gyro_products         p_i1 wx wy + p_i2 wy wz + p_i3 wx wz
    temperature_bias      c_i (T - T0)
    temperature_scale     k_i (T - T0) f_i
    thermal_hysteresis    h_i dT/dt
    warm_up               a_i exp(-t / tau)
    bias_drift            d_i t
    bias_step             s_i from the instant at on
    settling              a_i exp(-(t - end of the turn) / tau), building up in the turn
    hum                   a_i sin(2 pi hz t + phase)
    vibration_rectification   v_i u_i^2, u the vibration
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.profile import Truth
from fieldcal.sim_device.vocabulary import AXES, SIX, SimulatedEffect


@dataclass(frozen=True, slots=True)
class Life:
    """What the device lives through at n instants.

    Attributes
    ----------
    t : (n,) s since it was switched on
    f, w : (3, n) true specific force and angular rate, device axes
    warmth : (n,) temperature less that at the start, K
    warming : (n,) rate of the temperature, K/s
    since : (n,) s since the last turn ended, negative in a turn, inf before any
    progress : (n,) share of the last turn that has passed
    vibration : (3, n) vibration about `f`, m/s^2

    """

    t: Array
    f: Array
    w: Array
    warmth: Array
    warming: Array
    since: Array
    progress: Array
    vibration: Array


def outputs(truth: Truth, effects: tuple[SimulatedEffect, ...], life: Life) -> Array:
    """Outputs of the six channels without noise, (6, n)."""
    felt = life.f + life.vibration
    acc = _column(truth.acc_bias) + _column(truth.acc_scale) * felt
    gyr = _column(truth.gyr_bias) + _column(truth.gyr_scale) * life.w
    for effect in effects:
        if effect.id in ACC:
            acc = acc + ACC[effect.id](effect, life)
        elif effect.id in GYR:
            gyr = gyr + GYR[effect.id](effect, life)
        elif effect.id in BOTH:
            more = BOTH[effect.id](effect, life)
            acc, gyr = acc + more[:3], gyr + more[3:]
    return np.concatenate([acc, gyr])


def _column(values: tuple[float, ...]) -> Array:
    return np.array(values)[:, None]


def _matrix(effect: SimulatedEffect, letter: str, v: Array) -> Array:
    """Coefficients ``<letter>ij``, absent ones zero, times a vector (3, n)."""
    rows = []
    for i in "123":
        row = np.zeros_like(v[0])
        for j in "123":
            row = row + effect.numbers.get(f"{letter}{i}{j}", 0.0) * v[int(j) - 1]
        rows.append(row)
    return np.stack(rows)


def _pairs(v: Array) -> Array:
    return np.stack([v[0] * v[1], v[1] * v[2], v[0] * v[2]])


def _xyz(effect: SimulatedEffect) -> Array:
    return _column(effect.vector(AXES))


def _six(effect: SimulatedEffect) -> Array:
    return _column(effect.vector(SIX))


def _settling(effect: SimulatedEffect, life: Life) -> Array:
    after = np.exp(-np.maximum(life.since, 0.0) / effect["tau_s"])
    turned = np.where(life.progress > 0, 1.0, 0.0)
    left: Array = turned * np.where(life.since < 0, life.progress, after)
    return _six(effect) * left


def _hum(effect: SimulatedEffect, life: Life) -> Array:
    phase = 2 * np.pi * effect["hz"] * life.t + np.deg2rad(effect["phase_deg"])
    wave: Array = np.sin(phase)
    return _six(effect) * wave


Influence = Callable[[SimulatedEffect, Life], Array]

ACC: Mapping[str, Influence] = {
    "cross_coupling": lambda e, life: _matrix(e, "k", life.f),
    "quadratic": lambda e, life: _xyz(e) * life.f**2,
    "cubic": lambda e, life: _xyz(e) * life.f * life.f * life.f,
    "scale_asymmetry": lambda e, life: _xyz(e) * np.abs(life.f),
    "pendulous_products": lambda e, life: _matrix(e, "l", _pairs(life.f)),
    "temperature_scale": lambda e, life: _xyz(e) * life.warmth * life.f,
    "vibration_rectification": lambda e, life: _xyz(e) * life.vibration**2,
}
GYR: Mapping[str, Influence] = {
    "gyro_cross_coupling": lambda e, life: _matrix(e, "s", life.w),
    "gyro_scale": lambda e, life: _column(e.vector(("s1", "s2", "s3"))) * life.w,
    "g_sensitivity": lambda e, life: _matrix(e, "g", life.f),
    "g2_sensitivity": lambda e, life: _xyz(e) * life.f**2,
    "gyro_products": lambda e, life: _matrix(e, "p", _pairs(life.w)),
}
BOTH: Mapping[str, Influence] = {
    "temperature_bias": lambda e, life: _six(e) * life.warmth,
    "thermal_hysteresis": lambda e, life: _six(e) * life.warming,
    "warm_up": lambda e, life: _six(e) * np.exp(-life.t / e["tau_s"]),
    "bias_drift": lambda e, life: _six(e) * life.t,
    "bias_step": lambda e, life: _six(e) * np.where(life.t >= e["at_s"], 1.0, 0.0),
    "settling": _settling,
    "hum": _hum,
}
