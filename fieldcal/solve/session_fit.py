"""Fits parameter sets to the rows of one session, with the tilt that fits best.

The set contains what the method and the options ask for. If two models of the tilt fit
about equally well, the covariance includes the difference.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.calibration import Method
from fieldcal.calibration.names import TILTS, Tilt, group_of
from fieldcal.core.sentences import join_words
from fieldcal.model import thresholds
from fieldcal.model.causes.planned import parameters
from fieldcal.model.state import State
from fieldcal.solve.base_rate import known_earth_rate, with_base_rate
from fieldcal.solve.estimation import (
    ParameterEstimate,
    RecordedRows,
    estimate_parameters,
)
from fieldcal.solve.observation_rows import rows_of_observations, without_angles
from fieldcal.solve.observations import Observations
from fieldcal.solve.options import SolveOptions
from fieldcal.solve.parameter_set import ParameterSetOptions
from fieldcal.solve.rank import ladder_remedy


class SessionFit:
    """Fits of several parameter sets to the rows of one session.

    Parameters
    ----------
    observations : means of the windows
    options : options
    method : chosen method
    recorded : rows of the recording; None if there are only means
    earth : whether the gyroscopes measure the Earth's rate

    Attributes
    ----------
    base_rate : (3,) rad/s, the Earth's rate in base axes as far as it is known
    nominal : state to start from

    """

    def __init__(
        self,
        observations: Observations,
        options: SolveOptions,
        method: Method,
        recorded: RecordedRows | None,
        earth: bool = True,
    ) -> None:
        self.observations, self.options, self.method = observations, options, method
        navigation = observations.grade == "navigation"
        self.base_rate, self.earth_sigma = known_earth_rate(
            observations.latitude, navigation, options.heading, observations.base_motion
        )
        if not earth:
            self.base_rate, self.earth_sigma = np.zeros(3), (0.0, 0.0, 0.0)
        recorded_rows = recorded or rows_of_observations(observations)
        rows = recorded_rows.rows
        if method == "scalar":
            rows = without_angles(rows, observations.nominal)
        self.recorded = replace(
            recorded_rows, rows=with_base_rate(rows, self.base_rate)
        )
        self.turn_integrator = (
            self.recorded.turn_integrator() if observations.has_gyr else None
        )
        nominal = observations.nominal
        self.nominal = State(
            np.array([*nominal.acc_bias, *nominal.gyr_bias], dtype=float),
            np.array([*nominal.acc_scale, *nominal.gyr_scale], dtype=float),
            np.zeros((int(rows.x.position.max()) + 1, 2)),
            np.zeros(3),
        )

    def best_fit(self) -> tuple[ParameterEstimate, list[str]]:
        """The estimate with the model of the tilt that fits best, and remarks on it."""
        level, tilt = self.options.level_deg, self.options.tilt
        if self.method in ("scalar", "least_squares"):
            return self._fit("none"), []
        if level and tilt in ("auto", "none"):
            return self._fit("base_tilt", level), []
        if self.method == "two_position":
            return self._fit("none"), []
        if tilt != "auto":
            return self._fit(tilt, level), []
        return self._fit_best_tilt()

    @property
    def _other_tilt_deg(self) -> float:
        """Possible size of the other kind of tilt, deg; 0 if one kind is requested."""
        return self.options.beside_tilt_deg if self.options.tilt == "auto" else 0.0

    def _fit(
        self, tilt: Tilt, level: float | None = None, follow: bool = True
    ) -> ParameterEstimate:
        """Fit with a model of the tilt; without `follow`, to windows alone.

        An error of the factory has the size of the stated grade, unless it is rather as
        large as in the coarser grade that the biases show.
        """
        turning = self.turn_integrator if follow else None
        wanted = self._content(tilt, level, turned=turning is not None)
        estimate = estimate_parameters(
            self.recorded, turning, self.nominal, wanted, follow
        )
        if (stated := self.options.at_best) is None:
            return estimate
        chances = estimate.coarser_probabilities(stated)
        likely = [k for k, p in chances.items() if p < thresholds.NAMED]
        finer = {k: getattr(stated, k) for k in likely}
        if not finer:
            return estimate
        wanted = replace(wanted, factory=replace(wanted.factory, **finer))
        best = estimate_parameters(self.recorded, turning, self.nominal, wanted, follow)
        as_stated = np.prod([1 - chances[k] for k in finer])
        return best.with_model_uncertainty(best, estimate, 1 - float(as_stated))

    def _content(
        self, tilt: Tilt, level: float | None, turned: bool
    ) -> ParameterSetOptions:
        """What the parameter set contains with a model of the tilt.

        `level` is the uncertainty of the level of the base, deg; `turned` states that
        turns are fitted, which show the scale factors of the gyroscopes.
        """
        observations = self.observations
        table = bool(observations.rotating.any())
        sees_earth = (
            observations.grade == "navigation" and observations.latitude is not None
        )
        return ParameterSetOptions(
            tilt, cross=self.options.cross or self.method == "least_squares",
            gyro_cross=table or turned,
            gyr_scale=table or turned or (sees_earth and len(observations) > 1),
            level_deg=level, beside_tilt_deg=0.0 if level else self._other_tilt_deg,
            angles_deg=self.options.angles_deg, factory=self.options.factory,
            earth=self.earth_sigma, turned=turned, lot=self.options.lot,
        )  # fmt: skip

    def _fit_best_tilt(self) -> tuple[ParameterEstimate, list[str]]:
        """Fit with the better model of the tilt; the covariance includes the other one.

        The windows decide: turns add little to the choice.
        """
        fits = {name: self._fit(name, follow=False) for name in TILTS}
        usable = {n: e for n, e in fits.items() if determines_all(e)}
        if not usable:
            return self._fit("none"), [self._level_assumed_note()]
        if len(usable) == 1:
            name = next(iter(usable))
            return self._fit_all_rows(name, usable), [f"the tilt is taken as {name}"]
        ahead = usable["angle_offset"].score - usable["base_tilt"].score
        best, other = TILTS if ahead >= 0 else TILTS[::-1]
        ahead = abs(ahead)
        weight = 1 / (1 + float(np.exp(min(ahead, 50.0))))
        estimate = self._fit_all_rows(best, usable)
        mixed = estimate.with_model_uncertainty(usable[best], usable[other], weight)
        return mixed, [_tilt_note(best, other, ahead)]

    def _fit_all_rows(
        self, tilt: Tilt, by_windows: dict[Tilt, ParameterEstimate]
    ) -> ParameterEstimate:
        """Fit to all rows, if there are more than the windows used for the choice."""
        if self.turn_integrator is None and not self.recorded.explanations:
            return by_windows[tilt]
        return self._fit(tilt)

    def _level_assumed_note(self) -> str:
        extra = ladder_remedy(self.observations, parameters("angle_offset"))
        cure = f"; add {join_words(extra)} to find it" if extra else ""
        return (
            "these positions do not show the tilt, so the base is taken as level" + cure
        )


def _tilt_note(best: Tilt, other: Tilt, ahead: float) -> str:
    """Remark on the choice of the tilt, of which the best is `ahead` in ln Z."""
    if ahead > thresholds.TILT_LOG_MARGIN:
        return (
            f"the tilt is taken as {best}: {other} fits worse, by {2 * ahead:.0f}"
            " in chi2"
        )
    return (
        f"the tilt is taken as {best}, but these positions cannot tell it from"
        f" {other} (chi2 differs by {2 * ahead:.1f}): the uncertainties cover"
        " both; more positions with both angles turned would tell"
    )


def determines_all(estimate: ParameterEstimate) -> bool:
    """Whether all parameters of the accelerometers and the tilt are determined."""
    if not estimate.acc.dof and not estimate.acc.chi2 and not estimate.names:
        return False
    open_ = {group_of(n) for n in estimate.undetermined}
    return not open_ & {"acc_bias", "acc_scale", *TILTS}
