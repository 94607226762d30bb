"""GO or NO-GO: a calibration against the limits of its grade, with reasons.

Each check says in a sentence what was measured and what is allowed. A check that could
not be made, for want of a thermometer or of earlier calibrations, is said and does not
stop anybody. The history is compared with, and nothing of it enters the calibration.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldcal.calibration import COMPONENTS, Calibration
from fieldcal.chances import chi2_tail
from fieldcal.description import Description
from fieldcal.error_growth import TIMES, Growth, growth
from fieldcal.family import expected
from fieldcal.level import tilt_is_found, unsaid
from fieldcal.limits import Limits
from fieldcal.solve.words import SUSPECT
from fieldcal.verification import Verification

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
    """What is known beside the calibration itself.

    Attributes
    ----------
    temperatures : mean of each window, deg C, nan where unknown
    link : counts of `driver.Health`; empty where unknown
    verification : of a position that was not fitted, if one was held
    family : earlier calibrations of the device, oldest first; None without a history
    doubts : sentences about what happened on the way that make it NO-GO

    """

    temperatures: Sequence[float] = ()
    link: Mapping[str, int] | None = None
    verification: Verification | None = None
    family: Sequence[Calibration] | None = None
    doubts: Sequence[str] = ()


def decide(
    found: Calibration, about: Description, limits: Limits, seen: Circumstances
) -> Decision:
    """Check a calibration against limits."""
    checks = [
        _fit(found, limits),
        *_odd_positions(found),
        *_uncertainty(found, limits),
        *_level(found, about),
        *_change(found, limits, seen.family),
        _verification(seen.verification, limits),
        *_temperature(np.asarray(seen.temperatures, float), limits),
        *_link(seen.link, limits),
        *(Check("the run", False, doubt) for doubt in seen.doubts),
    ]
    g, mounting = about.gravity, about.mounting
    grown = tuple(growth(found, g, mounting, seconds) for seconds in TIMES)
    return Decision(tuple(checks), grown)


def with_decision(found: Calibration, made: Decision) -> Calibration:
    """The calibration with the decision among its information."""
    decision = {
        "go": made.go,
        "reasons": list(made.reasons),
        "checks": [_document(check) for check in made.checks],
    }
    expectation = [each.to_json() for each in made.growth]
    more = {"decision": decision, "expectation": expectation}
    return replace(found, info={**found.info, **more})


def _document(check: Check) -> dict[str, Any]:
    out: dict[str, Any] = {"name": check.name, "ok": check.ok, "says": check.says}
    if check.value is not None:
        out |= {"value": check.value, "limit": check.limit, "unit": check.unit}
    return out


def _fit(found: Calibration, limits: Limits) -> Check:
    if not found.good:
        return Check("fit", False, "the estimate itself is bad: " + _first(found))
    if found.dof <= 0 or not np.isfinite(found.chi2):
        return Check("fit", None, "the positions leave nothing over to check the fit")
    chance = chi2_tail(found.chi2, found.dof)
    ok = chance >= limits.fit_chance
    word = "agree" if ok else "do not agree"
    says = (
        f"the positions {word} with each other: χ² = {found.chi2:.1f} with"
        f" {found.dof} degrees of freedom, probability {chance:.2g}, at least"
        f" {limits.fit_chance:.2g}"
    )
    return Check("fit", ok, says, chance, limits.fit_chance, "1")


def _odd_positions(found: Calibration) -> list[Check]:
    """Say beside the decision that a position does not fit the others."""
    if max(found.info.get("bad_position", ()), default=0.0) < SUSPECT:
        return []
    told = [said for said in found.warnings if said.startswith("the position ")]
    return [Check("positions", None, said) for said in told]


def _first(found: Calibration) -> str:
    return found.warnings[0] if found.warnings else "see the fit"


def _uncertainty(found: Calibration, limits: Limits) -> list[Check]:
    checks = []
    for group in COMPONENTS:
        limit = limits.sigma(group)
        sensor_read = any(name.startswith(group[:4]) for name in found.names)
        if limit is None or not sensor_read:
            continue
        unit = COMPONENTS[group][1]
        _, sigma = found.vector(group)
        lacking = [a for a, s in zip("xyz", sigma, strict=True) if not np.isfinite(s)]
        if lacking and group in REQUIRED:
            says = f"{group} {' '.join(lacking)} was not determined by these positions"
            checks.append(Check(f"{group} uncertainty", False, says))
        elif not lacking:
            worst = int(np.argmax(sigma))
            ok = bool(sigma[worst] <= limit)
            says = (
                f"{group} {'xyz'[worst]} is known to ± {sigma[worst]:.2g}"
                f"{_of(unit)}, {'within' if ok else 'more than'} {limit:.2g}{_of(unit)}"
            )
            if not ok and group.startswith("acc"):
                says += _by_angles(found, limits)
            value = float(sigma[worst])
            checks.append(Check(f"{group} uncertainty", ok, says, value, limit, unit))
    return checks


def _by_angles(found: Calibration, limits: Limits) -> str:
    """What to do about angles that nobody said are set better than the grade asks."""
    angles = float(found.info.get("angle_sigma_deg") or 0.0)
    if found.method == "scalar" or angles < limits.angle_setting_deg:
        return ""
    return (
        f"; angles count as set to ± {angles:.2g}°: if they are set better say so"
        " (--angles), else turn further"
    )


def _level(found: Calibration, about: Description) -> list[Check]:
    """Whether anybody knows how level the base was: a tilt is taken for a bias."""
    if tilt_is_found(found) or "acc_bias" not in found.groups:
        return []
    level = found.info.get("level_sigma_deg")
    if level is None:
        return [Check("level", False, unsaid(about))]
    says = f"the base is level to ± {level:.2g}°, as was said: the ± have it in them"
    return [Check("level", True, says)]


def _change(
    found: Calibration, limits: Limits, family: Sequence[Calibration] | None
) -> list[Check]:
    if family is None:
        return [Check("change", None, "no serial number, so no history to compare")]
    if not family:
        return [Check("change", None, "first calibration of this device")]
    known = [n for n in found.names if limits.repeat(n.partition(".")[0]) is not None]
    checks = []
    for group in dict.fromkeys(n.partition(".")[0] for n in known):
        names = [n for n in known if n.startswith(f"{group}.")]
        made = [_compared(found, n, limits, family, len(known)) for n in names]
        checks += sorted(filter(None, made), key=lambda c: c.value or 0.0)[:1]
    return checks


def _compared(
    found: Calibration,
    name: str,
    limits: Limits,
    family: Sequence[Calibration],
    together: int,
) -> Check | None:
    """One parameter against the runs that have it; the chance is shared by all."""
    earlier = [c for c in family if name in c.names]
    group, _, axis = name.partition(".")
    repeat = limits.repeat(group)
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
        f"{group} {axis} differs from {usual.runs} earlier calibration"
        f"{'s' if usual.runs > 1 else ''} by {value - usual.mean:+.2g}"
        f" ± {usual.sigma(sigma):.2g}{unit}"
        f"{'' if ok else ': out of family; look at the device before you trust it'}"
    )
    return Check(f"{group} change", ok, says, chance, limit, "1")


def _verification(seen: Verification | None, limits: Limits) -> Check:
    if seen is None:
        return Check("verification", None, "no position was held to verify (--verify)")
    far = seen.largest > limits.verification_residual
    odd = seen.chance < limits.verification_chance
    says = (
        f"at {seen.position.name}, not fitted, the accelerometers are off by"
        f" {seen.largest:.2g} ± {np.linalg.norm(seen.sigma):.2g} m/s², allowed"
        f" {limits.verification_residual:.2g} m/s²"
    )
    if odd:
        says += (
            f"; the calibration does not explain that (probability {seen.chance:.1g})"
        )
    limit = limits.verification_residual
    return Check("verification", not (far or odd), says, seen.largest, limit, "m/s^2")


def _temperature(temperatures: np.ndarray[Any, Any], limits: Limits) -> list[Check]:
    known = temperatures[np.isfinite(temperatures)]
    if not len(known):
        return [Check("temperature", None, "the device tells no temperature")]
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


def _link(link: Mapping[str, int] | None, limits: Limits) -> list[Check]:
    if not link or not link.get("samples"):
        return [Check("link", None, "what the link lost was not recorded")]
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
