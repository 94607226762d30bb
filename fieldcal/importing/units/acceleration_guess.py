"""Unit of accelerations that nobody says, by what gravity reads in them."""

from __future__ import annotations

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.units.gravity_size import GravityReading, unequal_lengths
from fieldcal.importing.units.scales import (
    ACC_OUT,
    ACC_SCALES,
    Scale,
    binary_counts,
    fitting_scales,
    gain_scales,
    rounded_text,
)
from fieldcal.importing.units.unit_answers import (
    ask_unit,
    scales_of_decimals,
    unit_options,
    zero_options,
)
from fieldcal.importing.units.unit_doubts import LOG_GRAVITY

NO_UNIT = 0.75
"""What gravity reads at least in any unit, less what no factory scale is out by."""

PLAIN_UNITS = ["--acc-unit m/s^2", "--acc-unit g"]
"""What accelerations are in, where their lengths tell nothing."""


def guess_acceleration(
    name: str,
    said: ReadOptions,
    gravity: GravityReading,
    acc: Array,
    step: float,
    alone: bool = True,
) -> tuple[Scale, str] | None:
    """Unit of accelerations that nobody says, and why; None of those in m/s^2.

    Parameters
    ----------
    name, said : of the recording, and what is said of it
    gravity : what it reads
    acc : (n, 3) as the file has them
    step : s, from row to row; 0 if unknown
    alone : whether the recording is one file: several may be in different units

    Raises
    ------
    InputError
        With a question and its answers.

    """
    fits, shows = _fitting(said, gravity, acc, step)
    _ask_about_gravity(name, said, gravity, acc if alone else acc[:0], fits, shows)
    if len(fits) != 1:
        ask_unit(
            name,
            f"{shows}, which is gravity in"
            f" {' or '.join(map(str, fits)) or 'no usual unit'}",
            unit_options("acc", fits, "g", gravity.size) + zero_options(said, gravity),
        )
    plain = (fits[0].unit, fits[0].lsb) == ("m/s^2", 1)
    return None if plain else (fits[0], f"{fits[0]}: {shows}")


def _fitting(
    said: ReadOptions, gravity: GravityReading, acc: Array, step: float
) -> tuple[list[Scale], str]:
    """Scales by which what is read is gravity, and what shows it."""
    fits = fitting_scales(gravity.size, ACC_SCALES, ACC_OUT[not gravity.round])
    fits = scales_of_decimals(fits, acc)
    shows = f"|a| at rest is {rounded_text(gravity.size, 4)}"
    if gravity.round:
        shows += " (from a sphere through the rests)"
    named = [scale for scale in fits if str(scale) == said.usual_acc]
    if named and len(fits) > 1:
        fits = named
        shows += ", and so are accelerations of such names"
    if not fits and gravity.size >= NO_UNIT and (lsb := binary_counts(acc)):
        fits = [scale for scale in ACC_SCALES if str(scale) == "g"]
        shows += f", and its steps are those of {lsb} counts in a g"
    if not fits and step and not said.no_gain:
        scales = gain_scales(step, "m/s^2", G0)
        fits = fitting_scales(gravity.size, scales, ACC_OUT[not gravity.round])
    return fits, shows


def _ask_about_gravity(
    name: str,
    said: ReadOptions,
    gravity: GravityReading,
    acc: Array,
    fits: list[Scale],
    shows: str,
) -> None:
    """Ask where gravity seems to be taken out; `acc` is empty of one file of several.

    Raises
    ------
    InputError
        With a question and its answers.

    """
    if not fits and gravity.size < NO_UNIT:
        raise InputError(
            f"{name}: {shows}, less than gravity reads in any unit: it seems"
            " to be taken out of these accelerations, and nothing can be"
            f" calibrated by them; {LOG_GRAVITY}, or, if it is so, add"
            f" --acc-unit g --acc-lsb {rounded_text(gravity.size)}"
        )
    whole = acc[acc.any(axis=1)] - said.acc_scale * said.zero
    if len(acc) and (lengths := unequal_lengths(whole)) is not None:
        low, high = (rounded_text(one, 2) for one in lengths)
        ask_unit(
            name,
            f"|a| where it changes least is {low} to {high}, and gravity is the"
            " same everywhere: it may be taken out of these accelerations, and"
            f" nothing can be calibrated by them then ({LOG_GRAVITY}); if it is"
            " not, say the unit",
            (unit_options("acc", fits, "g", 1) if fits else PLAIN_UNITS)
            + zero_options(said, gravity),
        )
    if said.free and fits and fits[0].unit != "m/s^2" and not gravity.round:
        ask_unit(
            name,
            f"{shows}, and the names of its columns are those of accelerations"
            f" without gravity, by which nothing can be calibrated ({LOG_GRAVITY});"
            " if it is in them, say the unit",
            unit_options("acc", fits, "g", gravity.size),
        )
