"""A parameter set fitted to rows, and the estimate of its parameters.

The set is fitted until it converges (`settling`). The result there is averaged over the
effects that may exist in addition to the requested parameters (`averaging`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.factory import FactoryErrors
from fieldcal.core.samples import Array
from fieldcal.model import thresholds
from fieldcal.model.causes.cause import CLOSURE
from fieldcal.model.causes.known_rows import KnownRows
from fieldcal.model.causes.smoothing_left import UndoneSmoothing
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.evidence.unfitted_groups import chances_of_coarser
from fieldcal.model.posterior.mixture import Mixture
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.state import State
from fieldcal.model.system.turn_rows import TurnRows, Turns
from fieldcal.model.turns.turn_tracker import TurnTracker
from fieldcal.solve.agreement import TriadFit, triad_agreement
from fieldcal.solve.averaging import (
    AllParameters,
    average_explanations,
    lot_rows,
    parameter_matrix,
    select_determined,
)
from fieldcal.solve.end_values import end_values
from fieldcal.solve.explanations import WeightedExplanation
from fieldcal.solve.parameter_set import ParameterSet, ParameterSetOptions
from fieldcal.solve.reliability import WrongAngles, wrong_angles
from fieldcal.solve.settling import settle_without_bad_windows


@dataclass(frozen=True, slots=True)
class RecordedRows:
    """Rows of the windows, and the samples of the turns between them.

    Attributes
    ----------
    rows : rows of the windows
    since_turn : (o, n) time since the last turn, s, by origin
    source : samples of the turns; None if turns are not used
    explanations : explanations of the recording
    filters : equations of the second-order delay of the sensors' filters, measured by
        the accelerometers during turns: matrix (m, 2) by s^2 of each triad, and
        right-hand side (m,)
    cut_sigma : how much smaller each accelerometer's values may be because they were
        rounded toward zero, 1 sigma, m/s^2

    """

    rows: Rows
    since_turn: Array
    source: RowSource | None = None
    explanations: tuple[WeightedExplanation, ...] = ()
    filters: tuple[Array, Array] | None = None
    cut_sigma: tuple[float, ...] = ()

    def turn_integrator(self) -> TurnTracker | None:
        """Return the integrator of the turns; None if there are no turns."""
        if self.source is None:
            return None
        tracker = TurnTracker(self.source, self.rows, self.since_turn)
        return tracker if tracker.legs else None


@dataclass(frozen=True, slots=True)
class ParameterEstimate:
    """Estimate of the parameters of a set.

    Attributes
    ----------
    parameter_set : the set
    all_parameters : all parameters of the set, in its order
    names : (k,) parameters that the rows determine
    values, covariance : (k,), (k, k)
    undetermined : parameters that the rows do not determine
    mixture : posterior of the likeliest explanation
    score : log evidence of the set from all windows, before any is left out. Only this
        value can be compared between sets
    shift_sigmas : (k,) by how many sigmas the unrequested effects move each parameter
    sets : weighs sets of causes by the same rows
    acc, gyr : how well the windows of each triad agree
    turn_rows : rows of the turns
    contradicted_turns : pairs of used windows between which the rotation measured by
        the gyroscopes contradicts the positions
    wrong_angles : effect of wrong angles on the parameters, and how well it shows

    """

    parameter_set: ParameterSet
    all_parameters: AllParameters
    names: tuple[str, ...]
    values: Array
    covariance: Array
    undetermined: tuple[str, ...]
    mixture: Mixture
    score: float
    shift_sigmas: Array
    sets: Sets
    acc: TriadFit
    gyr: TriadFit
    turn_rows: tuple[TurnRows, ...]
    contradicted_turns: tuple[tuple[int, int], ...] = ()
    wrong_angles: tuple[WrongAngles, ...] = ()

    @property
    def sigma(self) -> Array:
        """Standard uncertainties, (k,)."""
        return np.sqrt(np.diag(self.covariance))

    def with_model_uncertainty(
        self, one: ParameterEstimate, other: ParameterEstimate, weight: float
    ) -> ParameterEstimate:
        """Add the difference from another model to the covariance.

        alpha0 turns about z and beta0 about x: these are the tilts of the base, taken
        in the other order.

        Parameters
        ----------
        one : this model, fitted to the rows that `other` is fitted to
        other : model with another kind of tilt, or another rate of the Earth
        weight : probability of `other`

        """
        twin = {"angle_offset.alpha0_deg": "base_tilt.about_z_deg",
                "angle_offset.beta0_deg": "base_tilt.about_x_deg"}  # fmt: skip
        twin |= {b: a for a, b in twin.items()}
        ours, theirs = (dict(zip(e.names, e.values, strict=True)) for e in (one, other))
        at = [i for i, n in enumerate(self.names)
              if n in ours and twin.get(n, n) in theirs]  # fmt: skip
        named = [self.names[i] for i in at]
        apart = np.array([theirs[twin.get(n, n)] - ours[n] for n in named])
        more = np.zeros_like(self.covariance)
        more[np.ix_(at, at)] = np.outer(apart, apart) + _excess_covariance(
            one.covariance_of(named),
            other.covariance_of([twin.get(n, n) for n in named]),
        )
        return replace(self, covariance=self.covariance + weight * more)

    def covariance_of(self, names: Sequence[str]) -> Array:
        """Covariance of the named parameters, in the order of the names."""
        at = [self.names.index(name) for name in names]
        return self.covariance[np.ix_(at, at)]

    def coarser_probabilities(self, stated: FactoryErrors) -> dict[str, float]:
        """Probability that each kind of error is as in the set, and not as stated."""
        state = self.sets.evaluate(self.parameter_set.members).state
        left = [g for _, g in self.parameter_set.base_members if g.cause == "factory"]
        return chances_of_coarser(
            state, left, self.parameter_set.options.factory, stated
        )

    @property
    def causes(self) -> dict[str, float]:
        """Unrequested causes in the set, with their probabilities."""
        out: dict[str, float] = {}
        for explanation in self.parameter_set.explanations:
            names = (cause.name for cause, _ in explanation.members if cause.reportable)
            for name in dict.fromkeys(names):
                out[name] = out.get(name, 0.0) + explanation.probability
        return dict(sorted(out.items(), key=lambda item: -item[1]))

    @property
    def any_cause_probability(self) -> float:
        """Probability that at least one unrequested cause is present."""
        return sum(
            explanation.probability
            for explanation in self.parameter_set.explanations
            if any(cause.reportable for cause, _ in explanation.members)
        )

    @property
    def valid_at_s(self) -> float | None:
        """Time for which biases are stated, s since the start, if they may change."""
        d = self.parameter_set
        changing = sum(
            one.probability
            for one in d.explanations
            if end_values(d, [one]).bias_scale.any()
        )
        if changing < thresholds.MENTIONED:
            return None
        x = d.x
        return float((x.since_start + x.lasts / 2).max())

    @property
    def changing_causes(self) -> dict[str, float]:
        """What may change biases or scale factors, noise too, with probabilities."""
        d, out = self.parameter_set, dict[str, float]()
        for one in d.explanations:
            changing = (
                member[0].name
                for member in (*one.members, *one.possible_members)
                if end_values(d, [WeightedExplanation((member,), 1.0)]).bias_scale.any()
            )
            for name in dict.fromkeys(changing):
                out[name] = out.get(name, 0.0) + one.probability
        return dict(sorted(out.items(), key=lambda item: -item[1]))

    @property
    def bad_probability(self) -> Array:
        """Probability that each window is bad, (n,) in the order of the positions."""
        out = np.zeros(int(self.parameter_set.window_positions.max()) + 1)
        out[self.parameter_set.window_positions] = self.mixture.bad
        return out

    @property
    def closure_squares(self) -> tuple[float, int]:
        """Sum of squares of the normalised closures of turns, and their number."""
        full = np.zeros(self.parameter_set.width)
        np.add.at(full, self.mixture.columns, self.mixture.mean)
        turns = self.turn_rows
        off = [(t.closure - t.design @ full[t.columns]) ** 2 * t.info for t in turns]
        white = np.concatenate([np.zeros(0), *off])
        return float(white.sum()), len(white)


def _excess_covariance(ours: Array, theirs: Array) -> Array:
    """Excess of the covariance `theirs` over `ours`, where it is larger; else zero."""
    sigma = np.sqrt(np.diag(ours))
    size, along = np.linalg.eigh((theirs - ours) / np.outer(sigma, sigma))
    along = along * sigma[:, None]
    larger: Array = (along * np.maximum(size, 0.0)) @ along.T
    return larger


def estimate_parameters(
    recorded: RecordedRows,
    turning: TurnTracker | None,
    nominal: State,
    wanted: ParameterSetOptions,
    averaged: bool = True,
) -> ParameterEstimate:
    """Fit a parameter set to rows.

    Parameters
    ----------
    recorded : the rows
    turning : integrator of their turns; None if turns are not used
    nominal : state to start from
    wanted : contents of the set
    averaged : whether to average over all explanations; otherwise the likeliest one

    """
    parameter_set = ParameterSet(
        recorded.rows, np.abs(nominal.scale), recorded.since_turn, turning is not None,
        wanted, recorded.explanations, recorded.cut_sigma,
    )  # fmt: skip
    if recorded.source is not None:
        parameter_set.always += UndoneSmoothing.of(recorded.source).groups(
            parameter_set
        )
    parameter_set.known = _known_rows(parameter_set, recorded, nominal)
    turns = None if turning is None else Turns(turning, parameter_set, False)
    fit = settle_without_bad_windows(recorded.rows, parameter_set, nominal, turns)
    mixture, gram = fit.mixture, fit.gram
    parameters = average_explanations(parameter_set, gram, mixture, nominal, averaged)
    picked = parameter_matrix(parameter_set, mixture.columns)
    names, values, covariance, moved, missing = select_determined(
        parameter_set, parameters
    )
    at = [parameter_set.names.index(name) for name in names]
    elsewhere = turning.contradicted_turns if turning else ()
    counts = set(
        parameter_set.window_positions[mixture.bad <= thresholds.CERTAIN].tolist()
    )
    return ParameterEstimate(
        parameter_set, parameters, names, values, covariance, missing, mixture,
        fit.score, moved,
        Sets(parameter_set, gram),
        triad_agreement(gram, parameter_set, mixture, (0, 1, 2)),
        triad_agreement(gram, parameter_set, mixture, (3, 4, 5)),
        fit.turn_rows,
        tuple(pair for pair in elsewhere if counts.issuperset(pair)),
        tuple(wrong_angles(parameter_set, mixture, names, picked[at])),
    )  # fmt: skip


def _known_rows(
    parameter_set: ParameterSet, recorded: RecordedRows, nominal: State
) -> KnownRows | None:
    """Prior knowledge of columns from the lot and from the accelerometers in turns."""
    lot, rows = parameter_set.options.lot, []
    if lot is not None and (known := lot_rows(parameter_set, lot, nominal)) is not None:
        rows.append(known)
    group, measured = parameter_set.filters, recorded.filters
    if group is not None and measured is not None and len(measured[1]):
        rows.append(KnownRows(group.columns, *measured))
    return KnownRows.concatenated(rows) if rows else None


def window_scatter(mixture: Mixture, channels: tuple[int, ...]) -> float:
    """Rms scatter of the windows of a triad beyond their noise, in outputs."""
    return float(np.sqrt(np.mean(mixture.scatter[list(channels)] ** 2)))


def closure_scatter(mixture: Mixture) -> float:
    """Rms scatter of the closures of turns beyond their noise, rad."""
    return float(mixture.scatter[CLOSURE])
