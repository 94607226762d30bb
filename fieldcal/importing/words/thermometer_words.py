"""Words of thermometers apart from the IMU, and of what stands beside them."""

from __future__ import annotations

from fieldcal.importing.words.other_columns import COUNTERS

FOREIGN = ("baro", "barometer", "bmp", "ms", "pressure", "mag", "ambient", "air",
           "board", "env", "cpu", "case", "gps", "room", "motor", "esc", "battery",
           "engine", "water", "oil", "outside", "chamber", "dew", "dewpoint", "wet",
           "target", "setpoint")  # fmt: skip
"""Words of thermometers that lie apart from the IMU."""

BESIDE_THERMOMETERS = (
    *COUNTERS, *"humidity humid hum rh pressure press baro altitude alt co light lux"
    " voltage volt volts battery bat vcc current status state flag event alarm date day"
    " serial name comment remark gas voc iaq dew dewpoint".split(),
)  # fmt: skip
"""Words of columns that stand beside a temperature and are no axes."""
