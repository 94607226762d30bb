"""Watches for what is wrong with the samples of a run, said once a position."""

from __future__ import annotations

from collections.abc import Iterator

from fieldcal.core.samples import Array, Block
from fieldcal.drivers.driver import Driver
from fieldcal.run.direction_watch import DirectionWatch
from fieldcal.run.gyro_unit import GyroUnitWatch
from fieldcal.run.mixed_devices_watch import MixedDevicesWatch
from fieldcal.run.zero_rates_watch import ZeroRatesWatch
from fieldcal.session.description import Description
from fieldcal.windows import Average


class SampleWatches:
    """Watches for a wrong unit, two devices, a direction, and rates of zero at rest.

    Parameters
    ----------
    driver : of the device
    about : the session's description

    """

    def __init__(self, driver: Driver, about: Description) -> None:
        self.units = GyroUnitWatch(about.gravity)
        self._mixed, self._direction = MixedDevicesWatch(), DirectionWatch()
        stated = bool(driver.notes.get("installed")) or about.keeps_gyro_bias
        self._zero_rates = ZeroRatesWatch(about.grade, stated)
        self._said = set[tuple[int, str]]()

    def add(self, piece: Block) -> None:
        """Look at a short stretch of samples."""
        self.units.add(piece)
        self._mixed.add(piece)
        self._direction.add(piece)

    def add_rest(self, rates: Array) -> None:
        """Look at rates at rest in a position, (n, 3) rad/s."""
        self._zero_rates.add_rest(rates)

    def add_window(self, average: Average) -> None:
        """Look at a window; what was said of the turn before it no longer counts."""
        self._zero_rates.add_window(average)
        self._said.clear()

    def new_notices(self, index: int) -> Iterator[str]:
        """What is wrong and was not yet said at the position of this number."""
        watches = (self.units, self._mixed, self._direction, self._zero_rates)
        for notice in (watch.notice for watch in watches):
            if notice and (index, notice) not in self._said:
                self._said.add((index, notice))
                yield notice
