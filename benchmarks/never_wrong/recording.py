"""What a device puts out on a bench.

Written apart from everything that estimates: base axes are east, down and north, the
device is turned by alpha about z and then by beta about the turned x, and

    U = b + K (A f_0),   f_0 = (0, -g, 0);   W = c + L (A w_0 + turning)

in procedure axes, put into the device's by its mounting, with what `Device` adds. Axes
of joints that are not square are turned by s about y from each other:

    A = R_y(-s) R_x(beta) R_y(s) R_z(alpha)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.never_wrong.bench import EARTH, Bench, Floats, Samples
from benchmarks.never_wrong.beside import merged


def turned(alpha: Floats, beta: Floats, vector: Floats, skew: float = 0.0) -> Floats:
    """A vector of base axes in procedure axes, (n, 3)."""
    x, y, z = np.moveaxis(np.broadcast_to(vector, (len(alpha), 3)), 1, 0)
    east = np.cos(alpha) * x + np.sin(alpha) * y
    down = np.cos(alpha) * y - np.sin(alpha) * x
    east, north = _about_y(skew, east, z)
    on_x = np.cos(beta) * north - np.sin(beta) * down
    east, on_x = _about_y(-skew, east, on_x)
    return np.column_stack([east, np.cos(beta) * down + np.sin(beta) * north, on_x])


def _about_y(angle: float, x: Floats, z: Floats) -> tuple[Floats, Floats]:
    """Components x and z in axes that are turned about y, (n,) each."""
    cos, sin = np.cos(angle), np.sin(angle)
    return cos * x - sin * z, cos * z + sin * x


def to_device(mounting: tuple[str, str, str], values: Floats) -> Floats:
    """Components along procedure axes as components along the device's, (n, 3)."""
    out = np.zeros_like(values)
    for procedure, name in enumerate(mounting):
        out[:, "xyz".index(name[1])] = values[:, procedure] * (
            -1 if name[0] == "-" else 1
        )
    return out


def recorded(bench: Bench, rng: np.random.Generator) -> Samples:
    """What the device puts out, and what one beside it puts between."""
    heading = rng.uniform(0, 2 * np.pi)
    s = _put_out(bench, heading, rng)
    if (beside := bench.beside) is None:
        return s
    acting = replace(bench.acting, slips=beside.turned, slip_s=-10.0)
    second = replace(
        bench, acting=acting, acc_bias=beside.acc_bias, acc_scale=beside.acc_scale,
        gyr_bias=beside.gyr_bias, gyr_scale=beside.gyr_scale, device=beside.device,
    )  # fmt: skip
    o = _put_out(second, heading, rng)
    return Samples(*merged((s.t, s.acc, s.gyr), (o.t, o.acc, o.gyr), beside, rng))


def _put_out(bench: Bench, heading: float, rng: np.random.Generator) -> Samples:
    """What one device puts out where the fixture's x points `heading` rad off east."""
    windows = bench.windows
    t = np.arange(0.0, windows[-1, 1] + 2.0, 1 / bench.rate)
    joints, speed = _joints(bench, t)
    alpha, beta = joints.T
    if bench.joints:
        alpha, beta = alpha + bench.tilt[0], beta + bench.tilt[1]
    sway, swing = bench.acting.tilted(t)
    down = np.column_stack([np.zeros_like(t), np.cos(sway), np.sin(sway)])
    f = turned(alpha, beta, _on_base(bench, -bench.gravity * down), bench.skew)
    latitude = np.deg2rad(bench.latitude)
    north = EARTH * np.cos(latitude)
    rates = np.tile([north * np.sin(heading), -EARTH * np.sin(latitude),
                     north * np.cos(heading)], (len(t), 1))  # fmt: skip
    rates[:, 0] += swing
    w = turned(alpha, beta, _on_base(bench, rates), bench.skew)
    w += speed[:, 1:] * np.array([np.cos(bench.skew), 0.0, -np.sin(bench.skew)])
    w += speed[:, :1] * turned(0 * beta, beta, np.array([0.0, 0.0, 1.0]), bench.skew)
    f, w = to_device(bench.mounting, f), to_device(bench.mounting, w)
    f, w = bench.acting.slid(t, f, w)
    f = bench.acting.felt(t, f, w)
    acc, gyr = bench.device.adds(t, f, w)
    acc += bench.acc_bias + bench.acc_scale * f
    gyr += bench.gyr_bias + bench.gyr_scale * w
    for out, more in zip(
        (acc, gyr), bench.acting.wanders(t, f, windows, rng), strict=True
    ):
        out += more
    acc, gyr = bench.acting.passed(t, acc, gyr)
    acc += rng.normal(0, bench.acc_noise, f.shape)
    gyr += rng.normal(0, bench.gyr_noise, w.shape)
    if bench.grain:
        acc = np.round(acc / bench.grain) * bench.grain
    return Samples(t, acc, gyr)


def _joints(bench: Bench, t: Floats) -> tuple[Floats, Floats]:
    """Angles of the two joints, rad, and their rates, rad/s, (n, 2) each."""
    held = np.deg2rad(bench.angles) + bench.off
    joints, speed, creeping = np.empty((len(t), 2)), *np.zeros((2, len(t), 2))
    joints[:] = held[0]
    for i in range(1, len(held)):
        # 0.7 s of rest on both sides, a raised cosine of speed between
        a, b = bench.windows[i - 1, 1] + 0.7, bench.windows[i, 0] - 0.7
        s = np.clip((t - a) / (b - a), 0, 1)
        moved = held[i] - held[i - 1]
        way = s - np.sin(2 * np.pi * s) / (2 * np.pi)
        joints = np.where((s > 0)[:, None], held[i - 1] + way[:, None] * moved, joints)
        rate = (1 - np.cos(2 * np.pi * s)) / (b - a) * ((s > 0) & (s < 1))
        speed += rate[:, None] * moved
        # a joint that is not turned does not creep, however its detents scatter
        far = bench.creep * np.sign(bench.angles[i] - bench.angles[i - 1])
        left = np.exp(-np.maximum(t - b, 0) / bench.creeps_s)
        creeping += (way * left)[:, None] * far
        speed += ((rate - way * (t > b) / bench.creeps_s) * left)[:, None] * far
    return joints + creeping, speed


def _on_base(bench: Bench, vectors: Floats) -> Floats:
    """Vectors of level axes in those of the base, (n, 3)."""
    if bench.joints:
        return vectors
    about_z, about_x = (np.full(len(vectors), angle) for angle in bench.tilt)
    return turned(about_z, about_x, vectors)
