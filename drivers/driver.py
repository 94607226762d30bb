"""What every driver is.

To add one, write drivers/<scheme>_imu.py with a subclass of `Driver` named `Imu`; then
`open_driver("<scheme>:<address>")` finds it. Opening takes the address, which may carry
options as a query: ``serial:/dev/ttyUSB0?baud=115200&format=witmotion``.

`receive` returns the samples that arrived, or None if no complete frame arrived in
time. None is no fault; an exception is one. A link that is interrupted and comes back
resumes the stream; the gap shows in the times and in `LinkHealth`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from importlib.util import find_spec
from time import monotonic, time
from typing import Any, ClassVar, NamedTuple, Self

from fieldcal.core.errors import DeviceError, DeviceSilent, InputError
from fieldcal.core.plugins import plugin_class
from fieldcal.core.samples import Block, Grain, concat

SILENCE_INTERVAL = 0.5
"""How often whoever reads is told of a silence, s of the host's clock."""

_STARTED = time() - monotonic()


def host_clock() -> float:
    """Host time in s since 1970 that is never set back; what `Block.t_host` counts."""
    return _STARTED + monotonic()


NOT_REAL_TIME_PPM = 1e5
"""Difference of the clocks beyond which a device does not run in real time, ppm."""


class ClockFit(NamedTuple):
    """The device's clock against the host's: a straight line through the arrivals.

    Attributes
    ----------
    fast_ppm, sigma_ppm : how fast the device's clock is, and its standard error
    offset_s, sigma_s : host time when the device's is 0, least delay included, s

    """

    fast_ppm: float
    sigma_ppm: float
    offset_s: float
    sigma_s: float

    @property
    def real_time(self) -> bool:
        """Whether the device runs beside the host's clock, not many times as fast."""
        return abs(self.fast_ppm) < NOT_REAL_TIME_PPM


class ReadBack(NamedTuple):
    """What a device was asked about what it does to its samples by itself.

    Attributes
    ----------
    same : how often it said the same as before
    changed : how often it said something else
    pending : whether it has yet to answer

    """

    same: int = 0
    changed: int = 0
    pending: bool = False


@dataclass(slots=True)
class LinkHealth:
    """State of the link, counted since it was opened.

    Attributes
    ----------
    received : bytes that came
    samples : whole samples delivered
    bad : frames refused by their checksum or their form
    skipped : bytes that belonged to no whole frame
    gaps : times that samples were missing between two others
    missing : samples missing in those gaps, as far as the device's clock tells
    repeated : samples dropped because their stamp was an old one
    restarts : times that the device's clock began anew
    clocked : whether the times are the device's own, and not fitted to the arrivals
    since_power_on : whether the device's clock begins anew when it is switched on, so
        that it shows every restart
    clock : the device's clock against the host's, None while it is not known

    """

    received: int = 0
    samples: int = 0
    bad: int = 0
    skipped: int = 0
    gaps: int = 0
    missing: int = 0
    repeated: int = 0
    restarts: int = 0
    clocked: bool = True
    since_power_on: bool = False
    clock: ClockFit | None = None


class Driver(ABC):
    """A link to one IMU: a context manager that yields blocks.

    Exceptions listed in `faults` become `DeviceError` with `name` in the text.
    `on_silence`, if set, is called every `SILENCE_INTERVAL` s in which `blocks` has no
    sample.
    """

    faults: ClassVar[tuple[type[Exception], ...]] = (OSError,)

    name: str
    health: LinkHealth
    on_silence: Callable[[], None] | None = None
    _first_heard: Block | None = None

    @abstractmethod
    def __init__(self, address: str) -> None: ...

    @abstractmethod
    def receive(self, timeout: float) -> Block | None:
        """Return what has come, or None if nothing whole came in `timeout` seconds."""

    @abstractmethod
    def close(self) -> None:
        """Release the link; safe to call twice."""

    def host_time(self) -> float:
        """Now, in s of the clock that stamps `Block.t_host`."""
        return host_clock()

    @property
    def reconnecting(self) -> bool:
        """True while the link is broken and the driver still tries to mend it."""
        return False

    @property
    def grain(self) -> Grain:
        """What the device rounds its outputs to, as far as it is known."""
        return Grain()

    @property
    def notes(self) -> Mapping[str, Any]:
        """What a recording keeps of the device beside its samples, as JSON."""
        return {}

    @property
    def read_back(self) -> ReadBack:
        """What it said of its own processing, where it can be asked."""
        return ReadBack()

    def read_again(self) -> None:
        """Ask it once more; `read_back` is pending until it has answered."""
        return

    def blocks(self, timeout: float = 3.0) -> Iterator[Block]:
        """Yield blocks as they come.

        A link that is being mended counts as no silence: the driver itself gives up.

        Raises
        ------
        DeviceSilent
            If no whole sample comes for `timeout` seconds of the host's clock.
        DeviceError
            If the link fails.

        """
        deadline, before = monotonic() + timeout, replace(self.health)
        while True:
            left = max(0.0, deadline - monotonic())
            block = self._receive(
                min(left, SILENCE_INTERVAL) if self.on_silence else left
            )
            if block is not None and len(block):
                before = replace(self.health)
                yield block
                # what is done with a block meanwhile is no silence
                deadline = monotonic() + timeout
                continue
            if self.on_silence:
                self.on_silence()
            if self.reconnecting:
                deadline = monotonic() + timeout
            elif monotonic() >= deadline:
                raise DeviceSilent(self._silence(timeout, before))

    def speaks(self, timeout: float) -> bool:
        """Whether a sample comes within `timeout` s; it is the first of `blocks`.

        Raises
        ------
        DeviceError
            If the link fails.

        """
        if self._first_heard is None:
            block = self._receive(timeout)
            self._first_heard = block if block is not None and len(block) else None
        return self._first_heard is not None

    def why_silent(self, before: LinkHealth) -> str:
        """Why no sample came since the link did like `before`, and what to do."""
        now = self.health
        if now.received == before.received:
            return "not a byte came; check cable, power and port"
        if now.skipped - before.skipped > (now.received - before.received) / 2:
            return self._garbage()
        return self._incomplete()

    def _incomplete(self) -> str:
        """What to say of frames that make no sample."""
        return "frames come, but no whole sample; check what the device is to send"

    def drain(self) -> Block:
        """Take what has queued up by now, so that the next block is from now on.

        Raises
        ------
        DeviceError
            If the link fails.

        """
        taken, deadline = [], monotonic() + 0.5
        while monotonic() < deadline and (block := self._receive(0.0)) is not None:
            taken.append(block)
        return concat(taken)

    def _silence(self, timeout: float, before: LinkHealth) -> str:
        sent = "went silent" if self.health.samples else "has sent no sample"
        return f"{self.name} {sent} for {timeout:g} s: {self.why_silent(before)}"

    def _garbage(self) -> str:
        return "bytes come, but none that this format knows; check format and baud rate"

    def _receive(self, timeout: float) -> Block | None:
        if self._first_heard is not None:
            heard, self._first_heard = self._first_heard, None
            return heard
        try:
            return self.receive(timeout)
        except self.faults as fault:
            raise DeviceError(f"{self.name} failed: {fault}") from fault

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def open_driver(url: str) -> Driver:
    """Open ``scheme:address``, e.g. ``serial:/dev/ttyUSB0?format=witmotion``.

    Raises
    ------
    InputError
        If no driver has that scheme, or the driver refuses its options.
    DeviceError
        If the device cannot be opened.

    """
    scheme, _, address = url.partition(":")
    module = f"fieldcal.drivers.{scheme}_imu"
    if not scheme.isidentifier() or find_spec(module) is None:
        raise InputError(
            f"no driver for {url!r}: write a scheme first, such as serial:/dev/ttyUSB0"
        )
    imu = plugin_class(module, Driver)  # type: ignore[type-abstract]
    try:
        return imu(address)
    except imu.faults as fault:
        raise DeviceError(f"cannot open {url}: {fault}") from fault
