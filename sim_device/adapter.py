"""A CAN adapter on a serial line, as the host sees it: the Lawicel protocol (slcan).

    S0 … S8, s…   bit rate     O, L   open the channel     C   close it
    V, v          versions     N      serial number        F   status flags
    Z0            no times     t, T, r, R   a frame to send, taken and lost

Each line ends with CR; the answer is CR, with z or Z before it for a frame, or BEL for
what is refused: a bit rate while the channel is open, a frame while it is closed.
Frames come as ``tiiindd…``: identifier in three hex digits, length, bytes.
"""

from __future__ import annotations

from fieldcal.core.samples import Block
from fieldcal.sim_device.can_packing import frames
from fieldcal.sim_device.wire import Wire

DONE, REFUSED = b"\r", b"\a"
LONGEST = 64


class Adapter(Wire):
    """Encodes samples as lines of a CAN adapter while its channel is open."""

    def __init__(self) -> None:
        super().__init__({})
        self.open = False
        self._line = b""

    def encode(self, block: Block) -> bytes:
        """Encode each frame as a line."""
        lines = (
            f"t{f.identifier:03X}{len(f.data)}{f.data.hex()}" for f in frames(block)
        )
        return "".join(
            line.upper().replace("T", "t", 1) + "\r" for line in lines
        ).encode()

    def answer(self, received: bytes) -> bytes:
        """Carry out commands, and say how that went."""
        *lines, rest = (self._line + received).split(b"\r")
        self._line = rest[-LONGEST:]
        return b"".join(map(self._carry_out, lines))

    def unplug(self) -> None:
        """Be as if just switched on."""
        self.open, self._line = False, b""

    def _carry_out(self, line: bytes) -> bytes:
        command = line[:1].decode("latin-1")
        if command in ("V", "v"):
            return command.encode() + b"1013" + DONE
        if command == "N":
            return b"NF1CA" + DONE
        if command in ("O", "L") and not self.open:
            self.open = True
        elif command == "C" and self.open:
            self.open = False
        elif command in ("S", "s") and not self.open and len(line) > 1:
            return DONE
        elif command == "F" and self.open:
            return b"F00" + DONE
        elif command in ("t", "r") and self.open:
            return b"z" + DONE
        elif command in ("T", "R") and self.open:
            return b"Z" + DONE
        elif command != "Z" or line != b"Z0":
            return REFUSED if command else DONE
        return DONE
