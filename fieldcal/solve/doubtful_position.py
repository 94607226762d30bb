"""A position that disagrees with the others, with its probability and the remedy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from fieldcal.core.samples import Array
from fieldcal.model import thresholds
from fieldcal.solve.observations import Observations


@dataclass(frozen=True, slots=True)
class DoubtfulPosition:
    """A position that may be disturbed.

    Attributes
    ----------
    name : name of the position
    probability : that its window is bad

    """

    name: str
    probability: float

    @classmethod
    def of(cls, observations: Observations, bad: Array) -> DoubtfulPosition | None:
        """The most doubtful position by probabilities (n,); None if all agree."""
        worst = int(bad.argmax())
        if bad[worst] < thresholds.SUSPECT:
            return None
        return cls(observations.positions[worst].name, float(bad[worst]))

    @classmethod
    def from_json(cls, value: Mapping[str, Any] | None) -> DoubtfulPosition | None:
        """Read what `to_json` wrote."""
        return cls(value["name"], value["probability"]) if value else None

    def to_json(self) -> dict[str, Any]:
        """Return the object of result.json."""
        return asdict(self)

    @property
    def sentence(self) -> str:
        """The disagreement, and the remedy."""
        if self.probability > thresholds.CERTAIN:
            return (
                f"the position {self.name} disagrees with all others and was given no"
                " weight: take it again"
            )
        return (
            f"the position {self.name} may be disturbed (probability"
            f" {100 * self.probability:.0f} %) and has less weight, which the"
            " uncertainties include: take it again"
        )
