"""Pytest fixtures for tests of your own procedure, driver or simulator.

    def test_ours(virtual_imu):
        device = virtual_imu("serial", effects=["base_tilt:about_x_deg=1"])
        device.assert_calibration(our_procedure(device.url))

    def test_our_simulator(simulator_matches):
        simulator_matches("recordings/bench-7", "build/simulated.csv", acc_bias=0.02)

pytest finds the fixtures once fieldcal is installed. Other modules are imported only
when a test uses a fixture.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration
    from fieldcal.drivers.driver import Driver
    from fieldcal.run.movers import VirtualMover

SIGMAS = 4.5
"""Standard uncertainties within which a value must agree with the truth."""

LATITUDE = 50.45
"""Latitude of a device unless an option states it, deg."""

LINKS: dict[str, tuple[list[str], str, str]] = {
    "serial": (["--serial", "{format}"], "serial:{port}?format={query}", "max"),
    "can": (
        ["--can", "slcan"],
        "can:{port}?interface=slcan&bitrate=500000&dbc=virtual",
        "max",
    ),
    "mavlink": (
        ["--mavlink", "tcpin:127.0.0.1:0"],
        "mavlink:{port}?message=HIGHRES_IMU&rate=100",
        # a socket holds minutes of samples: at full speed it would answer late
        "20",
    ),
}
"""Options of ``fieldcal sim``, address to open and default speed, by link."""


class VirtualImu:
    """A running virtual device, with access to its true parameters.

    Attributes
    ----------
    url : address that a driver opens
    port : pseudo-terminal, or endpoint
    control : path of the control socket

    """

    def __init__(
        self, device: VirtualMover, url: str, folder: Path, latitude: float
    ) -> None:
        self._latitude = latitude
        self._device, self._folder = device, folder
        self.url, self.port, self.control = url, device.port, device.control
        self._runs = 0

    @property
    def truth(self) -> Mapping[str, Any]:
        """True parameters, as ``fieldcal sim --truth`` writes them."""
        return self._device.truth

    def open(self) -> Driver:
        """Open the device with the driver of its link."""
        from fieldcal.drivers.driver import open_driver

        return open_driver(self.url)

    def turn(self, alpha_deg: float, beta_deg: float) -> float:
        """Turn the device; returns the device time of its arrival, s."""
        reply = self.ask(turn={"alpha_deg": alpha_deg, "beta_deg": beta_deg})
        return float(reply["until_s"])

    def bump(self, **how: float) -> None:
        """Disturb the device: ``push`` m/s^2, ``tilt_deg``, ``seconds``."""
        self.ask(bump=how)

    def fault(self, **what: float) -> None:
        """Disturb the link: ``silence_s``, ``hangup_s``, ``flip_bits`` and others."""
        self.ask(fault=what)

    def ask(self, **request: Any) -> dict[str, Any]:
        """Send an order to the control socket and return the reply."""
        return self._device.ask(**request)

    def recalibrate(
        self,
        procedure: str = "five_position",
        seconds: float = 30.0,
        tables: Mapping[str, Any] | None = None,
    ) -> Calibration:
        """Carry out a procedure on the device, which turns itself.

        Parameters
        ----------
        procedure : name of a module in ``fieldcal.procedures``
        seconds : averaging time
        tables : of session.toml, which replace those of the device

        """
        from fieldcal.run.unattended import recalibrate

        self._runs += 1
        folder = self._folder / f"session-{self._runs}"
        with self.open() as driver:
            return recalibrate(
                driver,
                self._device,
                folder,
                procedure,
                seconds,
                self._latitude,
                tables or {},
            )

    def assert_calibration(
        self,
        found: Calibration | Mapping[str, Any],
        sigmas: float = SIGMAS,
        within: Mapping[str, float] | None = None,
    ) -> None:
        """Fail unless a calibration agrees with the true parameters.

        Parameters
        ----------
        found : a `Calibration`, the object of result.json, or a result by group, as
            ``{"acc_bias": {"value": [x, y, z], "sigma": [x, y, z]}}``, in m/s^2 and
            rad/s
        sigmas : largest error of a value, in standard uncertainties
        within : largest standard uncertainty by group, as in ``{"acc_bias": 0.02}``

        """
        __tracebackhide__ = True
        from fieldcal.calibration.names import group_of
        from fieldcal.commands.table import true_values

        parameters = _parameters_with_sigma(found)
        truth = true_values(self.truth)
        wrong, compared = [], 0
        for name, (value, sigma) in parameters.items():
            limit = (within or {}).get(group_of(name), float("inf"))
            if sigma > limit:
                wrong.append(f"{name} is known to ± {sigma:.3g}, wanted {limit:.3g}")
            if name in truth:
                compared += 1
                if not abs(value - truth[name]) <= sigmas * sigma:
                    off = (value - truth[name]) / sigma
                    wrong.append(
                        f"{name} = {value:.6g} ± {sigma:.2g}, concealed is"
                        f" {truth[name]:.6g}: {off:+.1f} σ"
                    )
        if not compared:
            wrong.append("it has no parameter that the device conceals")
        lacking = set(within or {}) - {group_of(name) for name in parameters}
        wrong += [f"{group} was not determined" for group in sorted(lacking)]
        if wrong:
            pytest.fail("the calibration is wrong: " + "; ".join(wrong))


def _parameters_with_sigma(
    found: Calibration | Mapping[str, Any],
) -> dict[str, tuple[float, float]]:
    """Value and sigma by full name, of a calibration or of a result by group."""
    from fieldcal.calibration import Calibration

    if isinstance(found, Mapping) and "parameters" in found:
        found = Calibration.from_json(dict(found))
    if isinstance(found, Calibration):
        pairs = zip(found.values.tolist(), found.sigma.tolist(), strict=True)
        return dict(zip(found.names, pairs, strict=True))
    out: dict[str, tuple[float, float]] = {}
    for group, told in found.items():
        try:
            rows = zip("xyz", told["value"], told["sigma"], strict=True)
            out |= {f"{group}.{a}": (float(v), float(s)) for a, v, s in rows}
        except (KeyError, TypeError, ValueError):
            raise TypeError(
                f"{group} = {told!r} is no group of a calibration: write"
                ' {"value": [x, y, z], "sigma": [x, y, z]}'
            ) from None
    return out


Factory = Callable[..., VirtualImu]


@pytest.fixture
def virtual_imu(tmp_path: Path) -> Iterator[Factory]:
    """Start virtual devices, which are ended after the test.

    ``virtual_imu(link="serial", format="witmotion", effects=(), speed=None, seed=1,
    **options)`` starts one on a pseudo-terminal (serial), behind a CAN adapter (can) or
    as an autopilot (mavlink). `effects` are written as for ``fieldcal sim --with``;
    options are those of ``fieldcal sim``, as in ``acc_bias=(0.2, -0.3, 0.1)``.
    """
    devices: list[VirtualMover] = []

    def start(
        link: str = "serial",
        format: str = "witmotion",
        effects: Sequence[str] = (),
        speed: str | float | None = None,
        seed: int = 1,
        **options: Any,
    ) -> VirtualImu:
        from fieldcal.run.movers import VirtualMover

        if link not in LINKS:
            raise ValueError(f"link {link!r} is none of {', '.join(LINKS)}")
        arguments, url, usual = LINKS[link]
        command = [part.format(format=format) for part in arguments]
        command += [
            "--speed",
            str(usual if speed is None else speed),
            "--seed",
            str(seed),
        ]
        for effect in effects:
            command += ["--with", effect]
        options = {"latitude": LATITUDE, **options}
        command += [_command_option(name, value) for name, value in options.items()]
        device = VirtualMover(command, once=False)
        devices.append(device)
        query = format.replace("?", "&")
        address = url.format(port=device.port, query=query)
        return VirtualImu(device, address, tmp_path, float(options["latitude"]))

    yield start
    for device in devices:
        device.close()


def _command_option(name: str, value: Any) -> str:
    several = not isinstance(value, str) and isinstance(value, Sequence)
    text = ",".join(map(str, value)) if several else str(value)
    return f"--{name.replace('_', '-')}={text}"


@pytest.fixture
def simulator_matches() -> Callable[..., Any]:
    """Fail unless a simulator matches a recording within limits.

    ``simulator_matches(recording, simulated, **limits)`` takes a session folder, and a
    session folder or a file that ``fieldcal import`` reads. Every difference fails the
    test, unless it is within a limit: by id, a number in its unit or a text such as
    ``"10 %"``; ``chi2_per_dof`` limits that of the recording under the simulator's
    prediction. It returns the comparison, a `fieldcal.against.Match`.
    """

    def check(
        recording: str | Path, simulated: str | Path, **limits: float | str
    ) -> Any:
        __tracebackhide__ = True
        from fieldcal.against import compare, gate
        from fieldcal.against.opening import open_simulator_output
        from fieldcal.session.folder import Session

        allowed = gate.parse_limits(limits)
        session = Session.open(recording)
        real = session.block, session.about
        block, about, _ = open_simulator_output(Path(simulated), real)
        found = compare(real, (block, about), (str(recording), str(simulated)))
        beyond = [one.says for one in gate.check_match(found, allowed) if not one.ok]
        if beyond:
            pytest.fail(f"{simulated} does not match {recording}: {'; '.join(beyond)}")
        return found

    return check
