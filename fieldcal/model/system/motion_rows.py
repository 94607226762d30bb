"""Rows in motion, linearised: cosine coefficients, whitened by the noise's spectrum."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array, Index, Mask
from fieldcal.model.causes.basis import Course, General, RowView
from fieldcal.model.causes.cause import TRIADS
from fieldcal.model.causes.motion_dictionary import MotionDictionary
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.rows.coloured_noise import Bands
from fieldcal.model.rows.motion import MotionRows
from fieldcal.model.state import State
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.linear_system import (
    MIN_VISIBLE_SIGMAS,
    Parts,
    System,
    append_course,
)


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

    def linearised(self, state: State, wanted: Mask | None = None) -> list[LinearRows]:
        """Rows of every channel about a state, with all columns or those wanted."""
        d, rows = self.dictionary, self.motion
        views = self._views(state)
        off = self._off(views, state)
        white = rows.cosines(np.where(rows.used, off, 0.0))
        parts: Parts = {c: [] for c in d.observed.tolist()}
        asked = self._grouped() if wanted is None else wanted
        for first, end, basis in d.basis_ranges():
            at, kept = np.arange(first, end), asked[first:end]
            if not kept.any():
                continue
            if isinstance(basis, Course):
                append_course(parts, at, rows.cosines(basis.evaluate(views[0])), kept)
                continue
            table = self._table(basis, views)
            for c, channel_parts in parts.items():
                shown = kept & np.any(table[:, c] != 0.0, axis=0)
                if shown.any():
                    channel_parts.append((at[shown], rows.cosines(table[:, c, shown])))
        out = [
            self._channel(c, channel_parts, white[:, c])
            for c, channel_parts in parts.items()
            if channel_parts
        ]
        if wanted is None:
            for part in out:
                size = np.linalg.norm(part.design, axis=0) * d.typical[part.columns]
                d.shown[part.columns] |= size > MIN_VISIBLE_SIGMAS
        return out

    def _views(self, state: State) -> list[RowView]:
        """Rows with the accelerometers' inputs, and the gyroscopes' if different."""
        d = self.dictionary
        inputs = [d.x] if d.gyro_inputs is d.x else [d.x, d.gyro_inputs]
        return [RowView.of(x, d.since, state) for x in inputs]

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

    @staticmethod
    def _table(basis: General, views: Sequence[RowView]) -> Array:
        """Columns of all channels, with the gyroscopes' own inputs."""
        table = basis.evaluate(views[0])
        if len(views) > 1:
            table = np.concatenate(
                [table[:, ACC], basis.evaluate(views[1])[:, GYR]], axis=1
            )
        return table

    def _grouped(self) -> Mask:
        """Columns that belong to a group."""
        d = self.dictionary
        out = np.zeros(d.width, dtype=bool)
        for group in [*d.always, *(v for c in d.causes for v in c.variants)]:
            out[group.columns] = True
        return out

    def _channel(
        self, c: int, parts: Sequence[tuple[Index, Array]], white: Array
    ) -> LinearRows:
        """One channel's coefficients, whitened."""
        weight = 1 / np.sqrt(self.power[:, c])
        design = np.hstack([table for _, table in parts])
        design *= weight[:, None]
        columns = np.concatenate([at for at, _ in parts])
        rows = np.arange(len(white))
        return LinearRows(
            int(c), rows, self.motion.part, weight, columns, design, white * weight
        )


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
