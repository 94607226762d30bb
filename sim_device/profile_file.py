"""Device files: a virtual device written down.

A device file has the tables of `Profile` under their names, `format = 1` on top, and
``[effects.ID]`` with parameters, or ``[[effects.ID]]`` for what happens more than once.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.documents import load_toml
from fieldcal.core.errors import InputError
from fieldcal.sim_device.effect import SimulatedEffect
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.vocabulary import checked_effect

FORMAT = 1

_TABLES = {f.name: type(f.default) for f in fields(Profile) if f.name != "effects"}


def read_profile(path: Path) -> Profile:
    """Read a device file.

    Raises
    ------
    InputError
        If it cannot be read; names the file, the table and the key.

    """
    try:
        return profile_from_tables(_load(path))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def profile_from_tables(tables: Mapping[str, Any]) -> Profile:
    """Make the device of a parsed device file.

    Raises
    ------
    InputError
        Naming the table and the key.

    """
    known = ("format", *_TABLES, "effects")
    for name in tables:
        if name not in known:
            raise InputError(
                f"no table [{name}] in a device file; it has {_list(known)}"
            )
    if tables.get("format", FORMAT) != FORMAT:
        raise InputError(f"format = {tables['format']!r}; this version reads {FORMAT}")
    parts = {
        name: _part(name, kind, _table(tables, name)) for name, kind in _TABLES.items()
    }
    return Profile(**parts, effects=_effects(_table(tables, "effects")))


def to_toml(profile: Profile) -> str:
    """Text of a device file that `read_profile` gives back the same."""
    import tomlkit

    tables: dict[str, Any] = {"format": FORMAT}
    for name in _TABLES:
        table = asdict(getattr(profile, name))
        tables[name] = {k: _plain(v) for k, v in table.items() if v is not None}
    effects: dict[str, list[dict[str, Any]]] = {}
    for one in profile.effects:
        effects.setdefault(one.id, []).append(_written(one))
    tables["effects"] = {k: v[0] if len(v) == 1 else v for k, v in effects.items()}
    return tomlkit.dumps(tables)


def _load(path: Path) -> Mapping[str, Any]:
    try:
        return load_toml(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"is not TOML: {error}") from error


def _table(tables: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    table = tables.get(name, {})
    if not isinstance(table, Mapping):
        raise InputError(f"{name} must be a table: write [{name}]")
    return table


def _names(kind: type[Any]) -> list[str]:
    return [f.name for f in fields(kind)]


def _list(names: Any) -> str:
    return ", ".join(names)


def _part(name: str, kind: type[Any], table: Mapping[str, Any]) -> Any:
    types = {f.name: str(f.type) for f in fields(kind)}
    for key in table:
        if key not in types:
            raise InputError(f"[{name}] has no key {key!r}; it has {_list(types)}")
    return kind(
        **{
            key: _READERS[types[key]](f"[{name}] {key}", value)
            for key, value in table.items()
        }
    )


def _text(where: str, value: Any) -> str:
    if not isinstance(value, str):
        raise InputError(f"{where} = {value!r} must be text in quotes")
    return value


def _number(where: str, value: Any) -> float:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not np.isfinite(value):
        raise InputError(f"{where} = {value!r} must be a number")
    return float(value)


def _triad(where: str, value: Any) -> tuple[float, ...]:
    values = value if isinstance(value, list) else [value] * 3
    if len(values) != 3:
        raise InputError(f"{where} = {value!r} must be three numbers, x y z, or one")
    return tuple(_number(where, v) for v in values)


def _axes(where: str, value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f'{where} = {value!r} must be like ["+x", "-z", "+y"]')
    return tuple(_text(where, v) for v in value)


def _points(where: str, value: Any) -> tuple[tuple[float, float], ...]:
    if not isinstance(value, list) or not all(
        isinstance(pair, list) and len(pair) == 2 for pair in value
    ):
        raise InputError(f"{where} = {value!r} must be like [[0.0, 21.0], [600.0, 30]]")
    return tuple((_number(where, a), _number(where, b)) for a, b in value)


_READERS: Mapping[str, Callable[[str, Any], Any]] = {
    "str": _text,
    "Grade": _text,
    "float": _number,
    "float | None": _number,
    "Triad": _triad,
    "Triad | None": _triad,
    "tuple[str, str, str]": _axes,
    "tuple[tuple[float, float], ...]": _points,
}
"""How a key is read, by the type that its dataclass declares."""


def _effects(table: Mapping[str, Any]) -> tuple[SimulatedEffect, ...]:
    made = []
    for id_, given in table.items():
        for one in given if isinstance(given, list) else [given]:
            if not isinstance(one, Mapping):
                raise InputError(f"effects.{id_} must be a table: [effects.{id_}]")
            made.append(checked_effect(id_, one))
    return tuple(made)


def _written(one: SimulatedEffect) -> dict[str, Any]:
    """Parameters to write: the components of a vector that are not zero, and others."""
    given = {k: v for k, v in one.numbers.items() if v or k not in one.VECTOR}
    if one.VECTOR and not any(k in given for k in one.VECTOR):
        given[one.VECTOR[0]] = 0.0
    words = {k: v for k, v in one.words.items() if v}
    return {**given, **words}


def _plain(value: Any) -> Any:
    """Lists for tuples, all the way down."""
    return [_plain(v) for v in value] if isinstance(value, tuple) else value
