"""What the calibrations of two recordings tell of an effect in them.

Both are of one device: bias and scale factor are alike, unless they differ with the
probability `DIFFERS`. In one recording a wrong gravity is three odd scale factors;
beside another recording of the device it is three alike differences of them. With an
effect u of size v, a session's calibration is

    c(u) = c(0) - B u,    u ~ N(P q, P),    P = (M + v^-2)^-1                       (1)

and a relation of the sessions has, of the difference d with the covariance C under it,

    ln N(d; 0, C) + ln[1 - DIFFERS + DIFFERS int p(v') exp gain(v') dv']            (2)

which belongs under the integral over v in the evidence of the relation (`joint`). If
both have u alike, it is known from both, and d = c_r(0) - c_s(0) - (B_r - B_s) u.
Source: model evidence of pooled and separate regressions; D. MacKay 1992.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fieldcal.against.joint import (
    DIFFERS,
    EffectInformation,
    Relation,
    evidence_of_difference,
    over_sizes,
)
from fieldcal.core.samples import Array
from fieldcal.model.priors import SIZES


@dataclass(frozen=True, slots=True)
class GroupBesideEffect:
    """Biases or scale factors of one triad in one session, beside an effect.

    Attributes
    ----------
    values, covariance : (k,), (k, k) without the effect, m/s^2, rad/s or 1
    slope : (k, m) B of (1), by the typical sizes of the effect
    wander : (k, k) what the effect adds to the covariance: a random one by itself; any
        other takes away the instability that stands for it where it is left out
    typical : (k,) typical sizes

    """

    values: Array
    covariance: Array
    slope: Array
    wander: Array
    typical: Array

    def having(self, told: EffectInformation, size: float) -> GroupBesideEffect:
        """The group with the effect at a size, of which the session tells `told`."""
        spread = np.linalg.inv(told.inner + np.eye(len(told.rhs)) / size**2)
        return replace(
            self,
            values=self.values - self.slope @ (spread @ told.rhs),  # (1)
            covariance=self.covariance
            + self.slope @ spread @ self.slope.T
            + self.wander,
        )


@dataclass(frozen=True, slots=True)
class SideOfDevice:
    """One of two sessions, with what it tells of an effect.

    Attributes
    ----------
    groups : of its calibration; both sessions have the same ones
    told : of the effect; None where the session cannot have it

    """

    groups: Sequence[GroupBesideEffect]
    told: EffectInformation | None

    def having(self, size: float) -> SideOfDevice:
        """The session with the effect at a size."""
        if self.told is None:
            return self
        return replace(self, groups=[g.having(self.told, size) for g in self.groups])


def evidence_of_one_device(
    real: SideOfDevice, sim: SideOfDevice, random: bool, differs: float = DIFFERS
) -> dict[Relation, float]:
    """Ln evidence (2) of each relation, over what `joint` counts without it.

    Of a random effect, both have but the size alike. `differs` is 0 where only equal
    calibrations count; then 1 - DIFFERS is left as it is.
    """
    evidence = partial(_evidence_of_groups, differs=differs)
    out: dict[Relation, float] = {"neither": evidence(real, sim)}
    if real.told is not None:
        out["real"] = _under_integral(
            real.told.gain, lambda v: evidence(real.having(v), sim)
        )
    if sim.told is not None:
        out["simulator"] = _under_integral(
            sim.told.gain, lambda v: evidence(real, sim.having(v))
        )
    if real.told is None or sim.told is None:
        return out
    out["other"] = evidence(*(s.having(_likeliest_size(s)) for s in (real, sim)))
    if random:
        out["same"] = _under_integral(
            real.told.gain + sim.told.gain,
            lambda v: evidence(real.having(v), sim.having(v)),
        )
    elif real.told.inner.shape == sim.told.inner.shape:
        both = real.told.with_same(sim.told)
        apart = SideOfDevice(list(map(_apart, real.groups, sim.groups)), both)
        none = SideOfDevice([_nothing(g) for g in apart.groups], None)
        out["same"] = _under_integral(
            both.gain, lambda v: evidence(apart.having(v), none)
        )
    return out


def _likeliest_size(side: SideOfDevice) -> float:
    if side.told is None:
        return 0.0
    return float(SIZES[np.argmax(side.told.gain)])


def _apart(ours: GroupBesideEffect, theirs: GroupBesideEffect) -> GroupBesideEffect:
    """The difference of two groups, beside an effect that both have alike."""
    return replace(
        ours,
        values=ours.values - theirs.values,
        covariance=ours.covariance + theirs.covariance,
        slope=ours.slope - theirs.slope,
        wander=ours.wander + theirs.wander,
    )


def _nothing(of: GroupBesideEffect) -> GroupBesideEffect:
    return replace(
        of, values=np.zeros_like(of.values), covariance=np.zeros_like(of.covariance)
    )


def _under_integral(gain: Array, evidence: Callable[[float], float]) -> float:
    """Rise of a ln evidence by another one at each size, under its integral."""
    more = np.array([evidence(float(v)) for v in SIZES])
    return over_sizes(gain + more) - over_sizes(gain)


def _evidence_of_groups(real: SideOfDevice, sim: SideOfDevice, differs: float) -> float:
    """Ln evidence (2) of the differences of all groups."""
    return sum(
        evidence_of_calibrations(
            one.values - two.values,
            one.covariance + two.covariance,
            one.typical,
            differs,
        )
        for one, two in zip(real.groups, sim.groups, strict=True)
    )


def evidence_of_calibrations(
    difference: Array, covariance: Array, typical: Array, differs: float = DIFFERS
) -> float:
    """Ln evidence (2) of a difference (k,) with covariance (k, k), and its `typical`.

    In units of typical sizes, so that evidences of several can be added.
    """
    off, scaled = difference / typical, covariance / typical / typical[:, None]
    root = np.linalg.cholesky(scaled)
    white = np.linalg.solve(root, off)
    alike = -0.5 * float(white @ white) - float(np.log(np.diag(root)).sum())
    if not differs:
        return alike + float(np.log1p(-DIFFERS))
    gain = evidence_of_difference(off, scaled, np.ones(len(off)))
    return alike + float(
        np.logaddexp(np.log1p(-DIFFERS), np.log(differs) + gain)
    )  # (2)
