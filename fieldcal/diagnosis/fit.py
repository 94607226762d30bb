"""The fit of a recording's rows: causes, turns and nominal state."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.diagnosis.factory_left import factory_error_groups
from fieldcal.diagnosis.prepare import PreparedRecording
from fieldcal.model import thresholds
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.smoothing_left import UndoneSmoothing
from fieldcal.model.causes.wander import Wander
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.change_points import change_points
from fieldcal.model.rows.noise import rounding_noise
from fieldcal.model.rows.possible_restarts import possible_restarts
from fieldcal.model.rows.rest_onset import window_starts
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.state import State
from fieldcal.model.system.fitted import FittedSet
from fieldcal.model.system.turn_rows import Turns
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.model.turns.turn_tracker import TurnTracker
from fieldcal.session.description import Description


def build_fit(prepared: PreparedRecording) -> GaussNewton:
    """Set up the fit of a recording's rows: causes, turns and nominal state."""
    source, rows = prepared.source, prepared.rows
    about = source.about
    swayed = any(t.effect.kind == "motion" for t in prepared.spectral_lines)
    turned = bool(about.positions) and not swayed  # a base that rocks turns it as well
    nominal = nominal_state(about, int(rows.x.position.max()) + 1, prepared)
    unit = np.abs(nominal.scale)
    dictionary = Dictionary(
        rows.x, rows.used, times_since_turn(source, rows), rows.error_by_window, unit,
        turned, Wander.of(rows, unit), rows.session_error,
    )  # fmt: skip
    dictionary.unfitted = tuple(factory_error_groups(dictionary, about, prepared))
    dictionary.always += UndoneSmoothing.of(source).groups(dictionary)
    dictionary.add_instants(change_points(rows).tolist())
    dictionary.expect_within(possible_restarts(source.block, about))
    grain = rounding_noise(source.block, window_bounds(source.block, about))
    rough = bool((grain[:, :3] > thresholds.ROUNDING_SHARE * rows.noise[:3]).any())
    # swaying is removed from windows and closures, but not from samples within turns
    rough |= "sway" in prepared.checked.ids
    turning = TurnTracker(source, rows, dictionary.since)
    turns = Turns(turning, dictionary, not rough) if turned else None
    return GaussNewton(WindowSystem(rows, dictionary), nominal, turns)


def nominal_state(
    about: Description, places: int, prepared: PreparedRecording
) -> State:
    """The state that a simulation starts from."""
    nominal = about.nominal
    return State(
        np.concatenate([nominal["acc_bias"], nominal["gyr_bias"]]),
        np.concatenate([nominal["acc_scale"], nominal["gyr_scale"]]),
        np.zeros((places, 2)), np.zeros(3), prepared.known,
    )  # fmt: skip


def times_since_turn(source: RowSource, rows: Rows) -> Array:
    """Time since the turn, (o, n) s, for each possible origin of that time.

    The origin is the end of the motion, either as each window shows it, or a fixed time
    before each window: the usual time is the better guess where the end is hard to see.
    Each is given with and without a turn before the first window.
    """
    x, arrived = rows.x, source.rest_began
    if not source.about.positions or source.about.means_only:
        # of means nobody knows how long after the turn their samples were taken
        return np.full((1, len(x)), np.inf)
    starts = window_starts(source)
    lead = (starts - arrived)[np.isfinite(arrived)]
    usual = starts - (float(np.median(lead)) if len(lead) else 0.0)
    first = np.arange(len(starts)) == x.position.min()
    instants = [
        instant
        for arrivals in (arrived, usual)
        for instant in (arrivals, np.where(first, -np.inf, arrivals))
    ]
    return np.array([x.t - at[x.position] for at in instants])


def fit_calibration_only(whole: GaussNewton, rows: Rows) -> FittedSet:
    """Fit bias and scale factor alone to the windows."""
    d = whole.dictionary.calibration_only()
    fit = GaussNewton(WindowSystem(rows, d), whole.nominal)
    zeros: Array = np.zeros(d.width)
    state, values, _ = fit.settle(fit.nominal, zeros, ())
    wanted = fit.wanted_columns(())
    linear = fit.system.linearised(state, wanted)
    fitted = Sets(d, fit.gram_of(linear, values, wanted)).evaluate(())
    return FittedSet(rows, d, linear, values, fitted)
