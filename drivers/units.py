"""Units that devices and files use, and what one of each is in SI."""

from __future__ import annotations

from math import pi
from types import MappingProxyType

STANDARD_GRAVITY = 9.80665
"""What devices mean by 1 g, m/s^2."""

ACCELERATION = MappingProxyType(
    {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "mg": STANDARD_GRAVITY * 1e-3}
)
ANGULAR_RATE = MappingProxyType({"rad/s": 1.0, "deg/s": pi / 180, "mrad/s": 1e-3})
TIME = MappingProxyType({"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9})
