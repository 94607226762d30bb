"""Dialog with an autopilot: requests and answers, without I/O and clock.

Once a heartbeat tells who is there, the rate of the message is asked for
(SET_MESSAGE_INTERVAL, and where that is denied or not answered the raw sensor stream,
REQUEST_DATA_STREAM), then the parameters of the installed calibration are read, and
where that is wanted set to no calibration until they are given back. They are read
again every `REREAD_INTERVAL` s, whenever that is asked for, and after a restart until
they are stable. Our own heartbeat goes out every second, since some send nothing to who
is silent.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from math import inf
from typing import Any

from fieldcal.core.errors import DeviceError
from fieldcal.drivers.mavlink_installed import InstalledCalibration, identity_parameters
from fieldcal.drivers.mavlink_parameter_names import PX4, other_processing_parameters
from fieldcal.drivers.mavlink_watch import STABLE_ROUNDS, InstalledWatch, is_unchanged

HEARTBEAT_INTERVAL = 1.0
"""Time between two heartbeats, s."""

PATIENCE = 0.7
"""Time without an answer after which a request is repeated, s."""

TRIES = 3
"""How often a request is sent."""

REREAD_INTERVAL = 10.0
"""Time between two readings of the installed calibration, s."""

MOST_UNANSWERED = 40
"""Heartbeats without an answer after which an autopilot that answered before is given
up; while starting, it may not answer."""

GROUND_STATION = (255, 190)
"""System and component numbers of ground stations."""

NO_AUTOPILOT, SET_MESSAGE_INTERVAL = 8, 511
"""Autopilot number of a sender that is none; number of command SET_MESSAGE_INTERVAL."""

ACCEPTED, IN_PROGRESS = 0, 5
RAW_SENSORS = 1
INT32, REAL32 = 6, 9


class AutopilotDialog:
    """Dialog with one autopilot.

    Parameters
    ----------
    message : name and number of the requested message
    rate : Hz; 0 to leave it as it is
    instance : which sensor's parameters are read
    wants : whether a system and component are the ones to talk to
    take_out : whether to remove the installed calibration during the recording

    Attributes
    ----------
    vehicle : system and component of the autopilot
    installed : its installed calibration; None before the first heartbeat
    others : further autopilots that were heard
    says : sentences for the operator

    """

    def __init__(
        self,
        message: tuple[str, int],
        rate: float,
        instance: int,
        wants: Callable[[int, int], bool],
        take_out: bool,
    ) -> None:
        from pymavlink.dialects.v20 import all as dialect

        self._dialect = dialect
        self._out = dialect.MAVLink(None, *GROUND_STATION)
        self._message, self._rate = message, rate
        self._instance, self._wants = instance, wants
        self.vehicle: tuple[int, int] | None = None
        self.installed: InstalledCalibration | None = None
        self.others: set[tuple[int, int]] = set()
        self.says: list[str] = []
        self._beat = self._asked = -inf
        self._tries, self._denied = 0, ""
        self._rated = rate == 0
        self._watch: InstalledWatch | None = None
        self._read_at, self._unanswered, self._take_out = -inf, 0, take_out
        self._goal: dict[str, float] = {}

    @property
    def settled(self) -> bool:
        """Whether all requests were answered or given up."""
        answered = self.vehicle is not None and self._rated and not self.is_reading
        return answered and not self._take_out and not self.pending

    @property
    def is_reading(self) -> bool:
        """Whether the installed calibration is being read."""
        return self._watch is not None and self._watch.is_reading

    @property
    def is_rereading(self) -> bool:
        """Whether it is being read again, after it was read before."""
        return (
            self._watch is not None
            and self._watch.has_answered
            and self._watch.is_reading
        )

    @property
    def readings(self) -> tuple[int, int]:
        """Number of readings without and with a change."""
        return (self._watch.readings, self._watch.changes) if self._watch else (0, 0)

    @property
    def pending(self) -> dict[str, float]:
        """Parameters that are still to be set, with their values."""
        now = self.installed.in_samples if self.installed else {}
        return {n: v for n, v in self._goal.items() if not is_unchanged(now.get(n), v)}

    def give_back(self) -> None:
        """Restore the parameters, if they were changed."""
        self._take_out, self._tries, self._asked = False, -TRIES, -inf
        if self._goal and self.installed is not None:
            self._goal = {name: self.installed.values[name] for name in self._goal}

    def start_over(self) -> None:
        """Repeat all requests: the link was interrupted, or the autopilot restarted."""
        self._rated, self._tries = self._rate == 0, 0
        self.read_again(STABLE_ROUNDS)

    def read_again(self, rounds: int = 1) -> None:
        """Read the installed calibration again, if it was read before."""
        if self._watch is not None and self._watch.has_answered:
            self._watch.start_over(rounds)
            self._unanswered, self._asked = 0, -inf

    def hear(self, message: Any) -> None:
        """Process a message, as pymavlink decodes it."""
        kind = message.get_type()
        source = (message.get_srcSystem(), message.get_srcComponent())
        if kind == "HEARTBEAT":
            self._heartbeat(message, source)
        elif source != self.vehicle:
            return
        elif kind == "COMMAND_ACK" and message.command == SET_MESSAGE_INTERVAL:
            self._answered(message.result)
        elif kind == "PARAM_VALUE" and self.installed is not None:
            self._value(message)

    def bytes_due(self, now: float) -> bytes:
        """Bytes that are due to be sent at `now`, s of any clock."""
        out = b""
        if now - self._beat >= HEARTBEAT_INTERVAL:
            self._beat = now
            out += self._packed(self._out.heartbeat_encode(6, NO_AUTOPILOT, 0, 0, 4))
        if self.is_reading:
            self._read_at = now
        elif now - self._read_at >= REREAD_INTERVAL:
            self.read_again()
        if self.vehicle is None or self.settled or now - self._asked < PATIENCE:
            return out
        self._asked = now
        if not self._rated:
            return out + self._ask_rate()
        return out + (self._ask_parameters() if self.is_reading else self._set())

    def _packed(self, message: Any) -> bytes:
        packed: bytes = message.pack(self._out)
        self._out.seq = (self._out.seq + 1) % 256
        return packed

    def _heartbeat(self, message: Any, source: tuple[int, int]) -> None:
        if message.autopilot == NO_AUTOPILOT or not self._wants(*source):
            return
        self._unanswered += 1
        if self.vehicle is None:
            self.vehicle = source
            self.installed = InstalledCalibration(message.autopilot, self._instance)
            self._watch = InstalledWatch(self.installed)
        elif source != self.vehicle:
            self.others.add(source)

    def _ask_rate(self) -> bytes:
        name, number = self._message
        target = self.vehicle or (0, 0)
        self._tries += 1
        if self._tries > TRIES:
            return self._fall_back("does not answer SET_MESSAGE_INTERVAL")
        interval = round(1e6 / self._rate)
        values = (number, interval, 0, 0, 0, 0, 0)
        return self._packed(
            self._out.command_long_encode(*target, SET_MESSAGE_INTERVAL, 0, *values)
        )

    def _answered(self, result: int) -> None:
        if self._rated or result == IN_PROGRESS:
            return
        if result == ACCEPTED:
            self._next()
            return
        results = self._dialect.enums["MAV_RESULT"]
        why = results[result].name if result in results else f"result {result}"
        self._tries = TRIES
        self._denied = f"denies it ({why.removeprefix('MAV_RESULT_').lower()})"
        self._asked = -inf

    def _fall_back(self, why: str) -> bytes:
        """Request the stream that contains the message, for older programs."""
        name, _ = self._message
        says = (
            f"{self._rate:g} Hz of {name} asked for: the autopilot "
            f"{self._denied or why}, so the raw sensor stream was asked for instead"
        )
        if says not in self.says:
            self.says.append(says)
        self._next()
        rate, target = max(1, round(self._rate)), self.vehicle or (0, 0)
        return self._packed(
            self._out.request_data_stream_encode(*target, RAW_SENSORS, rate, 1)
        )

    def _next(self) -> None:
        self._rated, self._tries, self._denied = True, 0, ""
        self._asked = -inf

    def _ask_parameters(self) -> bytes:
        installed, watch = self.installed, self._watch
        if installed is None or watch is None:
            return b""
        self._tries += 1
        if watch.has_answered and self._unanswered > MOST_UNANSWERED:
            raise DeviceError(
                "the autopilot answers no more for its parameters, so nobody knows"
                f" what is in its samples: {', '.join(watch.unheard)}; check the link"
            )
        if not watch.has_answered and self._tries > TRIES:
            watch.give_up()
            self.says.append(
                "parameters that the autopilot did not answer: "
                + ", ".join(installed.missing)
            )
            return b""
        target = self.vehicle or (0, 0)
        more = other_processing_parameters(installed.autopilot, self._instance)
        unheard = [name for name in more if name not in installed.values]
        return b"".join(
            self._packed(
                self._out.param_request_read_encode(*target, name.encode(), -1)
            )
            for name in (*unheard, *watch.unheard)
        )

    def _set(self) -> bytes:
        """Bytes that set the pending parameters."""
        if self._take_out and self.installed is not None:
            self._take_out, self._tries = False, 0
            self._goal = identity_parameters(self.installed)
            self.installed.taken_out = bool(self._goal)
            if not self._goal:
                self.says.append(
                    "the installed calibration stays, as it could not be read whole"
                )
        self._tries += 1
        if self._tries > TRIES:
            raise DeviceError(
                f"the autopilot does not take parameters:"
                f" {parameter_list(self.pending)}; set them by hand, or"
                " leave out installed=identity"
            )
        target = self.vehicle or (0, 0)
        return b"".join(
            self._packed(
                self._out.param_set_encode(*target, name.encode(), value, REAL32)
            )
            for name, value in self.pending.items()
        )

    def _value(self, message: Any) -> None:
        installed, watch = self.installed, self._watch
        if installed is None or watch is None:
            return
        value = float(message.param_value)
        if installed.autopilot == PX4 and message.param_type == INT32:
            # PX4 sends the bits of a whole number, others its value
            (value,) = struct.unpack("<i", struct.pack("<f", message.param_value))
        if message.param_id in other_processing_parameters(
            installed.autopilot, self._instance
        ):
            installed.values[message.param_id] = float(value)
            return
        self._unanswered, waited = 0, watch.is_reading
        ended = watch.hear(message.param_id, float(value))
        at_once = ended or watch.is_reading != waited
        self._asked, self._tries = (-inf, 0) if at_once else (self._asked, 1)


def parameter_list(parameters: Mapping[str, float]) -> str:
    """Parameters as text, ``name = value``."""
    return ", ".join(f"{name} = {value:.9g}" for name, value in parameters.items())
