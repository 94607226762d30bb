"""Grades of devices, by the errors left by a factory; an MPU-6050 is consumer grade."""

from __future__ import annotations

from typing import Literal, get_args

Grade = Literal["consumer", "tactical", "navigation"]

GRADES: tuple[Grade, ...] = get_args(Grade)
