"""The device's clock runs fast, which shows against the host's."""

from __future__ import annotations

from fieldcal.sim_device.effect import Example, Number, Range, SimulatedEffect


class SimulatedClockSkew(SimulatedEffect):
    """Rate error of the device's clock, parts per million."""

    NUMBERS = {
        "ppm": Number(range=Range("between -100000 and 100000", lambda v: abs(v) < 1e5))
    }
    EXAMPLE = Example(
        {"ppm": 500.0},
        host_clock=True,
        unmended="the angles do not depend on the pace of the clock",
    )

    def clock_rate(self) -> float:
        """Seconds of the device's clock in a true second."""
        return 1 + 1e-6 * self["ppm"]
