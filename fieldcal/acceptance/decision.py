"""GO or NO-GO: a calibration against the limits of its grade, with reasons.

Each check says in a sentence what was measured and what is allowed. A check that could
not be made, without a thermometer or earlier calibrations, is reported and is no reason
for NO-GO. The history is compared with; nothing of it enters the calibration.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldcal.acceptance.growth import TIMES, Growth, growth
from fieldcal.acceptance.harmless import harmless
from fieldcal.acceptance.level import level_missing, tilt_is_found
from fieldcal.acceptance.remedy import Remedy, cheapest
from fieldcal.acceptance.site import gravity_contradicted, gravity_unknown
from fieldcal.acceptance.turned import turns_disagree
from fieldcal.acceptance.verification import Verification
from fieldcal.acceptance.witnesses import has_witnesses, left_out, witnesses
from fieldcal.calibration import COMPONENTS, Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import ParameterName, group_of, sensor_of
from fieldcal.core.chances import chi2_tail
from fieldcal.history.family import expected
from fieldcal.session.description import Description
from fieldcal.solve.doubt import DoubtfulPosition
from fieldcal.windows import Average

UNCERTAINTY = " uncertainty"
"""Behind the name of a group, of the check that its parameters are well known."""

REQUIRED = ("acc_bias", "acc_scale", "gyr_bias")
"""Groups whose uncertainty must be known and small; a sensor not read is excused."""


@dataclass(frozen=True, slots=True)
class Check:
    """One comparison with a limit.

    Attributes
    ----------
    name : of what was checked
    ok : whether it is within the limit; None where it could not be checked
    says : one sentence
    value, limit : None where there is no number
    unit : of both

    """

    name: str
    ok: bool | None
    says: str
    value: float | None = None
    limit: float | None = None
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Decision:
    """All checks, and what the calibration means for a navigator."""

    checks: tuple[Check, ...]
    growth: tuple[Growth, ...]
    remedy: Remedy | None = None

    @property
    def go(self) -> bool:
        """Whether no check failed."""
        return all(check.ok is not False for check in self.checks)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it is NO-GO; empty where it is GO."""
        return tuple(check.says for check in self.checks if check.ok is False)


@dataclass(frozen=True, slots=True)
class Circumstances:
    """Facts about the run that the calibration does not contain.

    Attributes
    ----------
    temperatures : mean of each window, deg C, nan where unknown
    link : counts of `driver.Health`; empty where unknown
    verification : of a position that was not fitted, if one was held
    family : earlier calibrations of the device, oldest first; None without a history
    doubts : sentences about what happened on the way that make it NO-GO
    windows : that it was made of

    """

    temperatures: Sequence[float] = ()
    link: Mapping[str, int] | None = None
    verification: Verification | None = None
    family: Sequence[Calibration] | None = None
    doubts: Sequence[str] = ()
    windows: Sequence[Average] = ()


def decide(
    found: Calibration,
    about: Description,
    limits: GradeLimits,
    circumstances: Circumstances,
) -> Decision:
    """Check a calibration against limits."""
    verification = _verification(circumstances.verification, limits)
    checks = [
        _fit(found, limits),
        *_odd_positions(found, verification.ok is True),
        *_turns(found, limits),
        *_uncertainty(found, limits),
        *_site(found, about),
        *_level(found, about),
        *_change(found, limits, circumstances.family),
        verification,
        *_temperature(np.asarray(circumstances.temperatures, float), limits),
        *_link(circumstances.link, limits),
        *(Check("the run", False, doubt) for doubt in circumstances.doubts),
    ]
    g, mounting = about.gravity, about.mounting
    grown = tuple(growth(found, g, mounting, seconds) for seconds in TIMES)
    made = Decision(tuple(checks), grown)
    return (
        made
        if made.go
        else replace(made, remedy=_remedy(found, about, limits, circumstances, checks))
    )


def _remedy(
    found: Calibration,
    about: Description,
    limits: GradeLimits,
    circumstances: Circumstances,
    checks: Sequence[Check],
) -> Remedy | None:
    """The cheapest remedy, where windows tell what one is worth."""
    windows = circumstances.windows
    if not windows:
        return None
    known = [w.sigma[:3][np.isfinite(w.sigma[:3])] for w in windows]
    sigma = float(np.median([s.max() for s in known if len(s)] or [np.nan]))
    seconds = float(np.median([w.end - w.start for w in windows]))
    if not (np.isfinite(sigma) and sigma > 0):
        return None
    failed = [
        check.name.removesuffix(UNCERTAINTY)
        for check in checks
        if check.ok is False and check.name.endswith(UNCERTAINTY)
    ]
    return cheapest(found, about, limits, failed, sigma, float(np.ceil(seconds)))


def with_decision(found: Calibration, made: Decision) -> Calibration:
    """The calibration with the decision among its information."""
    decision: dict[str, Any] = {
        "go": made.go,
        "reasons": list(made.reasons),
        "checks": [_document(check) for check in made.checks],
    }
    if made.remedy is not None:
        decision["remedy"] = made.remedy.to_json()
    expectation = [each.to_json() for each in made.growth]
    more = {"decision": decision, "expectation": expectation}
    return replace(found, info={**found.info, **more})


def _document(check: Check) -> dict[str, Any]:
    out: dict[str, Any] = {"name": check.name, "ok": check.ok, "says": check.says}
    if check.value is not None:
        out |= {"value": check.value, "limit": check.limit, "unit": check.unit}
    return out


def _fit(found: Calibration, limits: GradeLimits) -> Check:
    if not found.good:
        return Check("fit", False, "the estimate itself is bad: " + _first(found))
    if found.dof <= 0 or not np.isfinite(found.chi2):
        return Check("fit", None, "no degree of freedom is left to check the fit")
    chance = chi2_tail(found.chi2, found.dof)
    agree = chance >= limits.fit_chance
    word = "agree" if agree else "do not agree"
    says = (
        f"the positions {word} with each other: χ² = {found.chi2:.1f} with"
        f" {found.dof} degrees of freedom, probability {chance:.2g}, at least"
        f" {limits.fit_chance:.2g}"
    )
    if not agree and (small := harmless(found, limits)):
        says += f"; {small}"
        agree = True
    return Check("fit", agree, says, chance, limits.fit_chance, "1")


def _odd_positions(found: Calibration, verified: bool) -> list[Check]:
    """Name a position that does not fit the others; without witnesses it is NO-GO."""
    doubt = DoubtfulPosition.from_json(found.info.get("doubtful_position"))
    checks = [Check("positions", None, doubt.sentence)] if doubt else []
    if verified or not left_out(found):
        return checks
    return [*checks, Check("witnesses", has_witnesses(found), witnesses(found))]


def _turns(found: Calibration, limits: GradeLimits) -> list[Check]:
    """Whether the gyroscopes were turned as the positions say."""
    apart = turns_disagree(found, limits)
    return [Check("turns", False, apart)] if apart else []


def _first(found: Calibration) -> str:
    return found.warnings[0] if found.warnings else "see the fit"


def _uncertainty(found: Calibration, limits: GradeLimits) -> list[Check]:
    checks = []
    for group in COMPONENTS:
        limit = limits.sigma(group)
        read = {sensor_of(group_of(name)) for name in found.names}
        sensor_read = sensor_of(group) in read
        if limit is None or not sensor_read:
            continue
        unit = COMPONENTS[group][1]
        _, sigma = found.vector(group)
        lacking = [a for a, s in zip("xyz", sigma, strict=True) if not np.isfinite(s)]
        if lacking and group in REQUIRED:
            says = f"{group} {' '.join(lacking)} was not determined by these positions"
            checks.append(Check(group + UNCERTAINTY, False, says))
        elif not lacking:
            worst = int(np.argmax(sigma))
            ok = bool(sigma[worst] <= limit)
            says = (
                f"{group} {'xyz'[worst]} is known to ± {_apart(sigma[worst], limit)}"
                f"{_of(unit)}, {'within' if ok else 'more than'} {limit:.2g}{_of(unit)}"
            )
            if not ok and sensor_of(group) == "acc":
                says += _by_angles(found, limits)
            value = float(sigma[worst])
            checks.append(Check(group + UNCERTAINTY, ok, says, value, limit, unit))
    return checks


def _apart(value: float, limit: float) -> str:
    """A value with as many digits as tell it from its limit.

    >>> _apart(0.02041, 0.02), _apart(0.03123, 0.02)
    ('0.0204', '0.031')
    """
    for digits in range(2, 7):
        text = f"{value:.{digits}g}"
        if float(text) != float(f"{limit:.{digits}g}"):
            break
    return text


def _by_angles(found: Calibration, limits: GradeLimits) -> str:
    """Remedy where the setting of the angles limits the uncertainty."""
    angles = float(found.info.get("angle_sigma_deg") or 0.0)
    if found.method == "scalar" or angles < limits.angle_setting_deg:
        return ""
    return (
        f"; angles count as set to ± {angles:.2g}°: if they are set better say so"
        " (--angles), else turn further"
    )


def _site(found: Calibration, about: Description) -> list[Check]:
    """Whether gravity is known, which every accelerometer's scale is measured by."""
    if "acc_scale" not in found.groups:
        return []
    wrong = gravity_unknown(about) or gravity_contradicted(about)
    return [Check("site", False, wrong)] if wrong else []


def _level(found: Calibration, about: Description) -> list[Check]:
    """Whether the level of the base is known: an unseen tilt acts as a bias."""
    if tilt_is_found(found) or "acc_bias" not in found.groups:
        return []
    level = found.info.get("level_sigma_deg")
    if level is None:
        return [Check("level", False, level_missing(about))]
    says = f"the base is level to ± {level:.2g}°, as stated; each ± includes it"
    return [Check("level", True, says)]


def _change(
    found: Calibration, limits: GradeLimits, family: Sequence[Calibration] | None
) -> list[Check]:
    if family is None:
        return [Check("change", None, "no serial number, so no history to compare")]
    if not family:
        return [Check("change", None, "first calibration of this device")]
    known = [n for n in found.names if limits.repeat(group_of(n)) is not None]
    checks = []
    for group in dict.fromkeys(group_of(n) for n in known):
        names = [n for n in known if group_of(n) == group]
        made = [_compared(found, n, limits, family, len(known)) for n in names]
        checks += sorted(filter(None, made), key=lambda c: c.value or 0.0)[:1]
    return checks


def _compared(
    found: Calibration,
    name: str,
    limits: GradeLimits,
    family: Sequence[Calibration],
    together: int,
) -> Check | None:
    """One parameter against earlier runs; all parameters share the probability."""
    earlier = [c for c in family if name in c.names]
    parameter = ParameterName.of(name)
    repeat = limits.repeat(parameter.group)
    if not earlier or repeat is None:
        return None
    value, sigma = found.value(name), found.uncertainty(name)
    usual = expected(
        np.array([c.value(name) for c in earlier]),
        np.array([c.uncertainty(name) for c in earlier]),
        repeat,
    )
    chance, limit = usual.chance(value, sigma), limits.family_chance / together
    ok = chance >= limit
    unit = _of(found.units[found.names.index(name)])
    says = (
        f"{parameter.group} {parameter.component} differs from {usual.runs} earlier"
        f" calibration{'s' if usual.runs > 1 else ''} by {value - usual.mean:+.2g}"
        f" ± {usual.sigma(sigma):.2g}{unit}"
        f"{'' if ok else ': out of family; inspect the device before you use it'}"
    )
    return Check(f"{parameter.group} change", ok, says, chance, limit, "1")


def _verification(verification: Verification | None, limits: GradeLimits) -> Check:
    if verification is None:
        return Check("verification", None, "no position was taken to verify (--verify)")
    far = verification.largest > limits.verification_residual
    odd = verification.chance < limits.verification_chance
    says = (
        f"at {verification.position.name}, not fitted, the accelerometers are off by"
        f" {verification.largest:.2g} ± {np.linalg.norm(verification.sigma):.2g} m/s²,"
        f" allowed {limits.verification_residual:.2g} m/s²"
    )
    if odd:
        says += (
            "; the calibration does not explain that (probability"
            f" {verification.chance:.1g})"
        )
    limit = limits.verification_residual
    return Check(
        "verification", not (far or odd), says, verification.largest, limit, "m/s^2"
    )


def _temperature(
    temperatures: np.ndarray[Any, Any], limits: GradeLimits
) -> list[Check]:
    known = temperatures[np.isfinite(temperatures)]
    if not len(known):
        return [Check("temperature", None, "the device reports no temperature")]
    low, high = float(known.min()), float(known.max())
    least, most = limits.temperature_min_c, limits.temperature_max_c
    ok = least <= low and high <= most
    says = f"{low:.1f} to {high:.1f} °C, allowed {least:g} to {most:g} °C"
    span, wide = high - low, limits.temperature_span_k
    steady = span <= wide
    changed = (
        f"the temperature changed by {span:.1f} K from window to window, allowed"
        f" {wide:g} K{'' if steady else ': let it warm up, then run again'}"
    )
    far = low if low < least else high
    bound = least if low < least else most
    return [
        Check("temperature", ok, says, far, bound, "°C"),
        Check("temperature change", steady, changed, span, wide, "K"),
    ]


def _link(link: Mapping[str, int] | None, limits: GradeLimits) -> list[Check]:
    if not link or not link.get("samples"):
        return [Check("link", None, "losses of the link were not recorded")]
    samples, missing, bad = (link.get(k, 0) for k in ("samples", "missing", "bad"))
    checks = []
    for name, count, limit in (
        ("samples missing", missing, limits.lost_share),
        ("frames refused", bad, limits.bad_share),
    ):
        share = count / (samples + count)
        ok = share <= limit
        says = (
            f"{count} of {samples + count} {name} ({share:.2%}), allowed {limit:.2%}"
            f"{'' if ok else ': check cable and baud rate'}"
        )
        checks.append(Check(f"link: {name}", ok, says, share, limit, "1"))
    return checks


def _of(unit: str) -> str:
    return "" if unit == "1" else f" {unit.replace('^2', '²')}"
