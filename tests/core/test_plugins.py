"""What is added as one file: found, and refused where it is not one thing."""

import sys
from abc import ABC
from types import ModuleType

import pytest

from fieldcal import drivers, effects
from fieldcal.core.plugins import module_names, plugin_class
from fieldcal.physics.effect import Effect


class Base(ABC):  # noqa: B024
    """What others are of."""


def module_with(name: str, *classes: str) -> str:
    """A module that defines classes, each from the one before, the first from Base."""
    module = ModuleType(name)
    exec("class Other: pass", vars(module))
    last = "Base"
    vars(module)["Base"] = Base
    for one in classes:
        exec(f"class {one}({last}): pass", vars(module))
        last = one
    sys.modules[name] = module
    return name


def test_the_class_that_a_module_defines_is_found() -> None:
    assert plugin_class(module_with("m_one", "One"), Base).__name__ == "One"
    assert plugin_class(module_with("m_two", "One", "Two"), Base).__name__ == "Two"
    assert plugin_class(module_with("m_own", "One", "_Two"), Base).__name__ == "One"
    found = plugin_class("fieldcal.effects.hum", Effect)
    assert found.__module__ == "fieldcal.effects.hum"


def test_none_is_refused_by_name() -> None:
    told = "m_none must define one public subclass of Base; it has none$"
    with pytest.raises(LookupError, match=told):
        plugin_class(module_with("m_none"), Base)


def test_two_are_refused() -> None:
    name = module_with("m_twins", "One")
    exec("class Twin(Base): pass", vars(sys.modules[name]))
    with pytest.raises(LookupError, match="it has One, Twin"):
        plugin_class(name, Base)


def test_names_are_those_of_the_files() -> None:
    assert "hum" in module_names(effects.__path__)
    assert list(module_names(drivers.__path__)) == sorted(
        module_names(drivers.__path__)
    )
