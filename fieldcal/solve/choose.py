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
from fieldcal.calibration.names import Tilt
from fieldcal.core.factory import FactoryErrors
from fieldcal.model import priors
from fieldcal.solve import printed
from fieldcal.solve.estimation import ParameterEstimate, RecordedRows
from fieldcal.solve.latitude import VerticalEarthRate
from fieldcal.solve.lot_contribution import combine_with_lot
from fieldcal.solve.observations import Observations
from fieldcal.solve.options import SolveOptions
from fieldcal.solve.other_earth_rates import OtherEarthRates
from fieldcal.solve.result import build_calibration
from fieldcal.solve.session_fit import SessionFit

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
    session = SessionFit(observations, options, method, recorded)
    estimate, notes = session.best_fit()
    shown = VerticalEarthRate.of(
        estimate.parameter_set, estimate.sets, observations.latitude
    )
    if shown is None or not shown.other_favoured:
        return estimate, notes
    rates = OtherEarthRates.of(estimate, session.nominal, session.base_rate)
    ahead = rates.none.score - rates.stated.score + np.log(priors.WRONG_LATITUDE_CHANCE)
    score = np.array([0.0, shown.gain, ahead])
    weights = np.exp(score - score.max())
    as_said, elsewhere, absent = (weights / weights.sum()).tolist()
    if ahead > max(0.0, shown.gain):
        bare = SessionFit(observations, options, method, recorded, earth=False)
        none, others = bare.best_fit()
        mixed = none.with_model_uncertainty(rates.none, rates.stated, as_said)
        mixed = mixed.with_model_uncertainty(rates.none, rates.another, elsewhere)
        return mixed, [NO_EARTH, *others]
    mixed = estimate.with_model_uncertainty(rates.stated, rates.another, elsewhere)
    return mixed.with_model_uncertainty(rates.stated, rates.none, absent), notes
