"""Rows of one channel, linearised."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcal.core.samples import Array, Index


@dataclass(frozen=True, slots=True)
class LinearRows:
    """Rows of one channel, whitened.

    Attributes
    ----------
    channel : index in `samples.CHANNELS`
    rows : (r,) which rows
    window : (r,) number of the window of each row
    weight : (r,) 1/sigma
    columns : (k,) of the dictionary with influence on the channel
    design : (r, k) whitened
    white : (r,) whitened y - h(state)

    """

    channel: int
    rows: Index
    window: Index
    weight: Array
    columns: Index
    design: Array
    white: Array
