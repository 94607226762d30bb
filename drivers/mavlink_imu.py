"""An IMU in an autopilot: ``mavlink:udp:0.0.0.0:14550?message=HIGHRES_IMU&rate=100``.

The endpoint is a serial port, ``udp:HOST:PORT``, ``udpout:HOST:PORT``,
``tcp:HOST:PORT``, or a .tlog file. Options: ``message`` (HIGHRES_IMU, RAW_IMU,
SCALED_IMU, 2, 3), ``system``, ``component`` and ``instance`` where there are several,
``rate`` in Hz to ask for (0 to leave it; 50), ``acc_unit``, ``gyr_unit`` and
``rounding=nearest`` for a sender that is no usual one, ``baud``, ``reconnect`` as for a
serial port, ``speed`` of a log.

What an autopilot sends is not raw, whatever the message is called: the calibration it
has is built in. That is read and kept in `MavlinkImu.installed`, and read again now and
then, since it changes: at each start most average their gyroscopes. With
``installed=identity`` it is set to none meanwhile, and given back when the link is
closed.
"""

from __future__ import annotations

from collections import deque
from importlib.util import find_spec
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldcal.core.errors import DeviceError, FieldcalError, InputError, LinkLost
from fieldcal.core.samples import Block, Grain
from fieldcal.drivers.clock_comparison import ClockComparison
from fieldcal.drivers.driver import Driver, LinkHealth, ReadBack
from fieldcal.drivers.mavlink_dialog import AutopilotDialog, parameter_list
from fieldcal.drivers.mavlink_log import PlayedMavlinkLog, is_mavlink_log
from fieldcal.drivers.options import Options, split_address
from fieldcal.drivers.playback import playback_speed
from fieldcal.drivers.reader import Chunk, Reader

if TYPE_CHECKING:
    from fieldcal.drivers.mavlink_installed import InstalledCalibration
    from fieldcal.drivers.mavlink_link import TwoWaySource

LONGEST_GREETING = 6.0
"""Longest time until it is known who is there and what it has installed, s."""

LONGEST_HEARTBEAT_WAIT = 3.0
"""How long a first heartbeat may take, s."""

USUAL_RATE_HZ = 50.0
"""Rate that is asked for, Hz: a radio link carries it."""

LONGEST_FIRST_WAIT = 2.0
"""Longest wait for samples that tell unit and rate, s: there may be none yet."""

LONGEST_GIVE_BACK = 4.0
"""How long giving back the installed calibration may take, s."""

QUIET_TIME = 2.0
"""Time without samples after which the rate is asked for again, s: a reboot."""

LEAST_RATE_SAMPLES, MOST_RATE_SAMPLES = 16, 256
"""Least and most samples that the rate is told from."""


BAROMETER_REMARK = (
    "the temperature in HIGHRES_IMU is that of this autopilot's barometer, so it is"
    " left out; message=RAW_IMU has that of the sensor"
)


FILTER_BIAS_REMARK = (
    "PX4 takes the biases that its filter estimates at the moment out of HIGHRES_IMU,"
    " so that they change on the way and are not found; message=SCALED_IMU has the"
    " samples with them"
)


class MavlinkImu(Driver):
    """A link to an autopilot, or a log of one, and the samples of one of its sensors.

    Attributes
    ----------
    says : sentences for the operator: what was denied, what is missing

    """

    def __init__(self, address: str) -> None:
        _check_installed()
        from fieldcal.drivers.mavlink_samples import MavlinkDecoder

        endpoint, options = split_address(address, "mavlink")
        if not endpoint:
            raise InputError("mavlink: name a link, such as mavlink:udp:0.0.0.0:14550")
        self.name = endpoint
        self._decoder = MavlinkDecoder(options)
        self._asked = options.number("rate", USUAL_RATE_HZ, 0.0, 1e4)
        self.health: LinkHealth = self._decoder.health
        self._skew = ClockComparison(self.health)
        message = (self._decoder.message, self._decoder.kind.identifier)
        without = options.choice("installed", ("keep", "identity"), "keep")
        self._dialog = AutopilotDialog(
            message,
            self._asked,
            self._decoder.instance,
            self._decoder.accepts,
            without == "identity",
        )
        self._log: PlayedMavlinkLog | None = None
        self._reader: Reader | None = None
        self._closed = False
        self._line: TwoWaySource | None = None
        self._early: list[Block] = []
        self._recent: deque[float] = deque(maxlen=MOST_RATE_SAMPLES)
        self._last = monotonic()
        self._restarts, self._asked_again = 0, False
        if is_mavlink_log(endpoint):
            self._log = PlayedMavlinkLog(Path(endpoint), playback_speed(options))
            options.finish()
            return
        self._open(endpoint, options)

    def _open(self, endpoint: str, options: Options) -> None:
        from fieldcal.drivers.mavlink_link import endpoint_opener

        baud = int(options.number("baud", 57600, 50, 1e8))
        patience = options.number("reconnect", 10.0, 0.0, 86400.0)
        options.finish()
        open_line = endpoint_opener(endpoint, baud)

        def connect() -> TwoWaySource:
            self._line = open_line()
            return self._line

        self._reader = Reader(endpoint, connect, patience)
        try:
            self._greet()
        except LinkLost:
            # it talked and went: what came is handed out first, then this is met again
            if not self._early or self._dialog.pending:
                self.close()
                raise
        except BaseException:
            self.close()
            raise

    @property
    def says(self) -> list[str]:
        """Sentences for the operator."""
        heard = [f"asked for {self._asked:g} Hz, got {self.rate:.4g} Hz"]
        slow = self._log is None and self._asked > 0 and self.rate > 0
        remark = [self.installed.remark] if self.installed else []
        warm = [BAROMETER_REMARK] if self._decoder.thermometer == "barometer" else []
        if self._decoder.lacks_filter_bias:
            warm.append(FILTER_BIAS_REMARK)
        return [*self._dialog.says, *filter(None, remark), *warm, *heard * slow]

    @property
    def installed(self) -> InstalledCalibration | None:
        """The calibration that the autopilot has; None while it is not known."""
        return self._dialog.installed

    @property
    def grain(self) -> Grain:
        """What the message rounds to, once its unit is known."""
        return self._decoder.grain

    @property
    def rate(self) -> float:
        """Rate of the samples that came last, Hz; 0 before there are any."""
        steps = np.diff(np.array(self._recent))
        return float(1 / np.median(steps)) if len(steps) else 0.0

    @property
    def notes(self) -> dict[str, Any]:
        """What a recording keeps of the device."""
        decoder, installed = self._decoder, self.installed
        return {
            "message": decoder.message,
            "vehicle": decoder.vehicle,
            "acc_unit": decoder.acc_unit,
            "gyr_unit": decoder.gyr_unit,
            "thermometer": decoder.thermometer,
            "rate_hz": round(self.rate, 3),
            "installed": installed.as_table() if installed else None,
            "says": self.says,
        }

    @property
    def reconnecting(self) -> bool:
        """True while the link is gone and is being tried again."""
        return self._reader is not None and self._reader.reconnecting

    @property
    def read_back(self) -> ReadBack:
        """How often the installed calibration was read, and had changed."""
        same, changed = self._dialog.readings
        return ReadBack(same, changed, self._asked_again or self._dialog.is_rereading)

    def read_again(self) -> None:
        """Have the installed calibration read again by whoever receives."""
        self._asked_again = self._log is None

    def host_time(self) -> float:
        """Now, in s of the clock that stamps `Block.t_host`: for a log, its own."""
        return self._log.now if self._log else super().host_time()

    def receive(self, timeout: float) -> Block | None:
        """Return what has come, or None if nothing whole came in `timeout` seconds."""
        if self._early:
            return self._early.pop(0)
        deadline = monotonic() + timeout
        while True:
            left = max(0.0, deadline - monotonic())
            # our own heartbeat is due once a second
            block = self._hear(left if self._log else min(left, 0.5))
            if block is not None or monotonic() >= deadline:
                return block

    def close(self) -> None:
        """Give back what was changed, and release the link; safe to call twice.

        It is a DeviceError if the autopilot does not take its calibration back.
        """
        if self._reader is None or self._closed:
            return
        self._closed = True
        try:
            self._give_back()
        finally:
            self._reader.close()

    def _give_back(self) -> None:
        self._dialog.give_back()
        deadline = monotonic() + LONGEST_GIVE_BACK
        fault: Exception | None = None
        try:
            while self._dialog.pending and monotonic() < deadline:
                self._say(self._dialog.bytes_due(monotonic()))
                self._listen(self._take(0.05))
        except FieldcalError as error:
            fault = error
        if self._dialog.pending:
            raise DeviceError(
                f"{self.name} could not be given back its calibration: set by hand "
                f"{parameter_list(self._dialog.pending)}"
            ) from fault

    def _take(self, timeout: float) -> list[Chunk]:
        if self._log:
            return self._log.take(timeout)
        return self._reader.take(timeout) if self._reader else []

    def _hear(self, timeout: float) -> Block | None:
        """Return the samples that have come, and answer the rest."""
        chunks = self._take(timeout)
        block = self._listen(chunks)
        quiet = monotonic() - self._last > QUIET_TIME
        if block is not None or quiet:
            self._last = monotonic()
        restarts, self._restarts = self._restarts, self.health.restarts
        broken = any(chunk.broken for chunk in chunks)
        if broken or self._restarts > restarts or (quiet and self._dialog.settled):
            self._dialog.start_over()
        if self._asked_again:
            self._asked_again = False
            self._dialog.read_again()
        if self._dialog.vehicle:
            self._decoder.choose_vehicle(*self._dialog.vehicle)
        self._check_one()
        if self._log is None and self._line is not None:
            self._say(self._dialog.bytes_due(monotonic()))
        if block is not None:
            self._recent.extend(block.t.tolist())
            self._skew.add(block.t, block.t_host)
        return block

    def _listen(self, chunks: list[Chunk]) -> Block | None:
        """Decode, and tell the conversation what was said beside the samples."""
        block = self._decoder.feed_all(chunks)
        for message in self._decoder.other_messages:
            self._dialog.hear(message)
        self._decoder.other_messages.clear()
        return block

    def _say(self, data: bytes) -> None:
        try:
            if data and self._line is not None:
                self._line.write(data)
        except OSError:
            return  # the reader meets the same fault, and mends it

    def _greet(self) -> None:
        """Listen and ask until all is answered; samples that come meanwhile wait."""
        began = monotonic()
        while not self._dialog.settled and monotonic() < began + LONGEST_GREETING:
            block = self._hear(0.05)
            if block is not None:
                self._early.append(block)
            if (
                self._dialog.vehicle is None
                and monotonic() > began + LONGEST_HEARTBEAT_WAIT
            ):
                if self._early:
                    return
                raise DeviceError(self._silence(LONGEST_HEARTBEAT_WAIT, LinkHealth()))
        if self._dialog.installed is not None and self._dialog.installed.taken_out:
            self._early.clear()  # these came before the calibration was out
            self._decoder.drop_waiting()
        self._meet(monotonic() + LONGEST_FIRST_WAIT)

    def _meet(self, until: float) -> None:
        """Listen until the unit and the rate are known; the samples wait."""
        while monotonic() < until:
            if self._decoder.acc_unit and len(self._recent) >= LEAST_RATE_SAMPLES:
                return
            block = self._hear(0.05)
            if block is not None:
                self._early.append(block)

    def _check_one(self) -> None:
        """Refuse to choose between several vehicles."""
        several = {*self._decoder.sources, *self._dialog.others}
        if self._dialog.vehicle:
            several.add(self._dialog.vehicle)
        if len(several) > 1:
            named = ", ".join(f"system={s}&component={c}" for s, c in sorted(several))
            raise InputError(f"{self.name} carries several vehicles: name one, {named}")

    def _silence(self, timeout: float, before: LinkHealth) -> str:
        health, wanted = self.health, self._decoder.message
        others = sorted(self._decoder.messages_heard - {wanted})
        if health.received == before.received:
            cause = "not a byte came; check link, port and baud rate"
        elif others and wanted not in self._decoder.messages_heard:
            cause = f"no {wanted} comes, but {others[0]}; try message={others[0]}"
        elif wanted in self._decoder.messages_heard and not health.samples:
            cause = f"{wanted} comes, but of another sensor; check instance and system"
        elif self._dialog.vehicle:
            cause = f"an autopilot is there, but sends no {wanted}; try another message"
        else:
            cause = "bytes come, but no heartbeat of an autopilot; check baud rate and"
            cause += f" what is plugged in: `fieldcal ports --probe {self.name}`"
        sent = "went silent" if health.samples else "has sent no sample"
        asked = "".join(f" ({sentence})" for sentence in self._dialog.says)
        return f"{self.name} {sent} for {timeout:g} s: {cause}{asked}"


def _check_installed() -> None:
    if not all(find_spec(module) for module in ("pymavlink", "fastcrc")):
        raise InputError(
            "MAVLink needs pymavlink and fastcrc: pip install 'fieldcal[mavlink]'"
        )
