"""Chooses the parameter set for the requested calibration, and fits it.

    two known positions            two_position      bias and scale factor
    more known positions           joint             and the tilt that the data prefer
    positions without angles       scalar            by the length of the force
    rates of a table               least_squares     for the gyroscopes

Each method fits all rows at once: windows, the turns between them if they were
recorded, the Earth's rate as far as it is known, and the uncertainty of set angles. If
two models of the tilt fit about equally well, the uncertainty includes the difference.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from fieldcal.calibration import Calibration, Method
from fieldcal.calibration.lot_prior import LotPrior
from fieldcal.calibration.names import TILTS, Tilt, group_of
from fieldcal.core.factory import FactoryErrors
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.sentences import join_words
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.planned import parameters
from fieldcal.model.state import State
from fieldcal.solve import printed
from fieldcal.solve.base_rate import known_earth_rate, with_base_rate
from fieldcal.solve.estimation import (
    ParameterEstimate,
    RecordedRows,
    estimate_parameters,
)
from fieldcal.solve.latitude import VerticalEarthRate
from fieldcal.solve.lot_contribution import combine_with_lot
from fieldcal.solve.observation_rows import rows_of_observations, without_angles
from fieldcal.solve.observations import Observations
from fieldcal.solve.options import SolveOptions
from fieldcal.solve.parameter_set import ParameterSetOptions
from fieldcal.solve.rank import ladder_remedy
from fieldcal.solve.result import build_calibration

EarthRateModel = Literal["stated", "another", "none"]
"""Earth's rate in the gyroscopes: of the stated latitude, of another one, or none."""

COARSER_GRADE_CHANCE = 0.5
"""Probability from which an error is taken to be as large as in the coarser grade."""

NO_EARTH = (
    "the gyroscopes do not show the Earth's rate, as those of a simulator without it:"
    " their biases are stated without; real ones that do so take out what is a bias"
)
"""Warning if the Earth's rate is absent."""


def solve(
    observations: Observations,
    method: Method | Literal["auto"] = "auto",
    tilt: Tilt | Literal["auto"] = "auto",
    cross: bool = False,
    as_printed: bool = False,
    level_sigma_deg: float | None = None,
    heading_sigma_deg: float | None = None,
    angle_sigma_deg: float = 0.0,
    beside_tilt_sigma_deg: float = 0.0,
    recorded: RecordedRows | None = None,
    lot: LotPrior | None = None,
    factory: FactoryErrors | None = None,
    at_best: FactoryErrors | None = None,
) -> Calibration:
    """Estimate the calibration.

    Parameters
    ----------
    observations : n windows, see `Observations`
    method : "auto" takes two_position for two known positions, joint for more, scalar
        where angles are unknown; the method taken is named in the result
    tilt : model of the base's tilt; "auto" estimates it where the positions show it
    cross : estimate cross-coupling (non-orthogonality in the scalar method)
    as_printed : closed forms with the misprints of the paper, to compare
    level_sigma_deg : uncertainty of the level of the base about each level axis; the
        tilt is then that of the base, with this prior
    heading_sigma_deg : uncertainty of the direction of z from north; None means unknown
        for tactical grade, and exact for navigation grade
    angle_sigma_deg : uncertainty of each position's angles, about each level axis
    beside_tilt_sigma_deg : possible size of a tilt of the base besides offsets of the
        joints, or the other way round, if "auto" takes one of them
    recorded : the rows of the recording that the observations are means of, and its
        turns; of means alone there is one row for each window
    factory : sizes of errors that the factory left and that are not estimated; None for
        no errors
    at_best : the same for the stated grade, if `factory` is that of a coarser grade
        that the biases show; the rows decide for each kind of error
    lot : prior from the unit's lot; it is not used if the unit is an outlier

    Raises
    ------
    InputError
        If an argument is none of those listed.
    NotObservable
        If the positions determine no parameter.

    >>> from fieldcal.core.positions import TWO_POSITIONS
    >>> mean = np.zeros((2, 6))
    >>> mean[:, :3] = [[0.1, -9.81, 0.2], [-6.83672, -6.91037, 0.80457]]
    >>> cov = np.tile(np.diag([1e-6] * 3 + [1e-10] * 3), (2, 1, 1))
    >>> result = solve(Observations(TWO_POSITIONS, mean, cov, gravity=9.81))
    >>> result.method, np.round(result.vector("acc_scale")[0], 4).tolist()
    ('two_position', [1.0, 1.0, 1.0])
    """
    options = SolveOptions(
        method, tilt, cross, as_printed,
        level_sigma_deg, heading_sigma_deg, angle_sigma_deg, beside_tilt_sigma_deg, lot,
        factory or FactoryErrors(), at_best,
    )  # fmt: skip
    if as_printed:
        return printed.solve(observations, options)
    return _solve_with_lot(
        observations, options, options.method_for(observations), recorded
    )


def _solve_with_lot(
    observations: Observations,
    options: SolveOptions,
    method: Method,
    recorded: RecordedRows | None,
) -> Calibration:
    """The calibration of the session alone, or with its lot if the unit fits to it."""
    alone = replace(options, lot=None)
    estimate, notes = _fit_over_earth_rates(observations, alone, method, recorded)
    contribution = None
    if options.lot is not None:
        with_lot, lot_notes = _fit_over_earth_rates(
            observations, options, method, recorded
        )
        estimate, contribution = combine_with_lot(estimate, with_lot, options.lot)
        notes = notes if contribution is None or contribution.refused else lot_notes
    return build_calibration(
        method, observations, options, estimate, notes, contribution
    )


def _fit_over_earth_rates(
    observations: Observations,
    options: SolveOptions,
    method: Method,
    recorded: RecordedRows | None,
) -> tuple[ParameterEstimate, list[str]]:
    """Fit with the Earth's rate of the stated latitude, of another one, and with none.

    The most likely one is the result. Its covariance includes the differences from the
    others, weighted by their probabilities. Simulators may have no Earth's rate.
    """

    def fitted(earth: EarthRateModel) -> tuple[ParameterEstimate, list[str]]:
        return _SessionFit(observations, options, method, recorded, earth).best_fit()

    estimate, notes = fitted("stated")
    shown = VerticalEarthRate.of(
        estimate.parameter_set, estimate.sets, observations.latitude
    )
    if shown is None or not shown.other_favoured:
        return estimate, notes
    other, (none, others) = fitted("another")[0], fitted("none")
    ahead = none.score - estimate.score + np.log(priors.WRONG_LATITUDE_CHANCE)
    score = np.array([0.0, shown.gain, ahead])
    weights = np.exp(score - score.max())
    as_said, elsewhere, absent = (weights / weights.sum()).tolist()
    if ahead > max(0.0, shown.gain):
        mixed = none.with_model_uncertainty(none, estimate, as_said)
        return mixed.with_model_uncertainty(none, other, elsewhere), [NO_EARTH, *others]
    mixed = estimate.with_model_uncertainty(estimate, other, elsewhere)
    return mixed.with_model_uncertainty(estimate, none, absent), notes


class _SessionFit:
    """Fits of several parameter sets to the rows of one session.

    Parameters
    ----------
    observations : means of the windows
    options : options
    method : chosen method
    recorded : rows of the recording; None if there are only means
    earth : Earth's rate in the gyroscopes

    """

    def __init__(
        self,
        observations: Observations,
        options: SolveOptions,
        method: Method,
        recorded: RecordedRows | None,
        earth: EarthRateModel = "stated",
    ) -> None:
        self.observations, self.options, self.method = observations, options, method
        navigation = observations.grade == "navigation"
        base, self.earth_sigma = known_earth_rate(
            observations.latitude, navigation, options.heading, observations.base_motion
        )
        if earth == "another":
            self.earth_sigma = (self.earth_sigma[0], EARTH_RATE, self.earth_sigma[2])
        elif earth == "none":
            base, self.earth_sigma = np.zeros(3), (0.0, 0.0, 0.0)
        recorded_rows = recorded or rows_of_observations(observations)
        rows = recorded_rows.rows
        if method == "scalar":
            rows = without_angles(rows, observations.nominal)
        self.recorded = replace(recorded_rows, rows=with_base_rate(rows, base))
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
        """Fit with a model of the tilt; without `follow`, to windows alone."""
        turning = self.turn_integrator if follow else None
        observations, turned = self.observations, turning is not None
        table = bool(observations.rotating.any())
        sees_earth = (
            observations.grade == "navigation" and observations.latitude is not None
        )
        crossed = self.options.cross or self.method == "least_squares"
        wanted = ParameterSetOptions(
            tilt,
            cross=crossed,
            gyro_cross=table or turned,
            gyr_scale=table or turned or (sees_earth and len(observations) > 1),
            level_deg=level,
            beside_tilt_deg=0.0 if level else self._other_tilt_deg,
            angles_deg=self.options.angles_deg,
            factory=self.options.factory,
            earth=self.earth_sigma,
            turned=turned,
            lot=self.options.lot,
        )
        estimate = estimate_parameters(
            self.recorded, turning, self.nominal, wanted, follow
        )
        if (stated := self.options.at_best) is None:
            return estimate
        chances = estimate.coarser_probabilities(stated)
        finer = {
            k: getattr(stated, k)
            for k, p in chances.items()
            if p < COARSER_GRADE_CHANCE
        }
        if not finer:
            return estimate
        wanted = replace(wanted, factory=replace(wanted.factory, **finer))
        best = estimate_parameters(self.recorded, turning, self.nominal, wanted, follow)
        as_stated = np.prod([1 - chances[k] for k in finer])
        return best.with_model_uncertainty(best, estimate, 1 - float(as_stated))

    def _fit_best_tilt(self) -> tuple[ParameterEstimate, list[str]]:
        """Fit with the better model of the tilt; the covariance includes the other one.

        The windows decide: turns add little to the choice.
        """
        fits = {name: self._fit(name, follow=False) for name in TILTS}
        usable = {n: e for n, e in fits.items() if _determines_all(e)}
        if not usable:
            return self._fit("none"), [self._level_assumed_note()]
        if len(usable) == 1:
            name = next(iter(usable))
            return self._fit_all_rows(name, usable), [f"the tilt is taken as {name}"]
        ahead = usable["angle_offset"].score - usable["base_tilt"].score
        best, other = TILTS if ahead >= 0 else TILTS[::-1]
        ahead = abs(ahead)
        if ahead > thresholds.TILT_LOG_MARGIN:
            note = (
                f"the tilt is taken as {best}: {other} fits worse, by {2 * ahead:.0f}"
                " in chi2"
            )
        else:
            note = (
                f"the tilt is taken as {best}, but these positions cannot tell it from"
                f" {other} (chi2 differs by {2 * ahead:.1f}): the uncertainties cover"
                " both; more positions with both angles turned would tell"
            )
        weight = 1 / (1 + float(np.exp(min(ahead, 50.0))))
        estimate = self._fit_all_rows(best, usable)
        return estimate.with_model_uncertainty(usable[best], usable[other], weight), [
            note
        ]

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


def _determines_all(estimate: ParameterEstimate) -> bool:
    """Whether all parameters of the accelerometers and the tilt are determined."""
    if not estimate.acc.dof and not estimate.acc.chi2 and not estimate.names:
        return False
    open_ = {group_of(n) for n in estimate.undetermined}
    return not open_ & {"acc_bias", "acc_scale", *TILTS}
