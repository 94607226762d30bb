"""From what is asked for to a calibration: the set is given, the model does the rest.

    two known positions            two_position      bias and scale factor
    more known positions           joint             and the tilt that the data prefer
    positions without angles       scalar            by the length of the force
    rates of a table               least_squares     for the gyroscopes

Whatever the method is called, all rows are in one fit: windows, the turns between them
where they were recorded, the Earth's rate as far as it is known, how well angles are
set. Where two models of the tilt fit nearly alike, what they differ by is in the
uncertainty.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from fieldcal.calibration import Calibration, Method
from fieldcal.calibration.lot_prior import LotPrior
from fieldcal.calibration.names import TILTS, Tilt, group_of
from fieldcal.core.factory import FactoryErrors
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.sentences import join
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.planned import parameters
from fieldcal.model.state import State
from fieldcal.solve import printed
from fieldcal.solve.assumed import Asked
from fieldcal.solve.borrowed import borrowed
from fieldcal.solve.estimation import Estimated, Recorded, estimated
from fieldcal.solve.given import Wanted, earth_known, seen_by
from fieldcal.solve.latitude import EarthVertical
from fieldcal.solve.observations import Observations
from fieldcal.solve.rank import ladder_remedy
from fieldcal.solve.result import calibration
from fieldcal.solve.rows import of_means, without_angles

Earth = Literal["stated", "another", "none"]
"""Whose rate gyroscopes have: of the stated latitude, of another one, or none."""

EVEN = 0.5
"""Chance from which an error is taken to be as large as the coarser grade has it."""

NO_EARTH = (
    "the gyroscopes do not show the Earth's rate, as those of a simulator without it:"
    " their biases are stated without; real ones that do so take out what is a bias"
)
"""Said where the Earth's rate is absent."""


def solve(
    observations: Observations,
    method: Method | Literal["auto"] = "auto",
    tilt: Tilt | Literal["auto"] = "auto",
    cross: bool = False,
    as_printed: bool = False,
    level_sigma_deg: float | None = None,
    heading_sigma_deg: float | None = None,
    angle_sigma_deg: float = 0.0,
    beside_tilt_sigma_deg: float = 0.0,
    recorded: Recorded | None = None,
    lot: LotPrior | None = None,
    factory: FactoryErrors | None = None,
    at_best: FactoryErrors | None = None,
) -> Calibration:
    """Estimate the calibration.

    Parameters
    ----------
    observations : n windows, see `Observations`
    method : "auto" takes two_position for two known positions, joint for more, scalar
        where angles are unknown; the method taken is named in the result
    tilt : model of the base's tilt; "auto" estimates it where the positions show it
    cross : estimate cross-coupling (non-orthogonality in the scalar method)
    as_printed : closed forms with the misprints of the paper, to compare
    level_sigma_deg : how level the base was made, about each level axis; the tilt is
        then that of the base, within this
    heading_sigma_deg : how well z points north; not known for tactical grade if None
    angle_sigma_deg : how well each position's angles are set, about each level axis
    beside_tilt_sigma_deg : how large a tilt of the base may be beside offsets of the
        joints, and the other way round, where "auto" takes one of them
    recorded : the rows of the recording that the observations are means of, and its
        turns; of means alone there is one row for each window
    factory : what the factory left of errors that are not estimated; nothing if None
    at_best : the same if the device is as good as it is called, where `factory` is what
        its biases make likely: the rows tell which, for each kind of error
    lot : what the unit's lot says, which the result then has unless the unit is odd

    Raises
    ------
    InputError
        If an argument is none of those listed.
    NotObservable
        If the positions determine no parameter.

    >>> from fieldcal.core.positions import TWO
    >>> mean = np.zeros((2, 6))
    >>> mean[:, :3] = [[0.1, -9.81, 0.2], [-6.83672, -6.91037, 0.80457]]
    >>> cov = np.tile(np.diag([1e-6] * 3 + [1e-10] * 3), (2, 1, 1))
    >>> result = solve(Observations(TWO, mean, cov, gravity=9.81))
    >>> result.method, np.round(result.vector("acc_scale")[0], 4).tolist()
    ('two_position', [1.0, 1.0, 1.0])
    """
    asked = Asked(
        method, tilt, cross, as_printed,
        level_sigma_deg, heading_sigma_deg, angle_sigma_deg, beside_tilt_sigma_deg, lot,
        factory or FactoryErrors(), at_best,
    )  # fmt: skip
    if as_printed:
        return printed.solve(observations, asked)
    return _solved(observations, asked, asked.method_for(observations), recorded)


def _solved(
    observations: Observations, asked: Asked, method: Method, recorded: Recorded | None
) -> Calibration:
    """The calibration by the session alone, or with its lot where that fits."""
    alone = replace(asked, lot=None)
    found, notes = _fitted(observations, alone, method, recorded)
    told = None
    if asked.lot is not None:
        beside, others = _fitted(observations, asked, method, recorded)
        found, told = borrowed(found, beside, asked.lot)
        notes = notes if told is None or told.refused else others
    return calibration(method, observations, asked, found, notes, told)


def _fitted(
    observations: Observations, asked: Asked, method: Method, recorded: Recorded | None
) -> tuple[Estimated, list[str]]:
    """The set that fits, with what other rates of the Earth differ by in its sigmas.

    The rate of the stated latitude, of another, or none as simulators have it: one
    that fits a little better is not the only one that is possible.
    """

    def fitted(earth: Earth) -> tuple[Estimated, list[str]]:
        return _Session(observations, asked, method, recorded, earth).best()

    found, notes = fitted("stated")
    shown = EarthVertical.of(found.given, found.search, observations.latitude)
    if shown is None or not shown.favoured:
        return found, notes
    other, (none, others) = fitted("another")[0], fitted("none")
    ahead = none.score - found.score + np.log(priors.ELSEWHERE)
    score = np.array([0.0, shown.gain, ahead])
    weights = np.exp(score - score.max())
    as_said, elsewhere, absent = (weights / weights.sum()).tolist()
    if ahead > max(0.0, shown.gain):
        mixed = none.mixed_with(none, found, as_said)
        return mixed.mixed_with(none, other, elsewhere), [NO_EARTH, *others]
    mixed = found.mixed_with(found, other, elsewhere)
    return mixed.mixed_with(found, none, absent), notes


class _Session:
    """One session's rows, to be laid to sets.

    Parameters
    ----------
    observations : of the windows
    asked : what for
    method : that was chosen
    recorded : its rows, if there are more than the means
    earth : whose rate gyroscopes have

    """

    def __init__(
        self,
        observations: Observations,
        asked: Asked,
        method: Method,
        recorded: Recorded | None,
        earth: Earth = "stated",
    ) -> None:
        self.observations, self.asked, self.method = observations, asked, method
        navigation = observations.grade == "navigation"
        base, self.unknown = earth_known(
            observations.latitude, navigation, asked.heading, observations.under_way
        )
        if earth == "another":
            self.unknown = (self.unknown[0], EARTH_RATE, self.unknown[2])
        elif earth == "none":
            base, self.unknown = np.zeros(3), (0.0, 0.0, 0.0)
        given = recorded or of_means(observations)
        rows = given.rows
        if method == "scalar":
            rows = without_angles(rows, observations.nominal)
        self.recorded = replace(given, rows=seen_by(rows, base))
        self.turning = self.recorded.turning() if observations.has_gyr else None
        nominal = observations.nominal
        self.nominal = State(
            np.array([*nominal.acc_bias, *nominal.gyr_bias], dtype=float),
            np.array([*nominal.acc_scale, *nominal.gyr_scale], dtype=float),
            np.zeros((int(rows.x.position.max()) + 1, 2)),
            np.zeros(3),
        )

    def best(self) -> tuple[Estimated, list[str]]:
        """The set that fits, with remarks about the tilt."""
        level, tilt = self.asked.level_deg, self.asked.tilt
        if self.method in ("scalar", "least_squares"):
            return self._with("none"), []
        if level and tilt in ("auto", "none"):
            return self._with("base_tilt", level), []
        if self.method == "two_position":
            return self._with("none"), []
        if tilt != "auto":
            return self._with(tilt, level), []
        return self._by_tilt()

    @property
    def _beside(self) -> float:
        """How large the other kind of tilt may be; nothing where one is asked for."""
        return self.asked.beside_tilt_deg if self.asked.tilt == "auto" else 0.0

    def _with(
        self, tilt: Tilt, level: float | None = None, follow: bool = True
    ) -> Estimated:
        """A set with a model of the tilt; windows alone are to choose one by."""
        turning = self.turning if follow else None
        observations, turned = self.observations, turning is not None
        table = bool(observations.rotating.any())
        sees_earth = (
            observations.grade == "navigation" and observations.latitude is not None
        )
        crossed = self.asked.cross or self.method == "least_squares"
        wanted = Wanted(
            tilt,
            cross=crossed,
            gyro_cross=table or turned,
            gyr_scale=table or turned or (sees_earth and len(observations) > 1),
            level_deg=level,
            beside_tilt_deg=0.0 if level else self._beside,
            angles_deg=self.asked.angles_deg,
            factory=self.asked.factory,
            earth=self.unknown,
            turned=turned,
            lot=self.asked.lot,
        )
        found = estimated(self.recorded, turning, self.nominal, wanted, follow)
        if (stated := self.asked.at_best) is None:
            return found
        chances = found.coarser(stated)
        finer = {k: getattr(stated, k) for k, p in chances.items() if p < EVEN}
        if not finer:
            return found
        wanted = replace(wanted, factory=replace(wanted.factory, **finer))
        best = estimated(self.recorded, turning, self.nominal, wanted, follow)
        as_stated = np.prod([1 - chances[k] for k in finer])
        return best.mixed_with(best, found, 1 - float(as_stated))

    def _by_tilt(self) -> tuple[Estimated, list[str]]:
        """The model of the tilt that fits better, the other one being weighed in.

        Windows tell which; turns hardly add to that.
        """
        fits = {name: self._with(name, follow=False) for name in TILTS}
        usable = {n: e for n, e in fits.items() if _determines_all(e)}
        if not usable:
            return self._with("none"), [self._level_taken()]
        if len(usable) == 1:
            name = next(iter(usable))
            return self._whole(name, usable), [f"the tilt is taken as {name}"]
        ahead = usable["angle_offset"].score - usable["base_tilt"].score
        best, other = TILTS if ahead >= 0 else TILTS[::-1]
        ahead = abs(ahead)
        if ahead > thresholds.BETTER_TILT:
            note = (
                f"the tilt is taken as {best}: {other} fits worse, by {2 * ahead:.0f}"
                " in chi2"
            )
        else:
            note = (
                f"the tilt is taken as {best}, but these positions cannot tell it from"
                f" {other} (chi2 differs by {2 * ahead:.1f}): the uncertainties cover"
                " both; more positions with both angles turned would tell"
            )
        weight = 1 / (1 + float(np.exp(min(ahead, 50.0))))
        found = self._whole(best, usable)
        return found.mixed_with(usable[best], usable[other], weight), [note]

    def _whole(self, tilt: Tilt, by_windows: dict[Tilt, Estimated]) -> Estimated:
        """The set by all rows, where there are more than those it was chosen by."""
        if self.turning is None and not self.recorded.shown:
            return by_windows[tilt]
        return self._with(tilt)

    def _level_taken(self) -> str:
        extra = ladder_remedy(self.observations, parameters("angle_offset"))
        cure = f"; add {join(extra)} to find it" if extra else ""
        return (
            "these positions do not show the tilt, so the base is taken as level" + cure
        )


def _determines_all(found: Estimated) -> bool:
    """Whether all of the accelerometers is determined, and the tilt with it."""
    if not found.acc.dof and not found.acc.chi2 and not found.names:
        return False
    open_ = {group_of(n) for n in found.missing}
    return not open_ & {"acc_bias", "acc_scale", *TILTS}
