"""Reads and sets parameters of an autopilot over any MAVLink link, with verification.

PARAM_REQUEST_READ asks for one, PARAM_SET sets one, PARAM_VALUE answers both. The
answer to PARAM_SET does not prove that the value is kept. So a written parameter is
read again, after late answers have arrived. Requests are sent up to `TRIES` times,
since links lose packets; nan and infinity are no answers. A link that is closed is
opened again, since an autopilot may restart.

A parameter is sent as a 32-bit float. PX4 sends the bits of an integer in that float,
so a parameter must be read, which gives its type, before it is set.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Mapping
from time import monotonic, sleep
from typing import Any, Self

import numpy as np

from fieldcal.core.errors import DeviceError, InputError
from fieldcal.drivers.mavlink_dialog import (
    GROUND_STATION,
    INT32,
    NO_AUTOPILOT,
    REAL32,
    parameter_list,
)
from fieldcal.drivers.mavlink_link import TwoWaySource, endpoint_opener
from fieldcal.drivers.mavlink_parameter_names import PX4
from fieldcal.drivers.options import split_address

HEARTBEAT_INTERVAL, PATIENCE = 1.0, 0.7
"""Time between two heartbeats, and until a request is repeated, s."""

TRIES = 4
"""How often a request is sent."""

ROUNDS = 3
"""How often all parameters are set and read back at most."""

QUIET_TIME, LONGEST_SETTLING = 0.5, 3.0
"""Time without an answer after which no more is expected, and the longest wait, s."""

RECONNECT_TIME, RECONNECT_INTERVAL = 20.0, 0.5
"""How long opening a closed link is tried, and the time between attempts, s."""

LONGEST_HEARTBEAT_WAIT = 5.0
"""Longest wait for the first heartbeat, s."""

ARMED = 128
"""Bit of the mode in a heartbeat: motors may turn."""


class ParameterLink:
    """The parameters of the one autopilot on a link; a context manager.

    Parameters
    ----------
    address : as of the driver, ``mavlink:`` left out; only ``baud``, ``system`` and
        ``component`` matter here
    connect : opens the link, also again; by default the one of the address
    clock, pause : time of the host, s, and a function that waits for some s

    Attributes
    ----------
    autopilot : number of its program in the heartbeat
    armed : whether its motors may turn

    Raises
    ------
    DeviceError
        If the link cannot be opened, or no autopilot is heard.
    InputError
        If there are several, and the address names none.

    """

    def __init__(
        self,
        address: str,
        connect: Callable[[], TwoWaySource] | None = None,
        clock: Callable[[], float] = monotonic,
        pause: Callable[[float], None] = sleep,
    ) -> None:
        from pymavlink.dialects.v20 import all as dialect

        endpoint, options = split_address(address, "mavlink")
        baud = int(options.number("baud", 57600, 50, 1e8))
        wanted = {
            name: int(options.number(name, 0, 0, 255))
            for name in ("system", "component")
        }
        self.name, self._wanted = endpoint, wanted
        self._out = dialect.MAVLink(None, *GROUND_STATION)
        self._in = dialect.MAVLink(None)
        self._in.robust_parsing = True
        self._heard: dict[str, float] = {}
        self._whole: set[str] = set()
        self._vehicles: dict[tuple[int, int], Any] = {}
        self._beat = -np.inf
        self.autopilot, self.armed = 0, False
        self._target = (0, 0)
        self._clock, self._pause, self._answered = clock, pause, -np.inf
        self._connect = connect or endpoint_opener(endpoint, baud)
        self._line: TwoWaySource = self._connect()
        try:
            self._greet()
        except BaseException:
            self.close()
            raise

    def read(self, names: Iterable[str]) -> dict[str, float]:
        """Current values of parameters.

        Raises
        ------
        DeviceError
            If it does not answer for one of them.

        """
        wanted = list(names)
        for name in wanted:
            self._heard.pop(name, None)

        def ask() -> None:
            for name in wanted:
                if name not in self._heard:
                    self._send(
                        self._out.param_request_read_encode(
                            *self._target, name.encode(), -1
                        )
                    )

        self._until(lambda: all(n in self._heard for n in wanted), ask)
        lacking = [name for name in wanted if name not in self._heard]
        if lacking:
            raise DeviceError(
                f"{self.name}: the autopilot does not answer for"
                f" {', '.join(lacking)}; check the link, then try again"
            )
        return {name: self._heard[name] for name in wanted}

    def write(self, values: Mapping[str, float]) -> None:
        """Set parameters, and read each back.

        Raises
        ------
        DeviceError
            If a value differs from the one that was set.

        """
        for _ in range(ROUNDS):
            self._set(values)
            self._settle()
            kept = self.read(values)
            wrong = {
                n: kept[n] for n, v in values.items() if not same_float32(kept[n], v)
            }
            if not wrong:
                return
        raise DeviceError(
            f"{self.name}: the autopilot did not take what was set: it keeps"
            f" {parameter_list(wrong)}"
        )

    def _set(self, values: Mapping[str, float]) -> None:
        """Send values until each is acknowledged, or up to `TRIES` times."""
        for name in values:
            self._heard.pop(name, None)

        def ask() -> None:
            for name, value in values.items():
                if not same_float32(self._heard.get(name), value):
                    sent, kind = self._as_sent(name, value)
                    self._send(
                        self._out.param_set_encode(
                            *self._target, name.encode(), sent, kind
                        )
                    )

        self._until(
            lambda: all(same_float32(self._heard.get(n), v) for n, v in values.items()),
            ask,
        )

    def _as_sent(self, name: str, value: float) -> tuple[float, int]:
        """A value as it is sent, and its type; PX4 refuses another type."""
        if name not in self._whole:
            return value, REAL32
        (bits,) = struct.unpack("<f", struct.pack("<i", round(value)))
        return bits, INT32

    def _settle(self) -> None:
        """Wait for late answers before anything is requested again."""
        begin = self._clock()
        self._answered = max(self._answered, begin)
        while self._clock() < min(
            self._answered + QUIET_TIME, begin + LONGEST_SETTLING
        ):
            self._listen()

    def close(self) -> None:
        """Release the link; safe to call twice."""
        self._line.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _until(self, done: Callable[[], bool], ask: Callable[[], None]) -> None:
        """Call `ask` until `done`, up to `TRIES` times."""
        for _ in range(TRIES):
            ask()
            deadline = self._clock() + PATIENCE
            while self._clock() < deadline:
                self._listen()
                if done():
                    return

    def _greet(self) -> None:
        deadline = self._clock() + LONGEST_HEARTBEAT_WAIT
        while not self._vehicles and self._clock() < deadline:
            self._listen()
        if not self._vehicles:
            raise DeviceError(
                f"{self.name}: no heartbeat of an autopilot came in"
                f" {LONGEST_HEARTBEAT_WAIT:g} s; check link, port and baud rate"
            )
        named = all(self._wanted.values())
        settle = self._clock() + (0.0 if named else HEARTBEAT_INTERVAL)
        while self._clock() < settle:
            self._listen()  # others on the same link send a heartbeat within a second
        if len(self._vehicles) > 1:
            several = ", ".join(
                f"system={s}&component={c}" for s, c in sorted(self._vehicles)
            )
            raise InputError(
                f"{self.name} carries several vehicles: name one, {several}"
            )
        ((self._target, heartbeat),) = self._vehicles.items()
        self.autopilot = int(heartbeat.autopilot)
        self.armed = bool(heartbeat.base_mode & ARMED)

    def _listen(self) -> None:
        """Send a heartbeat if one is due, and process what arrives."""
        if self._clock() - self._beat >= HEARTBEAT_INTERVAL:
            self._beat = self._clock()
            self._send(self._out.heartbeat_encode(6, NO_AUTOPILOT, 0, 0, 4))
        try:
            data = self._line.read()
        except OSError as fault:
            self._reopen(fault)
            return
        for message in self._in.parse_buffer(data) or []:
            self._take(message)

    def _take(self, message: Any) -> None:
        source = (message.get_srcSystem(), message.get_srcComponent())
        kind = message.get_type()
        if kind == "HEARTBEAT" and message.autopilot != NO_AUTOPILOT:
            wanted = (self._wanted["system"], self._wanted["component"])
            if all(w in (0, s) for w, s in zip(wanted, source, strict=True)):
                self._vehicles[source] = message
        elif kind == "PARAM_VALUE" and source == self._target:
            value = float(message.param_value)
            if self.autopilot == PX4 and message.param_type == INT32:
                bits = struct.pack("<f", message.param_value)
                self._whole.add(message.param_id)
                self._heard[message.param_id] = float(struct.unpack("<i", bits)[0])
            elif np.isfinite(
                value
            ):  # the shortest number that equals this 32-bit float
                self._heard[message.param_id] = float(str(np.float32(value)))
            self._answered = self._clock()

    def _send(self, message: Any) -> None:
        packed = message.pack(self._out)
        self._out.seq = (self._out.seq + 1) % 256
        try:
            self._line.write(packed)
        except OSError as fault:
            self._reopen(fault)

    def _reopen(self, fault: OSError) -> None:
        """Open a closed link again; the caller repeats its request."""
        self._line.close()
        until = self._clock() + RECONNECT_TIME
        while self._clock() < until:
            self._pause(RECONNECT_INTERVAL)
            try:
                self._line = self._connect()
            except (OSError, DeviceError):
                continue
            return
        raise DeviceError(f"{self.name} hung up: {fault}; check the link") from fault


def same_float32(kept: float | None, wanted: float) -> bool:
    """Whether two values are equal as 32-bit floats; False if `kept` is None.

    >>> [same_float32(kept, 0.1) for kept in (0.1 + 1e-10, 0.1001, None)]
    [True, False, False]
    """
    if kept is None or not np.isfinite(kept):
        return False
    return bool(np.float32(kept) == np.float32(wanted))
