"""How a person tells a virtual device what to have: ids and parameters, checked.

A parameter is a number or a word. Of the components of a vector any may be left out
and is zero, but one must be given; other parameters have a default or must be given.
On the command line an effect is ``ID:param=value,…``. In a device file it is a table
``[effects.ID]``, or several tables ``[[effects.ID]]`` if it can happen more than once.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from fieldcal.core.errors import InputError
from fieldcal.sim_device import effects
from fieldcal.sim_device.effect import Number, SimulatedEffect, Word


def checked_effect(id_: str, given: Mapping[str, Any]) -> SimulatedEffect:
    """Check the parameters of one effect and fill in the defaults.

    Raises
    ------
    InputError
        If there is no such id or parameter, one is missing, or a value is out of range.

    >>> checked_effect("cross_coupling", {"k12": 0.003})["k12"]
    0.003
    """
    if id_ not in effects.ids():
        known = ", ".join(effects.ids())
        raise InputError(f"no effect is called {id_!r}; the device knows {known}")
    kind = effects.kind(id_)
    for name in given:
        if name not in kind.names():
            takes = ", ".join(kind.names()) or "no parameter"
            raise InputError(f"{id_} has no parameter {name!r}; it takes {takes}")
    if kind.VECTOR and not any(name in given for name in kind.VECTOR):
        some = ", ".join(kind.VECTOR)
        raise InputError(f"{id_} needs at least one of {some}")
    taken = {**dict.fromkeys(kind.VECTOR, Number(0.0)), **kind.NUMBERS}
    numbers = {n: _number(id_, n, given, takes) for n, takes in taken.items()}
    words = {n: _word(id_, n, given, takes) for n, takes in kind.WORDS.items()}
    return kind(numbers, words)


def parse(text: str) -> SimulatedEffect:
    """Read ``ID:param=value,…`` of the command line.

    Raises
    ------
    InputError
        If the text has not that form, or `checked_effect` refuses what it says.

    >>> parse("settling:ax=-0.03,tau_s=4")["tau_s"]
    4.0
    """
    id_, _, rest = text.partition(":")
    given: dict[str, Any] = {}
    for part in filter(None, (p.strip() for p in rest.split(","))):
        name, equals, value = (p.strip() for p in part.partition("="))
        if not equals or not name:
            raise InputError(f"{text!r}: {part!r} is not PARAMETER=VALUE, as in hz=50")
        if name in given:
            raise InputError(f"{text!r} gives {name} twice; leave one out")
        given[name] = value
    return checked_effect(id_.strip(), given)


def check_repeats(given: tuple[SimulatedEffect, ...]) -> None:
    """Refuse an effect given twice that can only be there once.

    Raises
    ------
    InputError
        Naming the effect.

    """
    seen: set[str] = set()
    for one in given:
        if one.id in seen and not one.REPEATS:
            raise InputError(
                f"{one.id} is given twice; give all its parameters at once"
            )
        seen.add(one.id)


def _number(id_: str, name: str, given: Mapping[str, Any], takes: Number) -> float:
    value = given.get(name, takes.default)
    if value is None:
        raise InputError(f"{id_} needs {name}, as in {id_}:{name}=…")
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{id_}: {name} must be a number, not {value!r}")
    if not takes.range.contains(number):
        raise InputError(
            f"{id_}: {name} must be {takes.range.description}, not {number:g}"
        )
    return number


def _word(id_: str, name: str, given: Mapping[str, Any], takes: Word) -> str:
    value = given.get(name, takes.default)
    if value is None:
        raise InputError(f"{id_} needs {name}, one of {takes.description}")
    text = "".join(value) if isinstance(value, list | tuple) else str(value)
    if text and not re.fullmatch(takes.pattern, text):
        raise InputError(f"{id_}: {name} must be {takes.description}, not {text!r}")
    return text
