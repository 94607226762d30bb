"""Errors left by the factory that a result assumes and does not estimate.

A few positions rarely contradict errors that are larger than usual. The decision
therefore names what the result relies on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

from fieldcal.acceptance.angles import angle_error_explaining
from fieldcal.acceptance.check import Check
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits, read
from fieldcal.calibration.names import ParameterName, group_of, sensor_of
from fieldcal.core.factory import FactoryErrors
from fieldcal.core.gravity import G0
from fieldcal.core.sentences import join_words
from fieldcal.session.description import Description

DEG_H = math.radians(1) / 3600
"""rad/s of one degree an hour."""

BEYOND, CERTAIN = 5.0, 3.0
"""Times the usual cross-coupling that no factory leaves, and standard deviations by
which it must be exceeded."""

SourceOfSize = Callable[..., str]
"""From the name of an error, and the size that is stated for it, to who says it."""


def factory_errors_used(calibration: Calibration) -> FactoryErrors:
    """Sizes of factory errors that a result was made with, from its `info`."""
    keys = (
        "square_sigma", "quadratic_sigma", "g_sensitivity_sigma",
        "acc_bias_per_k_sigma", "gyr_bias_per_k_sigma", "acc_hysteresis_sigma",
    )  # fmt: skip
    return FactoryErrors(*(float(calibration.info.get(key) or 0.0) for key in keys))


def check_factory_errors(
    calibration: Calibration, about: Description, limits: GradeLimits
) -> list[Check]:
    """Report the assumed sizes of errors that were not estimated."""
    return list(_factory_checks(calibration, about, limits))


def _factory_checks(
    calibration: Calibration, about: Description, limits: GradeLimits
) -> Iterator[Check]:
    left, usual = factory_errors_used(calibration), limits.factory
    measured = {sensor_of(group_of(n)) for n in calibration.names}
    of_grade = "as usual for the grade"
    if shows := calibration.info.get("grade_shown"):
        usual = read(shows["grade"]).factory
        of_grade = f"as usual for {shows['grade']} grade"
        yield _coarser_grade_check(calibration, about, shows)

    def whose(kind: str, said: float | None = None) -> str:
        size = getattr(left, kind)
        by_grade, if_fine = getattr(usual, kind), getattr(limits.factory, kind)
        if said is not None or size not in (by_grade, if_fine):
            return "as stated"
        return of_grade if size == by_grade else "as the recording shows"

    if "acc" in measured:
        yield from _coupling_check(calibration, left, about, whose)
        yield from _accelerometer_checks(left, about, whose)
    if "gyr" in measured:
        yield from _gyroscope_checks(left, about, whose)
    yield from _warm_up_check(left, measured, whose)


def _coupling_check(
    calibration: Calibration,
    left: FactoryErrors,
    about: Description,
    whose: SourceOfSize,
) -> Iterator[Check]:
    """Report the assumed cross-coupling; NO-GO if the recording shows far more."""
    shown = calibration.info.get("coupling_left_out", {"value": 0.0, "sigma": 0.0})
    size, sigma = abs(shown["value"]), shown["sigma"]
    if size - CERTAIN * sigma > BEYOND * left.cross_coupling:
        says = (
            f"accelerometer {shown['axis']} feels {100 * size:.2g} ±"
            f" {100 * sigma:.1g} % of the force along {shown['of']}, which is"
            f" {G0 * size:.2g} m/s² at 1 g and not in this calibration: the device is"
            f" fastened askew, by about {math.degrees(size):.2g}°, or its axes are not"
            " square; fasten it straight and record again, or estimate cross-coupling"
            " (--cross)"
        )
        yield Check("cross-coupling", False, says)
    elif left.cross_coupling:
        by = whose("cross_coupling", about.squareness)
        says = (
            f"this relies on axes that are square to ± {100 * left.cross_coupling:.2g}"
            f" %, {by}; each ± includes it. An uncalibrated device has more: estimate"
            " cross-coupling from nine positions or more (--cross)"
        )
        yield Check("cross-coupling", None, says)


def _accelerometer_checks(
    left: FactoryErrors, about: Description, whose: SourceOfSize
) -> Iterator[Check]:
    """Report the assumed errors of the accelerometers."""
    if left.quadratic:
        by = whose("quadratic", about.quadratic)
        size = 1e3 * left.quadratic * G0
        says = (
            f"this relies on accelerometers that are linear: K2 is 0 ± {size:.2g}"
            f" mg/g², {by} (--quadratic), and a kink at zero is as large at 1 g; each ±"
            " includes both"
        )
        yield Check("linearity", None, says)
    if left.hysteresis:
        says = (
            "this relies on accelerometers with a hysteresis of 0 ±"
            f" {1e3 * left.hysteresis / G0:.2g} mg, {whose('hysteresis')}; each ±"
            " includes it"
        )
        yield Check("hysteresis", None, says)


def _gyroscope_checks(
    left: FactoryErrors, about: Description, whose: SourceOfSize
) -> Iterator[Check]:
    """Report the assumed errors of the gyroscopes."""
    if left.g_sensitivity:
        by = whose("g_sensitivity", about.g_sensitivity)
        felt = float(f"{left.g_sensitivity * G0 / DEG_H:.2g}")  # 180, and not 1.8e+02
        says = (
            f"this relies on gyroscopes that feel 0 ± {felt:g} deg/h per g, {by}"
            " (--g-sensitivity); each ± includes it. Where a data sheet states more,"
            " state it, and hold each axis up and down"
        )
        yield Check("g-sensitivity", None, says)


def _warm_up_check(
    left: FactoryErrors, measured: set[str], whose: SourceOfSize
) -> Iterator[Check]:
    """Report the assumed change of biases while the device warms up."""
    sizes = {
        "acc": (left.acc_per_k, f"{1e3 * left.acc_per_k / G0:.2g} mg"),
        "gyr": (left.gyr_per_k, f"{float(f'{left.gyr_per_k / DEG_H:.2g}'):g} deg/h"),
    }
    told = {s: text for s, (size, text) in sizes.items() if size and s in measured}
    if told:
        by = join_words(list(dict.fromkeys(whose(f"{s}_per_k") for s in told)))
        both = join_words(list(told.values()))
        says = (
            f"this relies on biases that change by 0 ± {both} per K while the device"
            f" warms up, {by}; each ± includes it"
        )
        yield Check("warm-up", None, says)


def _coarser_grade_check(
    calibration: Calibration, about: Description, shows: Mapping[str, str]
) -> Check:
    """Report a device that is not as good as its grade.

    NO-GO if a wrong angle could explain it: one parameter is then far from nominal, and
    everything else agrees.
    """
    off = {}
    for name in shows["beyond"]:
        parameter = ParameterName.of(name)
        usual = about.nominal_as_sent[parameter.group][parameter.axis]
        off[name] = abs(calibration.value(name) - float(usual))
    if angle := angle_error_explaining(calibration, off):
        says = (
            f"{shows['because']}, which no device of {about.grade} grade has, or it is"
            f" {angle}: nothing in the recording tells which; record that position"
            f" again, or state --grade {shows['grade']} if that is what the device is"
        )
        return Check("grade", False, says)
    says = (
        f"this is no device of {about.grade} grade: {shows['because']}; what is not"
        f" estimated of it is taken to be as large as {shows['grade']} grade has it,"
        " unless the recording shows less. If that is what it is, state it (--grade"
        f" {shows['grade']}), which has its own limits as well; if its data sheet"
        " says less, state that (--squareness, --quadratic, --g-sensitivity)"
    )
    return Check("grade", None, says)
