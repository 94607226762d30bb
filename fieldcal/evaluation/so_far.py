"""What the windows taken so far are good for, while a run goes on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.diagnosis.explain import Explanation
from fieldcal.evaluation.solution import Laid


@dataclass(frozen=True, slots=True)
class SoFar:
    """A judgement about a session that is being recorded.

    Attributes
    ----------
    laid : its windows
    limits : of the device's grade
    found : its calibration with the decision about it; None where there is none
    says : why there is none
    failed : names of the checks that failed and that further positions may mend

    """

    laid: Laid
    limits: GradeLimits
    found: Calibration | None
    says: str = ""
    failed: tuple[str, ...] = ()

    @property
    def quick(self) -> bool:
        """Whether its search began with what was found before."""
        return self.laid.before is not None

    @property
    def explanation(self) -> Explanation | None:
        """What the recording shows to be there; None where it cannot be examined."""
        return self.laid.explanation

    @property
    def enough(self) -> bool:
        """Whether nothing failed that further positions may mend."""
        return self.found is not None and not self.failed

    @property
    def remedy(self) -> Mapping[str, Any] | None:
        """What would make it GO, as result.json has it; None if it is, or nothing."""
        decision = {} if self.found is None else self.found.info["decision"]
        remedy: Mapping[str, Any] | None = decision.get("remedy")
        return remedy

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it is NO-GO; empty where it is GO."""
        if self.found is None:
            return (self.says,)
        return tuple(self.found.info["decision"]["reasons"])
