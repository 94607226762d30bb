"""The grade that biases and scale factors of a device show, whatever is stated.

All errors of a device come from one process: a factory that leaves a bias of 50 mg or a
scale factor of 2 % does not make axes square to 0.1 %. A parameter may differ from
nominal by the tolerance of the stated grade (``..._tolerance`` in ``limits.toml``) and
by the usual change from run to run (``..._repeat``). If it differs by significantly
more, errors that are not estimated have the size of a coarser grade. Noise and grain
distinguish grades less well: accelerometers of 60 to 140 ug/sqrt(Hz) are sold in
both, and either may put out 16 bits.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fieldcal.calibration import limits
from fieldcal.calibration.names import ParameterName, sensor_of
from fieldcal.calibration.parameters import COMPONENTS
from fieldcal.calibration.plausible import MIN_SCALE_SIGMAS
from fieldcal.core.grade import GRADES, Grade
from fieldcal.core.samples import Array
from fieldcal.core.sentences import join_words


@dataclass(frozen=True, slots=True)
class GradeShown:
    """The grade that a device shows, and the reason if it is not the stated one.

    Attributes
    ----------
    grade : grade from which the sizes of errors that are not estimated are taken
    because : parameters beyond the stated grade, in words; empty if there are none
    beyond : full names of these parameters

    """

    grade: Grade
    because: str = ""
    beyond: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        stated: Grade,
        names: Sequence[str],
        values: Array,
        sigma: Array,
        nominal: Mapping[str, Array],
    ) -> GradeShown:
        """The best grade that has such parameters; never better than the stated one.

        Parameters
        ----------
        stated : stated grade of the device
        names : (k,) full names
        values, sigma : (k,) as a `Calibration` has them
        nominal : (3,) nominal values by group, as the device sends them

        """
        coarser = GRADES[GRADES.index(stated) :: -1]
        for grade in coarser:
            beyond = dict(_beyond(grade, names, values, sigma, nominal))
            if grade == stated:
                told = beyond
            if not beyond:
                break
        if grade == stated:
            return cls(grade)
        return cls(grade, join_words(list(told.values())), tuple(told))


def _beyond(
    grade: Grade,
    names: Sequence[str],
    values: Array,
    sigma: Array,
    nominal: Mapping[str, Array],
) -> Iterator[tuple[str, str]]:
    """Parameters that no device of a grade has, each with a description."""
    bounds = limits.read(grade)
    for name, value, s in zip(names, values, sigma, strict=True):
        parameter = ParameterName.of(name)
        tolerance = bounds.tolerance(parameter.group)
        if tolerance is None:
            continue
        most = tolerance + (bounds.repeat(parameter.group) or 0.0)
        usual = nominal[parameter.group][parameter.axis]
        scale = nominal[f"{sensor_of(parameter.group)}_scale"]
        size = abs(scale[parameter.axis])
        off = float(value - usual) / size
        if abs(off) - MIN_SCALE_SIGMAS * float(s) / size > most:
            unit = COMPONENTS[parameter.group][1].replace("m/s^2", "m/s²")
            shown = "" if unit == "1" else f" {unit}"
            says = f"is {off:+.2g}{shown} from nominal, more than {most:g}{shown}"
            yield name, f"{name} {says}"
