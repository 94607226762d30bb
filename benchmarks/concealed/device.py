"""A device with concealed physics, sample by sample.

Every effect is written out here from its physics in the time domain, apart from the
catalogue that the diagnosis fits with. What is concealed is a mapping from an id to
numbers; ids that begin with "outside" are not in the catalogue.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.concealed import motion
from benchmarks.concealed.motion import EARTH, Trip, Vector

Concealed = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Device:
    """A device and its place; noise densities in m/s^2/sqrt(Hz) and rad/s/sqrt(Hz)."""

    rate_hz: float = 50.0
    acc_density: float = 2e-3
    gyr_density: float = 1.5e-4
    acc_bias: tuple[float, ...] = (-0.3, 0.15, 0.07)
    acc_scale: tuple[float, ...] = (0.993, 1.008, 1.001)
    gyr_bias: tuple[float, ...] = (-0.004, 0.012, 0.02)
    nominal_off: tuple[float, ...] = (0.03, 0.01, -0.02)
    latitude_deg: float = 49.84
    gravity: float = 9.80966
    grade: str = "tactical"
    mounting: tuple[str, ...] = ("+x", "+y", "+z")
    wander: float = 0.0
    start_c: float = 24.0
    ramp_k: float = 0.0
    ramp_s: float = 150.0
    cycle_s: float = 0.0
    columns: tuple[str, ...] = ("gyr", "temperature")
    angles_known: bool = True


@dataclass
class World:
    """What is put together while a recording is made."""

    device: Device
    trip: Trip
    rng: np.random.Generator
    t: Vector
    path: motion.Path
    f: Vector
    w: Vector
    w_dot: Vector
    warm: Vector
    acc: Vector = field(default_factory=lambda: np.empty(0))
    gyr: Vector = field(default_factory=lambda: np.empty(0))

    def inside(self, i: int) -> NDArray[np.bool_]:
        """Samples of a window."""
        start, end = self.trip.windows[i]
        return (self.t >= start) & (self.t < end)


def vec(values: Mapping[str, Any], names: str) -> Vector:
    """Three numbers by their names, zero where not given."""
    return np.array([float(values.get(n, 0.0)) for n in names.split()])


def matrix(values: Mapping[str, Any], letter: str) -> Vector:
    """Three rows of three by names such as k12."""
    rows = [[values.get(f"{letter}{i}{j}", 0.0) for j in "123"] for i in "123"]
    return np.array(rows, dtype=float)


def record(
    device: Device, trip: Trip, concealed: Concealed, rng: np.random.Generator
) -> tuple[dict[str, Vector], dict[str, Any]]:
    """Columns of the samples, and the tables of session.toml."""
    world = _carried(device, trip, concealed, rng)
    _sensed(world, concealed)
    columns = _sampled(world, concealed)
    return columns, _session(device, trip, concealed)


def _carried(
    device: Device, trip: Trip, concealed: Concealed, rng: np.random.Generator
) -> World:
    t = np.arange(int(round(trip.length_s * device.rate_hz))) / device.rate_hz
    late = float(concealed.get("time_delay", {}).get("seconds", 0.0))
    angles = np.deg2rad(trip.positions)
    scale = concealed.get("angle_scale", {})
    angles = angles * (1 + vec(scale, "alpha beta"))
    offset = concealed.get("angle_offset", {})
    angles = angles + np.deg2rad(vec(offset, "alpha0_deg beta0_deg"))
    setting = concealed.get("angle_setting", {}).get("sigma_deg", 0.0)
    angles = angles + np.deg2rad(setting) * rng.standard_normal(angles.shape)
    f, _, _, path = _moved(device, trip, concealed, angles, t)
    _, w, w_dot, _ = _moved(device, trip, concealed, angles, t - late)
    lever = vec(concealed.get("lever_arm", {}), "x y z")
    _, w_now, w_dot_now, _ = _moved(device, trip, concealed, angles, t, earth=False)
    f = f + np.cross(w_now, np.cross(w_now, lever)) + np.cross(w_dot_now, lever)
    for i, (start, end) in enumerate(trip.windows):
        if (rate := trip.rate(i)) is not None:
            table = np.deg2rad(rate) @ _mounting(device)
            w[(t >= start) & (t < end)] += table
    warm = device.ramp_k * (1 - np.exp(-t / device.ramp_s))
    if device.cycle_s:
        warm = device.ramp_k * np.sin(2 * np.pi * t / device.cycle_s)
    return World(device, trip, rng, t, path, f, w, w_dot, warm)


def _mounting(device: Device) -> Vector:
    out = np.zeros((3, 3))
    for row, name in enumerate(device.mounting):
        out[row, "xyz".index(name[1])] = -1.0 if name[0] == "-" else 1.0
    return out


def _moved(
    device: Device,
    trip: Trip,
    concealed: Concealed,
    angles: Vector,
    t: Vector,
    earth: bool = True,
) -> tuple[Vector, Vector, Vector, motion.Path]:
    path = motion.follow(trip, angles, t)
    body = motion.matrices(path.alpha, path.beta)
    g = device.gravity * (1 + concealed.get("gravity_error", {}).get("relative", 0.0))
    lat = np.deg2rad(device.latitude_deg)
    psi = np.deg2rad(concealed.get("heading_error", {}).get("psi_deg", 0.0))
    north = np.array(
        [np.cos(lat) * np.sin(psi), -np.sin(lat), np.cos(lat) * np.cos(psi)]
    )
    seen = earth and (device.grade == "navigation" or "earth_rate" in concealed)
    tilt = concealed.get("base_tilt", {})
    base = motion.tilted(tilt.get("about_x_deg", 0.0), tilt.get("about_z_deg", 0.0))
    f_base = np.tile(base @ [0.0, -g, 0.0], (len(t), 1))
    w_base = np.tile(base @ (EARTH * seen * north), (len(t), 1))
    if (sway := concealed.get("sway")) is not None:
        axis = np.array(sway.get("axis", [1.0, 0.0, 0.0]))
        size, omega = np.deg2rad(sway["amplitude_deg"]), 2 * np.pi * sway["hz"]
        f_base = motion.small_turn(f_base, np.outer(size * np.cos(omega * t), axis))
        w_base = w_base - np.outer(size * omega * np.sin(omega * t), axis)
    w, w_dot = motion.rates(path)
    f = np.einsum("nij,nj->ni", body, f_base)
    w = w + np.einsum("nij,nj->ni", body, w_base)
    to_device = _mounting(device)
    return f @ to_device, w @ to_device, w_dot @ to_device, path


def _sensed(world: World, concealed: Concealed) -> None:
    """Outputs before noise."""
    d, f, w = world.device, world.f, world.w
    world.acc = np.array(d.acc_bias) + f * np.array(d.acc_scale)
    world.gyr = np.array(d.gyr_bias) + w
    for name, values in concealed.items():
        if (response := RESPONSES.get(name)) is not None:
            response(world, values)


def _cross(world: World, v: Mapping[str, Any]) -> None:
    world.acc += world.f @ matrix(v, "k").T


def _gyro_cross(world: World, v: Mapping[str, Any]) -> None:
    world.gyr += world.w @ matrix(v, "s").T


def _products(world: World, v: Mapping[str, Any]) -> None:
    x, y, z = world.f.T
    world.acc += np.column_stack([x * y, y * z, x * z]) @ matrix(v, "l").T


def _gyro_products(world: World, v: Mapping[str, Any]) -> None:
    x, y, z = world.w.T
    world.gyr += np.column_stack([x * y, y * z, x * z]) @ matrix(v, "p").T


def _along(world: World, v: Mapping[str, Any], course: Vector) -> None:
    world.acc += np.outer(course, vec(v, "ax ay az"))
    world.gyr += np.outer(course, vec(v, "gx gy gz"))


def _rectified(world: World, v: Mapping[str, Any]) -> None:
    for i in v["windows"]:
        inside = world.inside(i)
        shake = v["sd"] * world.rng.standard_normal((int(inside.sum()), 3))
        world.acc[inside] += shake + v["sd"] ** 2 * vec(v, "x y z")


def _hum(world: World, v: Mapping[str, Any]) -> None:
    _along(world, v, np.sin(2 * np.pi * v["hz"] * world.t + 0.4))


def _walk(world: World, v: Mapping[str, Any]) -> None:
    dt = 1 / world.device.rate_hz
    steps = world.rng.standard_normal((len(world.t), 6)) * np.sqrt(dt)
    walk = np.cumsum(steps, axis=0)
    world.acc += walk[:, :3] * vec(v, "ax ay az")
    world.gyr += walk[:, 3:] * vec(v, "gx gy gz")


def _outside(course: Any) -> Any:
    def add(world: World, v: Mapping[str, Any]) -> None:
        outputs = world.acc if v["channel"][0] == "a" else world.gyr
        outputs[:, "xyz".index(v["channel"][1])] += v["size"] * course(world, v)

    return add


RESPONSES: dict[str, Any] = {
    "cross_coupling": _cross,
    "gyro_cross_coupling": _gyro_cross,
    "gyro_scale": lambda o, v: o.gyr.__iadd__(o.w * vec(v, "s1 s2 s3")),
    "quadratic": lambda o, v: o.acc.__iadd__(o.f**2 * vec(v, "x y z")),
    "cubic": lambda o, v: o.acc.__iadd__(o.f**3 * vec(v, "x y z")),
    "scale_asymmetry": lambda o, v: o.acc.__iadd__(np.abs(o.f) * vec(v, "x y z")),
    "pendulous_products": _products,
    "g_sensitivity": lambda o, v: o.gyr.__iadd__(o.f @ matrix(v, "g").T),
    "g2_sensitivity": lambda o, v: o.gyr.__iadd__(o.f**2 * vec(v, "x y z")),
    "gyro_products": _gyro_products,
    "temperature_bias": lambda o, v: _along(o, v, o.warm),
    "temperature_scale": lambda o, v: o.acc.__iadd__(
        o.warm[:, None] * o.f * vec(v, "x y z")
    ),
    "thermal_hysteresis": lambda o, v: _along(o, v, np.gradient(o.warm, o.t)),
    "warm_up": lambda o, v: _along(o, v, np.exp(-o.t / v["tau_s"])),
    "bias_drift": lambda o, v: _along(o, v, o.t),
    "bias_step": lambda o, v: _along(o, v, (o.t >= v["at_s"]) * 1.0),
    "settling": lambda o, v: _along(o, v, np.exp(-(o.t - o.path.arrived) / v["tau_s"])),
    "vibration_rectification": _rectified,
    "hum": _hum,
    "random_walk": _walk,
    "outside_angle": _outside(lambda o, v: np.sin(3 * o.path.alpha)),
    "outside_wave": _outside(lambda o, v: np.sin(2 * np.pi * o.t / 71.0)),
    "outside_torsion": _outside(
        lambda o: np.sin(2 * o.path.alpha) * np.cos(o.path.beta)
    ),
    "outside_square": _outside(lambda o, v: (o.t / o.t[-1]) ** 4 - (o.t / o.t[-1])),
    "outside_odd_one": _outside(lambda o, v: o.inside(v["position"]) * 1.0),
}


def _sampled(world: World, concealed: Concealed) -> dict[str, Vector]:
    from benchmarks.concealed.chain import FAULTS

    d, n = world.device, len(world.t)
    density = np.sqrt(d.rate_hz)
    louder = concealed.get("noise_level", {})
    ratio = {louder["channel"]: louder["ratio"]} if louder else {}
    for i, axis in enumerate("xyz"):
        noise = world.rng.standard_normal((n, 2)) * density
        world.acc[:, i] += d.acc_density * ratio.get(f"a{axis}", 1.0) * noise[:, 0]
        world.gyr[:, i] += d.gyr_density * ratio.get(f"g{axis}", 1.0) * noise[:, 1]
    if d.wander:
        world.acc += d.wander * _flicker(world, d.acc_density)
        world.gyr += d.wander * _flicker(world, d.gyr_density)
    columns = {"t": world.t, **{f"a{a}": world.acc[:, i] for i, a in enumerate("xyz")}}
    if "gyr" in d.columns:
        columns |= {f"g{a}": world.gyr[:, i] for i, a in enumerate("xyz")}
    if "temperature" in d.columns:
        columns["temperature"] = (
            d.start_c + world.warm + 0.02 * world.rng.standard_normal(n)
        )
    if "t_host" in d.columns:
        columns["t_host"] = 1e5 + world.t + 2e-3 * world.rng.exponential(size=n)
    if "seq" in d.columns:
        columns["seq"] = np.arange(n, dtype=float)
    for name, values in concealed.items():
        if (fault := FAULTS.get(name)) is not None:
            columns = fault(columns, values, world.rng)
    return columns


def _flicker(world: World, density: float) -> Vector:
    """Bias instability, (n, 3), as strong as half a minute of averaged noise."""
    out = np.zeros((len(world.t), 3))
    dt = 1 / world.device.rate_hz
    from scipy.signal import lfilter

    for tau in (3.0, 30.0, 300.0):
        kick = world.rng.standard_normal((len(world.t), 3)) * np.sqrt(2 * dt / tau)
        out += lfilter([1.0], [1.0, -(1 - dt / tau)], kick, axis=0)
    scaled: Vector = out * density / np.sqrt(30.0) / np.sqrt(3.0)
    return scaled


def _session(device: Device, trip: Trip, concealed: Concealed) -> dict[str, Any]:
    positions: list[dict[str, Any]] = []
    for i, ((alpha, beta), (start, end)) in enumerate(
        zip(trip.positions, trip.windows, strict=True)
    ):
        table: dict[str, Any] = {"start_s": start, "end_s": end}
        if device.angles_known:
            table |= {"alpha_deg": float(alpha), "beta_deg": float(beta)}
        if (rate := trip.rate(i)) is not None:
            table["rate_deg_s"] = [float(r) for r in rate]
        positions.append(table)
    off = np.array(device.nominal_off)
    return {
        "format": 1,
        "device": {"name": "concealed", "grade": device.grade},
        "sampling": {"rate_hz": device.rate_hz},
        "site": {"latitude_deg": device.latitude_deg, "gravity": device.gravity},
        "frame": {"mounting": list(device.mounting)},
        "range": concealed.get("saturation", {}).get("range", {}),
        "nominal": {
            "acc_bias": (np.array(device.acc_bias) + off).tolist(),
            "acc_scale": (np.array(device.acc_scale) * (1 + off / 10)).tolist(),
            "gyr_bias": list(device.gyr_bias),
            "gyr_scale": [1.0, 1.0, 1.0],
        },
        "position": positions,
    }
