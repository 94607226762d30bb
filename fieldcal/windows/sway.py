"""A window on a base that sways: its outputs as they would be with the base at rest.

The base turns by a small vector phi(t) (device axes) about where it hangs at rest, a
ship at the pier, a vehicle on its springs, a mast in the wind. With the specific force
f0 at rest and the arm r from the turning centre, the device has

    f - f0 = f0 x phi + phi x (phi x f0) / 2 + w' x r + w x (w x r)              (1)
    w      = phi' - phi x phi' / 2                                               (2)

The first terms are waves, and their mean over a window is what its ends leave of them;
the mean of the others is none: phi^2 / 2 of gravity, and a coning rate. Each output y_c
is a constant, a drift and a random process whose spectrum all outputs share,

    y_c = m_c + q_c t + sum_k s_ck (a_ck cos w_k t + b_ck sin w_k t) + noise,
    a, b ~ N(0, v_k),   s = |f0| of accelerometers, w_k of gyroscopes            (3)

on frequencies half a cycle a window apart, and on those of the strongest lines. v_k and
the noise are those of greatest evidence: a swell is one line, gusts are many. What the
window leaves open of m_c is in its variance. Squares in (1) and (2) are taken of the
waves that the gyroscopes show.

Source: rotation kinematics to second order; MacKay 1992 and Tipping 2001 for (3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.windows.cells import CELL

LOWEST, HIGHEST = 0.06, 1.5
"""Frequencies at which bases sway, Hz: a long swell, a stiff tripod."""

WIDEST = 40.0
"""Seconds that are looked at together: longer windows are cut."""

LEAST = 16
"""Cells below which nothing is looked for."""

ROUNDS, KEPT = 20, 1.0
"""Steps towards the greatest evidence, and the power that a line must have in some
output, in that of its noise, to be looked at any longer."""

LINES, FINER = 4, 16
"""Lines whose frequencies are sought, and points of the first grid in 1 / T."""

ARM, GAUGE, LONGEST = 3.0, 0.02, 30.0
"""What is expected of the arm r, m, and of what scale factors may be off by; and the
longest arm: on that of a pendulum of the same period gravity's part does not show."""

WEAK = 0.01
"""Part of the strongest wave's power below which one is left to the noise."""

STEP_S, TINY = 0.25, 1e-15
"""Step of a window that is only thought of, s, and the least size of a wave in it."""

POINTS = 400
"""Instants at which the turning of a stretch is looked at."""

SMALLEST = float(np.deg2rad(0.1))
"""Turning below which nothing is looked for, rad: it moves gravity by less than 1e-5
m/s^2 in the mean."""

WORSE = 1.5
"""How many times as uncertain as on firm ground a window may be on a swaying base."""

LADDER = (10, 15, 20, 30, 45, 60, 90, 120, 180, 300, 600)
"""Seconds that a window may be given."""

ALIKE, MISSED = 0.3, 1e-4
"""Part of the power that gravity makes of the turning of which accelerometers across it
may show something else, and of which they do so where it turns."""


@dataclass(frozen=True, slots=True)
class Waves:
    """What sways in a stretch of a window.

    Attributes
    ----------
    hz : (k,) frequencies
    middle : s, where their phases count from
    cos, sin : (k, 6) amplitudes of the outputs
    force, arm : (3,) m/s^2 and m, f0 and r of (1)
    left : (6,) variance of the means at rest beyond that of white noise
    noise : (6,) variance of a mean over a cell of `length` s
    length : s
    span : s, the stretch that was looked at
    scale : (3,) outputs of the gyroscopes in a rad/s

    """

    hz: Array
    middle: float
    cos: Array
    sin: Array
    force: Array
    arm: Array
    left: Array
    noise: Array
    length: float
    span: tuple[float, float]
    scale: Array

    @property
    def size(self) -> tuple[float, float]:
        """Mean squares of the turning, rad^2, and of its rate, rad^2/s^2."""
        t = np.linspace(*self.span, POINTS)
        squares = [float((self.turn(t, i) ** 2).sum(axis=1).mean()) for i in (0, 1)]
        return squares[0], squares[1]

    def turn(self, t: Array, order: int = 0) -> Array:
        """Phi at some instants, or its derivative of some order, (n, 3) rad."""
        pulse = 2 * np.pi * self.hz[:, None]
        size = pulse ** (order - 1) / self.scale
        wave = self._angle(t) + np.pi / 2 * (order - 1)
        out: Array = np.cos(wave) @ (size * self.cos[:, 3:])
        out += np.sin(wave) @ (size * self.sin[:, 3:])
        return out

    def of(self, t: Array) -> Array:
        """What swaying adds to the outputs at some instants, (n, 6)."""
        return self.linear(t) + self.squares(t)

    def linear(self, t: Array) -> Array:
        """The terms of (1) and (2) that are waves, (n, 6)."""
        wave = self._angle(t)
        out: Array = np.cos(wave) @ self.cos + np.sin(wave) @ self.sin
        return out

    def squares(self, t: Array) -> Array:
        """The other ones, (n, 6)."""
        phi, rate = self.turn(t), self.turn(t, 1)
        out = np.empty((len(t), 6))
        out[:, :3] = np.cross(phi, np.cross(phi, self.force)) / 2
        out[:, :3] += np.cross(rate, np.cross(rate, self.arm))  # (1)
        out[:, 3:] = -np.cross(phi, rate) / 2 * self.scale  # (2)
        return out

    def _angle(self, t: Array) -> Array:
        out: Array = np.multiply.outer(t - self.middle, 2 * np.pi * self.hz)
        return out


def waves_of(t: Array, six: Array, scale: Array) -> list[Waves]:
    """Look for swaying in a window.

    Parameters
    ----------
    t : (n,) s
    six : (n, 6) m/s^2 and rad/s, nan where missing
    scale : (3,) nominal scale factors of the gyroscopes

    Returns
    -------
    One for each stretch of up to a minute; none where nothing sways.

    """
    parts = max(1, int(np.ceil((t[-1] - t[0]) / WIDEST))) if len(t) > 1 else 1
    found = [
        _stretch(t[some], six[some], scale)
        for some in np.array_split(np.arange(len(t)), parts)
    ]
    out = [one for one in found if one is not None]
    return out if len(out) == parts else []


def _stretch(t: Array, six: Array, scale: Array) -> Waves | None:
    """Waves of one stretch; None if there are none, or they are no turning."""
    cells = _cells(t, six)
    if cells is None:
        return None
    at, y, length = cells
    span = float(at[-1] - at[0]) + length
    hz: Array = np.arange(1, int(2 * span * HIGHEST) + 1) / (2 * span)
    hz = hz[hz >= max(LOWEST, 1 / span)]
    if not _swings(y[:, 3:] / scale, length):
        return None
    force, ends = y[:, :3].mean(axis=0), (float(t[0]), float(t[-1]))
    none = np.zeros(6)
    plain = Waves(
        hz[:0], float(at.mean()), y[:0], y[:0], force, none[:3], none, none, length,
        ends, scale,
    )  # fmt: skip
    hz = _beside(hz, _lines(at, y, hz), 1 / (8 * span))
    first = _Fitted(at, y, hz, length, plain).waves()
    if first is None or not (found := _with_arm(first)):
        return None
    # squares have waves of their own, of which the first fit took some for sway
    again = _Fitted(at, y - found.squares(at), hz, length, found).waves()
    return again or found


def _cells(t: Array, six: Array) -> tuple[Array, Array, float] | None:
    """Middles and means (m, 6) of cells in which nothing is missing, and how long."""
    if len(t) < LEAST:
        return None
    step = float(t[-1] - t[0]) / (len(t) - 1)
    each = max(1, round(CELL / step))
    count = len(t) // each
    if count < LEAST:
        return None
    y = six[: count * each].reshape(count, each, 6).mean(axis=1)
    at = t[: count * each].reshape(count, each).mean(axis=1)
    whole = np.isfinite(y).all(axis=1)
    if whole.sum() < max(LEAST, 0.7 * count):
        return None
    return at[whole], y[whole], each * step


def _beside(hz: Array, lines: Array, near: float) -> Array:
    """Frequencies with lines among them, but for those that are nearly the same."""
    kept: list[float] = []
    for line in lines.tolist():
        if all(abs(line - other) > near for other in kept):
            kept.append(line)
    apart = np.abs(np.subtract.outer(hz, np.array(kept))).min(axis=1) > near
    return np.sort(np.concatenate([hz[apart], kept]))


def _swings(rate: Array, length: float) -> bool:
    """Whether what rates (m, 3) sum up to goes to and fro enough to be looked at."""
    angle = np.cumsum((rate - rate.mean(axis=0)) * length, axis=0)
    about = _rest(np.arange(float(len(angle))), angle, ())
    return float((about**2).sum(axis=1).mean()) > SMALLEST**2 / 2


def _lines(t: Array, y: Array, hz: Array) -> Array:
    """Frequencies of the strongest lines, (l,) Hz, one found in what others leave."""
    noise = np.maximum(np.diff(y, n=2, axis=0).std(axis=0) / np.sqrt(6), 1e-12)
    white = y / noise
    step = float(hz[1] - hz[0]) / 2 if len(hz) > 1 else float(hz[0]) / 2
    grid = np.arange(hz[0], hz[-1], 2 * step / (FINER / 4))
    found: list[float] = []
    for _ in range(LINES):
        rest = _rest(t, white, found)
        power = np.abs(np.exp(-2j * np.pi * np.outer(grid, t)) @ rest) ** 2
        at = float(grid[int(np.argmax(power.sum(axis=1)))])
        found.append(at)
        for width in step / 2.0 ** np.arange(1, 9):
            for i in range(len(found)):
                near = found[i] + width * np.array([-1.0, 0.0, 1.0])
                others = [*found[:i], *found[i + 1 :]]
                left = [(_rest(t, white, [*others, f]) ** 2).sum() for f in near]
                found[i] = float(near[int(np.argmin(left))])
    return np.array(found)


def _rest(t: Array, y: Array, hz: Sequence[float]) -> Array:
    """What a constant, a drift and some waves leave of outputs, (m, c)."""
    wave = np.multiply.outer(t - t.mean(), 2 * np.pi * np.array(hz))
    s = (t - t.mean()) / np.ptp(t)
    design = np.column_stack([np.ones_like(s), s, np.cos(wave), np.sin(wave)])
    base = np.linalg.qr(design)[0]
    rest: Array = y - base @ (base.T @ y)
    return rest


class _Fitted:
    """The process (3) of the outputs of one stretch, by its evidence.

    Parameters
    ----------
    t, y : (m,), (m, 6) cells
    hz : (k,) frequencies
    length : s of a cell
    known : what is known of the stretch

    """

    def __init__(
        self, t: Array, y: Array, hz: Array, length: float, known: Waves
    ) -> None:
        self.hz, self.count, self.known = hz, len(t), known
        t = t - known.middle
        wave = np.multiply.outer(t, 2 * np.pi * hz)
        mean = np.sinc(hz * length)  # of a wave over a cell
        self.table = np.hstack([np.cos(wave) * mean, np.sin(wave) * mean])
        flat = np.linalg.qr(np.column_stack([np.ones(len(t)), t]))[0]
        self.free = self.table - flat @ (flat.T @ self.table)
        self.off = y - flat @ (flat.T @ y)
        rate = np.multiply.outer(2 * np.pi * hz, np.abs(known.scale))
        size = np.full((len(hz), 3), np.linalg.norm(known.force))
        self.size = np.tile(np.hstack([size, rate]), (2, 1))

    def waves(self) -> Waves | None:
        """Waves of greatest evidence; None where there is none beyond noise."""
        gram, pull = self.free.T @ self.free, self.free.T @ self.off
        bent = np.diff(self.off, n=2, axis=0)
        noise = np.maximum((bent**2).mean(axis=0) / 6, 1e-30)
        at = np.arange(len(self.hz))
        power = (2 / self.count * pull / self.size) ** 2
        v = (power[at] + power[at + len(at)]).mean(axis=1) / 2
        for _ in range(ROUNDS):
            both = np.concatenate([at, at + len(self.hz)])
            wide = np.sqrt(np.tile(v[at], 2))[:, None] * self.size[both]
            mean, cov = _posterior(gram[np.ix_(both, both)], pull[both], wide, noise)
            known = np.clip(1 - np.einsum("ckk->kc", cov) / wide**2, 1e-12, 1.0)
            share = [
                (x[: len(at)] + x[len(at) :]).sum(axis=1)
                for x in ((mean / self.size[both]) ** 2, known)
            ]
            v[at] = share[0] / share[1]
            rest = self.off - self.free[:, both] @ mean
            spare = np.maximum(self.count - 2 - known.sum(axis=0), 1.0)
            noise = np.maximum((rest**2).sum(axis=0) / spare, 1e-30)
            loud = v[at, None] * self.size[at] ** 2 * self.count / 2 > KEPT * noise
            if not loud.any():
                return None
            kept = loud.any(axis=1)
            mean, cov = mean[np.tile(kept, 2)], cov[:, np.tile(kept, 2)]
            cov, at = cov[:, :, np.tile(kept, 2)], at[kept]
        off = self.table[:, np.concatenate([at, at + len(self.hz)])].mean(axis=0)
        left = np.einsum("i,cij,j->c", off, cov, off)
        half = len(at)
        return replace(
            self.known, hz=self.hz[at], cos=mean[:half], sin=mean[half:], left=left,
            noise=noise,
        )  # fmt: skip


def _posterior(
    gram: Array, pull: Array, wide: Array, noise: Array
) -> tuple[Array, Array]:
    """Amplitudes (k, 6) of columns as wide as `wide` (k, 6), covariances (6, k, k)."""
    sizes = wide.T
    scaled = sizes[:, :, None] * gram * sizes[:, None, :] / noise[:, None, None]
    inverse = np.linalg.inv(scaled + np.eye(len(gram)))
    cov = sizes[:, :, None] * inverse * sizes[:, None, :]
    mean: Array = np.einsum("cij,jc->ic", cov, pull) / noise
    return mean, cov


def _with_arm(found: Waves) -> Waves | None:
    """The waves with r of (1); None if accelerometers do not show that it turns."""
    t, strong = np.linspace(*found.span, POINTS), _strong(found)
    made = np.cross(found.force, strong.turn(t))
    speeding = strong.turn(t, 2)
    design = np.stack([np.cross(speeding, e) for e in np.eye(3)] + [made], axis=2)
    design = design.reshape(-1, 4) * np.array([ARM, ARM, ARM, GAUGE])
    power = float((made**2).sum())
    noise = max(MISSED * power / len(t), 1e-12)
    rest = (strong.linear(t)[:, :3] - made).ravel()
    known = np.linalg.solve(
        design.T @ design / noise + np.eye(4), design.T @ rest / noise
    )
    across = (rest - design @ known).reshape(-1, 3)  # a ship heaves as well
    across -= np.outer(across @ found.force, found.force) / (found.force @ found.force)
    arm = ARM * known[:3]
    alike = float((across**2).sum()) < ALIKE * power
    return replace(found, arm=arm) if alike and np.abs(arm).max() < LONGEST else None


def _strong(found: Waves) -> Waves:
    """The waves that are no noise: of a quick one twice derived little is left else."""
    pulse = 2 * np.pi * found.hz
    power = (found.cos[:, 3:] ** 2 + found.sin[:, 3:] ** 2).sum(axis=1) / pulse**2
    kept = power > WEAK * power.max()
    return replace(found, hz=found.hz[kept], cos=found.cos[kept], sin=found.sin[kept])


def needed(waves: Waves) -> float:
    """Seconds that a window needs to be nearly as good as on firm ground.

    With waves of these sizes and unknown phases, none of its means is `WORSE` times as
    uncertain as by its noise.
    """
    power = (waves.cos**2 + waves.sin**2) / 2
    for seconds in LADDER:
        t = np.arange(0.0, seconds, STEP_S) - seconds / 2
        noise = waves.noise * waves.length / STEP_S
        wave = np.multiply.outer(t, 2 * np.pi * waves.hz)
        table = np.hstack([np.cos(wave), np.sin(wave)])
        flat = np.linalg.qr(np.column_stack([np.ones(len(t)), t]))[0]
        free = table - flat @ (flat.T @ table)
        wide = np.sqrt(np.tile(power, (2, 1))) + TINY
        _, cov = _posterior(free.T @ free, np.zeros_like(wide), wide, noise)
        off = table.mean(axis=0)
        left = np.einsum("i,cij,j->c", off, cov, off)
        if (noise / len(t) + left <= WORSE**2 * noise / len(t)).all():
            return float(seconds)
    return float(LADDER[-1])
