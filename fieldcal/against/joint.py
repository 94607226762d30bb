"""Whether two recordings have the same effect, and if not, which of them has it.

All other parameters eliminated, a session i gives of an effect its information M_i and
q_i = T b'_i ((3) of `fieldcal.model.evidence.gram`). If both sessions share the effect,
these add up. For an effect u = v T z with the prior p(v) of its size, ln Z is

    real alone        ln int p(v) exp gain(v; M_r, q_r) dv                          (1)
    simulator alone   ln int p(v) exp gain(v; M_s, q_s) dv                          (2)
    the same in both  ln int p(v) exp gain(v; M_r + M_s, q_r + q_s) dv              (3)
    another in each   ln int p(v) p(w | v) exp [gain(v; M_r, q_r)
                                                + gain(w; M_s, q_s)] dv dw          (4)
    in neither        0                                                             (5)

In (4) both have an effect of about one size: ln w is normal about ln v, with a standard
deviation of ln `RESIZED`. What has a tenth of an effect, or less, leaves it out. The
two may be independent, or the simulator has the same one but too weak or too strong:
u_s = c u_r. In the second case u is taken from the session that shows more of it, its
estimate is u_r = (1 + M_r)^-1 q_r, and the other determines c alone,

    ln int p(w | |u_r|) exp gain(w; d' M_s d, d' q_s) dw,    d along u_r            (7)

Both cases have the same prior probability. A random effect has another u in each
session anyway, and only its size v can be the same. For it, (3) is

    ln int p(v) exp [gain(v; M_r, q_r) + gain(v; M_s, q_s)] dv                      (6)

The prior probability that a device has an effect is its chance. A simulator has what
its device has with the probability `MODELLED`, and then the same size or another one
with equal probability. Bias and scale factor exist in every device; there the effect is
the difference d with the covariance C = C_r + C_s, present with the probability
`DIFFERS`. What that tells of other effects is in `one_device`.
Source: model evidence of pooled and separate regressions; D. MacKay 1992.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fieldcal.core.probability import probability_of_log_odds
from fieldcal.core.samples import Array
from fieldcal.model.evidence.eliminated import evidence_gains
from fieldcal.model.evidence.sizing import LOG_DENSITY
from fieldcal.model.priors import SIZES

Relation = Literal["real", "simulator", "same", "other", "neither"]

MODELLED = 0.5
"""Prior probability that a simulator has an effect that its device has."""

RESIZED = 3.0
"""Factor by which the size of an effect in a simulator is usually wrong."""

DIFFERS = 0.05
"""Prior probability that a simulator differs from its device in a given group of the
calibration: usually only one thing is wrong with it."""


@dataclass(frozen=True, slots=True)
class EffectInformation:
    """Information of one session about an effect.

    Attributes
    ----------
    inner, rhs : (k, k), (k,) M and q in units of the typical sizes
    largest_diagonal : largest diagonal element of M before any elimination
    evidence : ln evidence of the effect in that session, if known better than by (1)

    """

    inner: Array
    rhs: Array
    largest_diagonal: float
    evidence: float | None = None

    @property
    def gain(self) -> Array:
        """Ln evidence at each size v, shifted to agree with `evidence`."""
        return evidence_gains(self.inner, self.rhs, self.largest_diagonal) + self.shift

    @property
    def shift(self) -> float:
        """Difference of `evidence` and the evidence by (1)."""
        if self.evidence is None:
            return 0.0
        return self.evidence - over_sizes(
            evidence_gains(self.inner, self.rhs, self.largest_diagonal)
        )

    def with_same(self, other: EffectInformation) -> EffectInformation:
        """Information of both sessions together, which have the same effect, of (3)."""
        return EffectInformation(
            self.inner + other.inner,
            self.rhs + other.rhs,
            self.largest_diagonal + other.largest_diagonal,
        )

    @property
    def shows(self) -> bool:
        """Whether the session could show an effect of typical size at all."""
        return bool(np.linalg.eigvalsh(self.inner).max(initial=0.0) > 1.0)


def over_sizes(gain: Array) -> float:
    """Ln evidence of an effect of any size, from that at each of `SIZES`."""
    return float(np.logaddexp.reduce(gain + LOG_DENSITY))


def _about(gain: Array, size: float) -> float:
    """Ln evidence of an effect of about a size, from that at each of `SIZES`."""
    off = np.log(SIZES / size) / np.log(RESIZED)
    share = np.exp(-0.5 * np.square(off))
    total = float(np.logaddexp.reduce(gain - 0.5 * np.square(off)))
    return total - float(np.log(share.sum()))


def _evidence_of_other_size(real: Array, sim: Array) -> float:
    """Ln evidence (4) of effects of about one size, from that at each of `SIZES`."""
    each = [_about(sim, float(size)) for size in SIZES]
    return over_sizes(real + np.array(each))


def relation_probabilities(
    real: EffectInformation | None,
    sim: EffectInformation | None,
    chance: float,
    alike: float | None,
    scaled: float | None = None,
    of_one_device: Mapping[Relation, float] | None = None,
) -> dict[Relation, float]:
    """Probability of each relation between two sessions in one effect.

    Parameters
    ----------
    real, sim : information of each; None where it cannot have the effect
    chance : prior probability that a device has the effect
    alike : ln evidence of the same effect in both (3), if not to be calculated here
    scaled : ln evidence of proportional effects (7), if the effect has an equation
    of_one_device : further ln evidence of each relation, of both being one device

    """
    one, two = ((None if t is None else t.gain) for t in (real, sim))
    score: dict[Relation, float] = {"neither": float(np.log1p(-chance))}
    alone = float(np.log(chance) + np.log1p(-MODELLED))
    half = float(np.log(chance) + np.log(MODELLED) - np.log(2))
    if one is not None:
        score["real"] = alone + over_sizes(one)
    if two is not None:
        score["simulator"] = alone + over_sizes(two)
    if one is not None and two is not None and real and sim:
        other = _evidence_of_other_size(one, two)  # (4)
        if scaled is not None:
            other = float(np.logaddexp(other, scaled) - np.log(2))
        score["other"] = half + other
        score["same"] = half + (evidence_of_same(real, sim) if alike is None else alike)
    for name, more in (of_one_device or {}).items():
        score[name] += more
    total = np.logaddexp.reduce(np.array(list(score.values())))
    return {name: float(np.exp(s - total)) for name, s in score.items()}


def evidence_of_same(real: EffectInformation, sim: EffectInformation) -> float:
    """Ln evidence of one and the same effect in both sessions (3)."""
    if real.inner.shape != sim.inner.shape:
        return -np.inf
    return over_sizes(real.with_same(sim).gain) + real.shift + sim.shift


def evidence_of_proportional(
    real: EffectInformation, sim: EffectInformation
) -> float | None:
    """Ln evidence of an effect in one, and of a multiple of it in the other (7)."""
    if real.inner.shape != sim.inner.shape:
        return None
    known, other = sorted((real, sim), key=lambda t: -over_sizes(t.gain))
    course = np.linalg.solve(known.inner + np.eye(len(known.rhs)), known.rhs)
    size = float(np.linalg.norm(course))
    if size == 0:
        return None
    along = course / size
    inner, rhs = along @ other.inner @ along, along @ other.rhs
    times = evidence_gains(np.array([[inner]]), np.array([rhs]), other.largest_diagonal)
    return over_sizes(known.gain) + _about(times, size) + other.shift


def evidence_of_same_size(real: EffectInformation, sim: EffectInformation) -> float:
    """Ln evidence of a random effect of the same size in both (6)."""
    return over_sizes(real.gain + sim.gain)


def probability_of_difference(
    difference: Array, covariance: Array, typical: Array
) -> float:
    """Probability that a difference (k,) with covariance (k, k) is real.

    `typical` (k,) is the typical size of a real difference.
    """
    odds = np.log(DIFFERS) - np.log1p(-DIFFERS)
    return float(
        probability_of_log_odds(
            odds + evidence_of_difference(difference, covariance, typical)
        )
    )


def evidence_of_difference(
    difference: Array, covariance: Array, typical: Array
) -> float:
    """Ln evidence of a difference, over that of none."""
    information = np.linalg.inv(covariance)
    inner = information * typical * typical[:, None]
    told = EffectInformation(
        inner, typical * (information @ difference), float(np.diag(inner).max())
    )
    return over_sizes(told.gain)


def likeliest_difference(found: Mapping[Relation, float]) -> Relation:
    """The likeliest relation among those that are a difference."""
    differing: list[Relation] = ["real", "simulator", "other"]
    return max(differing, key=lambda name: found.get(name, 0.0))


def probability_of_differing(found: Mapping[Relation, float]) -> float:
    """Probability that the two differ."""
    return 1.0 - found.get("neither", 0.0) - found.get("same", 0.0)
