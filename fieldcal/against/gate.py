"""Checks whether a simulator still matches a recording within limits, for CI.

Every difference fails, unless it has a limit and all its parameters differ by less. A
limit is a number in the parameter's unit, or a part of the recording's value in per
cent. The limit `chi2_per_dof` is for the simulator's prediction of the recording. What
one of the two does not show has not been compared: it is no check that was passed, and
fails if it has a limit.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, tostring

from fieldcal.against.result import Difference, Match, RealAndSimulated
from fieldcal.against.sensor_model import CALIBRATION
from fieldcal.against.wording import DIRECTION_WORDS, difference_with_parameters
from fieldcal.core.errors import InputError
from fieldcal.core.escaping import escape_invisible
from fieldcal.effects import catalogue
from fieldcal.session.file_writing import write_atomically

PREDICTION = "chi2_per_dof"

ALWAYS = (*CALIBRATION, "noise")
"""Ids that every recording is checked for."""

IN_MOTION = (*CALIBRATION, "misalignment")
"""Ids that a recording is checked for where the simulator follows its motion."""


@dataclass(frozen=True, slots=True)
class Limit:
    """Largest allowed difference, in its unit or relative to the recording's value."""

    size: float
    relative: bool = False

    def allows(self, pair: RealAndSimulated) -> bool:
        """Whether the difference of a parameter is within the limit."""
        off = pair.difference.value
        if isinstance(off, str):
            return False
        if not self.relative:
            return abs(off) <= self.size
        value = pair.real.value if pair.real is not None else 0.0
        return not isinstance(value, str) and abs(off) <= self.size * abs(value)


@dataclass(frozen=True, slots=True)
class MatchCheck:
    """One id that was checked, whether it is within its limit, and why not."""

    name: str
    ok: bool
    says: str = ""


def parse_limits(given: Iterable[str] | Mapping[str, float | str]) -> dict[str, Limit]:
    """Parse limits from texts like "acc_bias=0.02", "noise=10%", or from a mapping.

    Raises
    ------
    InputError
        If an id is unknown, or a limit is no number.

    """
    if not isinstance(given, Mapping):
        given = dict(_split_limit(text) for text in given)
    known = (*ALWAYS, *IN_MOTION[-1:], PREDICTION, *catalogue())
    for name in given:
        if name not in known:
            raise InputError(
                f"--limit {name}: nothing is called so; it is {', '.join(known)}"
            )
    return {name: _parse_limit(name, str(text)) for name, text in given.items()}


def _split_limit(text: str) -> tuple[str, str]:
    name, is_one, size = text.partition("=")
    if not is_one:
        raise InputError(f"--limit {text}: write it as acc_bias=0.02 or noise=10%")
    return name.strip(), size


def _parse_limit(name: str, text: str) -> Limit:
    """A limit from a text like 0.02 or 10 %."""
    number = text.strip().removesuffix("%")
    relative = number != text.strip()
    try:
        size = float(number)
    except ValueError:
        size = -1.0
    if not size >= 0 or (relative and name == PREDICTION):
        raise InputError(f"--limit {name}={text}: must be a number, as in {name}=0.02")
    return Limit(size / 100 if relative else size, relative)


def check_match(found: Match, allowed: Mapping[str, Limit]) -> list[MatchCheck]:
    """Check every id that was compared, the ids of every recording first."""
    every = ALWAYS if found.aligned is None else IN_MOTION
    shown = [name for name in every if _is_compared(name, found)]
    names = [*shown, *found.alike, *(d.id for d in found.differences)]
    out = [_check(name, found, allowed) for name in dict.fromkeys(names)]
    lacking = "was not compared, since one of the two does not show it"
    out += [
        MatchCheck(name, False, f"{name.replace('_', ' ')} {lacking}")
        for name in every
        if name in allowed and name not in names
    ]
    if (limit := allowed.get(PREDICTION)) is not None:
        value = found.before.chi2_per_dof
        says = f"it is predicted with χ²/dof {value:.3g}, at most {limit.size:g}"
        out.append(MatchCheck(PREDICTION, value <= limit.size, says))
    return out


def _is_compared(name: str, found: Match) -> bool:
    """Whether both recordings show a quantity that every recording is checked for.

    A reference of the motion has it by definition.
    """
    if name == "misalignment":
        return True
    here, there = (
        one.noise if name == "noise" else one.calibration.get(name, {})
        for one in (found.real, found.simulator)
    )
    return bool(here) if found.aligned is not None else bool({*here} & {*there})


def _check(name: str, found: Match, allowed: Mapping[str, Limit]) -> MatchCheck:
    """Check one id: it does not differ, or by no more than is allowed."""
    beyond = [d for d in found.differences if d.id == name and not _within(d, allowed)]
    says = "; ".join(
        f"{DIRECTION_WORDS[d.direction]}: {difference_with_parameters(d)}"
        for d in beyond
    )
    return MatchCheck(name, not beyond, says)


def _within(one: Difference, allowed: Mapping[str, Limit]) -> bool:
    limit, sizes = allowed.get(one.id), one.sizes.values()
    return limit is not None and bool(sizes) and all(limit.allows(p) for p in sizes)


def write_junit(
    path: Path, name: str, found: Match, done: Iterable[MatchCheck]
) -> None:
    """Write checks as JUnit XML, with the differences as properties.

    Raises
    ------
    SessionError
        If the file cannot be written.

    """
    suite = Element("testsuite", name="fieldcal.against")
    values = SubElement(suite, "properties")
    SubElement(
        values, "property", name=PREDICTION, value=f"{found.before.chi2_per_dof:.6g}"
    )
    for one in found.differences:
        for parameter, pair in one.parameters.items():
            off = pair.difference.value
            text = off if isinstance(off, str) else f"{off:.6g}"
            SubElement(values, "property", name=f"{one.id}.{parameter}", value=text)
    failed = 0
    every = list(done)
    for check in every:
        case = SubElement(suite, "testcase", classname=name, name=check.name)
        if not check.ok:
            failed += 1
            SubElement(case, "failure", message=check.says)
    suite.set("tests", str(len(every)))
    suite.set("failures", str(failed))
    for element in suite.iter():
        for key, value in element.items():
            element.set(key, escape_invisible(value))
    write_atomically(path, tostring(suite, encoding="utf-8", xml_declaration=True))
