r"""Text: each sample a line of numbers, ``text?columns=…&separator=…&checksum=xor``.

``columns`` are any of t, seq, ax, ay, az, gx, gy, gz, temperature in any order;
``separator`` a character or comma, semicolon, tab, space; ``t_unit`` s, ms or us;
``acc_unit`` m/s^2, g or mg; ``gyr_unit`` rad/s, deg/s or mrad/s; ``digits`` significant
digits of a sensor's value. ``checksum=xor`` puts ``$`` before a line and ``*`` behind
it, with the exclusive or of all between them in two hexadecimal digits, as NMEA 0183
has it; ``prefix=$IMU`` a word before the first number. Lines end in CR LF.
"""

from __future__ import annotations

from functools import reduce
from operator import xor

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.sim_device.earth import STANDARD_GRAVITY
from fieldcal.sim_device.effect import SIX
from fieldcal.sim_device.wire import Wire

SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
SECONDS = {"s": 1.0, "ms": 1e3, "us": 1e6}
ACC = {"m/s^2": 1.0, "g": 1 / STANDARD_GRAVITY, "mg": 1e3 / STANDARD_GRAVITY}
GYR = {"rad/s": 1.0, "deg/s": 180 / np.pi, "mrad/s": 1e3}


class TextWire(Wire):
    """Lines of numbers."""

    options = {
        "columns": "t,ax,ay,az,gx,gy,gz,temperature",
        "separator": "comma",
        "t_unit": "s",
        "acc_unit": "m/s^2",
        "gyr_unit": "rad/s",
        "digits": "9",
        "checksum": "none",
        "prefix": "",
    }

    def __init__(self, given: dict[str, str]) -> None:
        super().__init__(given)
        separator = self.chosen["separator"]
        self._separator = SEPARATORS.get(separator, separator)
        if len(self._separator) != 1 or self._separator.isalnum():
            raise InputError(
                f"separator={separator!r} is not a character between words"
            )
        self._columns = self.chosen["columns"].split(",")
        unit = self.choice("t_unit", SECONDS)
        self._per_second = SECONDS[unit]
        self._acc = ACC[self.choice("acc_unit", ACC)]
        self._gyr = GYR[self.choice("gyr_unit", GYR)]
        self._checked = self.choice("checksum", ("none", "xor")) == "xor"
        digits = int(self.number("digits"))
        time = "%.6f" if unit == "s" else "%.0f"
        known = {"t": time, "seq": "%.0f", "temperature": "%.2f"}
        known |= dict.fromkeys(SIX, f"%.{digits}g")
        for name in self._columns:
            if name not in known:
                raise InputError(f"no column {name!r}; there are {', '.join(known)}")
        parts = [known[name] for name in self._columns]
        prefix = self.chosen["prefix"]
        self._start = "$" if self._checked or prefix.startswith("$") else ""
        first = [word] if (word := prefix.removeprefix("$")) else []
        self._line = self._separator.join(first + parts)

    def encode(self, block: Block) -> bytes:
        """Encode each sample as its line."""
        six = block.six * ([self._acc] * 3 + [self._gyr] * 3)
        values: dict[str, Array] = {
            "t": block.t * self._per_second,
            "seq": block.seq,
            "temperature": block.temperature,
            **{name: six[:, i] for i, name in enumerate(SIX)},
        }
        table = np.stack([values[name] for name in self._columns], axis=1)
        lines = [self._line % tuple(row) for row in table.tolist()]
        return "".join(map(self._ended, lines)).encode("ascii", "replace")

    def _ended(self, line: str) -> str:
        if not self._checked:
            return f"{self._start}{line}\r\n"
        check = reduce(xor, line.encode("ascii", "replace"), 0)
        return f"{self._start}{line}*{check:02X}\r\n"
