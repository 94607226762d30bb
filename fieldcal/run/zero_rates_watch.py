"""Whether the rates of a device at rest are zero, as if it took their bias out itself.

Some devices estimate the bias of their gyroscopes while they rest, and subtract it.
What is then calibrated is what they left over. The decision examines this in the end
(`acceptance.bias_removal`); an operator can switch it off at the beginning.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.run.introduction import ZERO_SIGMAS, ZEROED_NOTICE, rates_are_zero
from fieldcal.windows import Average

EARTH_RATE_GRADE = "navigation"
"""Grade whose biases are so small that all of its rates at rest are about zero."""


class ZeroRatesWatch:
    """Looks at rates in the first rest, and at the means of windows after that.

    Parameters
    ----------
    grade : of the device
    stated : whether the device states what it takes out, so that it is put back

    Attributes
    ----------
    notice : sentence about rates that are zero; empty as long as they are not, or once
        a window has shown a bias

    """

    def __init__(self, grade: str, stated: bool = False) -> None:
        self._decided = stated or grade == EARTH_RATE_GRADE
        self.notice = ""

    def add_rest(self, gyr: Array) -> None:
        """Judge rates (n, 3) at rest, rad/s; those of a first rest only."""
        if self._decided:
            return
        self._decided = True
        self.notice = ZEROED_NOTICE if rates_are_zero(gyr) else ""

    def add_window(self, window: Average) -> None:
        """Withdraw the notice if the mean of a window, which is better known, is one.

        A bias that is as small as the noise of a second shows in half a minute.
        """
        mean, sigma = np.abs(window.mean[3:]), window.sigma[3:]
        if self.notice and not (mean <= ZERO_SIGMAS * sigma).all():
            self.notice = ""
