"""Units of a recording: what its files and the user state, and what is guessed.

A guess is kept until the user confirms it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.recording import MAX_READING, Recording
from fieldcal.importing.units.alike_turns import tell_alike_turns
from fieldcal.importing.units.file_times import FIRST_ROWS, settle_time_units
from fieldcal.importing.units.turned_axes import NamedColumns
from fieldcal.importing.units.unit_doubts import check_format_units, check_one_unit
from fieldcal.importing.units.unit_guess import UnitGuess
from fieldcal.session.units import UNSCALED


class AssumedUnits(NamedTuple):
    """Assumptions about units that nobody stated.

    Attributes
    ----------
    guessed : a sentence each, by quantity
    acc_bias : x y z of [nominal], m/s^2; None where zero lies at zero

    """

    guessed: dict[str, str]
    acc_bias: list[float] | None = None


def settle_units(recording: Recording, stream: str) -> AssumedUnits:
    """Determine the units of a recording from its numbers.

    Raises
    ------
    InputError
        With a question and its answers, where several or none would do.

    """
    parts = recording.parts
    times = settle_time_units(parts) if len(parts) > 1 else []
    heard = recording.alone(stream)
    block = _beginning(heard, stream)
    if not all(part.asks_units for part in parts):
        check_format_units(recording, block)
        return AssumedUnits(heard.guessed)
    alone = len(parts) == 1
    said, columns = _stated_units(parts), _columns_of_rates(parts)
    # several files settle the units of their times themselves
    began = heard.began if alone and np.isfinite(heard.began) else 0.0
    guess = UnitGuess(str(recording.path), said, block, columns, alone, began)
    if guess.said.acc_unit not in UNSCALED and guess.acc_bias is None:
        check_one_unit(parts)
    for part in parts:
        part.wanted = guess.on(part.wanted)
    parts[0].says += [*guess.doubts, *tell_alike_turns(block)]
    taken = {k: why for one in (*parts, heard) for k, why in one.guessed.items()}
    taken |= {"time": times[0]} if times else {}
    return AssumedUnits(taken | guess.found, guess.acc_bias)


def _beginning(recording: Recording, stream: str) -> Block:
    whole = recording.first_rows(stream, FIRST_ROWS)
    # such values tell no unit; whoever takes the rows says where they stand
    acc, gyr = (np.where(np.abs(three) > MAX_READING, np.nan, three)
                for three in (whole.acc, whole.gyr))  # fmt: skip
    return replace(whole, acc=acc, gyr=gyr)


def _stated_units(parts: Sequence[Recording]) -> ReadOptions:
    """What is said of any part: each channel stands in one of them."""
    said = parts[0].wanted
    for part in parts[1:]:
        w = part.wanted
        said = replace(
            said,
            acc_unit=said.acc_unit or w.acc_unit,
            gyr_unit=said.gyr_unit or w.gyr_unit,
            time_unit=said.time_unit or w.time_unit,
            named=said.named | w.named,
        )
    return said


def _columns_of_rates(parts: Sequence[Recording]) -> NamedColumns:
    """Columns in which the rates stand, of the file that has them."""
    channels = [[c.partition("=")[0] for c in part.wanted.columns] for part in parts]
    pairs = zip(parts, channels, strict=True)
    part = next((part for part, known in pairs if "gx" in known), parts[0])
    wanted = part.wanted
    return NamedColumns(
        str(part.path), wanted.columns, wanted.reversed, part.columns_said
    )
