"""What every wire format is: samples in, the bytes that a device would send out.

To add one, write sim_device/wire_<name>.py with a subclass of `Wire` named `Encoder`;
``fieldcal sim --serial <name>`` finds it. Options follow as in a driver's address:
``text?separator=semicolon&checksum=xor``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import ClassVar
from urllib.parse import parse_qsl

from fieldcal.core.errors import InputError
from fieldcal.core.plugins import plugin_class
from fieldcal.core.samples import Block


class Wire(ABC):
    """Encoder of samples; `options` are names with their defaults."""

    options: ClassVar[Mapping[str, str]] = {}

    def __init__(self, given: Mapping[str, str]) -> None:
        for name in given:
            if name not in self.options:
                takes = ", ".join(self.options) or "none"
                raise InputError(f"no option {name!r} in this format; it has {takes}")
        self.chosen = {**self.options, **given}

    @abstractmethod
    def encode(self, block: Block) -> bytes:
        """Bytes that carry the samples, with the rounding that they cost."""

    def answer(self, received: bytes) -> bytes:
        """What the device sends back to bytes from the host; many say nothing."""
        return b""

    def choice(self, name: str, among: Mapping[str, float] | tuple[str, ...]) -> str:
        """Return the value of an option that is one of several words."""
        value = self.chosen[name]
        if value not in among:
            raise InputError(f"{name}={value!r} is none of {', '.join(among)}")
        return value

    def number(self, name: str) -> float:
        """Return the value of an option that is a number above 0."""
        try:
            value = float(self.chosen[name])
        except ValueError:
            value = 0.0
        if not 0 < value < float("inf"):
            raise InputError(f"{name}={self.chosen[name]!r} must be a number above 0")
        return value


def formats() -> tuple[str, ...]:
    """Names of the wire formats there are."""
    here = Path(__file__).parent
    found = (path.stem.removeprefix("wire_") for path in here.glob("wire_*.py"))
    return tuple(sorted(found))


def open_wire(spec: str) -> Wire:
    """Return the encoder for ``NAME?option=value&…``.

    Raises
    ------
    InputError
        If there is no such format, or it has no such option.

    """
    name, _, query = spec.partition("?")
    module = f"fieldcal.sim_device.wire_{name}"
    if not name.isidentifier() or find_spec(module) is None:
        raise InputError(
            f"no wire format {name!r} for the virtual device; there are "
            f"{', '.join(formats())}"
        )
    encoder = plugin_class(module, Wire)  # type: ignore[type-abstract]
    try:
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
    except ValueError as error:
        raise InputError(f"{spec!r}: options are like name=value&name=value") from error
    try:
        return encoder(dict(pairs))
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
