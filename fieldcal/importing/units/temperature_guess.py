"""Unit of temperatures that nobody says."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.units.scales import ANALOG
from fieldcal.importing.units.thermometers import (
    ANALOG_THERMOMETERS,
    is_usual_temperature,
    may_be_fahrenheit,
    temperature_counts,
    temperature_fits,
)
from fieldcal.importing.units.unit_answers import ask_unit
from fieldcal.session.units import UNSCALED


def guess_temperature(
    name: str, said: ReadOptions, values: Array
) -> tuple[str, str] | None:
    """Unit of temperatures (n,) that nobody says, and why; None of deg C or of none.

    Parameters
    ----------
    name, said : of the recording, and what is known of its other units
    values : (n,) as the file has them

    Raises
    ------
    InputError
        With a question and its answers.

    """
    fits = temperature_fits(values)
    known = values[np.isfinite(values)]
    whole = bool(len(known) and (known == np.round(known)).all())
    analog = whole and said.acc_lsb in {acc for acc, _ in ANALOG}
    if not len(known):
        return None
    low, high = float(known.min()), float(known.max())
    if "degC" in fits and not analog:
        if may_be_fahrenheit(low, high):
            ask_unit(
                name,
                f"its temperature reads {low:.6g} to {high:.6g}, which is hot in"
                " deg C and usual in deg F",
                ["--temp-unit degF", "--temp-unit degC, if it is so"],
            )
        return None
    if analog:
        ask_unit(
            name,
            f"its temperature reads {low:.6g} to {high:.6g} beside counts of"
            " which Analog Devices have so many in a g, so it may be counts too",
            [
                *temperature_counts(low, high, ANALOG_THERMOMETERS),
                *(["--temp-unit degC, if it is so"] if "degC" in fits else []),
                "--temp-unit none, which leaves it out",
            ],
        )
    # who writes one sensor's registers as they are, may write the other's so too
    scaled = said.acc_lsb == said.gyr_lsb == 1
    scaled &= said.acc_unit not in UNSCALED
    raw = not scaled and whole
    if len(fits) != 1 or raw or not is_usual_temperature(*fits.values()):
        ask_unit(
            name,
            f"its temperature reads {low:.6g} to {high:.6g}, which is no deg C",
            [
                *(f"--temp-unit {unit}" for unit in fits),
                *temperature_counts(low, high),
                "--temp-unit none, which leaves it out",
            ],
        )
    ((unit, middle),) = fits.items()
    return unit, f"{unit}: it is {middle:.1f} deg C then"
