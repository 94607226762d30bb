"""Calibration and decision from the windows recorded so far in a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.diagnosis.explain import Explanation
from fieldcal.evaluation.prepared_session import PreparedSession


@dataclass(frozen=True, slots=True)
class InterimResult:
    """Judgement of a session that is still being recorded.

    Attributes
    ----------
    prepared_session : the session with its windows
    limits : limits of the device's grade
    calibration : calibration with its decision; None if it failed
    failure : why there is no calibration; else empty
    failed_checks : names of failed checks that further positions may correct

    """

    prepared_session: PreparedSession
    limits: GradeLimits
    calibration: Calibration | None
    failure: str = ""
    failed_checks: tuple[str, ...] = ()

    @property
    def incremental(self) -> bool:
        """Whether the search started from the previous explanation."""
        return self.prepared_session.previous is not None

    @property
    def explanation(self) -> Explanation | None:
        """Explanation of the recording; None if it cannot be examined."""
        return self.prepared_session.explanation

    @property
    def sufficient(self) -> bool:
        """Whether no check failed that further positions may correct."""
        return self.calibration is not None and not self.failed_checks

    @property
    def remedy(self) -> Mapping[str, Any] | None:
        """Remedy of a NO-GO as in result.json; None if GO, or if there is none."""
        decision = {} if self.calibration is None else self.calibration.info["decision"]
        remedy: Mapping[str, Any] | None = decision.get("remedy")
        return remedy

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it is NO-GO; empty where it is GO."""
        if self.calibration is None:
            return (self.failure,)
        return tuple(self.calibration.info["decision"]["reasons"])
