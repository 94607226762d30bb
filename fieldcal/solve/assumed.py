"""Defaults of a requested calibration: the method, and with it the set."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fieldcal.calibration import Method
from fieldcal.calibration.lot_prior import LotPrior
from fieldcal.calibration.names import TILTS, Tilt
from fieldcal.core.errors import InputError, NotObservable
from fieldcal.core.factory import FactoryErrors
from fieldcal.core.sentences import join
from fieldcal.solve.observations import Observations

METHODS = ("auto", "two_position", "five_position", "least_squares", "joint", "scalar")
CHOICES = ("auto", "none", *TILTS)


@dataclass(frozen=True, slots=True)
class Asked:
    """What the user asked for.

    Attributes
    ----------
    method, tilt : or "auto"
    cross : whether cross-coupling is estimated
    as_printed : closed forms with the misprints of the paper
    level_deg, heading_deg : how level the base is, how well z points north; None where
        nobody said
    angles_deg : how well each position's angles are set
    beside_tilt_deg : how large a tilt of the base may be beside the offsets of joints
        that explain the positions, and the other way round
    lot : what the unit's lot says of it; None where it is not asked
    factory : what the factory left of errors that are not estimated
    at_best : the same by the grade that the device is called, where biases show a
        coarser one; each kind of error then has one of the two sizes

    """

    method: Method | Literal["auto"] = "auto"
    tilt: Tilt | Literal["auto"] = "auto"
    cross: bool = False
    as_printed: bool = False
    level_deg: float | None = None
    heading_deg: float | None = None
    angles_deg: float = 0.0
    beside_tilt_deg: float = 0.0
    lot: LotPrior | None = None
    factory: FactoryErrors = FactoryErrors()
    at_best: FactoryErrors | None = None

    def __post_init__(self) -> None:
        if self.method not in METHODS or self.tilt not in CHOICES:
            raise InputError(
                f"method {self.method!r} with tilt {self.tilt!r} is unknown: methods"
                f" are {join(METHODS)}, tilts are {join(CHOICES)}"
            )
        if self.lot is not None and self.as_printed:
            raise InputError("printed formulas know of no lot: leave one of them out")
        _refuse_none((self.level_deg, self.heading_deg, self.angles_deg))
        _refuse_none((self.beside_tilt_deg,))

    def method_for(self, observations: Observations) -> Method:
        """The method that suits the positions, or the one that is asked for.

        Raises
        ------
        NotObservable
            If the one that is asked for needs other positions.

        """
        still = ~observations.rotating
        known = int((observations.oriented & still).sum())
        if self.method == "auto":
            return _suitable_method(int(still.sum()), known)
        if self.method == "two_position" and (known != 2 or still.sum() != 2):
            raise NotObservable(
                f"two positions with known angles are needed and no other, not {known}"
                f" of {still.sum()}: with more of them use the joint estimate"
            )
        if self.method != "scalar" and known < still.sum():
            raise NotObservable(
                f"the method {self.method} needs the angles of every position: the"
                " scalar method does without"
            )
        self._refuse_tilt()
        return self.method

    def _refuse_tilt(self) -> None:
        if self.method == "two_position":
            if self.tilt in TILTS or self.cross:
                raise NotObservable(
                    "two positions give bias and scale factor only, not tilt or "
                    "cross-coupling: take five positions, each with another α or β"
                )
        if self.method == "five_position" and self.tilt == "none":
            raise InputError("the five-position method estimates the tilt: use joint")

    @property
    def heading(self) -> float | None:
        """Rad."""
        return None if self.heading_deg is None else float(np.deg2rad(self.heading_deg))


def _suitable_method(still: int, known: int) -> Method:
    """Take the method that suits so many positions, some of them with known angles."""
    if not still:
        return "least_squares"
    if known < still and known < 3:
        return "scalar"
    return "two_position" if known == 2 else "joint"


def _refuse_none(sigmas_deg: Iterable[float | None]) -> None:
    for degrees in sigmas_deg:
        if degrees is not None and not 0 <= degrees < 90:
            raise InputError(f"an uncertainty of {degrees:g}° is none: give 0 to 90°")
