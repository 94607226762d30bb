"""Whether two recordings have an effect alike, and if not, which of them has it.

Of an effect each session says, everything of its own eliminated, M_i and q_i = T b'_i
((3) of `fieldcal.model.evidence.gram`). What two sessions share adds up, so for one
effect u = v T z with p(v),

    real alone        ln int p(v) exp gain(v; M_r, q_r) dv                          (1)
    simulator alone   ln int p(v) exp gain(v; M_s, q_s) dv                          (2)
    the same in both  ln int p(v) exp gain(v; M_r + M_s, q_r + q_s) dv              (3)
    another in each   the sum of (1) and (2)                                        (4)
    in neither        0                                                             (5)

In (4) the two may have nothing to do with each other, or the simulator has the same
but too weak or too strong: u_s = c u_r. u is then known of the one that shows more, and
the other tells c alone,

    ln int p(v) exp gain(v; d' M_s d, d' q_s) dv,    d along (1 + M_r)^-1 q_r       (7)

Both are as likely. Of what is random, u is another in each anyway, and the same is v:
then (3) is

    ln int p(v) exp [gain(v; M_r, q_r) + gain(v; M_s, q_s)] dv                      (6)

Each is weighed by how likely it was before: an effect is in a device by its chance, and
a simulator has what its device has by `MODELLED`, then as likely of the same size as of
another. Of what every device has, bias and scale factor, the difference d is the
effect: of covariance C_r + C_s, and there or not by `DIFFERS`. Source: model evidence
of pooled and separate regressions; D. MacKay 1992.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fieldcal.core.chances import of_odds
from fieldcal.core.samples import Array
from fieldcal.model.evidence.gram import gains
from fieldcal.model.evidence.sizing import DENSITY

Relation = Literal["real", "simulator", "same", "other", "neither"]

MODELLED = 0.5
"""Probability that a simulator has what its device has: who compares does not know."""

DIFFERS = 0.05
"""Probability that a simulator that was made like its device differs in a group of its
calibration: what is wrong with it is usually one thing."""


@dataclass(frozen=True, slots=True)
class EffectTold:
    """What one session says of an effect.

    Attributes
    ----------
    inner, pull : (k, k), (k,) M and q in units of what is typical
    own : largest diagonal element of M before anything was eliminated
    evidence : of the effect in that session, ln, if it is known better than by (1)

    """

    inner: Array
    pull: Array
    own: float
    evidence: float | None = None

    @property
    def gain(self) -> Array:
        """Ln of the evidence over sizes v, brought to what it is in all."""
        return gains(self.inner, self.pull, self.own) + self.shift

    @property
    def shift(self) -> float:
        """What is to be added to evidence by (1) to have that which is known better."""
        if self.evidence is None:
            return 0.0
        return self.evidence - _over_sizes(gains(self.inner, self.pull, self.own))

    @property
    def shows(self) -> bool:
        """Whether the session could show an effect of typical size at all."""
        return bool(np.linalg.eigvalsh(self.inner).max(initial=0.0) > 1.0)


def _over_sizes(gain: Array) -> float:
    return float(np.logaddexp.reduce(gain + DENSITY))


def weighed(
    real: EffectTold | None,
    sim: EffectTold | None,
    chance: float,
    alike: float | None,
    scaled: float | None = None,
) -> dict[Relation, float]:
    """Probability of each relation between two sessions as to one effect.

    Parameters
    ----------
    real, sim : what each says; None where it cannot have it
    chance : that a device has the effect
    alike : ln evidence of the same in both (3), if it is not that of `real` and `sim`
    scaled : that of one of them times a number (7), if it has a course

    """
    one, two = ((None if t is None else t.gain) for t in (real, sim))
    score: dict[Relation, float] = {"neither": float(np.log1p(-chance))}
    alone = float(np.log(chance) + np.log1p(-MODELLED))
    half = float(np.log(chance) + np.log(MODELLED) - np.log(2))
    if one is not None:
        score["real"] = alone + _over_sizes(one)
    if two is not None:
        score["simulator"] = alone + _over_sizes(two)
    if one is not None and two is not None and real and sim:
        other = _over_sizes(one) + _over_sizes(two)  # (4)
        if scaled is not None:
            other = float(np.logaddexp(other, scaled) - np.log(2))
        score["other"] = half + other
        score["same"] = half + (both(real, sim) if alike is None else alike)
    total = np.logaddexp.reduce(np.array(list(score.values())))
    return {name: float(np.exp(s - total)) for name, s in score.items()}


def both(real: EffectTold, sim: EffectTold) -> float:
    """Ln evidence of one and the same effect in both sessions (3)."""
    if real.inner.shape != sim.inner.shape:
        return -np.inf
    there = gains(real.inner + sim.inner, real.pull + sim.pull, real.own + sim.own)
    return _over_sizes(there) + real.shift + sim.shift


def proportional(real: EffectTold, sim: EffectTold) -> float | None:
    """Ln evidence of an effect in one, and of some times as much in the other (7)."""
    if real.inner.shape != sim.inner.shape:
        return None
    known, other = sorted((real, sim), key=lambda t: -_over_sizes(t.gain))
    course = np.linalg.solve(known.inner + np.eye(len(known.pull)), known.pull)
    size = float(np.linalg.norm(course))
    if size == 0:
        return None
    along = course / size
    inner, pull = along @ other.inner @ along, along @ other.pull
    times = gains(np.array([[inner]]), np.array([pull]), other.own)
    return _over_sizes(known.gain) + _over_sizes(times) + other.shift


def as_large(real: EffectTold, sim: EffectTold) -> float:
    """Ln evidence of something random that is as large in both, by its size alone."""
    return _over_sizes(real.gain + sim.gain)


def differs(difference: Array, covariance: Array, typical: Array) -> float:
    """Probability that a difference (k,) of covariance (k, k) is none of chance."""
    information = np.linalg.inv(covariance)
    inner = information * typical * typical[:, None]
    told = EffectTold(
        inner, typical * (information @ difference), float(np.diag(inner).max())
    )
    odds = np.log(DIFFERS) - np.log1p(-DIFFERS) + _over_sizes(told.gain)
    return float(of_odds(odds))


def likeliest(found: Mapping[Relation, float]) -> Relation:
    """The relation of a difference that is likeliest: neither and same are none."""
    differing: list[Relation] = ["real", "simulator", "other"]
    return max(differing, key=lambda name: found.get(name, 0.0))


def apart(found: Mapping[Relation, float]) -> float:
    """Probability that the two differ."""
    return 1.0 - found.get("neither", 0.0) - found.get("same", 0.0)
