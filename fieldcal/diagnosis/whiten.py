"""The covariance of the rows: white noise, what windows share, random parts beyond it.

    cov(U_i) = D^2 + sum_w c_w c_w^T + sum_parts v^2 F F^T,    D = diag(sd_i)

c_w is what is off by the same in all rows of a window. Without random parts,

    L^-1 = prod_w (1 - (1 - 1 / sqrt(1 + s_w)) u_w u_w^T) D^-1,
    s_w = |D^-1 c_w|^2,    u_w = D^-1 c_w / sqrt(s_w)

Each random part belongs to one channel. F of

- "walk": a random walk through the rows, per sqrt(s);
- "offset": one value for each window;
- "window 7": a value for that window alone;
- "time", "faster time", "fast time", "alpha", "beta", "joints", "force", "force and
  time", "temperature", "since turn": a smooth function of that, nothing more being
  known of it (a short series with smaller and smaller terms).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.diagnosis.reduce import Rows
from fieldcal.effects import Experience
from fieldcal.samples import Array

KNOTS = 120
EXACT = 500
"""Rows up to which a walk is taken as it is, not on KNOTS spans."""

ALONE = "window"
"""What the kind of a part of one window begins with."""

HARMONICS = 4
SLOW = 5
FASTER, FAST = 8.0, 20.0
LONG_S = 1e4


@dataclass(frozen=True, slots=True)
class Part:
    """A random part of one channel: its kind, and v."""

    kind: str
    channel: int
    size: float

    @property
    def window(self) -> int | None:
        """The only window that it is in, if it is of that sort."""
        return window_of(self.kind)


@dataclass(frozen=True, slots=True)
class Errors:
    """What the rows' errors are made of beyond white noise.

    Attributes
    ----------
    parts : random parts of the channels
    setting : scatter of the angles from position to position, rad
    loose : positions that were not set at the angles that are said

    """

    parts: tuple[Part, ...] = ()
    setting: float = 0.0
    loose: tuple[int, ...] = ()

    def but(self, parts: tuple[Part, ...]) -> Errors:
        """The same with some parts put in place of those of their kind and channel."""
        new = {(p.kind, p.channel) for p in parts}
        kept = tuple(p for p in self.parts if (p.kind, p.channel) not in new)
        return replace(self, parts=kept + tuple(p for p in parts if p.size > 0))


class Whitener:
    """L^-1 of the covariance L L^T, channel by channel.

    Attributes
    ----------
    roots : by channel, L^-1 of its used rows, where it has random parts
    log_det : ln det L L^T over all channels

    """

    def __init__(self, rows: Rows, errors: Errors) -> None:
        self._used = rows.used
        self._weight = np.zeros(rows.y.shape)
        self._weight[self._used] = 1 / rows.sd[self._used]
        self.roots: dict[int, Array] = {}
        self._shared: dict[int, Array] = {}
        self.log_det = -2.0 * float(np.log(self._weight[self._used]).sum())
        for c in sorted({p.channel for p in errors.parts}):
            use = self._used[:, c]
            if use.any():
                inverse = _inverse_root(rows, errors, c)
                self.roots[c] = inverse
                narrower = np.diag(inverse) / self._weight[use, c]
                self.log_det -= 2 * float(np.log(narrower).sum())
        for c in np.flatnonzero(np.any(rows.common * self._used > 0, axis=0)).tolist():
            if c not in self.roots:
                self._shared[c], more = self._of_windows(rows, c)
                self.log_det += more

    def _of_windows(self, rows: Rows, c: int) -> tuple[Array, float]:
        """U with L^-1 = (1 - U U^T) D^-1, and what it adds to ln det."""
        use = self._used[:, c]
        over = rows.common[use, c] * self._weight[use, c]
        inside = _offset(rows.x, c)[use]
        s = inside.T @ over**2
        part = (1 - 1 / np.sqrt(1 + s)) / np.maximum(s, 1e-300)
        u: Array = inside * over[:, None] * np.sqrt(part)
        return u, float(np.log1p(s).sum())

    def __call__(self, values: Array) -> Array:
        """Whiten (n, 6) or (n, 6, k); rows that are not used become zero."""
        deep = (slice(None), slice(None)) + (None,) * (values.ndim - 2)
        clean = np.where(self._used[deep], values, 0.0)
        out = clean * self._weight[deep]
        for c, inverse in self.roots.items():
            use = self._used[:, c]
            out[use, c] = np.tensordot(inverse, clean[use, c], 1)
        for c, u in self._shared.items():
            use = self._used[:, c]
            scaled = out[use, c]
            out[use, c] = scaled - np.tensordot(u, np.tensordot(u.T, scaled, 1), 1)
        return out

    def channel(self, values: Array, c: int) -> Array:
        """Whiten (n, k) of one channel."""
        use = self._used[:, c]
        out = np.where(use[:, None], values, 0.0)
        if c in self.roots:
            out[use] = self.roots[c] @ out[use]
            return out
        out *= self._weight[:, c, None]
        if c in self._shared:
            u = self._shared[c]
            out[use] -= u @ (u.T @ out[use])
        return out


def _inverse_root(rows: Rows, errors: Errors, channel: int) -> Array:
    """L^-1 of a channel's used rows, window by window where they do not share."""
    use = rows.used[:, channel]
    cov = covariance(rows, errors, channel)[np.ix_(use, use)]
    cov += np.diag(rows.sd[use, channel] ** 2)
    common = rows.common[use, channel]
    cov += np.outer(common, common) * np.equal.outer(*[rows.x.position[use]] * 2)
    parts = [p for p in errors.parts if p.channel == channel]
    if any(p.kind != "offset" and p.window is None for p in parts):
        return np.linalg.inv(np.linalg.cholesky(cov))
    out, position = np.zeros_like(cov), rows.x.position[use]
    for p in np.unique(position):
        at = np.ix_(position == p, position == p)
        out[at] = np.linalg.inv(np.linalg.cholesky(cov[at]))
    return out


def covariance(rows: Rows, errors: Errors, channel: int) -> Array:
    """Covariance of a channel's random parts, (n, n)."""
    out = np.zeros((len(rows.x), len(rows.x)))
    for part in errors.parts:
        if part.channel == channel:
            f = factor(part.kind, rows.x, channel)
            out += part.size**2 * f @ f.T
    return out


def factor(kind: str, x: Experience, channel: int) -> Array:
    """F of a part, (n, m)."""
    if (window := window_of(kind)) is not None:
        there: Array = np.equal(x.position, window).astype(float)
        return there[:, None]
    return _FACTORS[kind](x, channel)


def _walk(x: Experience, channel: int) -> Array:
    """Means over rows of length L have cov min(t, t') - L/6 on the diagonal."""
    if len(x) > EXACT:
        return _coarse_walk(x.t)
    length = np.gradient(x.t) if len(x) > 1 else np.ones(1)
    for p in np.unique(x.position):
        inside = x.position == p
        if inside.sum() > 1:
            length[inside] = np.gradient(x.t[inside])
    t = x.t - x.t[0] + length[0] / 2
    return np.linalg.cholesky(np.minimum.outer(t, t) - np.diag(length / 6))


def _coarse_walk(t: Array) -> Array:
    """Increments on KNOTS spans, straight between them."""
    knots = np.linspace(0, len(t) - 1, KNOTS + 1)
    at = np.interp(knots, np.arange(len(t)), t)
    gaps = np.diff(at)
    part = np.clip((t[:, None] - at[:-1]) / np.where(gaps > 0, gaps, 1.0), 0.0, 1.0)
    out: Array = part * np.sqrt(gaps)
    return out


def _offset(x: Experience, channel: int) -> Array:
    same: Array = np.equal.outer(x.position, np.unique(x.position)).astype(float)
    return same


def _time(x: Experience, waves: float) -> Array:
    """Smooth over the length of the recording divided by `waves`.

    A walk's terms fall as 1/k; these fall off like a Gaussian beyond `waves`, so that a
    course that is smooth is not taken for a walk, nor the other way about.
    """
    part = (x.t - x.t[0]) / max(np.ptp(x.t), 1e-9)
    k = np.arange(1, round(2 * waves) + 1)
    out: Array = np.cos(np.pi * np.outer(part, k)) * np.exp(-0.5 * (k / waves) ** 2)
    return out


def _slow(x: Experience) -> Array:
    """Legendre's polynomials of time up to the fifth, the higher the smaller."""
    part = 2 * (x.t - x.t[0]) / max(np.ptp(x.t), 1e-9) - 1
    k = np.arange(1, SLOW + 1)
    out: Array = np.polynomial.legendre.legvander(part, SLOW)[:, 1:] / k
    return out


def _fading(x: Experience, channel: int) -> Array:
    return x.f[:, channel % 3, None] / x.gravity * _slow(x)


def _angle(angle: Array) -> Array:
    k = np.arange(1, HARMONICS + 1)
    turns = np.outer(angle, k)
    return np.hstack([np.sin(turns) / k, np.cos(turns) / k])


def _joints(x: Experience, channel: int) -> Array:
    one, two = (_angle(a)[:, [0, 1, 4, 5]] for a in (x.alpha, x.beta))
    return (one[:, :, None] * two[:, None, :]).reshape(len(x), -1)


def _force(x: Experience, channel: int) -> Array:
    f = x.f / x.gravity
    i = channel % 3
    j, k = (i + 1) % 3, (i + 2) % 3
    powers = [f[:, i] ** n / n for n in (2, 3, 4, 5)]
    others = [f[:, j] ** 2 / 2, f[:, k] ** 2 / 2, np.abs(f[:, i]) / 2]
    return np.column_stack(powers + others)


def _temperature(x: Experience, channel: int) -> Array:
    part = x.warming / max(float(np.ptp(x.warming)), 1e-9)
    return np.column_stack([part**n / n for n in (1, 2, 3, 4)])


def _since_turn(x: Experience, channel: int) -> Array:
    part = np.log1p(np.clip(x.since_turn, 0.0, LONG_S))
    part = part / max(float(np.max(part)), 1e-9)
    return np.column_stack([part**n / n for n in (1, 2, 3, 4)])


_FACTORS: dict[str, Callable[[Experience, int], Array]] = {
    "walk": _walk,
    "offset": _offset,
    "time": lambda x, c: _slow(x),
    "faster time": lambda x, c: _time(x, FASTER),
    "fast time": lambda x, c: _time(x, FAST),
    "force and time": _fading,
    "alpha": lambda x, c: _angle(x.alpha),
    "beta": lambda x, c: _angle(x.beta),
    "joints": _joints,
    "force": _force,
    "temperature": _temperature,
    "since turn": _since_turn,
}

SMOOTH = tuple(_FACTORS)[2:]
"""Kinds that are a smooth function of something."""


def window_of(kind: str) -> int | None:
    """The window that a kind of part is of alone.

    >>> window_of(kind_of(7)), window_of("walk")
    (7, None)
    """
    return int(kind.removeprefix(ALONE)) if kind.startswith(ALONE) else None


def kind_of(window: int) -> str:
    """Kind of the part of one window alone."""
    return f"{ALONE} {window}"


def nameless(kind: str) -> bool:
    """Whether a part is no random process that devices have, but something unknown."""
    return kind in SMOOTH or window_of(kind) is not None
