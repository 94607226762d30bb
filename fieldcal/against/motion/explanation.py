"""The explanation of a recording in motion, and others that are nearly as likely."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.against.motion.fit import MotionFit
from fieldcal.model import thresholds
from fieldcal.model.causes.motion_dictionary import MotionDictionary
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.probabilities import Posterior, ProbableCause
from fieldcal.model.rows.motion import MotionRows
from fieldcal.model.search.inference import InferenceResult


@dataclass(frozen=True, slots=True)
class Rival:
    """Causes that explain a recording as well as others, and their ln evidence."""

    names: frozenset[str]
    evidence: float


@dataclass(frozen=True)
class MotionExplanation:
    """The explanation of a recording in motion by its reference and causes.

    Attributes
    ----------
    fit : alignment and noise
    inferred : the best set of causes, its state, and the search
    posterior : probabilities of all causes
    evidence : ln, including that of the noise
    rivals : others that are nearly as likely; the best set does not show them, as the
        columns about its filters are not those about others

    """

    fit: MotionFit
    inferred: InferenceResult
    posterior: Posterior
    evidence: float
    rivals: tuple[Rival, ...] = ()

    @property
    def rows(self) -> MotionRows:
        """Rows at the estimated alignment."""
        return self.fit.rows

    @property
    def dictionary(self) -> MotionDictionary:
        """Columns of all causes."""
        return self.fit.system.dictionary

    @property
    def set(self) -> Set:
        """The best set of causes."""
        return self.inferred.best

    @property
    def names(self) -> frozenset[str]:
        """Names of the causes of the best set."""
        return reportable_names(self.set.members)

    def beside(self, others: Iterable[Rival]) -> MotionExplanation:
        """The explanation with the others that are its rivals."""
        likeliest = sorted(others, key=lambda one: one.evidence)
        rivals = {
            one.names: one
            for one in likeliest
            if one.names - self.names
            and self._behind(one) < thresholds.ALTERNATIVE_LOG_DISTANCE
        }
        return replace(self, rivals=tuple(rivals.values()))

    def probable_causes(self) -> list[ProbableCause]:
        """Causes that are likelier present than absent, with rivals' as aliases."""
        causes = [self._beside_rivals(c) for c in self.posterior.probable_causes()]
        return [c for c in causes if c.probability >= thresholds.NAMED]

    def _beside_rivals(self, cause: ProbableCause) -> ProbableCause:
        """A cause with the probability that rivals without it leave to it.

        Rivals that stand for the best set give it aliases instead.
        """
        without = [r for r in self.rivals if cause.name not in r.names]
        near = [r for r in without if self._behind(r) < thresholds.ALIAS_LOG_MARGIN]
        ahead = np.array([0.0, *(-self._behind(r) for r in self.rivals)])
        shares = np.exp(ahead - np.logaddexp.reduce(ahead))[1:]
        apart = [r in without and r not in near for r in self.rivals]
        added = sorted(frozenset().union(*(r.names for r in near)) - self.names)
        return replace(
            cause,
            probability=cause.probability * float(1 - shares[apart].sum()),
            aliases=tuple(dict.fromkeys((*cause.aliases, *added))),
        )

    def _behind(self, rival: Rival) -> float:
        return self.evidence - rival.evidence


def reportable_names(members: Iterable[Member]) -> frozenset[str]:
    """Names of the causes of some members that may be told."""
    return frozenset(c.name for c, _ in members if c.reportable)
