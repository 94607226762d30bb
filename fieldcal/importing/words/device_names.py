"""Names of columns and fields that tell devices apart, or who wore them."""

from __future__ import annotations

import re

COUNTERS = {"i", "id", "idx", "unit", "instance"}
"""Names under which numbers may as well count parts of a recording."""

DEVICES = {
    *COUNTERS, "imu", "sensor", "device", "node", "address", "addr", "dev", "mac",
    "module", "devicename", "serial", "serialnumber", "serialno", "devicetag",
    "sensorlocation", "sensorposition", "sensorplacement", "placement", "bodypart",
    "设备名称",
}  # fmt: skip
"""Names of columns that tell devices apart, without "id" at their end."""

WEARERS = {"user", "subject", "participant", "volunteer", "patient", "person"}
"""Names of columns that say who wore a device: of others another one."""


def tells_devices(name: str) -> bool:
    """Whether a name is that of a column or field that identifies devices."""
    return _bare(name) in DEVICES


def tells_wearers(name: str) -> bool:
    """Whether a name is that of a column that identifies who wore a device."""
    return _bare(name) in WEARERS


def may_count(name: str) -> bool:
    """Whether numbers under a name that tells devices may as well count parts."""
    return _bare(name) in COUNTERS


def _bare(name: str) -> str:
    """A name without signs, and without "id" behind a word that is known.

    >>> _bare("# Sensor_ID"), _bare("id"), _bare("grid")
    ('sensor', 'id', 'grid')
    """
    bare = re.sub(r"[\s_.-]+", "", name.lower().lstrip("#%/ "))
    known = bare.endswith("id") and bare[:-2] in DEVICES | WEARERS
    return bare[:-2] if known else bare
