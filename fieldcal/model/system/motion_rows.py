"""Rows in motion, linearised: cosine coefficients, whitened by the noise's spectrum."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array, Index, Mask
from fieldcal.model.causes.basis import Course, RowView
from fieldcal.model.causes.cause import TRIADS, Basis
from fieldcal.model.causes.motion_dictionary import MotionDictionary
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.rows.coloured_noise import Bands
from fieldcal.model.rows.motion import MotionRows
from fieldcal.model.state import State
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.linear_system import System


class MotionSystem(System):
    """Rows in motion and their dictionary, linearised about states.

    Parameters
    ----------
    dictionary : their columns
    power : (n, 6) of the noise of each coefficient

    """

    def __init__(self, dictionary: MotionDictionary, power: Array) -> None:
        super().__init__(dictionary)
        self.dictionary: MotionDictionary = dictionary
        self.power = power

    @property
    def motion(self) -> MotionRows:
        """The rows at the current alignment with the reference."""
        return self.dictionary.current.rows

    def independent_copy(self) -> MotionSystem:
        """The same rows with a copy of the dictionary."""
        return MotionSystem(self.dictionary.independent_copy(), self.power)

    @property
    def used(self) -> Mask:
        """Rows with a value, by channel, (n, 6)."""
        return self.motion.used

    def _about(self, state: State) -> tuple[Callable[[Basis], Array], Array]:
        """What evaluates a basis about a state, and recorded less calculated, (n, 6).

        Columns of gyroscopes have inputs of their own if the responses differ.
        """
        d = self.dictionary
        inputs = [d.x] if d.gyro_inputs is d.x else [d.x, d.gyro_inputs]
        views = [RowView.of(x, d.since, state) for x in inputs]

        def table_of(basis: Basis) -> Array:
            table = basis.evaluate(views[0])
            if len(views) == 1 or isinstance(basis, Course):
                return table
            of_gyr = basis.evaluate(views[1])
            return np.concatenate([table[:, ACC], of_gyr[:, GYR]], axis=1)

        return table_of, np.where(self.used, self._off(views, state), 0.0)

    def _off(self, views: Sequence[RowView], state: State) -> Array:
        """Recorded less calculated outputs, (n, 6).

        The inputs contain the known responses of the sensors already, so these are
        subtracted from the state's.
        """
        rows, since = self.motion, self.dictionary.since
        acc, gyr = views[0].x, views[-1].x
        out = rows.y - state.output(acc, since)
        if len(views) > 1:
            out[:, GYR] = rows.y[:, GYR] - state.output(gyr, since)[:, GYR]
        change = self.dictionary.current.change
        for triad, x, known in ((ACC, acc, rows.acc), (GYR, gyr, rows.gyr)):
            lag = (
                known.late * change[:, triad]
                + known.tau * x.slope[:, triad]
                + known.second * x.bend[:, triad]
                + rows.share * x.missed[:, triad]
            )
            out[:, triad] -= state.scale[triad] * lag
        return out

    def _every_column(self) -> Mask:
        """Columns that belong to a group."""
        d = self.dictionary
        out = np.zeros(d.width, dtype=bool)
        for group in [*d.always, *(v for c in d.causes for v in c.variants)]:
            out[group.columns] = True
        return out

    def _whitened(
        self, channel: int, columns: Index, table: Array, off: Array
    ) -> LinearRows:
        """Coefficients of a channel with columns (k,), of rows (n, k) and (n,)."""
        weight = 1 / np.sqrt(self.power[:, channel])
        design = self.motion.cosines(table) * weight[:, None]
        white = self.motion.cosines(off[:, None])[:, 0] * weight
        rows, part = np.arange(len(white)), self.motion.part
        return LinearRows(channel, rows, part, weight, columns, design, white)


def fit_residuals(
    part: LinearRows, values: Array, found: Eliminated
) -> tuple[Array, Array]:
    """Residuals of a channel's coefficients, and their leverages, (n,) each.

    Parameters
    ----------
    part : rows of the channel
    values : (k,) of the dictionary's columns in the state
    found : the columns that are fitted

    """
    place = {int(c): i for i, c in enumerate(found.columns)}
    here = [(j, place[int(c)]) for j, c in enumerate(part.columns) if int(c) in place]
    mine, theirs = (np.array(some, dtype=np.intp) for some in zip(*here, strict=True))
    design = part.design[:, mine]
    step = found.estimate[theirs] - values[part.columns[mine]]
    leverage = np.einsum("ij,ij->i", design @ found.half[:, theirs].T,
                         design @ found.half[:, theirs].T)  # fmt: skip
    return (part.white - design @ step) / part.weight, leverage


def noise_levels(
    bands: Bands,
    frequency: Array,
    linear: Sequence[LinearRows],
    values: Array,
    found: Eliminated,
) -> dict[int, Array]:
    """Log power of the noise at the places of bands, by channel, from residuals.

    Parameters
    ----------
    bands, frequency : of the coefficients, (n,) Hz
    linear : rows of each channel
    values : (k,) of the dictionary's columns in the state
    found : the columns that are fitted

    """
    out: dict[int, Array] = {}
    for _, channels in TRIADS:
        triad = [part for part in linear if part.channel in channels]
        if triad:
            residuals = [fit_residuals(part, values, found) for part in triad]
            levels = bands.levels(frequency, *map(list, zip(*residuals, strict=True)))
            out |= {
                part.channel: level for part, level in zip(triad, levels, strict=True)
            }
    return out
