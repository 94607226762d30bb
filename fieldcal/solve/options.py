"""Options of `solve`, and the default method for the recorded positions."""

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
from fieldcal.core.sentences import join_words
from fieldcal.solve.observations import Observations

METHODS = ("auto", "two_position", "five_position", "least_squares", "joint", "scalar")
TILT_CHOICES = ("auto", "none", *TILTS)


@dataclass(frozen=True, slots=True)
class SolveOptions:
    """Options of a requested calibration, those of `choose.solve`.

    `level_deg`, `heading_deg`, `angles_deg` and `beside_tilt_deg` are what it calls
    `level_sigma_deg` and so on: 1 sigma, None if not stated.
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
        if self.method not in METHODS or self.tilt not in TILT_CHOICES:
            raise InputError(
                f"method {self.method!r} with tilt {self.tilt!r} is unknown: methods"
                f" are {join_words(METHODS)}, tilts are {join_words(TILT_CHOICES)}"
            )
        if self.lot is not None and self.as_printed:
            raise InputError("printed formulas know of no lot: leave one of them out")
        _check_angle_sigmas((self.level_deg, self.heading_deg, self.angles_deg))
        _check_angle_sigmas((self.beside_tilt_deg,))

    def method_for(self, observations: Observations) -> Method:
        """The requested method, or for "auto" the one that suits the positions.

        Raises
        ------
        NotObservable
            If the requested method needs other positions.

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
        self._check_tilt()
        return self.method

    def _check_tilt(self) -> None:
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
        """Uncertainty of the heading, rad; None if not stated."""
        return None if self.heading_deg is None else float(np.deg2rad(self.heading_deg))


def _suitable_method(still: int, known: int) -> Method:
    """Choose the method for positions at rest, some of them with known angles."""
    if not still:
        return "least_squares"
    if known < still and known < 3:
        return "scalar"
    return "two_position" if known == 2 else "joint"


def _check_angle_sigmas(sigmas_deg: Iterable[float | None]) -> None:
    for degrees in sigmas_deg:
        if degrees is not None and not 0 <= degrees < 90:
            raise InputError(f"an uncertainty of {degrees:g}° is none: give 0 to 90°")
