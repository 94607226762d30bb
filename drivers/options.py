"""Options in an address: ``PORT?baud=115200&format=text``."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from math import isfinite
from urllib.parse import parse_qsl

from fieldcal.core.errors import InputError


class Options:
    """The options of one address, each taken once by name; `finish` refuses the rest.

    Parameters
    ----------
    owner : what the options are for, as errors name it
    query : what stands behind the question mark

    """

    def __init__(self, owner: str, query: str = "") -> None:
        self._owner = owner
        self._known: list[str] = []
        try:
            pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
        except ValueError:
            raise InputError(
                f"{owner}: write options as name=value joined by &, not {query!r}"
            ) from None
        self._given = dict(pairs)

    def text(self, name: str, default: str = "") -> str:
        """Return the option as it was written."""
        self._known.append(name)
        return self._given.get(name, default)

    def choice(self, name: str, choices: Collection[str], default: str) -> str:
        """Return the option, one of `choices`.

        Raises
        ------
        InputError
            If it is none of them.

        """
        value = self.text(name, default)
        if value not in choices:
            known = ", ".join(choices)
            raise InputError(f"{self._owner}: {name}={value} is none of {known}")
        return value

    def number(
        self, name: str, default: float, low: float = 0.0, high: float = 1e9
    ) -> float:
        """Return the option as a number within [low, high].

        Raises
        ------
        InputError
            If it is no such number.

        """
        value = self.text(name)
        if not value:
            return default
        try:
            number = float(value)
        except ValueError:
            number = float("nan")
        if not (isfinite(number) and low <= number <= high):
            raise InputError(
                f"{self._owner}: {name}={value} is no number from {low:g} to {high:g}"
            )
        return number

    def unit(self, name: str, known: Mapping[str, float], default: str) -> float:
        """Return the SI value of a unit, also with a factor, as in ``0.061*mg``.

        Raises
        ------
        InputError
            If it is none of `known`, or the factor is no number or 0.

        """
        value = self.text(name, default)
        factor, _, unit = value.rpartition("*")
        try:
            size = float(factor or 1.0) * known[unit]
            if not (size and isfinite(size)):
                raise ValueError
        except (ValueError, KeyError):
            raise InputError(
                f"{self._owner}: {name}={value} is none of {', '.join(known)}, nor one"
                f" of them with a factor, as in 0.5*{default}"
            ) from None
        return size

    def with_fixed(self, **values: str) -> Options:
        """Return these options with some that cannot be chosen."""
        for name in values:
            if name in self._given:
                raise InputError(f"{self._owner}: {name} is fixed in this format")
        other = Options(self._owner)
        other._given, other._known = {**self._given, **values}, self._known
        return other

    def finish(self) -> None:
        """Refuse what nobody asked for.

        Raises
        ------
        InputError
            If an option is unknown here.

        """
        if strange := sorted(set(self._given) - set(self._known)):
            known = ", ".join(sorted(set(self._known)))
            raise InputError(
                f"{self._owner} knows no option {strange[0]!r}: it takes {known}"
            )


def split_address(address: str, owner: str) -> tuple[str, Options]:
    """Split an address into what is before the question mark, and its options.

    >>> place, options = split_address("/dev/ttyUSB0?baud=9600", "serial")
    >>> place, options.number("baud", 115200)
    ('/dev/ttyUSB0', 9600.0)
    """
    place, _, query = address.partition("?")
    return place, Options(owner, query)
