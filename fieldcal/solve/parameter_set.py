"""The parameter set of `solve`: the parameters that describe the device.

It is a set of causes of the model (`fieldcal.model`) that is given instead of searched
for. The priors of the estimated parameters are so wide that they do not matter. The
tilt of the base, the errors of set angles, and the uncertainty of the Earth's rate have
the stated sizes. The error of an angle has two parts of equal variance: one is repeated
by the fixture each time the same detent is set, the other is new in each position.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from fieldcal.calibration.lot_prior import LotPrior
from fieldcal.calibration.names import TILTS, Tilt, group_of
from fieldcal.core.factory import WARMING_EFFECTS, FactoryErrors
from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.model import priors
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.detents import detent_columns, detents
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.effect_causes import effect_group
from fieldcal.model.causes.factory_groups import factory_groups
from fieldcal.model.causes.wander import Wander
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.rows.averages import Rows
from fieldcal.solve.end_values import EndValues, end_values
from fieldcal.solve.explanations import WeightedExplanation, translate_explanations
from fieldcal.solve.warm_scales import WARM_SCALE, warm_scale


@dataclass(frozen=True, slots=True)
class ParameterSetOptions:
    """Contents of a parameter set besides bias and scale factor; uncertainties 1 sigma.

    Attributes
    ----------
    tilt : kind of the estimated tilt
    cross, gyro_cross : whether cross-coupling of the accelerometers, of the gyroscopes,
        is estimated
    gyr_scale : whether the scale factor of the gyroscopes is estimated
    level_deg : uncertainty of the level about each level axis; None if not stated
    beside_tilt_deg : possible size of the other kind of tilt
    angles_deg : uncertainty of each set angle
    factory : sizes of the errors that the factory left and that are not estimated
    earth : (3,) rad/s, uncertainty of the Earth's rate in base axes
    turned : whether turns between positions were recorded
    lot : prior of the parameters from the unit's lot; None if not used

    """

    tilt: Tilt = "none"
    cross: bool = False
    gyro_cross: bool = False
    gyr_scale: bool = False
    level_deg: float | None = None
    beside_tilt_deg: float = 0.0
    angles_deg: float = 0.0
    factory: FactoryErrors = FactoryErrors()
    earth: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turned: bool = False
    lot: LotPrior | None = None


class ParameterSet(Dictionary):
    """Columns of the parameters, and of errors that affect single windows.

    Parameters
    ----------
    rows : rows of the windows
    unit : (6,) outputs per SI unit
    since : (o, n) time since the last turn, s, by origin
    turns : whether the turns between positions are used
    wanted : contents of the set
    shown : explanations of the recording; the set adds their causes that it lacks
    cut : how much smaller each accelerometer's values may be because they were rounded
        toward zero, 1 sigma

    Attributes
    ----------
    explanations : the explanations in the columns of this set, the likeliest first
    omitted_cross_coupling : cross-coupling of the accelerometers if it is not in the
        set; else None

    """

    def __init__(
        self,
        rows: Rows,
        unit: Array,
        since: Array,
        turns: bool,
        wanted: ParameterSetOptions,
        shown: Sequence[WeightedExplanation] = (),
        cut: Sequence[float] = (),
    ) -> None:
        self.options, self.cut = wanted, np.array(cut, dtype=float)
        self.sign = _mean_signs(rows, self.cut)
        common = rows.error_by_window
        wander = Wander.of(rows, unit) if len(rows.x) > len(common) else Wander.none()
        super().__init__(
            rows.x, rows.used, since, common, unit, turns, wander, rows.session_error
        )
        has = {group_of(n) for n in self.names}
        self.explanations = translate_explanations(self, shown, has) or (
            WeightedExplanation((), 1.0),
        )
        left = self._warm_scales(self.base_members)
        self.causes = [*self.causes, *(cause for cause, _ in left.values())]
        every = [m for explanation in self.explanations for m in explanation.members]
        self._warm = self._warm_scales(every)
        self.omitted_cross_coupling = self._usual_cross_coupling()

    @property
    def base_members(self) -> tuple[Member, ...]:
        """Requested parameters, and errors of known size."""
        return tuple((c, c.variants[0]) for c in self.causes)

    @property
    def members(self) -> tuple[Member, ...]:
        """The set with the causes of the likeliest explanation."""
        return self.with_causes(self.explanations[0].members)

    def with_causes(self, carried: Sequence[Member]) -> tuple[Member, ...]:
        """The set with further causes and their changes of scale factors."""
        warm = [self._warm[c.key] for c, _ in carried if c.key in self._warm]
        return (*self.base_members, *carried, *warm)

    @cached_property
    def end_values(self) -> EndValues:
        """Derivative of final biases and scale factors by the columns."""
        known = (*self.base_members, *self._warm.values())
        left = tuple(
            (cause, group)
            for cause, group in known
            if cause.name == WARM_SCALE or group.part in WARMING_EFFECTS
        )
        return end_values(self, (WeightedExplanation(left, 1.0), *self.explanations))

    @property
    def groups(self) -> list[Group]:
        """All groups; those that every set has come first."""
        return [*self.always, *(g for _, g in self.members)]

    def with_earth_sigma(self, size: Array) -> Self:
        """The set with another uncertainty (3,) of the Earth's rate, rad/s.

        None about axes where it is 0. Of a set that has columns of that rate.
        """
        out = copy(self)
        cause = self._earth_rate_cause(self.earth + np.arange(3), size)
        kept = [c for c in self.causes if c.name != cause.name]
        out.causes = [*kept, cause] if size.any() else kept
        return out

    # -- contents

    def _calibration(self) -> Iterator[Group]:
        """Bias and scale factor, free."""
        sizes, free = priors.BIAS * self.unit, priors.FREE_SIZE
        for part, at in self.triads:
            yield Group("bias", part, self.bias + at, sizes[at], fixed_size=free,
                        in_state=True)  # fmt: skip
            if part == "acc" or self.options.gyr_scale:
                size = priors.SCALE * self.unit[at]
                yield Group("scale", part, self.scale + at, size, fixed_size=free,
                            in_state=True)  # fmt: skip

    def _causes(self) -> Iterator[Cause]:
        """Causes of the requested parameters, and of errors of known size."""
        w, oriented = self.options, bool(self.x.oriented.any())
        if w.tilt != "none" and oriented:
            yield self._effect_cause(w.tilt, known=w.level_deg)
            if w.beside_tilt_deg:
                (other,) = set(TILTS) - {w.tilt}
                yield self._effect_cause(other, known=w.beside_tilt_deg)
        if w.cross:
            yield self._effect_cause("cross_coupling", turned=not oriented)
        left = replace(w.factory, **({"cross_coupling": 0.0} if w.cross else {}))
        for group in factory_groups(self, left, turned=not oriented):
            yield _given_cause(group)
        if w.gyro_cross:
            yield self._effect_cause(
                "gyro_cross_coupling", free=priors.GYRO_COUPLING_SIZE
            )
        if any(w.earth) and oriented:
            yield self._earth_rate_cause(self.add_earth(), np.array(w.earth))
        if w.angles_deg:
            yield from self._angle_causes(float(np.deg2rad(w.angles_deg)))
        if (lost := np.flatnonzero(self.cut)).size:
            at = self.add(General("cut", self._truncated_outputs), 3)[lost]
            yield _given_cause(
                Group("rounding", "acc", at, self.cut[lost], fixed_size=1.0)
            )

    def _warm_scales(self, members: Iterable[Member]) -> dict[str, Member]:
        """Changes of scale factors that accompany changes of biases, by cause key."""
        warm = {cause.key: warm_scale(self, group) for cause, group in members}
        return {key: scale for key, scale in warm.items() if scale is not None}

    def _usual_cross_coupling(self) -> Group | None:
        """Cross-coupling of usual size if it is not in the set; else None."""
        names = {c.name for c, _ in self.members}
        if "cross_coupling" in names or not self.x.f.any():
            return None
        oriented = bool(self.x.oriented.any())
        return self._effect_cause("cross_coupling", turned=not oriented).variants[0]

    def _effect_cause(
        self,
        name: str,
        turned: bool = False,
        known: float | None = None,
        free: float = priors.FREE_SIZE,
    ) -> Cause:
        """Cause of an effect with all its parameters, free or of a known size.

        If the device is `turned` by an unknown rotation, the parameters that such a
        rotation can produce from others are left out.
        """
        group = effect_group(self, name, turned)
        if known is None:
            return _given_cause(replace(group, fixed_size=free))
        size = np.full(len(group.params), known)
        return _given_cause(replace(group, typical=size, fixed_size=1.0))

    def _earth_rate_cause(self, at: Index, size: Array) -> Cause:
        """Uncertainty of the Earth's rate, in columns (3,)."""
        kept = np.flatnonzero(size)
        return _given_cause(
            Group("earth", "", at[kept], size[kept], fixed_size=1.0, in_state=True)
        )

    def _truncated_outputs(self, view: RowView) -> Array:
        """Change of outputs if each accelerometer's size is less by one, (n, 6, 3)."""
        out = np.zeros((len(view.x), 6, 3))
        for c in range(3):
            out[:, c, c] = -self.sign[view.x.position, c]
        return out

    def _angle_causes(self, sigma: float) -> Iterator[Cause]:
        """Errors of set angles: new in each position, and repeated with each detent."""
        x = self.x
        alike = x.oriented & ~np.isfinite(
            x.attitude_sigma
        )  # the others have their own uncertainty
        oriented = [p for p in self.window_positions if alike[x.position == p].all()]
        if not oriented:
            return
        size = sigma / np.sqrt(2.0)
        own = self.rotations_of(oriented)
        wide = np.full(len(own), size)
        yield _given_cause(
            Group("angle_setting", "own", own, wide, fixed_size=1.0, in_state=True)
        )
        # an angle that is set once has both parts of its error for itself
        if every := list(detents(self.x, oriented)):
            at = detent_columns(self, every)
            wide = np.full(len(at), size)
            yield _given_cause(
                Group("angle_setting", "repeated", at, wide, fixed_size=1.0)
            )

    # -- places of the parameters

    @cached_property
    def column_by_name(self) -> dict[str, int]:
        """Column of each parameter by its full name."""
        first, out = {"bias": self.bias, "scale": self.scale}, dict[str, int]()
        for group in self.always:
            for column in group.columns.tolist() if group.cause in first else ():
                axis = CHANNELS[column - first[group.cause]][-1]
                out[f"{group.part}_{group.cause}.{axis}"] = column
        for cause, group in self.base_members:
            for name, column in zip(group.names, group.columns.tolist(), strict=False):
                out[f"{cause.name}.{name}"] = column
        return out

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Full names of all parameters, in the order of results."""
        groups = (
            *("acc_bias", "acc_scale", "cross_coupling", self.options.tilt),
            *("gyr_bias", "gyr_scale", "gyro_cross_coupling"),
        )
        return tuple(n for g in groups for n in self.column_by_name if group_of(n) == g)


def _given_cause(group: Group) -> Cause:
    return Cause(group.cause, group.part, 1.0, (group,), "given")


def _mean_signs(rows: Rows, cut: Array) -> Array:
    """Sign of each accelerometer's mean by position, (p + 1, 3); 0 during turns.

    Its size is less than 1 near zero, where values of both signs occur.
    """
    held = rows.x.position
    out = np.zeros((int(held.max()) + 2, 3))
    for p in np.unique(held) if cut.any() else ():
        mean = np.nan_to_num(rows.y[held == p, :3]).mean(axis=0)
        out[p] = np.clip(mean / np.where(cut > 0, cut, np.inf), -1.0, 1.0)
    return out
