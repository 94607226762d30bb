"""Plug-ins, one in each file, found by the name of the file and by their base class."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pkgutil import iter_modules
from typing import TypeVar

T = TypeVar("T")


def module_names(path: Iterable[str]) -> tuple[str, ...]:
    """Names of the modules in a package's ``__path__``, in alphabetical order."""
    return tuple(sorted(module.name for module in iter_modules(path)))


def plugin_class(module: str, base: type[T]) -> type[T]:
    """Public subclass of `base` that a module defines.

    Parameters
    ----------
    module : its dotted name
    base : class that the plug-in derives from; of a chain of subclasses, the last
        counts

    Raises
    ------
    LookupError
        If the module defines none.

    """
    there = [
        thing
        for thing in vars(import_module(module)).values()
        if isinstance(thing, type)
        and issubclass(thing, base)
        and thing.__module__ == module
        and not thing.__name__.startswith("_")
    ]
    last = [c for c in there if not any(c in other.__mro__[1:] for other in there)]
    if len(last) != 1:
        found = ", ".join(c.__name__ for c in last) or "none"
        raise LookupError(
            f"{module} must define one public subclass of {base.__name__};"
            f" it has {found}"
        )
    return last[0]
