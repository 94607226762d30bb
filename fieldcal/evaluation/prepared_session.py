"""A recorded session with its windows, as the estimators take it.

The rows are those of `diagnose`: means over parts of windows with the noise measured in
the recording, after samples were corrected and lines were subtracted. Of a disturbed
window the undisturbed parts are used, if the device stayed in the same position.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.diagnosis.explain import Explanation, explain
from fieldcal.diagnosis.fit import times_since_turn
from fieldcal.diagnosis.prepare import PreparedRecording, prepare_recording
from fieldcal.evaluation.observations import build_observations
from fieldcal.evaluation.rounding_mode import (
    RoundingMode,
    rounding_mode,
)
from fieldcal.evaluation.undisturbed_span import undisturbed_span
from fieldcal.evaluation.usable_windows import UsableWindows, reported_grain
from fieldcal.session.description import Description
from fieldcal.session.folder import Session
from fieldcal.solve import Observations
from fieldcal.solve.estimation import RecordedRows
from fieldcal.solve.explanations import WeightedExplanation
from fieldcal.solve.observation_rows import mean_variances, with_window_variances
from fieldcal.windows.dead_band import dead_band_messages


@dataclass(frozen=True)
class PreparedSession:
    """A session with its windows, prepared for the estimators.

    Attributes
    ----------
    session : the recording
    windows : its usable windows
    previous : explanation of a part of the recording, from which the search may start

    """

    session: Session
    windows: UsableWindows
    previous: Explanation | None = None

    @cached_property
    def order(self) -> list[int]:
        """Indices into `windows`, in the order of time."""
        averages = self.windows.averages
        return sorted(range(len(averages)), key=lambda i: averages[i].start)

    @cached_property
    def about(self) -> Description:
        """Description of the session with these windows and their undisturbed spans."""
        about, windows = self.session.about, self.windows
        rows = [windows.position_numbers[i] for i in self.order]
        averages = [windows.averages[i] for i in self.order]
        ends = [
            undisturbed_span(self.session.block, about.windows[r], average)
            for r, average in zip(rows, averages, strict=True)
        ]
        return replace(
            about,
            positions=tuple(about.positions[r] for r in rows),
            windows=tuple((a, float(np.nextafter(b, np.inf))) for a, b in ends),
            position_numbers=tuple(rows),
        )

    @cached_property
    def observations(self) -> Observations:
        """Means of the windows, in the order of time."""
        averages = [self.windows.averages[i] for i in self.order]
        return build_observations(self.about, averages, range(len(averages)))

    @cached_property
    def rounding(self) -> RoundingMode:
        """Uncertainty of how the device rounds its values."""
        return rounding_mode(self.session, reported_grain(self.session))

    @cached_property
    def examination(self) -> tuple[PreparedRecording | None, str]:
        """The checked and reduced recording, or None and the reason."""
        try:
            return prepare_recording(self.session.block, self.about), ""
        except InputError as error:
            return None, str(error)

    @property
    def reduced_recording(self) -> PreparedRecording | None:
        """The checked and reduced recording; None if it cannot be examined."""
        return self.examination[0]

    @cached_property
    def explanation(self) -> Explanation | None:
        """Explanation of the recording; None if it cannot be examined."""
        if self.reduced_recording is None:
            return None
        return explain(self.reduced_recording, self.previous)

    @property
    def sample_warnings(self) -> list[str]:
        """Warnings of what samples hide, or that only the windows' means are used."""
        why = self.examination[1]
        if not why:
            return list(dead_band_messages(self.session.block, self.observations.mean))
        return [
            f"only the windows' means are used, neither samples nor turns nor [model],"
            f" since the recording cannot be examined: {why}"
        ]

    def recorded_rows(
        self, turns: bool, shown: Explanation | None = None
    ) -> RecordedRows | None:
        """Rows of the windows, and samples of the turns if these are to be used.

        `shown` is the explanation of the recording. None if it cannot be examined.
        """
        if self.reduced_recording is None:
            return None
        source, rows = self.reduced_recording.source, self.reduced_recording.rows
        measured = (self.observations.has_acc, self.observations.has_gyr)
        sd = np.full_like(rows.sd, np.nan)
        for c in np.flatnonzero(measured):
            sd[:, 3 * c : 3 * c + 3] = rows.sd[:, 3 * c : 3 * c + 3]
        rows = replace(rows, sd=sd)
        known = mean_variances(self.observations)
        known[:, :3] += self.rounding.variance_near_zero(self.observations.mean[:, :3])
        rows = with_window_variances(rows, known)
        likely = () if shown is None else shown.posterior.weights
        return RecordedRows(
            rows,
            times_since_turn(source, rows),
            source if turns else None,
            tuple(WeightedExplanation.of(s, p) for s, p in likely),
            None if shown is None else shown.filter_rows,
            tuple(self.rounding.cut_sigma.tolist()),
        )
